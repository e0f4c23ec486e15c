//! Sensors that sit elsewhere than at the TCP: against dense solves, against finite differences, and end to end.

use flexid_core::chain::Chain;
use flexid_core::chain::linearise::LinearChain;
use flexid_core::identify::{Acceptance, Estimate};
use flexid_core::loss::spectral;
use flexid_core::loss::target::Target;
use flexid_core::mounting::Mounting;
use flexid_core::parameters::Bushings;
use flexid_core::receptance::{Complex, PerDof, Terms, accelerance};
use flexid_core::sensors::{Accelerometer, Sensors};
use flexid_core::sought::Sought;
use flexid_core::spectrum::{Experiment, Measurement};

use crate::common::fits::{
    assert_within_the_intervals, identifier_of, mean_square, relative, scores, settle,
};
use crate::common::milling::{Conditions, SAMPLES, cut, record};
use crate::common::{BINS, Dense, EXPERIMENTS, MEASUREMENT, Random, mill3, nominal, respond};
use fearless_simd::Level;
use nalgebra::{DMatrix, DVector, Matrix3, Matrix3xX, MatrixXx3, Rotation3, Vector3};
use proptest::prelude::*;

type Dynamic = nalgebra::Complex<f64>;

const EARTH: Vector3<f64> = Vector3::new(0.0, 0.0, -9.80665);

/// A random robot with random sensors, and a force and a seam on it.
struct Case {
    chain: Chain,
    pose: Vec<f64>,
    gravity: Vector3<f64>,
    linear: LinearChain,
    bushings: Bushings,
    mounting: Mounting,
    /// Point at which the force acts, from the TCP.
    point: Vector3<f64>,
    s: Complex<f64>,
    force: [Complex<f64>; 3],
    seam: PerDof<f64>,
}

impl Case {
    fn new(seed: u64, joints: usize, gravity: Vector3<f64>) -> Self {
        let mut random = Random::new(seed);
        let (chain, pose) = (random.chain(joints), random.pose(joints));
        let bushings = random.bushings(joints);
        let linear = chain.linearise(&pose, gravity, &bushings).unwrap();
        let mounting = random.mounting();
        let s = Complex { re: random.uniform(0.0, 2.0), im: random.uniform(10.0, 1300.0) };
        let mut complex = |size: f64| Complex {
            re: random.uniform(-size, size),
            im: random.uniform(-size, size),
        };
        let force = std::array::from_fn(|_| complex(100.0));
        let seam = std::array::from_fn(|_| std::array::from_fn(|_| complex(50.0)));
        let point = Vector3::from_fn(|_, _| random.uniform(-0.4, 0.4));
        Self { chain, pose, gravity, linear, bushings, mounting, point, s, force, seam }
    }

    fn dense(&self) -> Dense {
        let sag: Vec<[f64; 6]> = self.linear.joints.iter().map(|joint| joint.sag.into()).collect();
        Dense::new(&self.chain, &self.pose, self.gravity, &sag)
    }

    fn terms(&self, accelerometer: Accelerometer) -> Terms<f64> {
        let Self { mounting, point, .. } = *self;
        let sensors = Sensors { accelerometer, mounting, point, ..Sensors::default() };
        Terms::new(&self.linear, &self.bushings, &sensors).unwrap()
    }
}

fn dynamic(z: Complex<f64>) -> Dynamic {
    Dynamic::new(z.re, z.im)
}

/// The readings of the sensors of a dense model: of all elongations and the force at its point at once, no force eliminated.
struct DenseSensors {
    stiffness: DMatrix<Dynamic>,
    /// Elongations to the reading, 3×n.
    reading: Matrix3xX<Dynamic>,
    /// Elongations to what the tool takes, 3×n.
    taken: Matrix3xX<Dynamic>,
    /// Forces at the point along the TCP's axes to loads, n×3: with the virtual work of the point's displacement.
    push: MatrixXx3<Dynamic>,
    force_axes: Matrix3<Dynamic>,
}

