use std::f64::consts::TAU;

use flexid_core::mounting::Mounting;
use flexid_core::parameters::Bushing;
use nalgebra::Vector3;
use rand_core::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::elements::{self, Element, Law};
use super::motion::{Surroundings, Work};
use super::*;
use crate::experiment::{Cut, STEPS};
use crate::reference::{mill3, model};

mod path;
mod ripple;

/// A short cut of the reference robot in gravity.
fn cut() -> Cut {
    let (scenario, _) = mill3();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
    let mut sampling = scenario.measurement;
    sampling.duration_s = 0.256;
    Cut {
        gravity: Vector3::new(0.0, 0.0, -9.80665),
        accelerometer: flexid_core::sensors::Accelerometer::Strapdown,
        ..Cut::new(&scenario.experiments[0], &scenario.cutting, &sampling, &mut rng)
    }
}

/// Noise-free readings of `plant`, force and acceleration.
fn readings(plant: &Plant) -> [Vec<Vector3<f64>>; 2] {
    let (scenario, chain) = mill3();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(4);
    let quiet = Surroundings { force_noise: 0.0, acceleration_noise: 0.0, spindle: vec![0.0; 512] };
    let work = Work { cut: &cut(), model: &chain, bushings: &scenario.truth, number: 0 };
    let response = plant.readings(work, &quiet, &mut rng, |_| ()).unwrap();
    [response.force, response.acceleration]
}

fn parse(text: &str) -> Result<Plant, BadInput> {
    Plant::parse(Path::new("plant.toml"), text, &model())
}

/// Root mean square of the difference, as a part of that of `exact`.
fn error(found: &[Vector3<f64>], exact: &[Vector3<f64>]) -> f64 {
    let sum = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>();
    let off = sum(&mut found.iter().zip(exact).map(|(a, b)| (a - b).norm_squared()));
    (off / sum(&mut exact.iter().map(Vector3::norm_squared))).sqrt()
}

/// The sample file is read, and its plant moves.
#[test]
fn the_sample_is_a_plant() {
    let plant = parse(include_str!("../../../scenario/mill3-plant.toml")).unwrap();
    let [_, exact] = readings(&Plant::default());
    let change = error(&readings(&plant)[1], &exact);
    assert!((0.01..0.5).contains(&change), "{change}");
}

#[test]
fn a_perfect_plant_is_the_model() {
    let (scenario, chain) = mill3();
    let exact = cut().response(&chain, &scenario.truth);
    let [force, acceleration] = readings(&Plant::default());
    assert!(error(&force, &exact.force) < 1e-9);
    let worst = error(&acceleration, &exact.acceleration);
    assert!(worst < 1e-9, "{worst:e}");
}

/// Deviations that have an equal: the same motion must come from another description of the same robot.
#[test]
fn deviations_that_mean_the_same_give_the_same() {
    let [_, exact] = readings(&Plant::default());

    // A bushing as stiff as the ground is no bushing.
    let stiff = parse(
        "[pedestal]\nmass_kg = 100.0\nstiffness = [1e14, 1e14, 1e14, 1e14, 1e14, 1e14]\n\
         damping = [1e7, 1e7, 1e7, 1e7, 1e7, 1e7]\n\
         [bending]\njoint = 2\nat = 0.4\nstiffness = [1e14, 1e14, 1e14, 1e14, 1e14, 1e14]\n\
         damping = [1e7, 1e7, 1e7, 1e7, 1e7, 1e7]\n",
    );
    let [_, found] = readings(&stiff.unwrap());
    let worst = error(&found, &exact);
    assert!(worst < 1e-5, "rigid bushings: {worst:e}");
    // Sensors turned against a turned tool have the axes of the model.
    let angle = "[0.02, -0.01, 0.03]";
    let back = "[-0.02, 0.01, -0.03]";
    let turned = parse(&format!(
        "[tool]\nangle_rad = {angle}\n[accelerometer]\nangle_rad = {back}\n[force_sensor]\nangle_rad = {back}\n"
    ));
    let [force, _] = readings(&turned.unwrap());
    let [own, _] = readings(&Plant::default());
    let turn = nalgebra::Rotation3::new(Vector3::new(0.02, -0.01, 0.03));
    let along: Vec<_> = own.iter().map(|force| turn * force).collect();
    assert!(error(&force, &along) < 1e-9, "the force along the model's axes");
}

