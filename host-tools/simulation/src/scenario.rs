//! The scenario file: the true robot, the experiments, the cutting force and the noise of the sensors.

use std::path::Path;

use flexid_core::parameters::{Bounds, Bushing, Ranges};
use flexid_pipeline::config::{BoundsSection, Config};
use flexid_pipeline::input::{self, BadInput};
use flexid_pipeline::model::{Kind, Model, ModelJoint};
use rand_core::Rng;
use rand_distr::{Distribution as _, Uniform};
use serde::Deserialize;

use flexid_pipeline::names::DOF_NAMES;

mod engagement;
mod entry;
mod limits;
mod sampling;

pub use engagement::Engagement;
use entry::Entry;
pub use entry::{Experiment, Feed};
use limits::{not_negative, within};
pub use sampling::Sampling;

/// Largest number of teeth of a cutter.
const MOST_TEETH: u32 = 1000;

/// A robot to be simulated, and its experiments.
#[derive(Clone, Debug)]
pub struct Scenario {
    /// Bounds of the parameters of robots.
    pub bounds: Bounds,
    /// The nominal robot: one bushing per joint, base first.
    pub truth: Vec<Bushing>,
    /// Experiments in the order in which they are done.
    pub experiments: Vec<Experiment>,
    /// Force of the tool on the robot.
    pub cutting: Cutting,
    /// Sampling of the sensors.
    pub measurement: Sampling,
}

/// A milling cutter. The force per tooth is proportional to the chip's thickness, which grows with the sine of the
/// angle from where the tooth enters.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cutting {
    /// Number of teeth on the cutter.
    pub teeth: u32,
    /// Angle over which a tooth cuts, degrees; 90 is a quarter of the cutter.
    pub immersion_deg: f64,
    /// Force along the cutting speed at the full thickness of the chip, N.
    pub peak_tangential_n: f64,
    /// Radial over tangential force.
    pub radial_ratio: f64,
    /// Axial over tangential force.
    pub axial_ratio: f64,
    /// Standard deviation of r in the force's random factor 1 + r; r is white up to half the sample rate.
    pub roughness: f64,
}

/// The contents of the scenario file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    /// Robot, for people. The simulator takes the robot from the model file.
    #[serde(rename = "robot")]
    _robot: String,
    #[serde(rename = "tcp")]
    _tcp: String,
    #[serde(default)]
    bounds: BoundsSection,
    truth: Vec<Truth>,
    experiment: Vec<Entry>,
    force: Cutting,
    measurement: Sampling,
}

/// The experiments of a file, whatever else it holds.
#[derive(Deserialize)]
struct Experiments {
    experiment: Vec<Entry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Truth {
    joint: String,
    stiffness: [f64; 6],
    damping: [f64; 6],
}

impl Scenario {
    /// Reads and checks the scenario that `config` names.
    ///
    /// # Errors
    /// The errors of [`Scenario::load`]; also if `config` names no scenario, or has another rate than the scenario.
    pub fn of(config: &Config) -> Result<Self, BadInput> {
        Self::of_first(config, usize::MAX)
    }

    /// [`Scenario::of`] without a check of experiments after the first `most`.
    ///
    /// # Errors
    /// The errors of [`Scenario::of`].
    pub fn of_first(config: &Config, most: usize) -> Result<Self, BadInput> {
        let bad = |message: &str| BadInput::new(&config.file, message);
        let file = config.scenario.as_deref().ok_or_else(|| {
            bad("[simulation] is missing: write [simulation] scenario = \"FILE.toml\"")
        })?;
        let scenario = Self::read(file, &input::read(file)?, &config.model, most)?;
        if scenario.measurement.rate_hz != config.rate_hz {
            return Err(bad(&format!(
                "[measurement] rate_hz is {}, but {} has {}: make them equal",
                config.rate_hz,
                file.display(),
                scenario.measurement.rate_hz
            )));
        }
        Ok(scenario)
    }

    /// Reads and checks the scenario `file` of the robot `model`.
    ///
    /// # Errors
    /// The file is wrong. The error is one line that names the file, the place, and the right input.
    pub fn load(file: &Path, model: &Model) -> Result<Self, BadInput> {
        Self::parse(file, &input::read(file)?, model)
    }

