//! Judges the sizes and the signs of static tests. No robot within the bounds gives way by more than the softest: each bushing bears a
//! part of the load that does not depend on stiffness, so that each part of the displacement grows with the compliance of its bushing. And
//! what only yields to a load moves with it, at the load's point and along the load.
//!
//! ```text
//! u = f·d/|f|        u < 0: impossible, since f·d = fᵀ C f is the work that the robot stores
//! ```
//!
//! A gauge at another point, or along other axes, may read against the load. Such tests are left out.

use flexid_core::chain::Chain;
use flexid_core::parameters::Bushing;
use flexid_core::statics::{Deflection, StaticTest};
use flexid_core::{DOF, MAX_JOINTS};
use flexid_pipeline::config::Config;
use flexid_wire::words::ThreeDigits;
use nalgebra::Vector3;

use super::Finding;
use super::Severity::Wrong;
use super::words::enumerate;

/// The subject of the findings of this file.
pub(super) const ABOUT: &str = "static tests";

/// Largest distance of the gauge from the force's line of action, m. Chosen: the tool's turn adds little there.
const NEAR_M: f64 = 1e-3;
/// Largest part of the force along axes that were not measured. Chosen: with it u may be below 0 only if the robot is ten thousand times as
/// soft along these.
const ALONG: f64 = 0.01;
/// Standard deviations below 0 at which noise does not explain u. Chosen: of 64 tests that do not move at all, one is as far out once in
/// five hundred tables.
const BEYOND: f64 = 4.0;

/// Judges sizes, then signs.
pub(super) fn judge(config: &Config) -> Vec<Finding> {
    of_sizes(config).into_iter().chain(of_signs(config)).collect()
}

/// The most by which a robot whose bushings are at least as stiff as these gives way at the gauge, m. `None` where the load moves nothing
/// there. Along a single axis it may be 0, which a gauge that is slightly turned does not read.
fn most(chain: &Chain, softest: &[Bushing], test: &StaticTest) -> Option<f64> {
    let linear = chain.linearise(&test.pose, Vector3::zeros(), softest).ok()?;
    let deflection = Deflection::new(&linear, softest, &test.wrench, &test.gauge).ok()?;
    // The displacement is the sum of these derivatives by the logarithms of the compliances.
    let along = |parts: [[f64; DOF]; MAX_JOINTS]| -> f64 {
        parts.as_flattened().iter().map(|part| part.abs()).sum()
    };
    let most = Vector3::from(deflection.gradient.map(along)).norm();
    (most > 0.0).then_some(most)
}

/// Names the test that gives way furthest beyond the softest robot.
fn of_sizes(config: &Config) -> Option<Finding> {
    let chain = config.model.chain().ok()?;
    let softest: Vec<Bushing> = config.bounds.joints[..config.model.joints.len()]
        .iter()
        .map(|own| Bushing {
            stiffness: own.stiffness.map(|[lower, _]| lower),
            damping: own.damping.map(|[lower, _]| lower),
        })
        .collect();
    let tests = config.statics.tests.iter().zip(&config.statics.lines);
    let readings =
        tests.filter_map(|(test, line)| Some((test, line, most(&chain, &softest, test)?)));
    let readings: Vec<_> = readings
        .flat_map(|(test, line, most)| {
            test.readings().map(move |(_, reading)| (test, *line, reading, most))
        })
        .collect();
    let beyond = readings
        .iter()
        .filter(|(.., reading, most)| reading.value.abs() - BEYOND * reading.deviation > *most);
    let ratio = |reading: &f64, most: &f64| reading.abs() / most;
    let (test, line, reading, most) = beyond.max_by(|(.., a, of_a), (.., b, of_b)| {
        ratio(&a.value, of_a).total_cmp(&ratio(&b.value, of_b))
    })?;
    let [fx, fy, fz, mx, my, mz] = test.wrench;
    let load = match Vector3::new(fx, fy, fz).norm() {
        0.0 => format!("{:.0} Nm", Vector3::new(mx, my, mz).norm()),
        force => format!("{force:.0} N"),
    };
    let in_mm = readings.iter().all(|(.., reading, most)| reading.value.abs() * 1e-3 <= *most);
    let finding = format!(
        "line {line} of [static] file: {} mm under {load}, and the softest robot within [bounds] gives way by {} mm there{}",
        ThreeDigits(reading.value.abs() * 1e3),
        ThreeDigits(most * 1e3),
        if in_mm { ": in mm?" } else { "" }
    );
    Some(Finding::new(
        Wrong,
        ABOUT,
        finding,
        "give displacements in m and loads in N, or correct [bounds]",
    ))
}

/// Displacement along the load, m, and the standard deviation of its noise. `None` where the gauge is not at the load and along it.
fn along_load(test: &StaticTest) -> Option<(f64, f64)> {
    let [fx, fy, fz, torque @ ..] = test.wrench;
    let force = Vector3::new(fx, fy, fz);
    let along = force.try_normalize(0.0)?;
    let arm = Vector3::from(torque) - Vector3::from(test.gauge.place).cross(&force);
    let parts = test.gauge.axes.map(|axis| along.dot(&Vector3::from(axis)));
    let [mut moved, mut variance, mut unmeasured] = [0.0; 3];
    for (part, reading) in parts.into_iter().zip(&test.displacement) {
        match reading {
            Some(reading) => {
                moved += part * reading.value;
                variance += (part * reading.deviation).powi(2);
            }
            None => unmeasured += part * part,
        }
    }
    let is_at_load = arm.norm() <= NEAR_M * force.norm();
    (is_at_load && unmeasured <= ALONG * ALONG).then(|| (moved, variance.sqrt()))
}