/// Each deviation alone changes the acceleration, by a part that is neither nothing nor everything.
#[test]
fn every_deviation_acts() {
    let [force, acceleration] = readings(&Plant::default());
    let bushing =
        "stiffness = [1e9, 1e9, 1e9, 5e8, 5e8, 5e8]\ndamping = [1e5, 1e5, 1e5, 5e4, 5e4, 5e4]";
    let plants = [
        "[accelerometer]\nangle_rad = [0.01, 0.0, 0.0]".to_owned(),
        "[accelerometer]\noffset_m = [0.0, 0.02, 0.0]".to_owned(),
        "[accelerometer]\ngain = [1.01, 1.0, 1.0]".to_owned(),
        "[accelerometer]\ncrosstalk = 0.01".to_owned(),
        "[accelerometer]\nlow_pass_hz = 800.0".to_owned(),
        "[accelerometer]\nhigh_pass_hz = 0.16".to_owned(),
        "[accelerometer]\nresonance_hz = 1600.0".to_owned(),
        "[accelerometer.clock]\nlate_s = 30e-6".to_owned(),
        "[accelerometer.clock]\nlate_spread_s = 30e-6".to_owned(),
        "[accelerometer.clock]\nppm = 50.0".to_owned(),
        "[accelerometer.clock]\njitter_s = 5e-6".to_owned(),
        "[accelerometer.noise]\nhum_hz = 50.0\nhum = 0.02".to_owned(),
        "[accelerometer.noise]\nspindle_orders = [1.0]\nspindle = 0.02".to_owned(),
        "[accelerometer.noise]\nspikes_per_s = 50.0\nspike = 1.0".to_owned(),
        "[accelerometer]\nlimit = 2.0".to_owned(),
        "[accelerometer]\nquantum = 0.02".to_owned(),
        "[accelerometer.stuck]\naxis = 1\nfrom_s = 0.1\nfor_s = 0.05".to_owned(),
        "[force_sensor]\nangle_rad = [0.01, 0.0, 0.0]".to_owned(),
        "[force_sensor]\nresonance_hz = 1600.0".to_owned(),
        "[tool]\nangle_rad = [0.01, 0.0, 0.0]".to_owned(),
        "[tool]\ntcp_m = [0.005, 0.0, 0.0]".to_owned(),
        "[robot]\nmass = [1.0, 1.0, 1.05]".to_owned(),
        "[robot]\ninertia = [1.0, 1.1, 1.1]".to_owned(),
        "[robot]\nspread = [[0, 0, 0, 0, 0, 0], [0.1, 0, 0, 0.2, 0, 0], [0, 0, 0, 0, 0.1, 0]]"
            .to_owned(),
        "[robot]\ncentre_of_mass_m = [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.01, 0.01, 0.01]]"
            .to_owned(),
        "[robot]\njoint_angle_rad = [0.0, 0.005, 0.0]".to_owned(),
        "[robot]\nelastic_centre_m = [[0.0, 0.0, 0.02], [0.0, 0.02, 0.0], [0.0, 0.02, 0.0]]"
            .to_owned(),
        "[robot]\nfeed_rad_per_s = [0.0, 0.001, 0.0]".to_owned(),
        format!("[pedestal]\nmass_kg = 500.0\n{bushing}"),
        format!("[bending]\njoint = 2\nat = 0.5\n{bushing}"),
        "[hose]\nstiffness_n_per_m = 2e5\ndamping_ns_per_m = 500.0".to_owned(),
        "[joints]\nhysteretic = 0.3".to_owned(),
        "[joints]\nservo = 0.1".to_owned(),
        "[joints]\nfriction = 20.0".to_owned(),
        "[joints]\nbacklash = 1e-6".to_owned(),
        "[joints]\ncubic_rad = 1e-4".to_owned(),
        "[joints]\nloaded_per_knm = 0.05".to_owned(),
    ];
    for text in &plants {
        let found = readings(&parse(text).unwrap());
        let changes = [error(&found[0], &force), error(&found[1], &acceleration)];
        let change = changes[0].max(changes[1]);
        assert!((1e-6..0.9).contains(&change), "{text}: {changes:?}");
    }
}

