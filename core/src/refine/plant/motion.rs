//! Motions of the robot, and derivatives of a reading by parts of the model as bilinear forms of them.
//!
//! ```text
//! ∂A = −s² η̂ᵀ ∂I η + λ̂ᵀ ∂X η₋ + λᵀ ∂X η̂₋ + η̂ᵀ ∂P F + ∂rᵀ η + G ∂Wᵀ η − η̂ᵀ ∂(h S) η            η₋ the displacement of the link before
//! ```
//!
//! I is the inertia of a link, and X the transformation from a link to the next. On the last link act P of the force F that cuts, r of
//! the observation, W of the tool, and a hose of the impedance h, whose spread is S. η are the displacements of the links and λ the loads
//! on the bushings in the record, η̂ and λ̂ those due to the observation; G is the observation per measured force. λ leaves out what the
//! stiffness due to gravity adds. On ground with the compliances `c − s e`, the base is the link before the first: `η₋ = diag(c − s e) Xᵀ
//! λ`.

use super::super::model::Model;
use super::change::{Block, FromParentChange, Tip};
use crate::receptance::lanes::Lanes;
use crate::receptance::{Complex, PACKED, PerDof, Rates, Response, Terms, ToolTerms, at, bushing};
use crate::{DOF, MAX_JOINTS};
use nalgebra::{Matrix3, Matrix6, Vector3};

pub(super) type Column<V> = [Complex<V>; DOF];

/// A motion of the robot and of its base.
#[derive(Clone)]
pub(super) struct Motion<V> {
    /// Displacement of each link.
    pub(super) displacements: PerDof<V>,
    /// Load on each bushing.
    loads: PerDof<V>,
    /// Displacement of the base.
    base: Column<V>,
    /// Load on the base, with what gravity adds.
    on_base: Column<V>,
}

/// Motions due to a unit observation along each axis, and that of the record.
pub(super) struct Motions<V> {
    per_observation: [Motion<V>; 3],
    pub(super) of_record: Motion<V>,
}

impl<V: Lanes<Scalar = f64>> Motion<V> {
    /// `η = δ + X η₋` and `λ = z δ − γ`, from the elongations δ and the load γ of a seam.
    #[inline(always)]
    fn new(
        model: &Model,
        rates: &Rates<V>,
        s: Complex<V>,
        elongations: &PerDof<V>,
        seam: Option<&PerDof<V>>,
    ) -> Self {
        let (terms, zero) = (&model.terms, Complex::zero(rates.damper.re));
        let mut motion = Self {
            displacements: [[zero; DOF]; MAX_JOINTS],
            loads: [[zero; DOF]; MAX_JOINTS],
            base: [zero; DOF],
            on_base: [zero; DOF],
        };
        for (joint, (own, x)) in terms.joints.iter().zip(&model.from_parent).enumerate() {
            let impedance = bushing(own, rates);
            for dof in 0..DOF {
                let load = &mut motion.loads[joint][dof];
                *load = impedance[dof] * elongations[joint][dof];
                if let Some(seam) = seam {
                    *load = *load - seam[joint][dof];
                }
            }
            let x = [&x.rotation, &x.lever, &x.turns].map(rows);
            if joint == 0 {
                motion.load_base(&x, terms, s, &elongations[0]);
            }
            motion.displacements[joint] = elongations[joint];
            let before = *motion.before(joint);
            add_transformed(x.each_ref(), &before, &mut motion.displacements[joint]);
        }
        motion
    }

    /// Displacement of the link before a joint.
    #[inline(always)]
    fn before(&self, joint: usize) -> &Column<V> {
        if joint == 0 { &self.base } else { &self.displacements[joint - 1] }
    }

    /// `∂X η₋` of a joint.
    #[inline(always)]
    fn changed(&self, joint: usize, change: &FromParentChange) -> Column<V> {
        let FromParentChange { rotation, lever, turns } = change;
        let before = self.before(joint);
        let mut moved = [Complex::zero(before[0].re); DOF];
        add_transformed([rotation, lever, turns], before, &mut moved);
        moved
    }