    /// Reads and checks the text of the scenario `file`.
    ///
    /// # Errors
    /// The errors of [`Scenario::load`].
    pub fn parse(file: &Path, text: &str, model: &Model) -> Result<Self, BadInput> {
        Self::read(file, text, model, usize::MAX)
    }

    fn read(file: &Path, text: &str, model: &Model, most: usize) -> Result<Self, BadInput> {
        let mut raw: File = input::parse_toml(file, text)?;
        raw.experiment.truncate(most);
        let bad = |message: String| BadInput::new(file, message);
        let bounds = raw.bounds.check(model).map_err(bad)?;
        let truth = truth(&raw.truth, model, &bounds).map_err(bad)?;
        raw.force.check().map_err(bad)?;
        raw.measurement.check().map_err(bad)?;
        let experiments = checked(raw.experiment, model, &raw.measurement).map_err(bad)?;
        Ok(Self { bounds, truth, experiments, cutting: raw.force, measurement: raw.measurement })
    }

    /// A robot drawn uniformly from the bounds.
    pub fn draw_truth(&self, rng: &mut impl Rng) -> Vec<Bushing> {
        let mut draw = |ranges: &[[f64; 2]; 6]| ranges.map(|range| uniform(rng, range));
        self.truth
            .iter()
            .zip(&self.bounds.joints)
            .map(|(_, own)| Bushing {
                stiffness: draw(&own.stiffness),
                damping: draw(&own.damping),
            })
            .collect()
    }

    /// Poses of the experiments, joint angles, rad (m).
    pub fn poses(&self) -> Vec<Vec<f64>> {
        self.experiments.iter().map(|own| own.pose.clone()).collect()
    }