#[test]
fn mistakes_are_named_with_place_and_mend() {
    for (text, message) in [
        (
            "[robot]\nmass = [1.0, 1.0]",
            "[robot] mass has 2, but the model has 3 joints: one per joint",
        ),
        ("[robot]\nmass = [1.0, 0.0, 1.0]", "[robot] mass is 0.0: must lie between 0.01 and 100.0"),
        ("[tool]\ntcp_m = [0, 50, 0]", "[tool] tcp_m is 50.0: must lie between -10.0 and 10.0"),
        ("[accelerometer]\nlow_pass = 3", "low_pass_hz"),
        (
            "[accelerometer.stuck]\naxis = 3\nfrom_s = 0\nfor_s = 1",
            "[accelerometer.stuck] axis is 3.0",
        ),
        ("[force_sensor]\noffset_m = [0.1, 0.0, 0.0]", "a force has no place"),
        (
            "[accelerometer]\nhigh_pass_hz = 1e-300",
            "[accelerometer] high_pass_hz is 1e-300: must lie between 0.01",
        ),
        (
            "[accelerometer.noise]\nhum = 1.0",
            "[accelerometer.noise] hum_hz is 0: give the frequency of the hum",
        ),
        ("[joints]\nbacklash = -1.0", "[joints] backlash is -1.0: must lie between 0.0"),
        (
            "[[ripple]]\njoint = 4\nratio = 121\norder = 2\namplitude_rad = 1e-4",
            "[[ripple]] joint is 4.0: must lie between 1.0 and 3.0",
        ),
        (
            "[[ripple]]\njoint = 1\nratio = 121\norder = 0\namplitude_rad = 1e-4",
            "[[ripple]] order is 0.0: must lie between 0.001 and 1000.0",
        ),
        (
            "[[ripple]]\njoint = 1\nratio = 0\norder = 2\namplitude_rad = 1e-4",
            "[[ripple]] ratio is 0.0: must lie between 0.1 and 100000.0",
        ),
        (
            "[[ripple]]\njoint = 1\nratio = 121\norder = 2\namplitude_rad = 20.0",
            "[[ripple]] amplitude_rad is 20.0: must lie between 0.0 and 0.01",
        ),
        (
            "[[ripple]]\njoint = 1\nratio = 121\norder = 2",
            "[[ripple]] key `amplitude_rad` (in rad) is missing",
        ),
        ("[[ripple]]\njoint = 1\namplitude = 1", "did you mean `amplitude_rad`"),
        (
            "[bending]\njoint = 4\nat = 0.5\nstiffness = [1,1,1,1,1,1]\ndamping = [1,1,1,1,1,1]",
            "[bending] joint is 4.0: must lie between 1.0 and 3.0",
        ),
    ] {
        let error = parse(text).unwrap_err().to_string();
        assert!(error.starts_with("plant.toml:") && error.contains(message), "{error}");
        assert!(!error.contains('\n'), "{error}");
    }
}

#[test]
fn hysteresis_that_leaves_no_stiffness_is_refused() {
    let (scenario, _) = mill3();
    let error = parse("[joints]\nhysteretic = 1.0\nhysteretic_at_hz = 40.0")
        .unwrap()
        .check_bushings(&scenario.truth);
    let error = error.unwrap_err();
    assert!(error.starts_with("[joints] hysteretic is 1: joint 1 "), "{error}");
    assert!(
        parse("[joints]\nhysteretic = 0.3\nhysteretic_at_hz = 40.0")
            .unwrap()
            .check_bushings(&scenario.truth)
            .is_ok()
    );
}

/// Step of a record of 2 kHz, s.
const STEP: f64 = 1.0 / (2000 * STEPS) as f64;

/// Real (elastic) and imaginary part (loss) of the load of these elements on one degree of freedom that moves as `sin ωt`, at the steps of
/// a record of 2 kHz.
fn impedance(laws: impl Iterator<Item = Law>, hz: f64) -> [f64; 2] {
    let period = (1.0 / hz / STEP).round() as usize;
    let mut past: Vec<Element> = laws.map(|law| Element::new(0, 0, law)).collect();
    let mut state = flexid_core::motion::State::default();
    let rest = flexid_core::motion::Coordinates::default();
    let mut parts = [0.0; 2];
    for n in 1..=20 * period {
        let phase = TAU * n as f64 / period as f64;
        state.elongation[0][0] = phase.sin();
        state.rate[0][0] = TAU * hz * phase.cos();
        elements::advance(&mut past, &elements::Place::default(), &state, STEP);
        if n > 19 * period {
            let mut loads = rest;
            elements::add_loads(&past, &elements::Place::default(), &state, 0.0, &mut loads);
            parts[0] += loads[0][0] * phase.sin() * 2.0 / period as f64;
            parts[1] += loads[0][0] * phase.cos() * 2.0 / period as f64;
        }
    }
    parts
}