    /// Loads the base by `Xᵀ (λ + (Γ − C) δ)` of the first joint.
    #[inline(always)]
    fn load_base(
        &mut self,
        x: &[Block; 3],
        terms: &Terms<f64>,
        s: Complex<V>,
        elongation: &Column<V>,
    ) {
        let first = &terms.joints[0];
        let mut load = self.loads[0];
        let real = |value: f64| elongation[0].re.fill(value);
        for turn in 0..3 {
            let load = &mut load[3 + turn];
            for i in 0..DOF {
                *load = load.add_mul_real(elongation[i], real(-first.gravity_coupling[i][turn]));
            }
            for i in 0..3 {
                let turns = real(first.gravity_turns[turn][i]);
                *load = load.add_mul_real(elongation[3 + i], turns);
            }
        }
        add_transposed(x.each_ref(), &load, &mut self.on_base);
        if let Some(ground) = &terms.ground {
            for dof in 0..DOF {
                self.base[dof] = self.on_base[dof] * ground.at(s, dof);
            }
        }
    }
}

impl<V: Lanes<Scalar = f64>> Motions<V> {
    #[inline(always)]
    pub(super) fn new(
        model: &Model,
        response: &Response<V>,
        s: Complex<V>,
        seam: &PerDof<V>,
    ) -> Self {
        let rates = response.rates();
        let of_record = Motion::new(model, rates, s, &response.elongation, Some(seam));
        Self { per_observation: per_observation(model, response, s), of_record }
    }

    /// The motion of the record, with those that a response at another s has per observation.
    #[inline(always)]
    pub(super) fn observed_at(&self, model: &Model, response: &Response<V>, s: Complex<V>) -> Self {
        let of_record = self.of_record.clone();
        Self { per_observation: per_observation(model, response, s), of_record }
    }

    /// `−s² η̂ᵀ ∂I η`.
    #[inline(always)]
    pub(super) fn add_inertia(
        &self,
        joint: usize,
        inertia: &[[f64; DOF]; DOF],
        s2: Complex<V>,
        derivative: &mut [Complex<V>; 3],
    ) {
        let displacement = &self.of_record.displacements[joint];
        for (i, row) in inertia.iter().enumerate() {
            let mut inert = Complex::zero(s2.re);
            for (value, displacement) in row.iter().zip(displacement) {
                inert = inert.add_mul_real(*displacement, s2.re.fill(*value));
            }
            inert = inert * s2;
            for (derivative, own) in derivative.iter_mut().zip(&self.per_observation) {
                *derivative = derivative.sub_mul(own.displacements[joint][i], inert);
            }
        }
    }

    /// `−η̂ᵀ s G η` of a link with this spin ω, rad/s, along its own axes. With the mass m, the centre of mass c and the second moments
    /// `S = Σ m p pᵀ`, the Coriolis load G of a displacement with the rates ḋ and φ̇ is
    ///
    /// ```text
    /// force 2 m ω × (ḋ + φ̇ × c)          torque 2 m c × (ω × ḋ) − 2 φ̇ × S ω
    /// ```
    #[inline(always)]
    pub(super) fn add_coriolis(
        &self,
        joint: usize,
        inertia: &[f64; PACKED],
        spin: &Vector3<f64>,
        s: Complex<V>,
        derivative: &mut [Complex<V>; 3],
    ) {
        let block = |row: usize| {
            Matrix3::from_fn(|i, j| inertia[at((row + i).max(3 + j), (row + i).min(3 + j))])
        };
        // −m [c×], and the moments of inertia about the origin of the joint.
        let (mass, centre, moments) = (inertia[0], block(0), block(3));
        let second_moments = Matrix3::identity() * (0.5 * moments.trace()) - moments;
        let turn = spin.cross_matrix();
        let mut g = Matrix6::zeros();
        g.fixed_view_mut::<3, 3>(0, 0).copy_from(&(2.0 * mass * turn));
        g.fixed_view_mut::<3, 3>(0, 3).copy_from(&(2.0 * turn * centre));
        g.fixed_view_mut::<3, 3>(3, 0).copy_from(&(-2.0 * centre * turn));
        let of_moments = (second_moments * spin).cross_matrix();
        g.fixed_view_mut::<3, 3>(3, 3).copy_from(&(2.0 * of_moments));
        let displacement = &self.of_record.displacements[joint];
        for i in 0..DOF {
            let mut load = Complex::zero(s.re);
            for (j, displacement) in displacement.iter().enumerate() {
                load = load.add_mul_real(*displacement, s.re.fill(g[(i, j)]));
            }
            load = load * s;
            for (derivative, own) in derivative.iter_mut().zip(&self.per_observation) {
                *derivative = derivative.sub_mul(own.displacements[joint][i], load);
            }
        }
    }

