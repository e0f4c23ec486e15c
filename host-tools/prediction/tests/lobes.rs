//! Stability lobes against closed forms, against the motion of a robot under its cutter in time, and against finite differences.

#[path = "../../../core/tests/common/mod.rs"]
mod common;

use std::f64::consts::{PI, TAU};
use std::path::Path;

use common::{Dense, Random, nominal};
use flexid_core::parameters::Bushings;
use flexid_pipeline::model::Model;
use flexid_pipeline::robot::{FoundRobot, JointBounds};
use flexid_prediction::lobes::{Limit, Lobes, Sample};
use flexid_prediction::milling::{Cutter, Milling, plane};
use flexid_prediction::{Dynamics, Robot};
use nalgebra::{Complex, DMatrix, DVector, Matrix2, Matrix3x2, Vector2};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

const POSE: [f64; 3] = [0.1, -0.5, 0.9];
const FEED: [f64; 3] = [1.0, 0.2, 0.0];
const AXIS: [f64; 3] = [0.0, 0.0, 1.0];
const BAND_HZ: [f64; 2] = [2.0, 200.0];
/// Time steps between two teeth. Chosen: the phase of a step is below 0.1 rad for the lobes that are tested.
const STEPS: usize = 160;

/// A slot with four teeth, whose forces are the same at all angles: there the zero-order method is exact.
fn slot() -> Cutter {
    Cutter { teeth: 4, tangential: 7e8, radial_ratio: 0.3, engagement: Milling::Up.engagement(1.0) }
}

/// The scenario's robot with these bushings. Stiffnesses and dampings vary by `std`, those of `uncertain` alone if any.
fn robot(bushings: &Bushings, std: f64, uncertain: Option<usize>) -> Robot {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenario/mill3-model.toml");
    let size = 12 * bushings.len();
    let variance = |row: usize, column: usize| {
        let varies = uncertain.is_none_or(|own| own == row);
        if row == column && varies { std * std } else { 0.0 }
    };
    let found = FoundRobot {
        model: Model::load(&file).unwrap(),
        gravity_m_per_s2: [0.0; 3],
        band_hz: BAND_HZ,
        reference_hz: None,
        poses: Vec::new(),
        bounds: vec![JointBounds { stiffness: [[1.0, 2.0]; 6], damping: [[1.0, 2.0]; 6] }; 3],
        imperfections: Vec::new(),
        covariance: (0..size)
            .flat_map(|row| (0..=row).map(move |column| variance(row, column)))
            .collect(),
    };
    Robot::new(found, bushings.clone()).unwrap()
}

fn lobes(dynamics: &Dynamics<'_>, cutter: Cutter) -> Lobes {
    Lobes::of(dynamics, cutter, &plane(FEED, AXIS).unwrap(), BAND_HZ).unwrap()
}

/// One mode along the feed: `G = 1/(k (1 − r² + 2iζr))`. Chatter frequency f gives `b = −1/(2 K Re G)` and
/// `n = 60 f / (N (k + ε/2π))` with `ε = 3π + 2 arctan(Im G / Re G)` (Altintas, _Manufacturing Automation_, 2nd ed., equations 4.19 and
/// 4.22); the least is `2 k ζ (1 + ζ) / K` (equation 4.21). K is `−N K_t α_xx / 4π`.
#[test]
fn one_mode_has_the_lobes_of_the_closed_form() {
    let (stiffness, natural, ratio) = (2e7, 60.0, 0.035);
    let cutter = Cutter {
        teeth: 3,
        tangential: 6e8,
        radial_ratio: 0.4,
        engagement: Milling::Up.engagement(0.5),
    };
    let directional = cutter.directional();
    let response = |hz: f64| {
        let r = hz / natural;
        (Complex::new(1.0 - r * r, 2.0 * ratio * r) * stiffness).inv()
    };
    let sample = |hz: f64| {
        let mut receptance = Matrix2::zeros();
        receptance[(0, 0)] = response(hz);
        Some(Sample::new(hz, &directional, &receptance, &[], |_, _| 0.0))
    };
    let lobes = Lobes::new(cutter, [1.0, 400.0], sample).unwrap();
    let along = -3.0 * 6e8 * directional[(0, 0)] / (4.0 * PI);
    let least = 2.0 * stiffness * ratio * (1.0 + ratio) / along;
    assert!((lobes.least().unwrap().value / least - 1.0).abs() < 1e-3);
    let mut tested = 0;
    for (hz, lobe) in [(61.5, 0), (63.0, 1), (62.2, 4), (70.0, 2), (64.0, 12)] {
        let g = response(hz);
        let depth = -1.0 / (2.0 * along * g.re);
        let phase = 3.0 * PI + 2.0 * (g.im / g.re).atan();
        // ε within a turn.
        let phase = phase.rem_euclid(TAU);
        let rpm = 60.0 * hz / (3.0 * (f64::from(lobe) + phase / TAU));
        let found = lobes.limit(rpm).unwrap();
        // A lower lobe may hide this one.
        if found.lobe == lobe {
            assert!((found.depth_m.value / depth - 1.0).abs() < 1e-3, "{found:?} {depth}");
            assert!((found.chatter_hz.value / hz - 1.0).abs() < 1e-5, "{found:?} {hz}");
            tested += 1;
        }
        assert!(found.depth_m.value <= depth * 1.001, "{found:?} {depth}");
    }
    assert!(tested >= 4, "{tested}");
}