impl DenseSensors {
    fn new(
        dense: &Dense,
        bushings: &Bushings,
        (mounting, point): (&Mounting, &Vector3<f64>),
        accelerometer: Accelerometer,
        s: Dynamic,
    ) -> Self {
        let tip = dense.tip();
        let (slide, turn) = (tip.fixed_rows::<3>(0), tip.fixed_rows::<3>(3));
        // Of a point p, θ × p; of gravity, θ × g.
        let at = |point: &Vector3<f64>| slide - point.cross_matrix() * turn;
        let tilt = -dense.gravity_at_tip().cross_matrix() * turn;
        let felt = match accelerometer {
            Accelerometer::Strapdown => tilt.clone(),
            Accelerometer::Inertial => 0.0 * &tilt,
        };
        let complex = |matrix: &Matrix3xX<f64>| matrix.map(Dynamic::from);
        let axes = mounting.accelerometer_axes.matrix().transpose();
        let at_rest = complex(&(axes * at(&mounting.accelerometer)));
        let centre = complex(&at(&mounting.tool_centre)) * (s * s) + complex(&tilt);
        Self {
            stiffness: dense.compliance(bushings, s).try_inverse().expect("it is an inverse"),
            reading: at_rest * (s * s) + complex(&(axes * felt)),
            taken: centre * Dynamic::from(mounting.tool_mass),
            push: complex(&at(point)).transpose(),
            force_axes: mounting.force_axes.matrix().map(Dynamic::from),
        }
    }

    /// `A x − P F = γ` and `R (F − W x) = F_m`, solved together.
    fn read(&self, measured: &[Dynamic; 3], seam: &[Dynamic]) -> [Dynamic; 3] {
        let n = self.stiffness.nrows();
        let mut matrix = DMatrix::zeros(n + 3, n + 3);
        matrix.view_mut((0, 0), (n, n)).copy_from(&self.stiffness);
        matrix.view_mut((0, n), (n, 3)).copy_from(&-&self.push);
        let back = self.force_axes.transpose();
        matrix.view_mut((n, 0), (3, n)).copy_from(&(-(back * &self.taken)));
        matrix.view_mut((n, n), (3, 3)).copy_from(&back);
        // Elongations are 1e7 times smaller than forces.
        let known = DVector::from_iterator(n + 3, seam.iter().chain(measured).copied());
        let solution = matrix.full_piv_lu().solve(&known).expect("a damped robot has one");
        let read = &self.reading * solution.rows(0, n);
        [read[0], read[1], read[2]]
    }
}

fn size(values: &[Dynamic]) -> f64 {
    values.iter().map(|value| value.norm()).fold(0.0, f64::max)
}

