//! Energy: the work of force and gravity is stored or turned to heat, however large the motion.

use flexid_core::chain::Chain;
use flexid_core::motion::radau::Radau;
use flexid_core::motion::{Coordinates, EquationOfMotion, State};
use flexid_core::parameters::{Bushing, Bushings};
use nalgebra::Vector3;

use super::mechanics::{dissipation, kinetic_energy, poses, potential_energy};
use crate::common::{EXPERIMENTS, Random, mill3, nominal};

const EARTH: Vector3<f64> = Vector3::new(0.3, -0.5, -9.8);

struct Balance {
    /// Work of the force, heat of the dampers, energy stored beyond the start: J.
    work: f64,
    heat: f64,
    stored: f64,
    /// The largest turn of a bushing, rad.
    turn: f64,
}

/// Pushes a robot for a while. Work and heat are integrals over time: Simpson's rule, pairs of steps.
fn balance(
    (chain, pose): (&Chain, &[f64]),
    bushings: &Bushings,
    start: State,
    (steps, step): (usize, f64),
    push: impl Fn(f64) -> Vector3<f64>,
) -> Balance {
    let equation =
        EquationOfMotion::about(chain, pose, EARTH, bushings, Coordinates::default()).unwrap();
    let to_base = poses(chain, pose, &equation.rest().elongation)[bushings.len()].rotation;
    let stored = |state: &State| {
        kinetic_energy(chain, pose, state) + potential_energy(chain, pose, EARTH, bushings, state)
    };
    // Power is F · v, and v the slope of the TCP's poses.
    let powers = |state: &State, time: f64| {
        const H: f64 = 1e-6;
        let tcp = |part: f64| {
            let mut moved = state.elongation;
            moved.iter_mut().zip(&state.rate).for_each(|(q, rate)| *q += part * rate);
            poses(chain, pose, &moved)[bushings.len()].translation.vector
        };
        let velocity = (tcp(H) - tcp(-H)) / (2.0 * H);
        [(to_base * push(time)).dot(&velocity), dissipation(bushings, state)]
    };
    let mut radau = Radau::new(equation, start, step);
    let (mut sums, mut turn) = ([0.0; 2], 0.0_f64);
    for n in 0..=steps {
        let weight = if n == 0 || n == steps { 1.0 } else { 2.0 * (1 + n % 2) as f64 };
        let now = powers(radau.state(), n as f64 * step);
        (0..2).for_each(|kind| sums[kind] += weight * step / 3.0 * now[kind]);
        let turns = radau.state().elongation.iter().flat_map(|q| q.iter().skip(3));
        turn = turns.fold(turn, |turn, angle| turn.max(angle.abs()));
        if n < steps {
            radau.step(|part| push((n as f64 + part) * step)).unwrap();
        }
    }
    let stored = stored(radau.state()) - stored(&start);
    Balance { work: sums[0], heat: sums[1], stored, turn }
}

fn push(t: f64) -> Vector3<f64> {
    let shape = (std::f64::consts::PI * (t / 0.2).min(1.0)).sin().powi(4);
    Vector3::new(300.0, -200.0, 100.0) * shape * (1.0 + (600.0 * t).sin())
}

#[test]
fn the_work_of_the_force_is_stored_or_turned_to_heat() {
    let (chain, bushings) = (mill3(), nominal());
    let pose = EXPERIMENTS[1].0;
    let start = EquationOfMotion::new(&chain, &pose, EARTH, &bushings).unwrap().rest();
    let Balance { work, heat, stored, .. } =
        balance((&chain, &pose), &bushings, start, (3000, 1e-4), push);
    let left = work - stored - heat;
    println!("scenario: {work:.3e} J are {stored:.3e} stored, {heat:.3e} heat; left {left:.1e} J");
    assert!(stored > 0.05 * work && heat > 0.05 * work, "{work} J are {stored} and {heat}");
    assert!(left.abs() < 1e-8 * work, "{work} J are not {stored} + {heat}");
}

/// Bushings that give way by half a radian, under gravity.
#[test]
fn large_motion_keeps_the_balance() {
    for seed in 0..3 {
        let mut random = Random::new(seed);
        let joints = 2 + seed as usize;
        let (chain, pose) = (random.chain(joints), random.pose(joints));
        let bushings: Bushings = (0..joints)
            .map(|_| Bushing {
                stiffness: std::array::from_fn(|_| random.uniform(1e4, 5e4)),
                damping: std::array::from_fn(|_| random.uniform(1e2, 5e2)),
            })
            .collect();
        let Balance { work, heat, stored, turn } =
            balance((&chain, &pose), &bushings, State::default(), (4000, 2.5e-4), |t| {
                20.0 * push(t)
            });
        let left = work - stored - heat;
        println!(
            "large motion, {turn:.2} rad: {work:.3e} J are {stored:.3e} stored, {heat:.3e} heat; left {left:.1e} J"
        );
        assert!(turn > 0.2, "{turn} rad are not large");
        assert!(
            heat > 0.2 * work && left.abs() < 1e-9 * heat,
            "{work} J are not {stored} + {heat}"
        );
    }
}

/// Nothing is lost without dampers but what the method loses, which falls with its order.
#[test]
fn undamped_motion_keeps_its_energy() {
    let mut random = Random::new(11);
    let (chain, pose) = (random.chain(3), random.pose(3));
    let bushing = Bushing { stiffness: [3e4; 6], damping: [0.0; 6] };
    let bushings: Bushings = (0..3).map(|_| bushing).collect();
    let mut rate = Coordinates::default();
    rate[..3]
        .iter_mut()
        .flat_map(|rate| rate.iter_mut())
        .for_each(|rate| *rate = random.uniform(-1.0, 1.0));
    let start = State { rate, ..State::default() };
    let loss = |steps: usize| {
        let step = 1.0 / steps as f64;
        let kept = balance((&chain, &pose), &bushings, start, (steps, step), |_| Vector3::zeros());
        (kept.stored / kinetic_energy(&chain, &pose, &start)).abs()
    };
    let losses = [200, 400, 800].map(loss);
    println!("undamped, 200, 400, 800 steps a second: {losses:?} of the energy lost");
    assert!(losses[2] < 1e-6, "{losses:?}");
    assert!(losses.windows(2).all(|pair| pair[0] > 24.0 * pair[1]), "{losses:?}");
}