    /// An experiment that the file does not have. Its pose is drawn uniformly between the joints' limits (between ± π
    /// or ± 1 m where there is none). Its spindle speeds are drawn from the ranges of the reference scenario, 600 to 900 rpm at the
    /// start and 3000 to 5400 rpm at the end, and its feed from the three axes.
    pub fn draw_experiment(&self, model: &Model, rng: &mut impl Rng) -> Experiment {
        let pose = model.driven().map(|joint| uniform(rng, reach(joint))).collect();
        let feed = [Feed::X, Feed::Y, Feed::Z][uniform(rng, [0.0, 3.0]) as usize];
        let spindle_rpm = [uniform(rng, [600.0, 900.0]), uniform(rng, [3000.0, 5400.0])];
        Experiment { pose, ..Experiment::standing("drawn", spindle_rpm, feed) }
    }
}

/// Reads and checks the `[[experiment]]` entries of `file`, a scenario or one of such entries alone. Their common sampling is `sampling`.
///
/// # Errors
/// The file is wrong. The error is one line that names the file, the place, and the right input.
pub fn experiments(
    file: &Path,
    model: &Model,
    sampling: &Sampling,
) -> Result<Vec<Experiment>, BadInput> {
    parse_experiments(file, &input::read(file)?, model, sampling)
}

/// Checks the text of the file of [`experiments`].
///
/// # Errors
/// Those of [`experiments`].
pub fn parse_experiments(
    file: &Path,
    text: &str,
    model: &Model,
    sampling: &Sampling,
) -> Result<Vec<Experiment>, BadInput> {
    let Experiments { experiment } = input::parse_toml(file, text)?;
    checked(experiment, model, sampling).map_err(|message| BadInput::new(file, message))
}

fn checked(
    entries: Vec<Entry>,
    model: &Model,
    sampling: &Sampling,
) -> Result<Vec<Experiment>, String> {
    if entries.is_empty() {
        return Err("no [[experiment]]: give at least one".into());
    }
    entries.into_iter().map(|one| one.check(model, sampling)).collect()
}

/// Range of a driven joint, rad (m): its limits, or ± π or ± 1 m where there is none.
pub fn reach(joint: &ModelJoint) -> [f64; 2] {
    let open = match joint.kind {
        Kind::Prismatic => 1.0,
        Kind::Revolute | Kind::Fixed => std::f64::consts::PI,
    };
    let [lower, upper] = joint.limits;
    let limits = |limit: f64| limit.abs() < 1e3;
    let lower = if limits(lower) { lower } else { upper.min(open) - 2.0 * open };
    let upper = if limits(upper) { upper } else { lower + 2.0 * open };
    [lower, upper]
}

/// A number drawn uniformly from `lower` to below `upper`; `lower` if the range is empty.
pub(crate) fn uniform(rng: &mut impl Rng, [lower, upper]: [f64; 2]) -> f64 {
    Uniform::new(lower, upper).map_or(lower, |range| range.sample(rng))
}

fn truth(raw: &[Truth], model: &Model, bounds: &Bounds) -> Result<Vec<Bushing>, String> {
    let given: Vec<&str> = raw.iter().map(|truth| truth.joint.as_str()).collect();
    let wanted: Vec<&str> = model.joints.iter().map(|joint| joint.name.as_str()).collect();
    if given != wanted {
        return Err(format!(
            "[[truth]] is given for the joints [{}], but the model has [{}]: one [[truth]] a joint, base first",
            given.join(", "),
            wanted.join(", ")
        ));
    }
    let by_mass = by_mass(model);
    raw.iter()
        .enumerate()
        .map(|(index, &Truth { ref joint, stiffness, damping })| {
            let bushing = Bushing { stiffness, damping };
            let by_mass = by_mass.as_ref().map(|own| &own.joints[index]);
            check(&bushing, &bounds.joints[index], by_mass, "[bounds]")
                .map_err(|error| format!("[[truth]] {joint} {error}"))?;
            Ok(bushing)
        })
        .collect()
}

/// Ranges that follow from the masses of a model, where `[bounds]` states none.
pub(crate) fn by_mass(model: &Model) -> Option<Bounds> {
    model.chain().ok().map(|chain| Bounds::of(&chain))
}

/// Checks that a true bushing can be found. The error states what is wrong with it, where its range comes from, and the mend. `section`
/// names the section that states the ranges, `by_mass` holds those that follow from the masses.
pub(crate) fn check(
    bushing: &Bushing,
    ranges: &Ranges,
    by_mass: Option<&Ranges>,
    section: &str,
) -> Result<(), String> {
    let by_mass = by_mass.unwrap_or(ranges);
    let kinds = [
        ("stiffness", &bushing.stiffness, &ranges.stiffness, &by_mass.stiffness),
        ("damping", &bushing.damping, &ranges.damping, &by_mass.damping),
    ];
    for (kind, values, ranges, by_mass) in kinds {
        for (dof, &value) in values.iter().enumerate() {
            let [lower, upper] = ranges[dof];
            if (lower..=upper).contains(&value) {
                continue;
            }
            let range = format!("{} to {}", rounded(lower), rounded(upper));
            let must = if by_mass[dof] == ranges[dof] {
                format!(
                    "must lie within {range}, which follow from the masses in [model] file: correct it, or state its range in {section}"
                )
            } else {
                format!("must lie within {section}, {range}: correct it, or widen the range")
            };
            return Err(format!("{kind} {} is {value:e}: {must}", DOF_NAMES[dof]));
        }
    }
    Ok(())
}

/// A number with four digits that count, without zeros at its end.
fn rounded(value: f64) -> String {
    let four = format!("{value:.3e}");
    four.parse().map_or(four, |value: f64| format!("{value:e}"))
}

impl Cutting {
    fn check(&self) -> Result<(), String> {
        if !(1..=MOST_TEETH).contains(&self.teeth) {
            let teeth = self.teeth;
            return Err(format!("[force] teeth is {teeth}: must lie between 1 and {MOST_TEETH}"));
        }
        within("[force] immersion_deg", self.immersion_deg, 180.0)?;
        not_negative("[force] peak_tangential_n", self.peak_tangential_n)?;
        not_negative("[force] radial_ratio", self.radial_ratio)?;
        not_negative("[force] axial_ratio", self.axial_ratio)?;
        not_negative("[force] roughness", self.roughness)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::{mill3, model};
    use rand_core::SeedableRng;
    use rand_xoshiro::Xoshiro256PlusPlus;

    const TEXT: &str = include_str!("../../scenario/mill3.toml");

    #[test]
    fn the_reference_scenario_is_read() {
        let (scenario, _) = mill3();
        assert_eq!(scenario.truth[1].stiffness[4], 8.6e6);
        assert_eq!(scenario.experiments[2].feed, Feed::Z);
        assert_eq!(scenario.measurement.samples(), 8192);
        assert!((scenario.measurement.acceleration_noise() - 0.0155057).abs() < 1e-6);
        assert!((scenario.measurement.force_noise() - 0.1581139).abs() < 1e-6);
    }

    #[test]
    fn mistakes_are_named_with_place_and_mend() {
        let table = [
            ("rate_hz = 2000.0", "rate_hz = -5.0", "[measurement] rate_hz is -5: must be above 0"),
            (
                "rate_hz = 2000.0",
                "rate = 2000.0",
                "[measurement] rate: unknown key `rate`: did you mean `rate_hz` (in Hz)?",
            ),
            ("teeth = 2", "teeth = 0", "[force] teeth is 0: must lie between 1 and 1000"),
            ("teeth = 2", "teeth = 4_000_000_000", "teeth is 4000000000: must lie between"),
            ("duration_s = 4.096", "duration_s = 1e-9", "must hold at least 256 samples, 0.128 s"),
            ("band_hz = [2.0, 200.0]", "band_hz = [2.0, 2.1]", "at least 1 / duration_s wide"),
            ("400.0", "1e300", "[force] peak_tangential_n is 1e300: must lie between 0 and 1e6"),
            (
                "4.8e7,",
                "1e300,",
                "[[truth]] joint_3 stiffness tx is 1e300: must lie within [bounds]",
            ),
            (
                "4.8e7,",
                "1e-300,",
                "tx is 1e-300: must lie within [bounds], 1e7 to 2e8: correct it, or widen the range",
            ),
            ("1.2e3, 0.7e4]", "99.0, 0.7e4]", "joint_3 damping ry is 9.9e1: must lie within"),
            ("[1.0e7, 2.0e8]", "[1e-300, 1e300]", "must be 1e-3 <= lower < upper <= 1e12"),
            (
                "joint = \"joint_3\"",
                "joint = \"wrist\"",
                "[[truth]] is given for the joints [joint_1, joint_2, wrist]",
            ),
            ("[4.8e7,", "[-4.8e7,", "[[truth]] joint_3 stiffness tx is -4.8e7: must lie within"),
            (
                "pose = [0.00, ",
                "pose = [",
                "[[experiment]] \"slot, arm half stretched\" pose has 2 angles",
            ),
            (
                "-0.45",
                "-4.5",
                "[[experiment]] \"slot, arm half stretched\" pose: -4.5 is outside the limits of joint_2",
            ),
            ("feed = \"x\"", "feed = \"w\"", "unknown variant `w`"),
            ("[600, 4200]", "[0, 4200]", "spindle_rpm is 0: must be above 0"),
            (
                "[1.0e7, 2.0e8]",
                "[2.0e8, 1.0e7]",
                "[bounds] stiffness_translation_n_per_m is [2e8, 1e7]: must be",
            ),
        ];
        for (right, wrong, message) in table {
            assert!(TEXT.contains(right), "{right}");
            let text = TEXT.replacen(right, wrong, 1);
            let error =
                Scenario::parse(Path::new("s.toml"), &text, &model()).unwrap_err().to_string();
            assert!(error.starts_with("s.toml:") && error.contains(message), "{error}");
            assert!(!error.contains('\n'), "{error}");
        }
    }

    #[test]
    fn a_robot_feeds_and_mistakes_in_its_path_are_named() {
        let text = include_str!("../../scenario/mill3-feed.toml");
        let parse = |text: &str| Scenario::parse(Path::new("s.toml"), text, &model());
        let scenario = parse(text).unwrap();
        let [first, ..] = &scenario.experiments[..] else { panic!("no experiment") };
        let sampling = first.sampling(&scenario.measurement);
        assert_eq!((sampling.samples(), sampling.angle_rate_hz()), (44_000, 100.0));
        // A ramp to 10 mm/s at 100 mm/s² takes 0.2 s.
        let course = first.course.as_ref().unwrap();
        assert!((course.ends_s() - 21.2).abs() < 1e-9, "{}", course.ends_s());
        let often = text.replacen("rate_hz = 2000.0", "rate_hz = 2000.0\nangle_rate_hz = 25.0", 1);
        let often = parse(&often).unwrap();
        assert_eq!(often.experiments[0].sampling(&often.measurement).angle_rate_hz(), 25.0);
        let place = "s.toml: [[experiment]] \"slot, arm half stretched\"";
        for (right, wrong, message) in [
            ("[[200.0,", "[[2000.0,", " path_mm: point 1 of 1: after "),
            ("[[200.0,", "[[1e9,", " path_mm is 1000000000: must lie within 1e5"),
            ("[[200.0, 0.0, 0.0]]", "[]", " path_mm: moves nowhere"),
            ("path_mm = [[200.0, 0.0, 0.0]]", "", " feed_mm_per_s is of no use without path_mm"),
            ("feed_mm_per_s = 10.0", "", " path_mm is given without feed_mm_per_s: give"),
            ("per_s = 10.0", "per_s = 0.0", " feed_mm_per_s is 0: must be above 0"),
            (
                "feed_mm_per_s = 10.0",
                "feed_mm_per_s = 5.0",
                " path_mm takes 40.10 s after a rest of 1 s, but the experiment lasts 22 s: give it duration_s = 42",
            ),
            (
                "duration_s = 22.0",
                "duration_s = 22.0\nengagement_by_mm = [[0, 0], [210, 1]]",
                " engagement_by_mm: point 2 of 2: 210 mm is off the path, 0 to 200 mm",
            ),
            (
                "duration_s = 22.0",
                "duration_s = 22.0\nengagement_by_mm = [[0, 2.0]]",
                " engagement_by_mm: point 1 of 1: the part 2 must lie between 0 and 1",
            ),
            (
                "duration_s = 22.0",
                "duration_s = 22.0\nengagement_by_mm = [[9, 0], [9, 1]]",
                " engagement_by_mm: point 2 of 2: must lie beyond 9 mm",
            ),
            (
                "path_mm = [[200.0, 0.0, 0.0]]\nfeed_mm_per_s = 10.0",
                "engagement_by_mm = [[0, 1]]",
                " engagement_by_mm is of no use without path_mm: give a path, or remove it",
            ),
            (
                "feed = \"x\"\npath_mm = [[200.0, 0.0, 0.0]]\nfeed_mm_per_s = 10.0",
                "feed = \"path\"",
                " feed = \"path\" is of no use without path_mm: give a path, or remove it",
            ),
            (
                "duration_s = 22.0",
                "duration_s = 1e-9",
                " duration_s is 0.000000001: must hold at least",
            ),
        ] {
            assert!(text.contains(right), "{right}");
            let error = parse(&text.replacen(right, wrong, 1)).unwrap_err().to_string();
            assert!(error.starts_with(&format!("{place}{message}")), "{error}");
            assert!(!error.contains('\n'), "{error}");
        }
    }

    /// The scenario of six joints states no bounds.
    #[test]
    fn a_range_that_follows_from_the_masses_is_named_as_such() {
        let text = include_str!("../../scenario/mill6.toml");
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenario");
        let model = Model::load(&folder.join("mill6-model.toml")).unwrap();
        let error = |value: &str| {
            let text = text.replacen("[2.6e8,", value, 1);
            Scenario::parse(Path::new("s.toml"), &text, &model).map_err(|error| error.to_string())
        };
        assert!(error("[2.6e8,").is_ok());
        let message = error("[2.6e13,").unwrap_err();
        let (place, range) = message.split_once(": must lie within ").unwrap();
        assert_eq!(place, "s.toml: [[truth]] joint_1 stiffness tx is 2.6e13");
        let (range, mend) =
            range.split_once(", which follow from the masses in [model] file").unwrap();
        assert_eq!(mend, ": correct it, or state its range in [bounds]");
        for end in range.split(" to ") {
            let (digits, _) = end.split_once('e').unwrap();
            assert!(digits.len() <= "1.234".len(), "{message}");
        }
    }

    #[test]
    fn drawn_robots_and_poses_lie_in_their_ranges() {
        let (scenario, _) = mill3();
        let model = model();
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
        let mut sum = 0.0;
        for _ in 0..200 {
            for bushing in scenario.draw_truth(&mut rng) {
                for dof in 0..6 {
                    let [lower, upper] = scenario.bounds.joints[0].stiffness[dof];
                    assert!((lower..upper).contains(&bushing.stiffness[dof]));
                    sum += (bushing.stiffness[dof] - lower) / (upper - lower);
                }
            }
            scenario.draw_experiment(&model, &mut rng).check(&model).unwrap();
        }
        let mean = sum / (200.0 * 18.0);
        assert!((mean - 0.5).abs() < 0.02, "uniform draws have the mean 0.5, not {mean}");
    }
}
