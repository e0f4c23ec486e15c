//! The delay between force and acceleration that no line tells.
//!
//! Above the modes a rigid tool moves as a free mass (Ewins, Modal Testing, 2000, section 2.2), which springs and dampers hold less the
//! higher the frequency. Spectra A of the acceleration and F of the force, whose stamps differ by τ, fulfil
//!
//! ```text
//! A e^{iωτ} = (M + i D ω₀/ω + K ω₀²/ω²) F        M, D, K real, 3×3; M positive on its diagonal
//! ```
//!
//! The delay is the τ at which such matrices explain most, over all pieces of the log, each with its own: forces along several axes may be
//! as coherent with each other as milling makes them. Groups of bins have the weight that the scatter of a complex matrix leaves, which is
//! that of their coherence (Hannan and Thomson, Estimating group delay, 1973), with an error of the model beside it.
//!
//! Modes beyond the band leave a part of the acceleration unexplained, which may have any phase: half of its power turns the phase of the mass. With
//! the share s that is explained, the delay is off by √((1 − s) / 2s) / ω in the mean square, ω the mean frequency of the acceleration there.

use std::f64::consts::TAU;

use flexid_core::spectrum::fft;
use nalgebra::{Complex, Matrix3, Rotation3, SMatrix, SVector, Vector3};
use serde::Serialize;

use super::line::median;

/// Force and acceleration at the same instants, along the axes of their sensors. Missing values are NaN.
#[derive(Clone, Debug, Default)]
pub(super) struct Piece {
    pub(super) force: [Vec<f32>; 3],
    pub(super) acceleration: [Vec<f32>; 3],
}

/// What spectra are taken of.
#[derive(Clone, Copy, Debug)]
pub(super) struct Settings {
    pub(super) rate_hz: f64,
    /// Upper edge of the band of the modes, Hz.
    pub(super) above_hz: f64,
    /// From the axes of the force sensor and of the accelerometer to those of the TCP.
    pub(super) axes: [Rotation3<f64>; 2],
}

/// The delay that was found.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Delay {
    /// Time by which the stamps of the acceleration are later than those of the force at the same instant, s.
    pub delay_s: f64,
    /// Standard deviation, with the error that modes beyond the band leave, s.
    pub std_s: f64,
    /// Standard deviation from piece to piece, beside that from axis to axis, s.
    pub spread_s: f64,
    /// Number of pieces of the log in which force and acceleration were coherent.
    pub pieces: usize,
    /// Part of the acceleration that a mass explains, 0 to 1.
    pub share: f64,
}

/// Largest delay, s: 20 ms, the latency of drivers that stamp on arrival, and some.
const LARGEST_S: f64 = 21e-3;
/// Beyond it the search goes on, s, so that a delay beyond is no delay at the limit.
const SEARCHED_S: f64 = 22e-3;
/// Width of a group of bins, Hz: over it a delay of 20 ms turns by a third of a radian to each side.
const GROUP_HZ: f64 = 5.0;
/// Fewest bins of a group, beside three complex numbers that are fitted.
const FEWEST: usize = 8;
/// Highest frequency over the rate: filters of sensors begin there.
const HIGHEST: f64 = 0.45;
/// Groups are used from this coherence on: of 20 bins without any, one in 3000 has it.
const COHERENT: f64 = 0.5;
/// Fewest groups of a piece, all axes together: of 400 without any coherence one is taken for coherent.
const GROUPS: usize = 30;
/// Error of a mass as a model, over the acceleration.
const OF_MODEL: f64 = 0.05;
/// Part of the largest explained power from which on another delay is as likely. Chosen: of cuts at one speed all delays that differ by a tooth period explain as
/// much but for the ends of the cuts, and of sweeps less than half.
const AS_LIKELY: f64 = 0.9;
/// Least part of the acceleration that a mass must explain. Nine real numbers explain less than half of ten groups and more by accident.
const EXPLAINED: f64 = 0.5;
/// Most missing values of a piece, over all: they are held.
const MISSING: f64 = 0.02;

