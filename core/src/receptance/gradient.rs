//! The measured acceleration of one record and its exact derivatives, by the recursion's way back, tip to base.
//!
//! With the elongations e_out of a unit load along each measured direction, and q those of the record itself
//! (its force and its seam), reciprocity gives every derivative as a product of two elongations:
//!
//! ```text
//! ∂A_a/∂ln k_i = −k_i e_out,ia q_i       ∂A_a/∂ln d_i = −s d_i e_out,ia q_i       ∂A_a/∂γ_i = e_out,ia
//! ```

use super::complex::Complex;
use super::lanes::{Lanes, Scalar};
use super::recursion::{Column, Passage, before, hold, load_here};
use super::symmetric::{Factor, at};
use super::terms::{JointTerms, Terms};
use super::tool::look_beyond;
use crate::{DOF, MAX_JOINTS};

/// One value per degree of freedom, joint by joint.
pub type PerDof<V> = [[Complex<V>; DOF]; MAX_JOINTS];

/// What one bin of a record says, one bin per lane; one for all bins in turn, for it is large.
#[derive(Clone, Debug)]
pub struct Response<V> {
    /// What the accelerometer would read, without c₀ and c₁, along its axes, m/s² (times seconds).
    pub acceleration: [Complex<V>; 3],
    /// Accelerance: reading along the accelerometer's axis `[row]` per force along the force sensor's axis `[column]`, m/s²/N.
    pub accelerance: [[Complex<V>; 3]; 3],
    /// e_out: reading along `[axis]` per unit load on the bushing of joint `[j]`, DOF `[i]`.
    pub per_load: [PerDof<V>; 3],
    /// q: elongations in this record, m and rad (times seconds).
    pub elongation: PerDof<V>,
    /// `∂A/∂ln m`: reading along `[axis]` by the mass and inertia of link `[j]`, where the terms want it. Gravity's stiffness
    /// is taken to stay: of the reference robot that leaves out 4 % at most at 5 Hz, and 0.3 % at 20 Hz.
    pub per_mass: [[Complex<V>; MAX_JOINTS]; 3],
    /// The bushings as the way out has passed them, from the second on, and what the seam loads them with.
    passages: [Passage<V>; MAX_JOINTS],
    halfway: PerDof<V>,
}

impl<V: Lanes> Response<V> {
    /// Of no bin yet.
    #[inline(always)]
    pub fn new(like: V) -> Self {
        let zero = Complex::zero(like);
        let per_dof = [[zero; DOF]; MAX_JOINTS];
        Self {
            acceleration: [zero; 3],
            accelerance: [[zero; 3]; 3],
            per_load: [per_dof; 3],
            elongation: per_dof,
            per_mass: [[zero; MAX_JOINTS]; 3],
            passages: [Passage::new(like); MAX_JOINTS],
            halfway: per_dof,
        }
    }

    /// At complex frequency `s` (rad/s), to the record's `force` (as measured, along the force sensor's axes, N) and `seam`, if
    /// it has one: the load on every bushing that mends the record's end, `γ = g + h/s`, N and Nm (both times seconds, as
    /// spectra are).
    #[inline(always)]
    pub fn evaluate(
        &mut self,
        terms: &Terms<V::Scalar>,
        s: Complex<V>,
        force: &[Complex<V>; 3],
        seam: Option<&PerDof<V>>,
    ) {
        if terms.tool.is_some() {
            // One copy for both: a tool has weight, and where there is no gravity its terms are zero.
            self.respond::<true, true>(terms, s, force, seam);
        } else if terms.gravity {
            self.respond::<true, false>(terms, s, force, seam);
        } else {
            self.respond::<false, false>(terms, s, force, seam);
        }
    }

