//! Derivatives of a reading by the imperfections, each in its standard deviation.
//!
//! An imperfection of the model changes the inertia I of a link, the transformation X between two links, or the loads on the last
//! link: P of the force F that cuts, r of the observation, W of the tool. With the displacements η of the links and the loads λ on the
//! bushings, η̂ and λ̂ due to the observation, and G the observation per measured force:
//!
//! ```text
//! ∂A = −s² η̂ᵀ ∂I η + λ̂ᵀ ∂X η₋ + λᵀ ∂X η̂₋ + η̂ᵀ ∂P F + ∂rᵀ η + G ∂Wᵀ η            η₋ the displacement of the link before
//! ```
//!
//! The others act on the reading A, or on the measured force:
//!
//! ```text
//! delay −s A      gain of A  A_a           resonance of A  −s² A/(1 + s²/ω_r²)       high-pass of A  −A/s/(1 + ω_h/s)
//!                 gain of F  −G_a F_a      resonance of F  s² G F/(1 + s²/ω_r²)      high-pass of F  G F/s/(1 + ω_h/s)
//! ```

use heapless::Vec;
use nalgebra::Matrix3;

use super::super::batch::Batch;
use super::super::further::Further;
use super::super::model::Model;
use super::super::rows::{Rows, write};
use super::change::{Block, Change, FromParentChange, Tip};
use crate::chain::from_parent::FromParent;
use crate::imperfection::{Imperfection, MAX_IMPERFECTIONS, Sensor};
use crate::receptance::lanes::Lanes;
use crate::receptance::{Complex, Filter, PerDof, Response, Terms, ToolTerms};
use crate::{DOF, MAX_JOINTS};

/// Step of a difference, in standard deviations of the imperfection. Chosen: rounding changes a derivative by less than 1e-6 of it, and
/// curvature by a thousandth of what it changes over a standard deviation.
pub(super) const STEP: f64 = 1e-3;

type Column<V> = [Complex<V>; DOF];

/// Columns of the imperfections of a record.
#[derive(Clone, Debug)]
pub(super) struct Imperfections {
    /// Each imperfection, with its standard deviation.
    pub(super) all: Vec<(Imperfection, f64), MAX_IMPERFECTIONS>,
    /// X of each joint.
    pub(super) from_parent: Vec<FromParent, MAX_JOINTS>,
    /// Derivative of the model by each imperfection of the model, in its standard deviation.
    pub(super) changes: Vec<Change, MAX_IMPERFECTIONS>,
    /// Filter of the accelerometer.
    pub(super) accelerometer_filter: Filter<f64>,
}

/// Displacement of each link, and load on each bushing.
struct Motion<V> {
    displacements: PerDof<V>,
    loads: PerDof<V>,
}

/// Motions due to a unit observation along each axis, and that of the record.
struct Motions<V> {
    per_observation: [Motion<V>; 3],
    of_record: Motion<V>,
}

impl<V: Lanes<Scalar = f64>> Motion<V> {
    /// `η = δ + X η₋` and `λ = (k + s d) δ − γ`, from the elongations δ and the load γ of a seam.
    #[inline(always)]
    fn new(
        from_parent: &[FromParent],
        terms: &Terms<f64>,
        s: Complex<V>,
        elongations: &PerDof<V>,
        seam: Option<&PerDof<V>>,
    ) -> Self {
        let zero = Complex::zero(s.re);
        let mut motion =
            Self { displacements: [[zero; DOF]; MAX_JOINTS], loads: [[zero; DOF]; MAX_JOINTS] };
        let Self { displacements, loads } = &mut motion;
        for (joint, own) in terms.joints.iter().enumerate() {
            displacements[joint] = elongations[joint];
            if joint > 0 {
                let x = &from_parent[joint];
                let [rotation, lever, turns] = [&x.rotation, &x.lever, &x.turns].map(rows);
                let before = displacements[joint - 1];
                add_transformed([&rotation, &lever, &turns], &before, &mut displacements[joint]);
            }
            for dof in 0..DOF {
                let [stiffness, damping] =
                    [own.stiffness[dof], own.damping[dof]].map(|value| s.re.fill(value));
                let mut impedance = s.scale(damping);
                impedance.re = impedance.re + stiffness;
                loads[joint][dof] = impedance * elongations[joint][dof];
                if let Some(seam) = seam {
                    loads[joint][dof] = loads[joint][dof] - seam[joint][dof];
                }
            }
        }
        motion
    }
}

impl<V: Lanes<Scalar = f64>> Motions<V> {
    #[inline(always)]
    fn new(
        from_parent: &[FromParent],
        model: &Model,
        response: &Response<V>,
        batch: &Batch<V>,
        seam: &PerDof<V>,
    ) -> Self {
        let motion = |elongations: &PerDof<V>, seam: Option<&PerDof<V>>| {
            Motion::new(from_parent, &model.terms, batch.s, elongations, seam)
        };
        Self {
            per_observation: response.per_load.each_ref().map(|per_load| motion(per_load, None)),
            of_record: motion(&response.elongation, Some(seam)),
        }
    }