/// An element is exact for an elongation that is linear within each step h. The mean of `sin ωt` over its straight lines is smaller by
/// `(ωh)²/12` (to second order), and the load follows the elongation but for the part `k/(1 + iω/ω₀)` that has relaxed. 1e-4 of the
/// transient is left after 19 periods.
#[test]
fn maxwell_elements_have_their_impedance() {
    for relaxation_hz in [0.1, 10.0, 1000.0] {
        for hz in [2.0, 20.0, 200.0] {
            let (k, rate) = (3.0, TAU * relaxation_hz);
            let [real, imaginary] =
                impedance(std::iter::once(Law::Maxwell { stiffness: k, rate }), hz);
            let ratio = hz / relaxation_hz;
            let expected = [k * ratio * ratio, k * ratio].map(|part| part / (1.0 + ratio * ratio));
            let of_interpolation = (TAU * hz * STEP).powi(2) / 12.0 * k / ratio.hypot(1.0);
            let apart = (real - expected[0]).hypot(imaginary - expected[1]);
            assert!(
                apart < of_interpolation + 1e-4,
                "{relaxation_hz} Hz at {hz} Hz: {real} {imaginary}, {expected:?}"
            );
        }
    }
}

/// The loss does not depend on frequency, and at the named frequency it is that of the damper, without stiffness. The stiffness grows with
/// the logarithm of the frequency (Nashif, Jones and Henderson, 1985).
#[test]
fn hysteresis_loses_the_same_at_all_frequencies() {
    let joints = Joints { hysteretic: 1.0, hysteretic_at_hz: 40.0, ..Joints::default() };
    let loss = 7.0 * TAU * 40.0;
    for hz in [4.0_f64, 40.0, 160.0, 200.0] {
        let parts = impedance(joints.hysteresis(7.0), hz);
        let expected = [2.0 / std::f64::consts::PI * (hz / 40.0).ln(), 1.0];
        for (part, expected) in parts.iter().zip(expected) {
            assert!((part / loss - expected).abs() < 0.01, "{hz} Hz: {parts:?} of {loss}");
        }
        // So is the bushing stated there.
        let own = joints.at(&Bushing { stiffness: [1e6; 6], damping: [7.0; 6] }, hz);
        assert!(((own.stiffness[5] - 1e6) / loss - expected[0]).abs() < 1e-9, "{hz} Hz: {own:?}");
        assert!((own.damping[5] * TAU * hz / loss - 1.0).abs() < 1e-9, "{hz} Hz: {own:?}");
    }
}

#[test]
fn friction_holds_and_slips_and_play_is_free() {
    let state = |x: f64| {
        let mut state = flexid_core::motion::State::default();
        state.elongation[0][0] = x;
        state
    };
    let rest = flexid_core::motion::Coordinates::default();
    let load = |elements: &[Element], x: f64| {
        let mut loads = rest;
        elements::add_loads(elements, &elements::Place::default(), &state(x), 0.0, &mut loads);
        loads[0][0]
    };
    let mut friction = [Element::new(0, 0, Law::Friction { stiffness: 8.0, limit: 2.0 })];
    assert_eq!([0.125, 0.25, 0.5].map(|x| load(&friction, x)), [1.0, 2.0, 2.0]);
    elements::advance(&mut friction, &elements::Place::default(), &state(0.5), 1e-3);
    assert_eq!(load(&friction, 0.375), 1.0, "on the way back it holds at once");
    let play = [Element::new(0, 0, Law::Play { stiffness: 8.0, half: 0.125, at_rest: 0.0 })];
    let with_spring = |x: f64| 8.0 * x + load(&play, x);
    assert_eq!([0.0625, 0.125, 0.375, -0.375].map(with_spring), [0.0, 0.0, 2.0, -2.0]);
    // A spring that bears a load lies at one flank: it is linear until the load changes its sign.
    let loaded = [Element::new(0, 0, Law::Play { stiffness: 8.0, half: 0.125, at_rest: 0.5 })];
    let with_spring = |x: f64| 8.0 * x + load(&loaded, x);
    assert_eq!([0.0, 0.25, -0.5, -0.75, -1.0].map(with_spring), [0.0, 2.0, -4.0, -4.0, -6.0]);
}