/// Real numbers of a row of M, D and K.
const ROW: usize = 9;
type Row = SVector<f64, ROW>;
type Square = SMatrix<f64, ROW, ROW>;

/// Spectra of one axis of the acceleration in a group, weighted.
struct Group {
    omega: f64,
    /// Lowest frequency of the band over that of the group.
    below: f64,
    /// Cross spectra with the force, and those of the force.
    cross: Vector3<Complex<f64>>,
    force: Matrix3<Complex<f64>>,
    power: f64,
}

/// One axis of the acceleration in one piece.
struct Curve {
    axis: usize,
    piece: usize,
    groups: Vec<Group>,
    /// Inverse of the spectra of the force, over all groups.
    inverse: Square,
    power: f64,
}

impl Group {
    /// Cross spectra with the forces that M, D and K turn, at a delay.
    fn cross(&self, delay_s: f64) -> Row {
        let turn = Complex::from_polar(1.0, self.omega * delay_s);
        let own = self.cross.map(|cross| cross * turn);
        Row::from_fn(|index, _| {
            let own = own[index % 3];
            [own.re, self.below * own.im, self.below * self.below * own.re][index / 3]
        })
    }

    /// Spectra of these forces.
    fn force(&self) -> Square {
        let of = [
            Complex::new(1.0, 0.0),
            Complex::new(0.0, self.below),
            Complex::new(self.below * self.below, 0.0),
        ];
        Square::from_fn(|row, column| {
            (of[row / 3] * of[column / 3].conj() * self.force[(row % 3, column % 3)]).re
        })
    }
}

impl Curve {
    /// Returns the power that real rows of M, D and K explain at a delay. It is 0 where a force along the axis would accelerate against itself.
    fn explained(&self, delay_s: f64) -> f64 {
        let cross: Row = self.groups.iter().map(|own| own.cross(delay_s)).sum();
        let row = self.inverse * cross;
        if row[self.axis] > 0.0 { row.dot(&cross) } else { 0.0 }
    }
}