    /// `λ̂ᵀ ∂X η₋ + λᵀ ∂X η̂₋`.
    #[inline(always)]
    pub(super) fn add_from_parent(
        &self,
        joint: usize,
        change: &FromParentChange,
        derivative: &mut [Complex<V>; 3],
    ) {
        let of_record = self.of_record.changed(joint, change);
        let load = &self.of_record.loads[joint];
        for (derivative, own) in derivative.iter_mut().zip(&self.per_observation) {
            *derivative = dot(*derivative, &own.loads[joint], &of_record);
            *derivative = dot(*derivative, load, &own.changed(joint, change));
        }
    }

    /// Derivative by the compliance of the ground along a degree of freedom: the product of the loads on the base. Its mass takes up a part of
    /// either.
    #[inline(always)]
    pub(super) fn by_ground(&self, model: &Model, s: Complex<V>, dof: usize) -> [Complex<V>; 3] {
        let moved = match &model.terms.ground {
            Some(ground) => self.of_record.on_base[dof] * ground.per_compliance(s, dof),
            None => self.of_record.on_base[dof],
        };
        self.per_observation.each_ref().map(|own| own.on_base[dof] * moved)
    }

    /// Derivative by the logarithm of the mass m on the ground: with the displacement α per load, `−s² m α²` times that product, along all axes.
    #[inline(always)]
    pub(super) fn by_base_mass(&self, model: &Model, s: Complex<V>) -> [Complex<V>; 3] {
        let mut derivative = [Complex::zero(s.re); 3];
        let Some(ground) = &model.terms.ground else { return derivative };
        let inertia = (s * s).scale(s.re.fill(-ground.mass));
        for dof in 0..3 {
            let displacement = ground.at(s, dof);
            let moved = self.of_record.on_base[dof] * inertia * displacement * displacement;
            for (derivative, own) in derivative.iter_mut().zip(&self.per_observation) {
                *derivative = derivative.add_mul(own.on_base[dof], moved);
            }
        }
        derivative
    }

    /// Derivative by the stiffness of the hose: `−η̂ᵀ S η`.
    #[inline(always)]
    pub(super) fn by_hose(&self, model: &Model, s: Complex<V>) -> [Complex<V>; 3] {
        match &model.terms.hose {
            Some(hose) => self.by_spread(model.terms.joints.len() - 1, &hose.spread),
            None => [Complex::zero(s.re); 3],
        }
    }

    /// `−η̂ᵀ S η` with a spread S of the last link.
    #[inline(always)]
    fn by_spread(&self, last: usize, spread: &[f64; PACKED]) -> [Complex<V>; 3] {
        let displacement = &self.of_record.displacements[last];
        let like = displacement[0].re;
        let mut derivative = [Complex::zero(like); 3];
        for i in 0..DOF {
            let mut pull = Complex::zero(like);
            for (j, displacement) in displacement.iter().enumerate() {
                pull = pull.add_mul_real(*displacement, like.fill(spread[at(i, j)]));
            }
            for (derivative, own) in derivative.iter_mut().zip(&self.per_observation) {
                *derivative = derivative.sub_mul(own.displacements[last][i], pull);
            }
        }
        derivative
    }

