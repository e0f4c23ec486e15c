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
use super::tool::{give_back, look_beyond};
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
    /// Whether there is a seam.
    sealed: bool,
    /// The dynamic stiffness of the last link, factorised.
    tip: Factor<V>,
    /// Loads on the last link, then displacements, in turn those of each before it: of the readings and of the record.
    readings: [Column<V>; 3],
    load: Column<V>,
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
            sealed: false,
            tip: Factor::zero(like),
            readings: [[zero; DOF]; 3],
            load: [zero; DOF],
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
        self.read(terms, s, force, seam);
        self.elongate(terms, s, None);
    }

    /// The first half of [`Response::evaluate`], base to tip: acceleration and accelerance.
    #[inline(always)]
    pub fn read(
        &mut self,
        terms: &Terms<V::Scalar>,
        s: Complex<V>,
        force: &[Complex<V>; 3],
        seam: Option<&PerDof<V>>,
    ) {
        if terms.gravity {
            self.reach::<true>(terms, s, seam);
        } else {
            self.reach::<false>(terms, s, seam);
        }
        self.push(terms, force);
        sense(terms, s, &mut self.readings);
        if let Some(tool) = &terms.tool {
            look_beyond(tool, &terms.force, &self.tip, s * s, &mut self.readings);
        }
        for reading in &mut self.readings {
            self.tip.solve(reading);
        }
        // By reciprocity the readings' own displacements give what is read of any load.
        for axis in 0..3 {
            self.acceleration[axis] = Complex::zero(s.re);
            self.accelerance[axis] = [Complex::zero(s.re); 3];
            for i in 0..DOF {
                let moved = self.readings[axis][i];
                self.acceleration[axis] = self.acceleration[axis].plus(moved, self.load[i]);
                for push in 0..3 {
                    let along = s.re.fill(terms.force[push][i]);
                    let accelerance = &mut self.accelerance[axis][push];
                    *accelerance = accelerance.plus_real(moved, along);
                }
            }
        }
    }

    /// The second half, tip to base: elongations, and with them the derivatives; by a force that was `more` (N, times
    /// seconds) than that which has been read of, and the acceleration by it.
    #[inline(always)]
    pub fn elongate(
        &mut self,
        terms: &Terms<V::Scalar>,
        s: Complex<V>,
        more: Option<&[Complex<V>; 3]>,
    ) {
        if let Some(more) = more {
            self.push(terms, more);
            for axis in 0..3 {
                for push in 0..3 {
                    let reading = self.acceleration[axis];
                    self.acceleration[axis] =
                        reading.plus(self.accelerance[axis][push], more[push]);
                }
            }
        }
        if let Some(tool) = &terms.tool {
            give_back(tool, &terms.force, &self.tip, s * s, &mut self.load);
        }
        self.tip.solve(&mut self.load);
        if terms.gravity {
            self.descend::<true>(terms, s);
        } else {
            self.descend::<false>(terms, s);
        }
    }

    /// Adds a force at the TCP to the load on the last link.
    #[inline(always)]
    fn push(&mut self, terms: &Terms<V::Scalar>, force: &[Complex<V>; 3]) {
        for axis in 0..3 {
            for i in 0..DOF {
                let along = force[axis].re.fill(terms.force[axis][i]);
                self.load[i] = self.load[i].plus_real(force[axis], along);
            }
        }
    }

    /// Base to tip: the dynamic stiffness of the last link, factorised, and what the seam loads it with.
    #[inline(always)]
    fn reach<const GRAVITY: bool>(
        &mut self,
        terms: &Terms<V::Scalar>,
        s: Complex<V>,
        seam: Option<&PerDof<V>>,
    ) {
        let s2 = s * s;
        self.sealed = seam.is_some();
        self.load = [Complex::zero(s.re); DOF];
        if let Some(seam) = seam {
            self.load = seam[0];
        }
        let stiffness = self.tip.matrix();
        for (index, joint) in terms.joints.iter().enumerate() {
            if index > 0 {
                let passage = &mut self.passages[index];
                passage.pass::<GRAVITY>(joint, s, s2, stiffness);
                if let Some(seam) = seam {
                    let halfway = &mut self.halfway[index];
                    load_here(joint, &self.load, &seam[index], halfway);
                    passage.halfway(halfway);
                    self.load = seam[index];
                    passage.hand_on::<GRAVITY>(halfway, &mut self.load);
                }
            } else {
                hold::<V, GRAVITY>(joint, s, s2, stiffness);
            }
        }
        self.tip.factorise();
    }

    /// Tip to base, from the displacements of the last link.
    #[inline(always)]
    fn descend<const GRAVITY: bool>(&mut self, terms: &Terms<V::Scalar>, s: Complex<V>) {
        for (index, joint) in terms.joints.iter().enumerate().rev() {
            if terms.masses {
                let inert = weigh(joint, s * s, &self.load);
                for axis in 0..3 {
                    self.per_mass[axis][index] = Complex::zero(s.re);
                    for i in 0..DOF {
                        let derivative = &mut self.per_mass[axis][index];
                        *derivative = derivative.minus(self.readings[axis][i], inert[i]);
                    }
                }
            }
            for column in 0..4 {
                let (moved, elongation, halfway) = match column {
                    3 => {
                        let halfway = self.sealed.then_some(&self.halfway[index]);
                        (&mut self.load, &mut self.elongation[index], halfway)
                    }
                    axis => (&mut self.readings[axis], &mut self.per_load[axis][index], None),
                };
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
pub(super) fn sense<V: Lanes>(
    terms: &Terms<V::Scalar>,
    s: Complex<V>,
    readings: &mut [Column<V>; 3],
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