/// Reading and accelerance of random sensors on random robots, forces and seams.
#[test]
fn equals_a_dense_solve() {
    let mut worst = 0.0_f64;
    for seed in 0..300 {
        let gravity = if seed % 3 == 0 { Vector3::zeros() } else { EARTH };
        let accelerometer =
            if seed % 3 == 1 { Accelerometer::Strapdown } else { Accelerometer::Inertial };
        let joints = 1 + (seed % 7) as usize;
        let case = Case::new(seed, joints, gravity);
        let s = dynamic(case.s);
        let place = (&case.mounting, &case.point);
        let sensors = DenseSensors::new(&case.dense(), &case.bushings, place, accelerometer, s);
        let seam: Vec<Dynamic> =
            case.seam[..joints].iter().flatten().map(|&load| dynamic(load)).collect();
        let terms = case.terms(accelerometer);
        let ours = respond(&terms, case.s, &case.force, &case.seam);
        let expected = sensors.read(&case.force.map(dynamic), &seam);
        for axis in 0..3 {
            let gap = (dynamic(ours.observed[axis]) - expected[axis]).norm();
            worst = worst.max(gap / size(&expected));
        }
        let mut quick = [[Complex::default(); 3]; 3];
        accelerance(&terms, case.s, &mut quick);
        let none = vec![Dynamic::ZERO; 6 * joints];
        for push in 0..3 {
            let unit = std::array::from_fn(|axis| Dynamic::from(f64::from(axis == push)));
            let expected = sensors.read(&unit, &none);
            for axis in 0..3 {
                for ours in [ours.per_force[axis][push], quick[axis][push]] {
                    worst = worst.max((dynamic(ours) - expected[axis]).norm() / size(&expected));
                }
            }
        }
    }
    println!("sensors elsewhere against a dense solve, 300 robots, J = 1..7: worst {worst:.1e}");
    assert!(worst < 1e-8, "{worst:e}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 128, rng_seed: proptest::test_runner::RngSeed::Fixed(11), ..ProptestConfig::default() })]

    /// Derivatives in every parameter and every seam load, strapdown in gravity: central differences.
    #[test]
    fn gradient_equals_finite_differences(seed in 0_u64..10_000, joints in 1_usize..=7) {
        let case = Case::new(seed, joints, EARTH);
        let terms = case.terms(Accelerometer::Strapdown);
        let reading = |bushings: &Bushings, seam: &PerDof<f64>| {
            let mut moved = terms.clone();
            moved.set_bushings(bushings);
            respond(&moved, case.s, &case.force, seam).observed.map(dynamic)
        };
        let here = respond(&terms, case.s, &case.force, &case.seam);
        let whole = size(&here.observed.map(dynamic));
        for joint in 0..joints {
            for dof in 0..6 {
                for damping in [false, true] {
                    let with = |factor: f64| {
                        let mut bushings = case.bushings.clone();
                        let bushing = &mut bushings[joint];
                        let all = if damping { &mut bushing.damping } else { &mut bushing.stiffness };
                        all[dof] *= factor;
                        reading(&bushings, &case.seam)
                    };
                    let step = 1e-4_f64;
                    let (up, down) = (with(step.exp()), with((-step).exp()));
                    for axis in 0..3 {
                        let ours = here.derivatives(&terms, joint, dof)[axis][usize::from(damping)];
                        let gap = dynamic(ours) - (up[axis] - down[axis]) * (0.5 / step);
                        prop_assert!(gap.norm() < 1e-5 * (whole + dynamic(ours).norm()), "{joint} {dof} {axis}");
                    }
                }
                let mut pushed = case.seam;
                pushed[joint][dof].re += 1e3;
                let pushed = reading(&case.bushings, &pushed);
                for axis in 0..3 {
                    let ours = dynamic(here.per_load[axis][joint][dof]);
                    let gap = ours - (pushed[axis] - dynamic(here.observed[axis])) * 1e-3;
                    prop_assert!(gap.norm() < 1e-8 * ours.norm() + 1e-14 * (1.0 + whole), "{joint} {dof} {axis}");
                }
            }
        }
    }
}

/// The scenario's records with sensors mounted so, in gravity and strapdown.
fn records(
    chain: &Chain,
    truth: &Bushings,
    mounting: Mounting,
    seed: u64,
) -> Vec<flexid_core::stream::Record<SAMPLES>> {
    let mut random = Random::new(seed);
    let conditions =
        Conditions { gravity: EARTH, strapdown: true, mounting, ..Conditions::default() };
    EXPERIMENTS
        .iter()
        .map(|(pose, rpm, feed)| {
            let force = cut(&mut random, *rpm, *feed);
            record(chain, pose, truth, &force, &conditions, &mut random)
        })
        .collect()
}

fn measurement(mounting: Mounting) -> Measurement {
    Measurement {
        gravity: EARTH.into(),
        accelerometer: Accelerometer::Strapdown,
        mounting,
        ..MEASUREMENT
    }
}

/// A spindle with its sensors some way behind the cutter, and 2 kg beyond the force sensor.
fn spindle() -> Mounting {
    Mounting {
        accelerometer: Vector3::new(0.08, -0.05, 0.22),
        accelerometer_axes: Rotation3::from_euler_angles(0.4, -0.3, 1.2),
        force_axes: Rotation3::from_euler_angles(-0.2, 0.5, -0.7),
        tool_mass: 2.0,
        tool_centre: Vector3::new(0.01, 0.02, 0.12),
    }
}

/// The search's loss in single precision, against the surface similarity of a dense model's spectra.
#[test]
fn the_searchs_loss_equals_a_dense_one() {
    let mut random = Random::new(81);
    let truth = random.bushings(3);
    // A heavy tool, so that its part is not lost in the rounding.
    let mounting = Mounting { tool_mass: 40.0, ..spindle() };
    let experiments = experiments(&records(&mill3(), &truth, mounting, 82), mounting);
    for bushings in [truth, nominal(), random.bushings(3)] {
        for experiment in &experiments {
            let spectra = &experiment.thinned;
            let target = Target::new(&mill3(), &measurement(mounting), experiment.site()).unwrap();
            let found = spectral::ssp(&target, spectra, &bushings, Level::new());
            let dense = Dense::new(&mill3(), &experiment.pose, EARTH, &[[0.0; 6]; 3]);
            let mut sums = [0.0; 3];
            for bin in 0..spectra.bins {
                let s = Dynamic::new(spectra.alpha.into(), spectra.omega[bin].into());
                let place = (&mounting, &Vector3::zeros());
                let sensors =
                    DenseSensors::new(&dense, &bushings, place, Accelerometer::Strapdown, s);
                let at = |spectrum: &flexid_core::spectrum::Spectrum<BINS>| {
                    std::array::from_fn(|axis| {
                        Dynamic::new(spectrum.re[axis][bin].into(), spectrum.im[axis][bin].into())
                    })
                };
                let model = sensors.read(&at(&spectra.force), &[Dynamic::ZERO; 18]);
                let measured = at(&spectra.acceleration);
                for axis in 0..3 {
                    let power = measured[axis].norm_sqr() + model[axis].norm_sqr();
                    sums[axis] += (measured[axis] - model[axis]).norm_sqr() / power;
                }
            }
            for axis in 0..3 {
                let expected = sums[axis] / spectra.bins as f64;
                let gap = (f64::from(found[axis]) - expected).abs();
                assert!(gap < 1e-4 * (1.0 + expected), "{axis}: {} {expected}", found[axis]);
            }
        }
    }
}

fn experiments(
    records: &[flexid_core::stream::Record<SAMPLES>],
    mounting: Mounting,
) -> Vec<Experiment<BINS>> {
    let mut buffer = [0.0; SAMPLES];
    let measurement = measurement(mounting);
    records
        .iter()
        .map(|record| {
            Experiment::new(&mill3(), &measurement, record, &mut buffer).expect("a good record")
        })
        .collect()
}

fn identify(records: &[flexid_core::stream::Record<SAMPLES>], mounting: Mounting) -> Estimate {
    let experiments = experiments(records, mounting);
    settle(&mut identifier_of(measurement(mounting), Sought::new(3).unwrap()), &experiments)
}

fn at_the_noise_limit(estimate: &Estimate, truth: &Bushings) {
    let scores = scores(&estimate.bushings, truth, &relative(estimate));
    let (consistency, mean_square) = (estimate.consistency, mean_square(&scores));
    println!("chi^2/dof {consistency:.3}, mean square of the scores {mean_square:.2}");
    assert_eq!(estimate.acceptance, Acceptance::Consistent);
    assert!((consistency - 1.0).abs() < 0.05, "{consistency}");
    assert_within_the_intervals(&scores);
}

/// Lever arm, turned sensors and tool mass: known, the joints are found to the noise limit; each left out, the fit says no.
#[test]
fn sensors_elsewhere_are_allowed_for() {
    let truth = Random::new(83).bushings(3);
    let mounting = spindle();
    let records = records(&mill3(), &truth, mounting, 84);
    at_the_noise_limit(&identify(&records, mounting), &truth);
    let ignorant = [
        ("all", Mounting::AT_TCP),
        ("lever arm", Mounting { accelerometer: Vector3::zeros(), ..mounting }),
        ("force axes", Mounting { force_axes: Rotation3::identity(), ..mounting }),
        ("tool mass", Mounting { tool_mass: 0.0, ..mounting }),
    ];
    for (what, ignorant) in ignorant {
        let estimate = identify(&records, ignorant);
        let Estimate { acceptance, consistency, structure, .. } = estimate;
        println!("{what} left out: chi^2/dof {consistency:.2}, {structure:?}");
        assert_ne!(acceptance, Acceptance::Consistent, "{what} left out: {consistency}");
    }
}