    /// `η̂ᵀ ∂P F + ∂rᵀ η + G ∂Wᵀ η − h η̂ᵀ ∂S η`. `cut` is F.
    #[inline(always)]
    pub(super) fn add_tip(
        &self,
        last: usize,
        tip: &Tip,
        response: &Response<V>,
        s: Complex<V>,
        cut: &[Complex<V>; 3],
        derivative: &mut [Complex<V>; 3],
    ) {
        let like = s.re;
        let displacement = &self.of_record.displacements[last];
        let mut load = [Complex::zero(like); DOF];
        for (force, loads) in cut.iter().zip(&tip.force) {
            for (load, own) in load.iter_mut().zip(loads) {
                *load = load.add_mul_real(*force, like.fill(*own));
            }
        }
        let mut observations = [[Complex::zero(like); DOF]; 3];
        tip.observation.loads(s, &mut observations);
        for axis in 0..3 {
            let own = &self.per_observation[axis].displacements[last];
            derivative[axis] = dot(derivative[axis], own, &load);
            derivative[axis] = dot(derivative[axis], &observations[axis], displacement);
        }
        if let Some(hose) = &tip.hose {
            let h = hose.impedance(s);
            for (derivative, own) in derivative.iter_mut().zip(self.by_spread(last, &hose.spread)) {
                *derivative = derivative.add_mul(own, h);
            }
        }
        if let Some(tool) = &tip.tool {
            let taken = taken_by_tool(tool, s, displacement);
            for axis in 0..3 {
                for (per_force, taken) in response.per_force[axis].iter().zip(&taken) {
                    derivative[axis] = derivative[axis].add_mul(*per_force, *taken);
                }
            }
        }
    }
}

#[inline(always)]
fn per_observation<V: Lanes<Scalar = f64>>(
    model: &Model,
    response: &Response<V>,
    s: Complex<V>,
) -> [Motion<V>; 3] {
    let rates = response.rates();
    response.per_load.each_ref().map(|per_load| Motion::new(model, rates, s, per_load, None))
}

/// `Wᵀ η`: force that a tool takes at a displacement of the last link, along the axes of the force sensor.
#[inline(always)]
pub(super) fn taken_by_tool<V: Lanes<Scalar = f64>>(
    tool: &ToolTerms<f64>,
    s: Complex<V>,
    displacement: &Column<V>,
) -> [Complex<V>; 3] {
    let s2 = s * s;
    core::array::from_fn(|axis| {
        let mut taken = Complex::zero(s.re);
        for i in 0..DOF {
            let mut load = s2.scale(s.re.fill(tool.inertia[axis][i]));
            load.re = load.re + s.re.fill(tool.weight[axis][i]);
            taken = taken.add_mul(load, displacement[i]);
        }
        taken
    })
}

/// `y ← y + [[rotation, lever], [0, turns]] x`.
#[inline(always)]
fn add_transformed<V: Lanes<Scalar = f64>>(
    [rotation, lever, turns]: [&Block; 3],
    x: &Column<V>,
    y: &mut Column<V>,
) {
    let like = x[0].re;
    for i in 0..3 {
        for k in 0..3 {
            y[i] = y[i]
                .add_mul_real(x[k], like.fill(rotation[i][k]))
                .add_mul_real(x[3 + k], like.fill(lever[i][k]));
            y[3 + i] = y[3 + i].add_mul_real(x[3 + k], like.fill(turns[i][k]));
        }
    }
}

/// `y ← y + [[rotation, lever], [0, turns]]ᵀ x`.
#[inline(always)]
fn add_transposed<V: Lanes<Scalar = f64>>(
    [rotation, lever, turns]: [&Block; 3],
    x: &Column<V>,
    y: &mut Column<V>,
) {
    let like = x[0].re;
    for i in 0..3 {
        for k in 0..3 {
            y[i] = y[i].add_mul_real(x[k], like.fill(rotation[k][i]));
            y[3 + i] = y[3 + i]
                .add_mul_real(x[k], like.fill(lever[k][i]))
                .add_mul_real(x[3 + k], like.fill(turns[k][i]));
        }
    }
}

/// `sum + Σ aᵢ bᵢ`.
#[inline(always)]
fn dot<V: Lanes>(mut sum: Complex<V>, a: &Column<V>, b: &Column<V>) -> Complex<V> {
    for (a, b) in a.iter().zip(b) {
        sum = sum.add_mul(*a, *b);
    }
    sum
}

/// Rows of a matrix.
#[inline(always)]
fn rows(matrix: &Matrix3<f64>) -> Block {
    core::array::from_fn(|i| core::array::from_fn(|j| matrix[(i, j)]))
}
