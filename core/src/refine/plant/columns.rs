//! Derivatives of a reading by the imperfections, each in its standard deviation.
//!
//! An imperfection of the model changes inertias, transformations and loads (`change`), whose effect follows from the motions
//! of the robot (`motion`); so do those of the ground. The others change an impedance (below), or act on the reading A or on the
//! measured force F, with the accelerance G:
//!
//! ```text
//! delay −s A      gain of A  A_a           resonance of A  −s² A/(1 + s²/ω_r²)       high-pass of A  −A/s/(1 + ω_h/s)
//!                 gain of F  −G_a F_a      resonance of F  s² G F/(1 + s²/ω_r²)      high-pass of F  G F/s/(1 + ω_h/s)
//! dispersion s³ A/(1 − c s³ + e s⁴)        roll-off −s⁴ A/(1 − c s³ + e s⁴)
//! ```
//!
//! Those of a bushing along one degree of freedom change its impedance z: the derivative is `−∂z e_out q`, summed over the degrees of
//! freedom.

use heapless::Vec;

use super::super::batch::Batch;
use super::super::model::Model;
use super::super::rows::{Rows, add, write};
use super::change::Change;
use super::motion::{Motions, taken_by_tool};
use super::sag::Sag;
use crate::imperfection::{Imperfection, Sensor};
use crate::receptance::lanes::Lanes;
use crate::receptance::{
    Complex, Filter, PerDof, Response, Terms, per_growth, per_hysteretic_part,
};
use crate::sought::Sought;
use crate::{DOF, MAX_JOINTS};

/// Columns of imperfections in the rows of a record: of those that stand before the unknowns, and of those that are sought as unknowns.
#[derive(Clone, Copy, Debug)]
pub(in crate::refine) struct Columns<'a> {
    /// Those before the unknowns, each with its standard deviation.
    pub(in crate::refine) before: &'a [(Imperfection, f64)],
    /// Derivative of the model by each imperfection of the model, in its standard deviation: of those before the unknowns, then of those that are
    /// sought.
    pub(in crate::refine) changes: &'a [Change],
    /// Sags of the bushings.
    pub(in crate::refine) sags: &'a [Sag],
    /// Number of the record.
    pub(in crate::refine) record: usize,
}

