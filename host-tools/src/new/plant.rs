//! The plant: everything off by up to half of its accuracy, for `flexid simulate --plant`.

use std::fmt::Write as _;

use flexid_core::MAX_JOINTS;
use flexid_core::imperfection::{Accuracies, BASE_OVER_MOVING, GROUND_LAG, SPREAD_OVER_INERTIA};
use flexid_pipeline::model::Model;
use rand_core::{Rng, SeedableRng as _};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::SEED;

/// Part of an accuracy up to which errors are drawn. Chosen: a plant of a careful integrator, which three cuts tell from the robot.
const PART: f64 = 0.5;

/// Errors that are drawn uniformly up to [`PART`] of their accuracies.
struct Errors(Xoshiro256PlusPlus);

impl Errors {
    /// An error of this accuracy, with three digits.
    fn of(&mut self, accuracy: f64) -> f64 {
        let part = 2.0 * (self.0.next_u32() as f64 / u32::MAX as f64) - 1.0;
        tidy(PART * part * accuracy)
    }

    /// The size of an error that is no less than zero.
    fn size(&mut self, accuracy: f64) -> f64 {
        tidy(0.5 * (PART * accuracy + self.of(accuracy).abs()))
    }

    fn vector(&mut self, accuracy: f64) -> [f64; 3] {
        [(); 3].map(|()| self.of(accuracy))
    }

    /// A factor whose logarithm has this accuracy, with four decimal places.
    fn factor(&mut self, accuracy: f64) -> f64 {
        let factor = self.of(accuracy).exp();
        format!("{factor:.4}").parse().unwrap_or(factor)
    }
}

/// Three digits.
fn tidy(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

/// A plant of the robot of `model`, within the accuracies that the configuration of the folder takes.
pub(super) fn text(model: &Model) -> String {
    let mut typical = Accuracies::typical();
    if let Some(guessed) = model.accuracy {
        typical.mass = guessed.link_mass;
        typical.inertia = guessed.link_inertia;
        typical.centre_of_mass = guessed.centre_of_mass_m;
    }
    let mut errors = Errors(Xoshiro256PlusPlus::seed_from_u64(SEED));
    let (joints, driven) = (model.joints.len(), model.driven().count());
    let mut text = "# A plant for `flexid simulate --plant`: what a real one has beside the model, each error drawn up to half of the accuracy that edge.toml takes as\n\
                    # assumed, or the model states. All entries are in flexid's manual: host-tools/docs/simulate.md.\n"
        .to_owned();
    for (section, own) in
        [("force_sensor", typical.force), ("accelerometer", typical.accelerometer)]
    {
        let gain = [(); 3].map(|()| errors.factor(own.gain));
        let _ = write!(
            text,
            "\n[{section}]\nangle_rad = {:?}\ngain = {gain:?}\ncrosstalk = {:?}\n",
            errors.vector(own.angle),
            errors.size(own.crosstalk)
        );
    }
    let _ = write!(
        text,
        "offset_m = {:?}\n\n[accelerometer.clock]\nlate_s = {:?}\nlate_spread_s = {:?}\nppm = {:?}\n\n[tool]\nangle_rad = {:?}\ntcp_m = {:?}\n",
        errors.vector(typical.accelerometer_place),
        errors.size(typical.delay),
        errors.size(typical.record_delay),
        errors.of(1e6 * typical.delay_drift),
        errors.vector(typical.tool_angle),
        errors.vector(typical.tool_centre_point),
    );
    let masses: Vec<f64> = (0..joints).map(|_| errors.factor(typical.mass)).collect();
    let spread = SPREAD_OVER_INERTIA * typical.inertia;
    let spreads: Vec<[f64; 6]> = (0..joints).map(|_| [(); 6].map(|()| errors.of(spread))).collect();
    let _ = write!(
        text,
        "\n# True over modelled; true less modelled or reported, m, rad\n[robot]\nmass = {masses:?}\nspread = {spreads:?}\n"
    );
    let mut of_axes =
        |accuracy: f64| -> Vec<[f64; 3]> { (0..joints).map(|_| errors.vector(accuracy)).collect() };
    let _ = write!(
        text,
        "centre_of_mass_m = {:?}\nelastic_centre_m = {:?}\n",
        of_axes(typical.centre_of_mass),
        of_axes(typical.elastic_centre)
    );
    let angles: Vec<f64> = (0..driven).map(|_| errors.of(typical.joint_angle)).collect();
    let _ = writeln!(text, "joint_angle_rad = {angles:?}");
    // A pedestal is a bushing of its own.
    if joints < MAX_JOINTS {
        let moving: f64 = model.driven().map(|joint| joint.mass_kg).sum();
        let mass = tidy(BASE_OVER_MOVING * moving * errors.factor(typical.base_mass));
        let mut stiff = |accuracy: f64| tidy(1.0 / errors.size(accuracy));
        let stiffness: [f64; 6] = std::array::from_fn(|dof| {
            stiff(if dof < 3 { typical.ground_translation } else { typical.ground_rotation })
        });
        let damping = stiffness.map(|own| tidy(GROUND_LAG * own));
        let _ = write!(
            text,
            "\n[pedestal]\nmass_kg = {mass:?}\nstiffness = {stiffness:?}\ndamping = {damping:?}\n"
        );
    }
    let _ = write!(
        text,
        "\n[hose]\nstiffness_n_per_m = {:?}\ndamping_ns_per_m = {:?}\n\n[joints]\nhysteretic = {:?}\nservo = {:?}\nloaded_per_knm = {:?}\n",
        errors.size(typical.hose),
        errors.size(typical.hose_damping),
        errors.size(typical.hysteresis),
        errors.size(typical.servo),
        errors.size(1e3 * typical.load),
    );
    text
}