/// Static compliance of one bushing with its elastic centre at e: a force at the TCP p moves it by `K_t⁻¹ F` and turns it by
/// `K_r⁻¹ (p − e) × F`.
#[test]
fn the_elastic_centre_is_where_the_springs_act() {
    use flexid_core::chain::{Chain, Joint, JointKind, Link};
    use nalgebra::{Isometry3, Matrix3};
    let link = Link {
        mass: 10.0,
        centre_of_mass: Vector3::new(0.1, 0.0, 0.3),
        inertia: Matrix3::identity(),
    };
    let axis = Vector3::z_axis();
    let origin = Isometry3::translation(0.2, 0.1, -0.3);
    let joint = Joint { origin, axis, kind: JointKind::Revolute, link };
    let tcp = Vector3::new(0.7, -0.2, 0.4);
    let chain = Chain::new(&[joint], Isometry3::translation(tcp.x, tcp.y, tcp.z)).unwrap();
    let bushing = Bushing { stiffness: [1e7, 2e7, 3e7, 4e6, 5e6, 6e6], damping: [1e3; 6] };
    let centre = Vector3::new(0.05, -0.08, 0.11);
    let robot = Robot { elastic_centre_m: vec![centre.into()], ..Robot::default() };
    let plant = Plant { robot, ..Plant::default() };
    let robot = plant.robot(&chain, &[0.0], &[bushing], &Mounting::AT_TCP).unwrap();
    let linear = robot.chain.linearise(&[0.0], Vector3::zeros(), &robot.bushings).unwrap();
    let jacobian = linear.jacobian()[0];
    let force = Vector3::new(3.0, -5.0, 7.0);
    let mut found = Vector3::zeros();
    for (column, k) in jacobian.iter().zip(bushing.stiffness) {
        let column = Vector3::from(*column);
        found += column * column.dot(&force) / k;
    }
    let [k, turning] = [0, 3].map(|i| Vector3::from_row_slice(&bushing.stiffness[i..i + 3]));
    let lever = tcp - centre;
    let expected =
        force.component_div(&k) + lever.cross(&force).component_div(&turning).cross(&lever);
    assert!((found - expected).norm() < 1e-12 * expected.norm().max(1.0), "{found} {expected}");
}

/// Power density of pink noise over that of white noise: `1 + corner/f` to a few per cent.
#[test]
fn pink_noise_has_its_density() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(6);
    let noise = noise::Disturbance { pink_below_hz: 20.0, ..Default::default() };
    let (rate, samples, records) = (1000.0, 4096, 200);
    let mut power = [0.0; 3];
    let frequencies = [3.0, 20.0, 300.0];
    for _ in 0..records {
        let series = noise.draw(1.0, rate, &vec![0.0; samples], &mut rng);
        for (power, hz) in power.iter_mut().zip(frequencies) {
            // Hann's window keeps what is strong at low frequencies out of the others.
            let mut sum = [0.0; 2];
            for (n, value) in series.iter().enumerate() {
                let window = 1.0 - (TAU * n as f64 / samples as f64).cos();
                let (sin, cos) = (TAU * hz * n as f64 / rate).sin_cos();
                sum[0] += window * value * cos;
                sum[1] += window * value * sin;
            }
            *power += (sum[0] * sum[0] + sum[1] * sum[1]) / (1.5 * samples as f64 * records as f64);
        }
    }
    for (power, hz) in power.iter().zip(frequencies) {
        let ratio = power / (1.0 + 20.0 / hz);
        // The mean of 200 squares of complex normal numbers scatters by 7 %.
        assert!((0.75..1.3).contains(&ratio), "{hz} Hz: {ratio}");
    }
}

#[test]
fn converters_clip_round_and_stick() {
    let stuck = Some(sensors::Stuck { axis: 1, from_s: 0.01, for_s: 0.005 });
    let sensor = Sensor { limit: 1.0, quantum: 0.25, stuck, ..Sensor::default() };
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
    let ramp: Vec<_> = (0..80).map(|n| Vector3::repeat(f64::from(n) / 40.0)).collect();
    let readings = sensor.read(&ramp, 4, 1000.0, 0.0, &[0.0; 20], &mut rng);
    let x: Vec<_> = readings.iter().map(|reading| reading.x).collect();
    assert_eq!(x[..7], [0.0, 0.0, 0.25, 0.25, 0.5, 0.5, 0.5]);
    assert!(x[10..].iter().all(|&x| x == 1.0), "{x:?}");
    assert!(readings[10..15].iter().all(|reading| reading.y == readings[9].y));
    assert_eq!(readings[9].y, 1.0);
}
