//! The observation of one record in the model, and its exact derivatives, by a second pass of the recursion from tip to
//! base.
//!
//! e_out are the elongations due to a unit load along each measured direction. q are the elongations in the record, due to
//! its force and its seam. By reciprocity these elongations give every derivative:
//!
//! ```text
//! ∂A_a/∂ln k_i = −k_i e_out,ia q_i       ∂A_a/∂ln d_i = −s d_i e_out,ia q_i       ∂A_a/∂γ_i = e_out,ia
//! ```
//!
//! If bushings depend on the frequency (`law`), k_i is `k_i (1 + g ψ)`, and s d_i is `σ d_i`.

use super::complex::{Column, Complex};
use super::elimination::Elimination;
use super::lanes::{Lanes, Scalar};
use super::law::Rates;
use super::recursion::{SeamLoads, outward};
use super::symmetric::Factor;
use super::terms::Terms;
use super::tool::{ToolReaction, tip_displacements};
use crate::{DOF, MAX_JOINTS};

/// One complex value per degree of freedom, `[joint][degree of freedom]`.
pub type PerDof<V> = [[Complex<V>; DOF]; MAX_JOINTS];

/// Response of the model in one bin of a record, one bin per lane. It is large, so that callers reuse one for all bins.
#[derive(Clone, Debug)]
pub struct Response<V> {
    /// The observation: the reading of the accelerometer along its axes, without the jumps c₋₁, c₀ and c₁ of the seam,
    /// m/s² (times seconds); in a static test the displacement, m.
    pub observed: [Complex<V>; 3],
    /// Observation along axis `[row]` per force along the force sensor's axis `[column]`: the accelerance, m/s²/N.
    pub per_force: [[Complex<V>; 3]; 3],
    /// e_out: observation along `[axis]` per unit load on the bushing of joint `[j]`, DOF `[i]`.
    pub per_load: [PerDof<V>; 3],
    /// q: elongations in this record, m and rad (times seconds).
    pub elongation: PerDof<V>,
    /// Elimination of each bushing from the second on, or from the first if the ground gives way, as [`Response::read`] leaves it.
    eliminations: [Elimination<V>; MAX_JOINTS],
    /// Load of the seam at each elimination, as `Elimination::half_solve` leaves it.
    seam_half: PerDof<V>,
    /// σ and ψ.
    rates: Rates<V>,
    /// True if the record has a seam.
    has_seam: bool,
    /// Dynamic stiffness of the last link, factorised.
    tip: Factor<V>,
    /// Reaction of the tool, if the terms have one, as [`Response::read`] leaves it.
    tool: ToolReaction<V>,
    /// Loads of the three observations on the last link, then the displacements of the last link and in turn of each link before
    /// it.
    observations: [Column<V>; 3],
    /// Load of the record on the last link, then the displacements of the last link and in turn of each link before it.
    load: Column<V>,
}

impl<V: Lanes> Response<V> {
    /// A response of no bin yet.
    #[inline(always)]
    pub fn new(like: V) -> Self {
        let zero = Complex::zero(like);
        let per_dof = [[zero; DOF]; MAX_JOINTS];
        Self {
            observed: [zero; 3],
            per_force: [[zero; 3]; 3],
            per_load: [per_dof; 3],
            elongation: per_dof,
            eliminations: [Elimination::new(like); MAX_JOINTS],
            seam_half: per_dof,
            rates: Rates::plain(zero),
            has_seam: false,
            tip: Factor::zero(like),
            tool: ToolReaction::new(like),
            observations: [[zero; DOF]; 3],
            load: [zero; DOF],
        }
    }

    /// σ and ψ of the last evaluation.
    #[inline(always)]
    pub(crate) fn rates(&self) -> &Rates<V> {
        &self.rates
    }

    /// Evaluates the response at the complex frequency `s` (rad/s) to the record's `force` and `seam`. `force` is the
    /// measured force along the force sensor's axes, N. `seam`, if the record has one, is the load on every bushing that
    /// joins the record's end to its start, `γ = g + h/s`, N and Nm. Both are times seconds, as spectra are.
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

    /// First half of [`Response::evaluate`], base to tip: `observed` and `per_force`.
    #[inline(always)]
    pub fn read(
        &mut self,
        terms: &Terms<V::Scalar>,
        s: Complex<V>,
        force: &[Complex<V>; 3],
        seam: Option<&PerDof<V>>,
    ) {
        s.re.apart(
            #[inline(always)]
            || self.read_inlined(terms, s, force, seam),
        );
    }