/// A robot under its cutter, whose elongations move by `M ë + D ė + K e = Pᵀ F`. The state moves by the exponential of a time step; teeth cut
/// one by one what the tooth before has left.
struct Cut {
    /// Change of the state, elongations above their rates, in a time step, and of a force within it along feed and normal.
    step: DMatrix<f64>,
    push: DMatrix<f64>,
    /// Displacements along feed and normal by the state.
    shown: DMatrix<f64>,
    time_step: f64,
}

impl Cut {
    fn new(robot: &Robot, plane: &Matrix3x2<f64>, time_step: f64) -> Self {
        let chain = robot.model().chain().unwrap();
        let dense = Dense::new(&chain, &POSE, nalgebra::Vector3::zeros(), &[[0.0; 6]; 3]);
        let n = 18;
        let inverse = dense.mass().try_inverse().unwrap();
        let of = |value: fn(&flexid_core::parameters::Bushing) -> [f64; 6]| {
            let all = robot.bushings().iter().flat_map(value);
            DMatrix::from_diagonal(&DVector::from_iterator(n, all))
        };
        let mut state = DMatrix::zeros(2 * n + 2, 2 * n + 2);
        state.view_mut((0, n), (n, n)).fill_diagonal(1.0);
        state.view_mut((n, 0), (n, n)).copy_from(&-(&inverse * of(|own| own.stiffness)));
        state.view_mut((n, n), (n, n)).copy_from(&-(&inverse * of(|own| own.damping)));
        let tip = plane.transpose() * dense.tip().rows(0, 3);
        state.view_mut((n, 2 * n), (n, 2)).copy_from(&(&inverse * tip.transpose()));
        // The force is constant within a step (Van Loan, 1978).
        let moved = (state * time_step).exp();
        let mut shown = DMatrix::zeros(2, 2 * n);
        shown.columns_mut(0, n).copy_from(&tip);
        Self {
            step: moved.view((0, 0), (2 * n, 2 * n)).into_owned(),
            push: moved.view((0, 2 * n), (2 * n, 2)).into_owned(),
            shown,
            time_step,
        }
    }

