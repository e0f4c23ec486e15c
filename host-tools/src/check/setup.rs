//! Judges the configuration, its model and its DBC file. Mistakes in them have been refused before, each by one line.

use flexid_pipeline::config::{Accelerometer, Config, loose};
use flexid_pipeline::text::count;

use super::Finding;
use super::Severity::{Doubtful, Note};
use super::words::{enumerate, hz};
use crate::urdf;

const ABOUT: &str = "configuration";
const ABOUT_MODEL: &str = "model";
/// The subject of the findings of this file.
pub(super) const ABOUTS: [&str; 2] = [ABOUT, ABOUT_MODEL];

/// Returns whether the configuration describes records, and not static tests alone.
pub(super) fn has_signals(config: &Config) -> bool {
    !config.signals.is_none()
}

/// The first finding: that nothing may be off but what is sought or stated, if `[accuracy]` assumes so.
pub(super) fn of_perfect_accuracies(config: &Config) -> Option<Finding> {
    let finding = "[accuracy] takes as perfect what it does not state: the intervals hold only for such a plant";
    let mend = "right for a simulated robot; leave assume = \"perfect\" out for a real one";
    config.assumes_perfect.then(|| Finding::new(Doubtful, ABOUT, finding, mend))
}

/// Judges joints, band, gravity, masses and accuracies.
pub(super) fn judge(config: &Config) -> Vec<Finding> {
    let mut findings = Vec::new();
    if has_signals(config) {
        findings.extend(of_joints(config));
        findings.push(Finding::right(ABOUT, of_the_record(config)));
        findings.extend(of_gravity(config));
    }
    findings.extend(urdf::doubts(&config.model).into_iter().map(|doubt| {
        let severity = if doubt.is_choice { Note } else { Doubtful };
        Finding::new(severity, ABOUT_MODEL, doubt.finding, doubt.mend)
    }));
    if !config.statics.tests.is_empty() {
        let tests = count(config.statics.tests.len() as u64, "static test");
        findings.push(Finding::right(ABOUT, format!("{tests} in [static] file")));
    }
    // A guess is what the model says of itself.
    let guessed = config.model.accuracy.map_or(0.0, |guessed| guessed.centre_of_mass_m);
    let is_guess =
        |key: &str| key == "centre_of_mass_m" && config.accuracies.centre_of_mass <= guessed;
    let loose = loose(&config.accuracies).filter(|(key, _)| !is_guess(key));
    findings.extend(loose.map(|(key, times)| {
        Finding::new(
            Doubtful,
            ABOUT,
            format!("[accuracy] {key} is {times:.0} times as large as is typical, so that little is left of what is stated"),
            "measure it, and state what the measurement reaches, as one standard deviation; parts are fractions, 0.005 for 0.5 %",
        )
    }));
    findings
}

/// The joints against the signals of the DBC file.
fn of_joints(config: &Config) -> Vec<Finding> {
    let signals = &config.signals;
    let joints = count(signals.joints.len() as u64, "driven joint");
    let named = enumerate(&signals.joints);
    let place = match (&config.poses, config.interface.is_empty()) {
        (Some(_), true) => "each with an angle in [recording] poses",
        (None, true) => "each with a column of the table",
        (_, false) => "each with a signal in [bus] dbc",
    };
    let mut findings = vec![Finding::right(ABOUT, format!("{joints}, {place}: {named}"))];
    if !signals.other_angles.is_empty() {
        let others = &signals.other_angles;
        findings.push(Finding::new(
            Note,
            ABOUT,
            format!(
                "[bus] dbc has {} that [signals] joints does not name: {}",
                count(others.len() as u64, "further angle"),
                enumerate(others.iter().map(|other| &other.name))
            ),
            format!("right for a robot of {joints}; else import all of its joints"),
        ));
    }
    findings
}

fn of_the_record(config: &Config) -> String {
    if !config.knows_rate {
        return "the sampling rate is that of the table's time".to_owned();
    }
    let seconds = config.record_samples as f64 / config.rate_hz;
    let [lower, upper] = config.band_hz;
    // As the bins of an experiment are counted.
    let bins = (upper * seconds).floor() - (lower * seconds).ceil() + 1.0;
    format!(
        "a record has {} samples ({seconds:.1} s), and {bins} bins from {} to {} Hz",
        config.record_samples,
        hz(lower),
        hz(upper)
    )
}

fn of_gravity(config: &Config) -> Option<Finding> {
    let (is_zero, is_inertial) =
        (config.gravity == [0.0; 3], config.accelerometer == Accelerometer::Inertial);
    let stated = match (is_zero, is_inertial) {
        (false, false) => return None,
        (true, false) => "gravity_m_per_s2 is zero",
        (false, true) => "accelerometer is \"inertial\"",
        (true, true) => "gravity_m_per_s2 is zero and accelerometer is \"inertial\"",
    };
    let mend = "right for a simulated robot; leave it out for a real one";
    Some(Finding::new(Note, ABOUT, stated, mend))
}