/// Finds the delay.
///
/// # Errors
/// The error says why there is none.
pub(super) fn delay(
    pieces: impl Iterator<Item = Piece>,
    settings: &Settings,
) -> Result<Delay, String> {
    let highest_hz = HIGHEST * settings.rate_hz;
    let nyquist_hz = 0.5 * settings.rate_hz;
    // Of slow sensors the upper part of the band must do.
    let lowest_hz = settings.above_hz.min(0.5 * nyquist_hz);
    let mut curves = Vec::new();
    for (number, piece) in pieces.enumerate() {
        curves.extend(self::curves(number, &piece, settings, [lowest_hz, highest_hz]));
    }
    if curves.is_empty() {
        return Err(format!(
            "force and acceleration are not coherent between {lowest_hz:.0} and {highest_hz:.0} Hz in any part of the log"
        ));
    }
    let all = |delay_s: f64| curves.iter().map(|own| own.explained(delay_s)).sum::<f64>();
    // An eighth of the shortest period.
    let step_s = 0.125 / highest_hz;
    let (delay_s, explained) = largest(all, 0.0, SEARCHED_S, step_s);
    let share = explained / curves.iter().map(|own| own.power).sum::<f64>();
    if share < EXPLAINED {
        return Err(format!(
            "no delay makes the tool a mass between {lowest_hz:.0} and {highest_hz:.0} Hz: {:.0} % of the acceleration is explained",
            100.0 * share
        ));
    }
    if delay_s.abs() > LARGEST_S {
        return Err(format!(
            "force and acceleration are more than {:.0} ms apart",
            1e3 * LARGEST_S
        ));
    }
    // Of a force of one tooth period all delays that differ by it are as likely.
    let steps = (SEARCHED_S / step_s).ceil() as i64;
    let others = (-steps..=steps).map(|index| index as f64 * step_s);
    let others = others.filter(|other| (other - delay_s).abs() > 1.0 / lowest_hz);
    let rival = others.map(|at| (at, all(at))).max_by(|one, other| one.1.total_cmp(&other.1));
    if let Some((at_s, _)) = rival.filter(|(_, own)| *own > AS_LIKELY * explained) {
        return Err(format!(
            "{:.1} and {:.1} ms are as likely, as where all cuts have one speed",
            1e3 * delay_s,
            1e3 * at_s
        ));
    }
    // Each axis of each piece by itself, within half a period of the middle of the band.
    let near_s = 0.5 / (lowest_hz + highest_hz);
    let each: Vec<(&Curve, f64)> = curves
        .iter()
        .map(|own| (own, largest(|delay_s| own.explained(delay_s), delay_s, near_s, step_s / 4.0)))
        .filter(|(own, (_, explained))| *explained > EXPLAINED * own.power)
        .map(|(own, (delay_s, _))| (own, delay_s))
        .collect();
    let mean_square = |all: &mut dyn Iterator<Item = f64>, freedom: usize| {
        all.map(|own| own * own).sum::<f64>() / freedom.max(1) as f64
    };
    let scatter =
        mean_square(&mut each.iter().map(|(_, own)| own - delay_s), each.len().saturating_sub(1));
    let middle = |axis: usize| {
        let mut of: Vec<f64> =
            each.iter().filter(|(own, _)| own.axis == axis).map(|own| own.1).collect();
        median(&mut of)
    };
    let middles = [0, 1, 2].map(middle);
    let among = each.iter().map(|(own, delay_s)| delay_s - middles[own.axis]);
    let groups = || curves.iter().flat_map(|own| &own.groups);
    let power: f64 = groups().map(|own| own.power).sum();
    let omega = groups().map(|own| own.power * own.omega).sum::<f64>() / power;
    let of_modes_s = ((1.0 - share).max(0.0) / (2.0 * share)).sqrt() / omega;
    let mut counted: Vec<usize> = curves.iter().map(|own| own.piece).collect();
    counted.dedup();
    Ok(Delay {
        delay_s,
        std_s: (scatter / each.len().max(1) as f64).sqrt().hypot(of_modes_s),
        spread_s: mean_square(&mut among.clone(), each.len().saturating_sub(3)).sqrt(),
        pieces: counted.len(),
        share,
    })
}

/// Returns the largest value and its place, within `reach` of `from`.
fn largest(of: impl Fn(f64) -> f64, from: f64, reach: f64, step: f64) -> (f64, f64) {
    let steps = (reach / step).ceil() as i64;
    let at = |index: i64| from + index as f64 * step;
    let values = (-steps..=steps).map(|index| (index, of(at(index))));
    let best = values.max_by(|one, other| one.1.total_cmp(&other.1));
    let mut place = best.map_or(from, |(index, _)| at(index));
    // The parabola through three points, closer and closer.
    let mut step = step;
    for _ in 0..6 {
        let [before, here, after] = [place - step, place, place + step].map(&of);
        let bend = before - 2.0 * here + after;
        if bend < 0.0 {
            place += (0.5 * step * (before - after) / bend).clamp(-step, step);
        }
        step *= 0.4;
    }
    (place, of(place))
}