    /// Growth of the vibration, 1/s, after the other modes have decayed.
    fn growth(&self, cutter: &Cutter, depth: f64, seconds: f64) -> f64 {
        let n = self.step.nrows() / 2;
        let mut state =
            DVector::from_fn(2 * n, |i, _| if i < n { 1e-6 * (i as f64).cos() } else { 0.0 });
        let mut before = vec![Vector2::zeros(); STEPS + 1];
        let count = (seconds / self.time_step) as usize;
        let mut sizes = [0.0_f64; 2];
        for step in 0..count {
            let now: Vector2<f64> = (&self.shown * &state).fixed_rows::<2>(0).into_owned();
            let rate: Vector2<f64> = (&self.shown
                * state.rows(n, n).clone_owned().resize_vertically(2 * n, 0.0))
            .fixed_rows::<2>(0)
            .into_owned();
            let middle = now + rate * (self.time_step / 2.0);
            let left = (before[step % (STEPS + 1)] + before[(step + 1) % (STEPS + 1)]) / 2.0;
            before[step % (STEPS + 1)] = now;
            let mut force = Vector2::zeros();
            for tooth in 0..cutter.teeth {
                let turn = (step as f64 + 0.5) / STEPS as f64 + f64::from(tooth);
                let angle = (TAU * turn / f64::from(cutter.teeth)).rem_euclid(TAU);
                if angle < cutter.engagement[0] || angle > cutter.engagement[1] {
                    continue;
                }
                let (sin, cos) = angle.sin_cos();
                let chip = Vector2::new(sin, cos).dot(&(middle - left));
                let tangential = cutter.tangential * depth * chip;
                let radial = cutter.radial_ratio * tangential;
                force +=
                    Vector2::new(-tangential * cos - radial * sin, tangential * sin - radial * cos);
            }
            state = &self.step * state + &self.push * force;
            let part = step as f64 / count as f64;
            if (0.5..0.6).contains(&part) {
                sizes[0] = sizes[0].max(now.norm());
            } else if part >= 0.9 {
                sizes[1] = sizes[1].max(now.norm());
            }
        }
        (sizes[1] / sizes[0]).ln() / (0.4 * seconds)
    }
}

/// On both sides of the limit, 4 % away.
#[test]
fn the_robot_chatters_above_the_limit_and_calms_down_below() {
    let robot = robot(&nominal(), 0.0, None);
    let dynamics = robot.at(&POSE).unwrap();
    let cutter = slot();
    let lobes = lobes(&dynamics, cutter);
    for rpm in [150.0, 260.0, 700.0] {
        let limit = lobes.limit(rpm).unwrap();
        let period = 60.0 / (4.0 * rpm);
        let cut = Cut::new(&robot, &plane(FEED, AXIS).unwrap(), period / STEPS as f64);
        let depth = limit.depth_m.value;
        let [below, above] = [0.96, 1.04].map(|part| cut.growth(&cutter, part * depth, 60.0));
        assert!(below < 0.0 && above > 0.0, "{rpm} rpm, {limit:?}: {below} {above}");
    }
}

/// A mode of the robot and one of the spindle above the band. Where the teeth pass above the band, that of the robot hardly chatters, and that of
/// the spindle does: the band alone allows cuts several times too deep, or all. Nothing can be stated of such speeds.
#[test]
fn teeth_that_pass_above_the_band_meet_modes_that_it_does_not_show() {
    let cutter = Cutter { teeth: 3, ..slot() };
    let directional = cutter.directional();
    let mode = |hz: f64, stiffness: f64, natural: f64, ratio: f64| {
        let r = hz / natural;
        (Complex::new(1.0 - r * r, 2.0 * ratio * r) * stiffness).inv()
    };
    let sample = |hz: f64| {
        let response = mode(hz, 2e6, 20.0, 0.02) + mode(hz, 2e7, 700.0, 0.03);
        Some(Sample::new(hz, &directional, &(Matrix2::identity() * response), &[], |_, _| 0.0))
    };
    let [narrow, whole] =
        [BAND_HZ, [2.0, 2000.0]].map(|band| Lobes::new(cutter, band, sample).unwrap());
    assert_eq!(narrow.speeds(), [40.0, 4000.0]);
    for rpm in [9_000.0, 12_000.0, 18_000.0] {
        let (own, truth) = (narrow.limit(rpm), whole.limit(rpm).unwrap());
        assert!(truth.chatter_hz.value > BAND_HZ[1], "{rpm} rpm: {truth:?}");
        assert!(
            own.is_none_or(|own| own.depth_m.value > 2.0 * truth.depth_m.value),
            "{rpm} rpm: {own:?}"
        );
    }
}

