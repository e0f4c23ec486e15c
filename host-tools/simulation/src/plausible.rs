//! Plausible robots: joints as soft and as damped as those of robots that mill, for the inertia that they carry.
//!
//! Gear and main bearing of a joint are one unit, sized by the largest moment of inertia I that the joint carries about any of its axes, and by
//! the mass m. With the natural frequency f of the drive, ω = 2π f, and a number n for each other direction:
//!
//! ```text
//! drive  k = I ω²        tilting  k = n I ω²        along the axes  k = 32 n m ω²        d = 2 ζ √(k I), 2 ζ √(k m)
//! ```

use std::f64::consts::TAU;

use flexid_core::DOF;
use flexid_core::chain::{Chain, Joint, JointKind};
use flexid_core::parameters::Bushing;
use flexid_pipeline::model::Model;
use rand_core::Rng;

use crate::scenario::{Scenario, by_mass, uniform};

/// Natural frequency of each drive with what it carries, Hz. Chosen: the lowest modes, in which several drives swing together, then lie at 4 to
/// 20 Hz, as those of the reference scenarios do. Drives are faster towards the tool, where gears are large for what they carry.
pub const DRIVE_HZ: [f64; 2] = [8.0, 30.0];
/// Damping ratio of each spring with what it carries. Chosen: from the 1 % of the reference scenario to four times as much, for joints that are bolted
/// and greased.
pub const DAMPING_RATIO: [f64; 2] = [0.01, 0.04];
/// Stiffness of a joint's main bearing against tilting over that of its gear in torsion. Chosen below the 7 to 11 of a gear with such a bearing
/// (TP004 of Wittenstein by its data sheet: 85 over 8 to 12 Nm per arcmin), since larger gears are stiffer in torsion.
const TILTING: [f64; 2] = [5.0, 9.0];
/// Stiffness of that bearing along the axes over that against tilting, each over the inertia. Springs on a ring of diameter D have
/// k_t = 8 k_r / D². D is estimated as half the radius of gyration ρ = √(I / m) of what a joint carries (0.15 m at wrists,
/// 0.4 m at bases); so k_t / m is 8 (ρ / D)² = 32 times k_r / I.
const ALONG: f64 = 32.0;

/// A robot drawn with `rng` for `scenario`: uniformly from the ranges that its `[bounds]` states, plausibly where it states none.
/// One bushing per joint of `model`, base first.
pub fn of(scenario: &Scenario, model: &Model, chain: &Chain, rng: &mut impl Rng) -> Vec<Bushing> {
    let mut robot = scenario.draw_truth(rng);
    let Some(by_mass) = by_mass(model) else { return robot };
    let plausible = draw(chain, rng);
    let ranges = scenario.bounds.joints.iter().zip(&by_mass.joints);
    for ((own, plausible), (stated, by_mass)) in robot.iter_mut().zip(&plausible).zip(ranges) {
        for dof in 0..DOF {
            if stated.stiffness[dof] == by_mass.stiffness[dof] {
                own.stiffness[dof] = plausible.stiffness[dof];
            }
            if stated.damping[dof] == by_mass.damping[dof] {
                own.damping[dof] = plausible.damping[dof];
            }
        }
    }
    robot
}

/// A plausible robot drawn with `rng`, each number uniformly on the logarithmic scale. One bushing per joint of `chain`, base first.
pub fn draw(chain: &Chain, rng: &mut impl Rng) -> Vec<Bushing> {
    let mut between = |[lower, upper]: [f64; 2]| uniform(rng, [lower.ln(), upper.ln()]).exp();
    let mut hertz: Vec<f64> = chain.joints().iter().map(|_| between(DRIVE_HZ)).collect();
    hertz.sort_by(f64::total_cmp);
    let mut bushing = |((joint, carried), hertz): ((&Joint, [f64; DOF]), f64)| {
        let omega = TAU * hertz;
        let mut bushing = Bushing::default();
        for dof in 0..DOF {
            let inertia = sized_by(&carried, dof);
            let is_along = dof < 3 && joint.kind != JointKind::Prismatic;
            let stiffer = match joint.drive() {
                Some(drive) if drive == dof => 1.0,
                _ if is_along => ALONG * between(TILTING),
                _ => between(TILTING),
            };
            let stiffness = stiffer * inertia * omega * omega;
            bushing.stiffness[dof] = stiffness;
            bushing.damping[dof] = 2.0 * between(DAMPING_RATIO) * (stiffness * inertia).sqrt();
        }
        bushing
    };
    chain.joints().iter().zip(chain.carried()).zip(hertz).map(&mut bushing).collect()
}

/// The mass, kg, or for a rotation the largest moment of inertia, kg m², of what a joint carries.
fn sized_by(carried: &[f64; DOF], dof: usize) -> f64 {
    if dof < 3 { carried[dof] } else { carried[3..].iter().copied().fold(0.0, f64::max) }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;
    use rand_core::SeedableRng as _;
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;
    use crate::reference;

    /// The scenario of six joints, which states no bounds.
    fn mill6() -> (Scenario, Model, Chain) {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenario");
        let model = Model::load(&folder.join("mill6-model.toml")).unwrap();
        let scenario = Scenario::load(&folder.join("mill6.toml"), &model).unwrap();
        let chain = model.chain().unwrap();
        (scenario, model, chain)
    }

    proptest! {
        #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(1), ..Default::default() })]

        /// The drive of a joint that rolls what it carries, such as a spindle, turns less than its size, and is faster about its own axis.
        #[test]
        fn drives_swing_slowly_and_bearings_fast(seed: u64) {
            let (scenario, model, chain) = mill6();
            let robot = of(&scenario, &model, &chain, &mut Xoshiro256PlusPlus::seed_from_u64(seed));
            for (joint, (bushing, carried)) in chain.joints().iter().zip(robot.iter().zip(chain.carried())) {
                let drive = joint.drive().unwrap();
                for dof in 0..DOF {
                    let (k, d, m) = (bushing.stiffness[dof], bushing.damping[dof], sized_by(&carried, dof));
                    let hertz = (k / m).sqrt() / TAU;
                    let range = match dof {
                        _ if dof == drive => 8.0..30.0,
                        0..3 => 100.0..520.0,
                        _ => 17.0..91.0,
                    };
                    prop_assert!(range.contains(&hertz), "{hertz} Hz");
                    let ratio = d / (2.0 * (k * m).sqrt());
                    prop_assert!((0.01..0.04).contains(&ratio), "{ratio}");
                }
                let about = (bushing.stiffness[drive] / carried[drive]).sqrt() / TAU;
                prop_assert!(about >= 8.0, "{about} Hz");
            }
            let bounds = by_mass(&model).unwrap();
            for (own, ranges) in robot.iter().zip(&bounds.joints) {
                crate::scenario::check(own, ranges, None, "").unwrap();
            }
        }
    }

    #[test]
    fn what_bounds_state_is_drawn_from_them_alone() {
        let (mill3, chain) = reference::mill3();
        let model = reference::model();
        let seed = || Xoshiro256PlusPlus::seed_from_u64(7);
        assert_eq!(of(&mill3, &model, &chain, &mut seed()), mill3.draw_truth(&mut seed()));
        let (mut scenario, model, chain) = mill6();
        scenario.bounds.joints[2].stiffness[1] = [1.0, 2.0];
        let robot = of(&scenario, &model, &chain, &mut seed());
        assert!((1.0..2.0).contains(&robot[2].stiffness[1]) && robot[2].stiffness[0] > 1e6);
    }
}