    #[inline(always)]
    fn respond<const GRAVITY: bool, const TOOL: bool>(
        &mut self,
        terms: &Terms<V::Scalar>,
        s: Complex<V>,
        force: &[Complex<V>; 3],
        seam: Option<&PerDof<V>>,
    ) {
        let mut tip = Factor::zero(s.re);
        // What the record loads the last link with: its seam, handed on, and its force.
        let mut load = seam.map_or([Complex::zero(s.re); DOF], |seam| seam[0]);
        self.reach::<GRAVITY>(terms, s, seam, &mut tip, &mut load);
        for axis in 0..3 {
            for i in 0..DOF {
                load[i] = load[i].plus_real(force[axis], s.re.fill(terms.force[axis][i]));
            }
        }
        let mut moved = [load; 4];
        read(terms, s, &mut moved);
        if TOOL && let Some(tool) = &terms.tool {
            look_beyond(tool, &terms.force, &tip, s * s, &mut moved);
        }
        for column in &mut moved {
            tip.solve(column);
        }
        // At the tip: by reciprocity the readings' own displacements give what is read of any load.
        for axis in 0..3 {
            self.acceleration[axis] = Complex::zero(s.re);
            self.accelerance[axis] = [Complex::zero(s.re); 3];
            for i in 0..DOF {
                self.acceleration[axis] = self.acceleration[axis].plus(moved[axis][i], load[i]);
                for push in 0..3 {
                    let along = s.re.fill(terms.force[push][i]);
                    let accelerance = &mut self.accelerance[axis][push];
                    *accelerance = accelerance.plus_real(moved[axis][i], along);
                }
            }
        }
        for (index, joint) in terms.joints.iter().enumerate().rev() {
            if terms.masses {
                let inert = weigh(joint, s * s, &moved[3]);
                for axis in 0..3 {
                    self.per_mass[axis][index] = Complex::zero(s.re);
                    for i in 0..DOF {
                        let derivative = &mut self.per_mass[axis][index];
                        *derivative = derivative.minus(moved[axis][i], inert[i]);
                    }
                }
            }
            for column in 0..4 {
                let (elongation, halfway) = match column {
                    3 => (&mut self.elongation[index], seam.map(|_| &self.halfway[index])),
                    axis => (&mut self.per_load[axis][index], None),
                };
                let moved = &mut moved[column];
                if index == 0 {
                    *elongation = *moved;
                    continue;
                }
                let mut carried = [Complex::zero(s.re); DOF];
                self.passages[index].carry::<GRAVITY>(moved, halfway, &mut carried);
                for i in 0..DOF {
                    elongation[i] = moved[i] - carried[i];
                }
                before(joint, &carried, moved);
            }
        }
    }

    /// Base to tip: the dynamic stiffness of the last link, factorised, and what the seam loads it with, from the first's.
    #[inline(always)]
    fn reach<const GRAVITY: bool>(
        &mut self,
        terms: &Terms<V::Scalar>,
        s: Complex<V>,
        seam: Option<&PerDof<V>>,
        tip: &mut Factor<V>,
        load: &mut Column<V>,
    ) {
        let s2 = s * s;
        for (index, joint) in terms.joints.iter().enumerate() {
            if index > 0 {
                let passage = &mut self.passages[index];
                passage.pass::<GRAVITY>(joint, s, s2, tip.matrix());
                if let Some(seam) = seam {
                    let halfway = &mut self.halfway[index];
                    load_here(joint, load, &seam[index], halfway);
                    passage.halfway(halfway);
                    *load = seam[index];
                    passage.hand_on::<GRAVITY>(halfway, load);
                }
            } else {
                hold::<V, GRAVITY>(joint, s, s2, tip.matrix());
            }
        }
        tip.factorise();
    }

    /// `∂A/∂ln k` and `∂A/∂ln d` of joint `joint`, DOF `dof`, per axis.
    #[inline(always)]
    pub fn derivatives(
        &self,
        terms: &Terms<V::Scalar>,
        s: Complex<V>,
        joint: usize,
        dof: usize,
    ) -> [[Complex<V>; 2]; 3] {
        let minus = |value: V::Scalar| s.re.fill(V::Scalar::from_f64(-value.to_f64()));
        let elongation = self.elongation[joint][dof];
        let sprung = elongation.scale(minus(terms.joints[joint].stiffness[dof]));
        let damped = (elongation * s).scale(minus(terms.joints[joint].damping[dof]));
        let mut derivatives = [[sprung, damped]; 3];
        for axis in 0..3 {
            for derivative in &mut derivatives[axis] {
                *derivative = *derivative * self.per_load[axis][joint][dof];
            }
        }
        derivatives
    }
}

/// What the accelerometer reads of a displacement of the last link, one axis a column: `s²` along it, and how gravity
/// tilts it, later by the delay.
#[inline(always)]
pub(super) fn read<V: Lanes, const N: usize>(
    terms: &Terms<V::Scalar>,
    s: Complex<V>,
    readings: &mut [Column<V>; N],
) {
    let s2 = s * s;
    let delayed = terms.delay.to_f64() != 0.0;
    let mut lag = s;
    if delayed {
        lag = (-s.scale(s.re.fill(terms.delay))).exponential();
    }
    for axis in 0..3 {
        for i in 0..DOF {
            let mut reading = s2.scale(s.re.fill(terms.reading[axis][i]));
            if terms.strapdown {
                reading.re = reading.re + s.re.fill(terms.tilt[axis][i]);
            }
            if delayed {
                reading = reading * lag;
            }
            readings[axis][i] = reading;
        }
    }
}

/// `s² I y`.
#[inline(always)]
fn weigh<V: Lanes>(
    joint: &JointTerms<V::Scalar>,
    s2: Complex<V>,
    displacement: &Column<V>,
) -> Column<V> {
    let mut inert = [Complex::zero(s2.re); DOF];
    for i in 0..DOF {
        for j in 0..DOF {
            inert[i] = inert[i].plus_real(displacement[j], s2.re.fill(joint.inertia[at(i, j)]));
        }
        inert[i] = inert[i] * s2;
    }
    inert
}