/// A limit, whose standard deviation comes from one parameter, moves by it with this parameter.
fn on_lobe(lobes: &Lobes, rpm: f64, lobe: u32) -> Option<Limit> {
    lobes.limit(rpm).filter(|own| own.lobe == lobe)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, failure_persistence: None, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]

    #[test]
    fn standard_deviations_of_limits_are_those_of_finite_differences(
        seed in any::<u64>(),
        uncertain in 0..36_usize,
        rpm in 120.0..1500.0,
    ) {
        let mut random = Random::new(seed);
        let mut bushings = nominal();
        for bushing in &mut bushings {
            let mut all = bushing.stiffness.iter_mut().chain(&mut bushing.damping);
            all.try_for_each(|value| { *value *= random.uniform(0.7, 1.4); Some(()) }).unwrap();
        }
        let cutter = Cutter { engagement: Milling::Down.engagement(0.6), ..slot() };
        let std = 5e-3;
        let own = robot(&bushings, std, Some(uncertain));
        let own = lobes(&own.at(&POSE).unwrap(), cutter);
        let limit = own.limit(rpm).unwrap();
        let shifted = |by: f64| {
            let mut bushings = bushings.clone();
            let bushing = &mut bushings[uncertain / 12];
            let mut all = bushing.stiffness.iter_mut().chain(&mut bushing.damping);
            *all.nth(uncertain % 12).unwrap() *= by.exp();
            let robot = robot(&bushings, 0.0, None);
            let lobes = lobes(&robot.at(&POSE).unwrap(), cutter);
            (on_lobe(&lobes, rpm, limit.lobe), lobes.least())
        };
        let (up, down) = (shifted(std), shifted(-std));
        if let (Some(above), Some(below)) = (up.0, down.0) {
            for (found, above, below) in [
                (limit.depth_m, above.depth_m, below.depth_m),
                (limit.chatter_hz, above.chatter_hz, below.chatter_hz),
            ] {
                let change = ((above.value / below.value).ln() / 2.0).abs();
                // The receptance between two samples is off by 1e-4, and on a steep flank the limit is no straight line.
                let off = (found.relative_std - change).abs();
                prop_assert!(change > 0.1 || off < (0.05 + 2.0 * change) * change + 1e-4, "{limit:?}: {change:e}");
            }
        }
        let (least, above, below) = (own.least().unwrap(), up.1.unwrap(), down.1.unwrap());
        let change = ((above.value / below.value).ln() / 2.0).abs();
        // Where another mode becomes the worst one, the least limit has a kink.
        let kink = (above.value * below.value / least.value.powi(2)).ln().abs();
        let off = (least.relative_std - change).abs();
        prop_assert!(kink > 0.2 * change || off < 0.05 * change + 1e-4, "{least:?}: {change:e}");
    }
}

/// Robots drawn from the covariance: each limit lies in its interval as often as the interval says.
#[test]
fn intervals_hold_the_limits_of_drawn_robots() {
    let std = 0.02;
    let cutter = slot();
    let robot_found = robot(&nominal(), std, None);
    let found = lobes(&robot_found.at(&POSE).unwrap(), cutter);
    let speeds: Vec<f64> = (0..12).map(|index| 130.0 * 1.25_f64.powi(index)).collect();
    let mut random = Random::new(7);
    let (mut held, mut all) = (0, 0);
    for _ in 0..40 {
        let mut bushings = nominal();
        for bushing in &mut bushings {
            for value in bushing.stiffness.iter_mut().chain(&mut bushing.damping) {
                *value *= (std * random.normal()).exp();
            }
        }
        let drawn = robot(&bushings, 0.0, None);
        let drawn = lobes(&drawn.at(&POSE).unwrap(), cutter);
        for &rpm in &speeds {
            let ([low, high], truth) = (
                found.limit(rpm).unwrap().depth_m.interval,
                drawn.limit(rpm).unwrap().depth_m.value,
            );
            held += u32::from((low..=high).contains(&truth));
            assert!(low >= found.least().unwrap().interval[0], "{rpm} rpm");
            all += 1;
        }
    }
    let part = f64::from(held) / f64::from(all);
    // Speeds of a robot depend on each other: forty robots of 95 %, give or take three standard deviations.
    assert!((0.847..=0.997).contains(&part), "{part}");
}