#[cfg(test)]
mod tests {
    use flexid_core::imperfection::Accuracies;
    use flexid_pipeline::model::MassAccuracy;

    use crate::check::Check;
    use crate::check::fixture::{config, other_angle};

    use super::*;

    fn notes(config: &Config) -> Vec<String> {
        let all = judge(config).into_iter();
        all.filter(|finding| finding.severity == Note).map(|finding| finding.finding).collect()
    }

    #[test]
    fn what_no_real_robot_has_is_noted() {
        let mut config = config();
        assert_eq!(notes(&config).len(), 1, "{:?}", notes(&config));
        config.gravity = [0.0, 0.0, -9.8];
        assert!(notes(&config)[0].starts_with("accelerometer is"));
        config.accelerometer = Accelerometer::Strapdown;
        assert_eq!(notes(&config), Vec::<String>::new());
        config.signals.other_angles = [("q4", 0x114), ("q5", 0x115)].map(other_angle).into();
        let note = "[bus] dbc has 2 further angles that [signals] joints does not name: q4 and q5";
        assert_eq!(notes(&config), [note]);
    }

    #[test]
    fn perfect_accuracies_are_doubted_first() {
        let mut config = Config { assumes_perfect: true, ..config() };
        let first = |config: &Config| Check::new(config, None).findings[0].finding.clone();
        assert!(first(&config).starts_with("[accuracy] takes as perfect what it does not state"));
        let mass = config.model.joints[0].mass_kg;
        config.model.joints.iter_mut().for_each(|joint| joint.mass_kg = mass);
        assert!(first(&config).starts_with("[accuracy] takes as perfect what it does not state"));
        config.assumes_perfect = false;
        assert!(first(&config).starts_with("every moving link weighs"));
    }

    #[test]
    fn an_accuracy_far_above_the_typical_one_is_doubtful() {
        let mut config = config();
        let doubts = |config: &Config| {
            let all = judge(config).into_iter().filter(|finding| finding.severity == Doubtful);
            all.map(|finding| finding.finding).collect::<Vec<_>>()
        };
        config.accuracies = Accuracies { tool_centre_point: 0.02, ..Accuracies::typical() };
        assert_eq!(doubts(&config), Vec::<String>::new());
        config.accuracies.tool_centre_point = 0.5;
        let [only] = &doubts(&config)[..] else { panic!("one doubt") };
        assert!(only.starts_with("[accuracy] tcp_m is 500 times as large as is typical"), "{only}");
    }

    /// The model says how well it guesses a centre of mass.
    #[test]
    fn the_accuracy_of_a_guess_is_not_doubtful() {
        let mut config = config();
        let guessed = 21.0 * Accuracies::typical().centre_of_mass;
        config.model.accuracy =
            Some(MassAccuracy { link_mass: 0.3, link_inertia: 0.4, centre_of_mass_m: guessed });
        let mut is_doubtful = |centre_of_mass: f64| {
            config.accuracies = Accuracies { centre_of_mass, ..Accuracies::typical() };
            judge(&config).iter().any(|own| own.finding.contains("centre_of_mass_m"))
        };
        assert_eq!([guessed, 1.01 * guessed].map(&mut is_doubtful), [false, true]);
    }

    #[test]
    fn placeholders_for_masses_are_doubtful() {
        let mut config = config();
        let doubts = |config: &Config| {
            let all = judge(config).into_iter().filter(|finding| finding.severity == Doubtful);
            all.map(|finding| finding.finding).collect::<Vec<_>>()
        };
        assert_eq!(doubts(&config), Vec::<String>::new());
        let inertia = config.model.joints[0].inertia_kg_m2;
        for joint in &mut config.model.joints {
            joint.mass_kg = 500.0;
        }
        let masses = "every moving link weighs 500 kg: are these placeholders?";
        assert_eq!(doubts(&config), [masses]);
        config.model.joints[0].mass_kg = 501.0;
        config.model.joints[1].inertia_kg_m2 = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0];
        let identity = "the link on joint 'joint_2' has an inertia of 1 kg m² about each axis: is this a placeholder?";
        assert!(doubts(&config).iter().any(|doubt| doubt == identity), "{:?}", doubts(&config));
        for joint in &mut config.model.joints {
            joint.inertia_kg_m2 = inertia;
        }
        let inertias = "every moving link has the same inertia: are these placeholders?";
        assert!(doubts(&config).iter().any(|doubt| doubt == inertias), "{:?}", doubts(&config));
    }

    #[test]
    fn a_robot_without_a_tool_is_doubtful() {
        let mut config = config();
        config.model.tcp.xyz_m = [0.0, 0.0, 0.009];
        let at_joint =
            "the TCP lies at joint 'joint_3', so that a cut has no lever to turn that joint";
        let all = judge(&config);
        assert!(all.iter().any(|it| it.severity == Doubtful && it.finding.starts_with(at_joint)));
    }

    #[test]
    fn the_record_is_described() {
        let config = config();
        assert_eq!(
            of_the_record(&config),
            "a record has 8192 samples (4.1 s), and 811 bins from 2 to 200 Hz"
        );
    }
}