impl Columns<'_> {
    /// No columns.
    pub(in crate::refine) const NONE: Self =
        Self { before: &[], changes: &[], sags: &[], record: 0 };

    /// Derivative of the reading along each axis by an imperfection that is not of the model.
    #[inline(always)]
    fn of_reading<V: Lanes<Scalar = f64>>(
        &self,
        imperfection: Imperfection,
        response: &Response<V>,
        model: &Model,
        batch: &Batch<V>,
        motions: &Motions<V>,
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
        let cube = || {
            let filter = &model.accelerometer_filter;
            batch.s * batch.s * batch.s * filter.of_low_pass(batch.s).reciprocal()
        };
        let mut derivative = [Complex::zero(like); 3];
        match imperfection {
            Imperfection::Delay => return by_reading(batch.s),
            Imperfection::Dispersion => return by_reading(-cube()),
            Imperfection::RollOff => return by_reading(batch.s * cube()),
            Imperfection::DelayDrift => return batch.drift,
            Imperfection::RecordDelay(record) if record == self.record => {
                return by_reading(batch.s);
            }
            Imperfection::Hysteresis => {
                let excess = per_hysteretic_part(batch.s, model.terms.hysteresis.reference);
                let damping = |joint: usize, dof: usize| model.terms.joints[joint].damping[dof];
                return by_impedance(&model.terms, response, excess, damping);
            }
            Imperfection::Servo(own) => {
                let drive = model.drives[own];
                let stiffness = |joint: usize, dof: usize| {
                    let is_driven = joint == own && drive == Some(dof);
                    if is_driven { model.terms.joints[own].stiffness[dof] } else { 0.0 }
                };
                return by_impedance(&model.terms, response, per_growth(batch.s), stiffness);
            }
            Imperfection::Ground(dof) => return motions.by_ground(model, batch.s, dof),
            Imperfection::GroundDamping(dof) => {
                let by_compliance = motions.by_ground(model, batch.s, dof);
                return by_compliance.map(|by_compliance| -(by_compliance * batch.s));
            }
            Imperfection::BaseMass => return motions.by_base_mass(model, batch.s),
            Imperfection::Hose => return motions.by_hose(model, batch.s),
            Imperfection::HoseDamping => {
                return motions.by_hose(model, batch.s).map(|by_stiffness| by_stiffness * batch.s);
            }
            Imperfection::Resonance(Sensor::Accelerometer) => {
                return by_reading(resonance(&model.accelerometer_filter));
            }
            Imperfection::HighPass(Sensor::Accelerometer) => {
                return by_reading(high_pass(&model.accelerometer_filter));
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

/// Adds the derivatives by the stiffnesses times their `rates`.
#[inline(always)]
fn add_stiffness<V: Lanes<Scalar = f64>>(
    terms: &Terms<f64>,
    response: &Response<V>,
    rates: &[[f64; DOF]; MAX_JOINTS],
    derivative: &mut [Complex<V>; 3],
) {
    for (joint, (own, rates)) in terms.joints.iter().zip(rates).enumerate() {
        for (dof, rate) in rates.iter().enumerate().filter(|(_, rate)| **rate != 0.0) {
            let by = response.derivatives(terms, joint, dof);
            for (derivative, [by_stiffness, _]) in derivative.iter_mut().zip(by) {
                let relative = by_stiffness.re.fill(rate / own.stiffness[dof]);
                *derivative = derivative.add_mul_real(by_stiffness, relative);
            }
        }
    }
}

/// The force that cuts: what is measured, and what the tool takes.
#[inline(always)]
pub(super) fn force_that_cuts<V: Lanes<Scalar = f64>>(
    model: &Model,
    batch: &Batch<V>,
    motions: &Motions<V>,
) -> [Complex<V>; 3] {
    let mut cut = batch.force;
    if let Some(tool) = &model.terms.tool {
        let last = model.terms.joints.len() - 1;
        let taken = taken_by_tool(tool, batch.s, &motions.of_record.displacements[last]);
        for (cut, taken) in cut.iter_mut().zip(taken) {
            *cut = *cut + taken;
        }
    }
    cut
}

/// Derivative of the reading by a change of the model. `cut` is the force that cuts.
#[inline(always)]
pub(super) fn of_change<V: Lanes<Scalar = f64>>(
    change: &Change,
    response: &Response<V>,
    model: &Model,
    s: Complex<V>,
    cut: &[Complex<V>; 3],
    motions: &Motions<V>,
) -> [Complex<V>; 3] {
    let last = model.terms.joints.len() - 1;
    let mut derivative = [Complex::zero(s.re); 3];
    if let Some((joint, inertia)) = &change.inertia {
        motions.add_inertia(*joint, inertia, s * s, &mut derivative);
    }
    for (joint, change) in &change.from_parent {
        motions.add_from_parent(*joint, change, &mut derivative);
    }
    if let Some(rates) = &change.stiffness {
        add_stiffness(&model.terms, response, rates, &mut derivative);
    }
    if let Some(tip) = &change.tip {
        motions.add_tip(last, tip, response, s, cut, &mut derivative);
    }
    derivative
}

/// `−Σ ∂z e_out q` over all degrees of freedom, with `∂z` a real value of each times a common factor.
#[inline(always)]
fn by_impedance<V: Lanes<Scalar = f64>>(
    terms: &Terms<f64>,
    response: &Response<V>,
    factor: Complex<V>,
    value: impl Fn(usize, usize) -> f64,
) -> [Complex<V>; 3] {
    let mut sums = [Complex::zero(factor.re); 3];
    for joint in 0..terms.joints.len() {
        for dof in 0..DOF {
            let value = value(joint, dof);
            if value != 0.0 {
                let moved = response.elongation[joint][dof].scale(factor.re.fill(-value));
                for (sum, per_load) in sums.iter_mut().zip(&response.per_load) {
                    *sum = sum.add_mul(moved, per_load[joint][dof]);
                }
            }
        }
    }
    sums.map(|sum| sum * factor)
}

impl Columns<'_> {
    /// Writes the columns of each lane, from `first` on. It adds to those of the stiffnesses, which have been written.
    /// `response` is that of `model` at `batch`; `seam` holds the loads of the seam.
    #[inline(always)]
    pub(in crate::refine) fn write<V: Lanes<Scalar = f64>, const W: usize>(
        &self,
        rows: &mut [Rows<W>],
        (first, sought): (usize, &Sought),
        response: &Response<V>,
        model: &Model,
        batch: &Batch<V>,
        seam: &PerDof<V>,
    ) {
        let s = batch.s;
        let of_unknowns = first + self.before.len();
        let motions = Motions::new(model, response, s, seam);
        let cut = force_that_cuts(model, batch, &motions);
        let mut of_loads: Vec<[Complex<V>; 3], { DOF * MAX_JOINTS }> = Vec::new();
        for sag in self.sags {
            let of_geometry = of_change(&sag.change, response, model, s, &cut, &motions);
            let mut of_load = of_geometry;
            if let Some(rates) = &sag.stiffness {
                add_stiffness(&model.terms, response, rates, &mut of_load);
            }
            // There is room for all of them.
            let _ = of_loads.push(of_load);
            if let Some(unknown) = sag.unknown {
                for (axis, value) in of_geometry.into_iter().enumerate() {
                    add(rows, axis, of_unknowns + unknown, -value);
                }
            }
        }
        let mut changes = self.changes.iter().enumerate();
        let of_sought = (of_unknowns + sought.first_imperfection()..).zip(sought.imperfections());
        for (column, &(imperfection, deviation)) in (first..).zip(self.before).chain(of_sought) {
            let derivative = if imperfection.is_of_model() {
                let Some((place, change)) = changes.next() else { continue };
                let mut derivative = of_change(change, response, model, s, &cut, &motions);
                let rates = self.sags.iter().map(|sag| sag.by_imperfection[place]);
                for (rate, of_load) in rates.zip(&of_loads).filter(|(rate, _)| *rate != 0.0) {
                    for (derivative, value) in derivative.iter_mut().zip(of_load) {
                        *derivative = derivative.add_mul_real(*value, s.re.fill(rate));
                    }
                }
                derivative
            } else {
                let own = self.of_reading(imperfection, response, model, batch, &motions);
                own.map(|value| value.scale(s.re.fill(deviation)))
            };
            for (axis, value) in derivative.into_iter().enumerate() {
                write(rows, axis, column, value);
            }
        }
    }
}