/// The axes of a piece whose acceleration is coherent with the force.
fn curves(number: usize, piece: &Piece, settings: &Settings, band_hz: [f64; 2]) -> Vec<Curve> {
    let turned = |of: &[Vec<f32>; 3], axes: &Rotation3<f64>| -> Option<[Vec<f64>; 3]> {
        let [x, y, z] = [held(&of[0])?, held(&of[1])?, held(&of[2])?];
        let mut turned = [Vec::new(), Vec::new(), Vec::new()];
        for ((x, y), z) in x.into_iter().zip(y).zip(z) {
            let value = axes * Vector3::new(x, y, z);
            (0..3).for_each(|axis| turned[axis].push(value[axis]));
        }
        Some(turned)
    };
    let both =
        turned(&piece.force, &settings.axes[0]).zip(turned(&piece.acceleration, &settings.axes[1]));
    let Some((force, acceleration)) = both else { return Vec::new() };
    let length = force[0].len();
    let [force, acceleration] = [force, acceleration].map(|of| of.map(|of| spectrum(&of)));
    let spacing_hz = settings.rate_hz / length as f64;
    let bins = ((GROUP_HZ / spacing_hz) as usize).max(FEWEST);
    let [first, end] = band_hz.map(|hz| ((hz / spacing_hz) as usize).min(force[0].len()));
    let mut curves = [0, 1, 2].map(|axis| Curve {
        axis,
        piece: number,
        groups: Vec::new(),
        inverse: Square::zeros(),
        power: 0.0,
    });
    for from in (first.max(1)..end.saturating_sub(bins)).step_by(bins) {
        let omega = TAU * spacing_hz * (from as f64 + 0.5 * (bins - 1) as f64);
        let of_bin = |of: &[Vec<Complex<f64>>; 3], bin: usize| {
            Vector3::new(of[0][bin], of[1][bin], of[2][bin])
        };
        let mut power = Matrix3::<Complex<f64>>::zeros();
        let mut cross = Matrix3::<Complex<f64>>::zeros();
        let mut own = Vector3::<f64>::zeros();
        for bin in from..from + bins {
            let (force, acceleration) = (of_bin(&force, bin), of_bin(&acceleration, bin));
            power += force * force.adjoint();
            cross += acceleration * force.adjoint();
            own += acceleration.map(|own| own.norm_sqr());
        }
        // An axis that is not measured has no power.
        let trace = power.trace().re;
        let Some(inverse) =
            (power + Matrix3::identity() * Complex::from(1e-9 * trace)).try_inverse()
        else {
            continue;
        };
        for (axis, curve) in curves.iter_mut().enumerate() {
            let row = cross.row(axis).into_owned();
            let explained = (row * inverse * row.adjoint())[0].re;
            let freedom = bins as f64 / (bins - 3) as f64;
            let left = (own[axis] - explained).max(0.0) * freedom;
            if !(own[axis] > 0.0 && 1.0 - left / own[axis] > COHERENT) {
                continue;
            }
            let weight = bins as f64 / (left + OF_MODEL * OF_MODEL * own[axis]);
            curve.groups.push(Group {
                omega,
                below: TAU * band_hz[0] / omega,
                cross: row.transpose() * Complex::from(weight),
                force: power * Complex::from(weight),
                power: own[axis] * weight,
            });
        }
    }
    if curves.iter().map(|own| own.groups.len()).sum::<usize>() < GROUPS {
        return Vec::new();
    }
    let complete = |mut curve: Curve| {
        let force: Square = curve.groups.iter().map(Group::force).sum();
        curve.power = curve.groups.iter().map(|own| own.power).sum();
        curve.inverse = (force + Square::identity() * (1e-9 * force.trace())).try_inverse()?;
        (!curve.groups.is_empty()).then_some(curve)
    };
    curves.into_iter().filter_map(complete).collect()
}

/// Returns values with what is missing held. Returns `None` if much is.
fn held(values: &[f32]) -> Option<Vec<f64>> {
    let missing = values.iter().filter(|own| !own.is_finite()).count();
    if missing as f64 > MISSING * values.len() as f64 {
        return None;
    }
    let mut last = values.iter().copied().find(|own| own.is_finite())?;
    let held = values.iter().map(|&own| {
        last = if own.is_finite() { own } else { last };
        f64::from(last)
    });
    Some(held.collect())
}

/// Returns the spectrum below half the rate, the mean taken out, with Hann's window. It is empty of another length than records have.
fn spectrum(values: &[f64]) -> Vec<Complex<f64>> {
    let length = values.len() as f64;
    let mean = values.iter().sum::<f64>() / length;
    let windowed = values.iter().enumerate().map(|(index, value)| {
        let half = std::f64::consts::PI * (index as f64 + 0.5) / length;
        ((value - mean) * half.sin().powi(2)) as f32
    });
    let mut windowed: Vec<f32> = windowed.collect();
    let bins = fft::real_transform(&mut windowed).unwrap_or_default();
    bins.iter().map(|bin| Complex::new(f64::from(bin.re), f64::from(bin.im))).collect()
}