/// Names the tests that move against their load beyond their noise; if there is none, those that do so together.
fn of_signs(config: &Config) -> Option<Finding> {
    let statics = &config.statics;
    let tests = statics.tests.iter().zip(&statics.lines);
    let judged: Vec<(usize, f64, f64)> = tests
        .filter_map(|(test, line)| along_load(test).map(|(moved, std)| (*line, moved, std)))
        .collect();
    let sum: f64 = judged.iter().map(|(_, moved, _)| moved).sum();
    let variance: f64 = judged.iter().map(|(.., std)| std * std).sum();
    let beyond = |times: f64| {
        let against = judged.iter().filter(move |(_, moved, std)| *moved < -times * std);
        against.map(|(line, ..)| *line).collect::<Vec<usize>>()
    };
    let mut lines = beyond(BEYOND);
    if lines.is_empty() && sum < -BEYOND * variance.sqrt() {
        lines = beyond(0.0);
    }
    let which = match &lines[..] {
        [] => return None,
        [only] => format!("line {only} of [static] file has a displacement"),
        all if all.len() == judged.len() => {
            format!(
                "all {} tests of [static] file with a gauge at the load have displacements",
                all.len()
            )
        }
        some => format!("lines {} of [static] file have displacements", enumerate(some)),
    };
    let finding = format!("{which} against the load, which no robot does");
    let mend = "turn the sign of load or displacement: force along the axes of the TCP, displacement loaded less unloaded, both at the point stated";
    Some(Finding::new(Wrong, ABOUT, finding, mend))
}

#[cfg(test)]
mod tests {
    use flexid_core::statics::{Gauge, Reading};

    use crate::check::fixture;

    use super::*;

    const DOWN: [f64; 6] = [0.0, 0.0, -981.0, 0.0, 0.0, 0.0];

    /// A test whose gauge along z reads `dz`, m, with 2 µm of noise.
    fn test(wrench: [f64; 6], dz: f64) -> StaticTest {
        StaticTest {
            pose: [0.0, -0.4, 0.9].into_iter().collect(),
            wrench,
            gauge: Gauge::default(),
            displacement: [None, None, Some(Reading::stated(dz, 2e-6))],
        }
    }

    /// The findings on tests on the lines from 2.
    fn finding(tests: Vec<StaticTest>) -> Option<String> {
        let mut config = fixture::config();
        config.statics.lines = (2..2 + tests.len()).collect();
        config.statics.tests = tests;
        judge(&config).pop().map(|finding| finding.finding)
    }

    /// The softest robot of the scenario gives way by 0.7 mm under 981 N.
    #[test]
    fn a_displacement_of_no_robot_is_named_with_its_unit() {
        let in_mm = |dz: f64| test(DOWN, 1e3 * dz);
        let said = finding(vec![test(DOWN, -1e-4), in_mm(-1e-4), in_mm(-9e-5)]).unwrap();
        assert!(said.starts_with("line 3 of [static] file: 100 mm under 981 N, and the"), "{said}");
        assert!(said.ends_with(" mm there: in mm?"), "{said}");
        let said = finding(vec![test([0.0, 0.0, 0.0, 0.0, 50.0, 0.0], -9.9)]).unwrap();
        assert!(said.contains("9900 mm under 50 Nm") && said.ends_with(" mm there"), "{said}");
    }

    #[test]
    fn a_displacement_against_its_load_is_named() {
        let right = || test(DOWN, -1e-4);
        let reversed = || test(DOWN, 1e-4);
        assert_eq!(finding(vec![right(), right()]), None);
        assert_eq!(finding(Vec::new()), None);
        let said = finding(vec![right(), reversed(), right()]).unwrap();
        assert!(said.starts_with("line 3 of [static] file has a displacement against"), "{said}");
        let said = finding(vec![right(), reversed(), right(), right(), reversed()]).unwrap();
        assert!(said.starts_with("lines 3 and 6 of [static] file"), "{said}");
        let said = finding(vec![reversed(), reversed()]).unwrap();
        assert!(said.starts_with("all 2 tests of [static] file"), "{said}");
    }

    /// Each alone may be noise.
    #[test]
    fn small_displacements_are_judged_together() {
        let small = || test(DOWN, 5e-6);
        assert_eq!(finding(vec![small(), small()]), None);
        let said = finding(vec![small(), small(), small()]).unwrap();
        assert!(said.starts_with("all 3 tests"), "{said}");
    }

    /// Elsewhere, or along another axis, a robot that only yields may move against the load.
    #[test]
    fn a_gauge_that_is_not_at_the_load_says_nothing() {
        let mut beside = test(DOWN, 1e-4);
        beside.gauge.place = [0.05, 0.0, 0.0];
        let turned = test([0.0, 0.0, -981.0, 50.0, 0.0, 0.0], 1e-4);
        let across = test([500.0, 0.0, -981.0, 0.0, 0.0, 0.0], 1e-4);
        let torque = test([0.0, 0.0, 0.0, 50.0, 0.0, 0.0], 1e-4);
        assert_eq!(finding(vec![beside, turned, across, torque]), None);
    }

    /// The load hangs where the gauge is: its torque about the TCP is `p × f`, and the gauge reads along axes of its own.
    #[test]
    fn a_load_beside_the_tool_is_judged_at_its_point() {
        let [fx, fz] = [300.0, -981.0];
        let mut hung = test([fx, 0.0, fz, 0.0, -0.12 * fz, 0.0], -1e-4);
        hung.gauge.place = [0.12, 0.0, 0.0];
        let length = fx.hypot(fz);
        let [x, z] = [fx / length, fz / length];
        hung.gauge.axes = [[z, 0.0, -x], [0.0, 1.0, 0.0], [x, 0.0, z]];
        let said = finding(vec![hung]).unwrap();
        assert!(said.starts_with("line 2 "), "{said}");
    }
}