    /// `−s² η̂ᵀ ∂I η`.
    #[inline(always)]
    fn add_inertia(
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

    /// `λ̂ᵀ ∂X η₋ + λᵀ ∂X η̂₋`.
    #[inline(always)]
    fn add_from_parent(
        &self,
        joint: usize,
        change: &FromParentChange,
        derivative: &mut [Complex<V>; 3],
    ) {
        let FromParentChange { rotation, lever, turns } = change;
        let changed = |motion: &Motion<V>| {
            let before = &motion.displacements[joint - 1];
            let mut moved = [Complex::zero(before[0].re); DOF];
            add_transformed([rotation, lever, turns], before, &mut moved);
            moved
        };
        let of_record = changed(&self.of_record);
        let load = &self.of_record.loads[joint];
        for (derivative, own) in derivative.iter_mut().zip(&self.per_observation) {
            *derivative = dot(*derivative, &own.loads[joint], &of_record);
            *derivative = dot(*derivative, load, &changed(own));
        }
    }

    /// `η̂ᵀ ∂P F + ∂rᵀ η + G ∂Wᵀ η`. `cut` is F.
    #[inline(always)]
    fn add_tip(
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

impl Imperfections {
    /// Derivative of the reading along each axis by an imperfection that is not of the model.
    #[inline(always)]
    fn of_reading<V: Lanes<Scalar = f64>>(
        &self,
        imperfection: Imperfection,
        response: &Response<V>,
        model: &Model,
        batch: &Batch<V>,
    ) -> [Complex<V>; 3] {
        let like = batch.s.re;
        let by_force = |factor: Complex<V>| -> [Complex<V>; 3] {
            core::array::from_fn(|axis| {
                let mut sum = Complex::zero(like);
                for push in 0..3 {
                    sum = sum.add_mul(response.per_force[axis][push], batch.force[push]);
                }
                sum * factor
            })
        };
        let by_reading = |factor: Complex<V>| response.observed.map(|reading| -(reading * factor));
        let resonance =
            |filter: &Filter<f64>| (batch.s * batch.s) * filter.of_resonance(batch.s).reciprocal();
        let high_pass =
            |filter: &Filter<f64>| batch.inverse_s * filter.of_high_pass(batch.s).reciprocal();
        let mut derivative = [Complex::zero(like); 3];
        match imperfection {
            Imperfection::Delay => return by_reading(batch.s),
            Imperfection::Resonance(Sensor::Accelerometer) => {
                return by_reading(resonance(&self.accelerometer_filter));
            }
            Imperfection::HighPass(Sensor::Accelerometer) => {
                return by_reading(high_pass(&self.accelerometer_filter));
            }
            Imperfection::Resonance(Sensor::Force) => {
                return by_force(resonance(&model.force_filter));
            }
            Imperfection::HighPass(Sensor::Force) => {
                return by_force(high_pass(&model.force_filter));
            }
            Imperfection::Gain(Sensor::Accelerometer, axis) => {
                derivative[axis] = response.observed[axis];
            }
            Imperfection::Gain(Sensor::Force, push) => {
                for axis in 0..3 {
                    derivative[axis] = -(response.per_force[axis][push] * batch.force[push]);
                }
            }
            _ => {}
        }
        derivative
    }
}

impl Further for &mut Imperfections {
    #[inline(always)]
    fn count(&self) -> usize {
        self.all.len()
    }

    #[inline(always)]
    fn write<V: Lanes<Scalar = f64>, const W: usize>(
        &mut self,
        rows: &mut [Rows<W>],
        first: usize,
        response: &Response<V>,
        model: &Model,
        batch: &Batch<V>,
        seam: &PerDof<V>,
    ) {
        let s = batch.s;
        let last = model.terms.joints.len() - 1;
        let motions = Motions::new(&self.from_parent, model, response, batch, seam);
        let mut cut = batch.force;
        if let Some(tool) = &model.terms.tool {
            let taken = taken_by_tool(tool, s, &motions.of_record.displacements[last]);
            for (cut, taken) in cut.iter_mut().zip(taken) {
                *cut = *cut + taken;
            }
        }
        let mut changes = self.changes.iter();
        for (index, &(imperfection, deviation)) in self.all.iter().enumerate() {
            let mut derivative = [Complex::zero(s.re); 3];
            if imperfection.is_of_model() {
                let Some(change) = changes.next() else { continue };
                if let Some((joint, inertia)) = &change.inertia {
                    motions.add_inertia(*joint, inertia, s * s, &mut derivative);
                }
                for (joint, change) in &change.from_parent {
                    motions.add_from_parent(*joint, change, &mut derivative);
                }
                if let Some(tip) = &change.tip {
                    motions.add_tip(last, tip, response, s, &cut, &mut derivative);
                }
            } else {
                let own = self.of_reading(imperfection, response, model, batch);
                derivative = own.map(|value| value.scale(s.re.fill(deviation)));
            }
            for (axis, value) in derivative.into_iter().enumerate() {
                write(rows, axis, first + index, value);
            }
        }
    }
}

/// `Wᵀ η`: force that a tool takes at a displacement of the last link, along the axes of the force sensor.
#[inline(always)]
fn taken_by_tool<V: Lanes<Scalar = f64>>(
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