    #[inline(always)]
    fn read_inlined(
        &mut self,
        terms: &Terms<V::Scalar>,
        s: Complex<V>,
        force: &[Complex<V>; 3],
        seam: Option<&PerDof<V>>,
    ) {
        self.has_seam = seam.is_some();
        self.rates = terms.rates(s);
        self.load = [Complex::zero(s.re); DOF];
        let seam = seam.map(|bushings| SeamLoads {
            bushings,
            half: &mut self.seam_half,
            link: &mut self.load,
        });
        let (rates, eliminations, tip) = (&self.rates, &mut self.eliminations, &mut self.tip);
        if terms.gravity {
            outward::<V, MAX_JOINTS, true>(terms, s, rates, eliminations, tip, seam);
        } else {
            outward::<V, MAX_JOINTS, false>(terms, s, rates, eliminations, tip, seam);
        }
        self.add_force(terms, force);
        terms.observation.loads(s, &mut self.observations);
        if let Some(tool) = &terms.tool {
            let displacements = tip_displacements(&terms.force_loads, &self.tip, s.re);
            self.tool.evaluate(tool, s * s, &displacements);
            self.tool.add_to_observations(&displacements, &mut self.observations);
        }
        for observation in &mut self.observations {
            self.tip.solve(observation);
        }
        // By reciprocity the displacements due to the loads of the observations give the observation for any load.
        for axis in 0..3 {
            self.observed[axis] = Complex::zero(s.re);
            self.per_force[axis] = [Complex::zero(s.re); 3];
            for i in 0..DOF {
                let displacement = self.observations[axis][i];
                self.observed[axis] = self.observed[axis].add_mul(displacement, self.load[i]);
                for force in 0..3 {
                    let load = s.re.fill(terms.force_loads[force][i]);
                    let per_force = &mut self.per_force[axis][force];
                    *per_force = per_force.add_mul_real(displacement, load);
                }
            }
        }
    }

    /// Second half of [`Response::evaluate`], tip to base: elongations, which give the derivatives. `more` is the difference
    /// between the record's force and the force given to [`Response::read`] (N, times seconds); it also changes `observed`.
    #[inline(always)]
    pub fn elongate(
        &mut self,
        terms: &Terms<V::Scalar>,
        s: Complex<V>,
        more: Option<&[Complex<V>; 3]>,
    ) {
        s.re.apart(
            #[inline(always)]
            || self.elongate_inlined(terms, s, more),
        );
    }

    #[inline(always)]
    fn elongate_inlined(
        &mut self,
        terms: &Terms<V::Scalar>,
        s: Complex<V>,
        more: Option<&[Complex<V>; 3]>,
    ) {
        if let Some(more) = more {
            self.add_force(terms, more);
            for axis in 0..3 {
                for force in 0..3 {
                    let observed = &mut self.observed[axis];
                    *observed = observed.add_mul(self.per_force[axis][force], more[force]);
                }
            }
        }
        if terms.tool.is_some() {
            self.tool.add_to_load(&terms.force_loads, &self.tip, &mut self.load);
        }
        self.tip.solve(&mut self.load);
        if terms.gravity {
            self.inward::<true>(terms, s);
        } else {
            self.inward::<false>(terms, s);
        }
    }

    /// Adds a force at the TCP to the load on the last link.
    #[inline(always)]
    fn add_force(&mut self, terms: &Terms<V::Scalar>, force: &[Complex<V>; 3]) {
        for axis in 0..3 {
            for i in 0..DOF {
                let load = force[axis].re.fill(terms.force_loads[axis][i]);
                self.load[i] = self.load[i].add_mul_real(force[axis], load);
            }
        }
    }

    /// Computes the elongations from tip to base, from the displacements of the last link.
    #[inline(always)]
    fn inward<const GRAVITY: bool>(&mut self, terms: &Terms<V::Scalar>, s: Complex<V>) {
        for (index, joint) in terms.joints.iter().enumerate().rev() {
            for column in 0..4 {
                let (displacement, elongation, half) = match column {
                    3 => {
                        let half = self.has_seam.then_some(&self.seam_half[index]);
                        (&mut self.load, &mut self.elongation[index], half)
                    }
                    axis => (&mut self.observations[axis], &mut self.per_load[axis][index], None),
                };
                if index == 0 && terms.ground.is_none() {
                    *elongation = *displacement;
                    continue;
                }
                let mut x = [Complex::zero(s.re); DOF];
                self.eliminations[index].recover::<GRAVITY>(displacement, half, &mut x);
                for i in 0..DOF {
                    elongation[i] = displacement[i] - x[i];
                }
                joint.to_parent.displacement(&x, displacement);
            }
        }
    }

    /// `∂A/∂ln k` and `∂A/∂ln d` of joint `joint`, DOF `dof`, per axis.
    #[inline(always)]
    pub fn derivatives(
        &self,
        terms: &Terms<V::Scalar>,
        joint: usize,
        dof: usize,
    ) -> [[Complex<V>; 2]; 3] {
        let Rates { damper, drive } = self.rates;
        let minus = |value: V::Scalar| damper.re.fill(V::Scalar::from_f64(-value.to_f64()));
        let elongation = self.elongation[joint][dof];
        let mut sprung = elongation.scale(minus(terms.joints[joint].stiffness[dof]));
        if let Some(drive) = drive
            && let Some(growth) = terms.joints[joint].growth
            && growth.dof == dof
        {
            sprung = sprung + (sprung * drive).scale(damper.re.fill(growth.part));
        }
        let damped = (elongation * damper).scale(minus(terms.joints[joint].damping[dof]));
        let mut derivatives = [[sprung, damped]; 3];
        for axis in 0..3 {
            for derivative in &mut derivatives[axis] {
                *derivative = *derivative * self.per_load[axis][joint][dof];
            }
        }
        derivatives
    }
}
