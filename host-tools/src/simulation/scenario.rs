//! The scenario file: the true robot, the experiments, the cutting force and the noise of the sensors.

use std::path::Path;

use flexid_core::parameters::{Bounds, Bushing, EmptyBounds};
use flexid_edge::input::BadInput;
use flexid_edge::model::Model;
use rand_core::Rng;
use serde::Deserialize;

/// Standard gravity, in which accelerometers' noise is given, m/s².
const STANDARD_GRAVITY: f64 = 9.80665;

/// A robot to be simulated, and what is done with it.
#[derive(Clone, Debug)]
pub struct Scenario {
    /// Where the parameters of robots lie.
    pub bounds: Bounds,
    /// The nominal robot: one bushing a joint, base first.
    pub truth: Vec<Bushing>,
    /// In the order in which they are done.
    pub experiments: Vec<Experiment>,
    /// What the tool does to the robot.
    pub cutting: Cutting,
    /// How the sensors sample.
    pub measurement: Sampling,
}

/// One cut at one pose.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Experiment {
    /// For people.
    pub name: String,
    /// Joint angles, rad (m), base first.
    pub pose: Vec<f64>,
    /// Spindle speed at the beginning and at the end of the cut, revolutions per minute.
    pub spindle_rpm: [f64; 2],
    /// Axis of the TCP along which the tool is fed.
    pub feed: Feed,
}

/// An axis of the TCP.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Feed {
    /// Along x; the tool's axis is z.
    X,
    /// Along y; the tool's axis is x.
    Y,
    /// Along z; the tool's axis is y.
    Z,
}

/// A milling cutter: force per tooth proportional to the chip's thickness, which grows with the sine of
/// the angle from where the tooth enters.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cutting {
    /// Teeth on the cutter.
    pub teeth: u32,
    /// Angle over which a tooth cuts, degrees; 90 is a quarter of the cutter.
    pub immersion_deg: f64,
    /// Force along the cutting speed at the full thickness of the chip, N.
    pub peak_tangential_n: f64,
    /// Radial over tangential force.
    pub radial_ratio: f64,
    /// Axial over tangential force.
    pub axial_ratio: f64,
    /// Standard deviation of the force's random factor 1 + r, r white up to half the sample rate.
    pub roughness: f64,
}

/// How force and acceleration are sampled.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sampling {
    /// Samples per second.
    pub rate_hz: f64,
    /// Length of an experiment, s.
    pub duration_s: f64,
    /// Band in which displacements are compared, Hz.
    pub band_hz: [f64; 2],
    /// Amplitude density of the accelerometer's noise, one-sided, standard gravities.
    pub acceleration_noise_g_per_sqrt_hz: f64,
    /// Amplitude density of the force sensor's noise, one-sided.
    pub force_noise_n_per_sqrt_hz: f64,
}

/// The file as it is written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    /// For people: the simulator takes the robot from the model file.
    #[serde(rename = "robot")]
    _robot: String,
    #[serde(rename = "tcp")]
    _tcp: String,
    bounds: BoundsSection,
    truth: Vec<Truth>,
    experiment: Vec<Experiment>,
    force: Cutting,
    measurement: Sampling,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BoundsSection {
    stiffness_translation_n_per_m: [f64; 2],
    stiffness_rotation_nm_per_rad: [f64; 2],
    damping_translation_ns_per_m: [f64; 2],
    damping_rotation_nms_per_rad: [f64; 2],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Truth {
    joint: String,
    stiffness: [f64; 6],
    damping: [f64; 6],
}

impl Sampling {
    /// Standard deviation of one force sample's noise, N.
    pub fn force_noise(&self) -> f64 {
        self.force_noise_n_per_sqrt_hz * (self.rate_hz / 2.0).sqrt()
    }

    /// Standard deviation of one acceleration sample's noise, m/s².
    pub fn acceleration_noise(&self) -> f64 {
        self.acceleration_noise_g_per_sqrt_hz * STANDARD_GRAVITY * (self.rate_hz / 2.0).sqrt()
    }

    /// Samples of one experiment.
    pub fn samples(&self) -> usize {
        (self.rate_hz * self.duration_s).round() as usize
    }
}

impl Scenario {
    /// Reads and checks the scenario `file` of the robot `model`.
    ///
    /// # Errors
    /// One line that names the file, the place, and what would be right.
    pub fn load(file: &Path, model: &Model) -> Result<Self, BadInput> {
        let text = std::fs::read_to_string(file)
            .map_err(|error| BadInput::new(file, format!("cannot be read: {error}")))?;
        Self::parse(file, &text, model)
    }

    fn parse(file: &Path, text: &str, model: &Model) -> Result<Self, BadInput> {
        let raw: File = toml::from_str(text).map_err(|error| BadInput {
            line: error.span().map(|span| 1 + text[..span.start].matches('\n').count()),
            ..BadInput::new(file, error.message())
        })?;
        let bad = |message: String| BadInput::new(file, message);
        let b = &raw.bounds;
        let bounds = Bounds::new(
            b.stiffness_translation_n_per_m,
            b.stiffness_rotation_nm_per_rad,
            b.damping_translation_ns_per_m,
            b.damping_rotation_nms_per_rad,
        )
        .map_err(|EmptyBounds { damping, dof }| {
            let kind = if damping { "damping" } else { "stiffness" };
            let motion = if dof < 3 { "translation" } else { "rotation" };
            bad(format!("[bounds] {kind}_{motion}: must be 0 < lower < upper"))
        })?;
        let truth = truth(&raw.truth, model).map_err(bad)?;
        if raw.experiment.is_empty() {
            return Err(bad("no [[experiment]]: give at least one".into()));
        }
        raw.experiment.iter().try_for_each(|one| one.check(model)).map_err(bad)?;
        raw.force.check().map_err(bad)?;
        raw.measurement.check().map_err(bad)?;
        Ok(Self {
            bounds,
            truth,
            experiments: raw.experiment,
            cutting: raw.force,
            measurement: raw.measurement,
        })
    }

    /// A robot drawn uniformly from the bounds.
    pub fn draw_truth(&self, rng: &mut impl Rng) -> Vec<Bushing> {
        let mut draw = |ranges: &[[f64; 2]; 6]| ranges.map(|range| uniform(rng, range));
        self.truth
            .iter()
            .map(|_| Bushing {
                stiffness: draw(&self.bounds.stiffness),
                damping: draw(&self.bounds.damping),
            })
            .collect()
    }

    /// An experiment that the file does not have: a pose drawn uniformly between the joints' limits
    /// (between ± π or ± 1 m where there is none), spindle speeds and feed like those of the file.
    pub fn draw_experiment(&self, model: &Model, rng: &mut impl Rng) -> Experiment {
        let pose = model
            .joints
            .iter()
            .map(|joint| {
                let open = match joint.kind {
                    flexid_edge::model::Kind::Revolute => std::f64::consts::PI,
                    flexid_edge::model::Kind::Prismatic => 1.0,
                };
                let [lower, upper] = joint.limits;
                let lower = if lower.is_finite() { lower } else { upper.min(open) - 2.0 * open };
                let upper = if upper.is_finite() { upper } else { lower + 2.0 * open };
                uniform(rng, [lower, upper])
            })
            .collect();
        let feed = [Feed::X, Feed::Y, Feed::Z][(3.0 * unit(rng)) as usize];
        let spindle_rpm = [uniform(rng, [600.0, 900.0]), uniform(rng, [3000.0, 5400.0])];
        Experiment { name: "drawn".into(), pose, spindle_rpm, feed }
    }
}

/// In [0, 1).
fn unit(rng: &mut impl Rng) -> f64 {
    (rng.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
}

fn uniform(rng: &mut impl Rng, [lower, upper]: [f64; 2]) -> f64 {
    lower + (upper - lower) * unit(rng)
}

fn truth(raw: &[Truth], model: &Model) -> Result<Vec<Bushing>, String> {
    let given: Vec<&str> = raw.iter().map(|truth| truth.joint.as_str()).collect();
    let wanted: Vec<&str> = model.joints.iter().map(|joint| joint.name.as_str()).collect();
    if given != wanted {
        return Err(format!(
            "[[truth]] is given for the joints [{}], but the model has [{}]: one [[truth]] a joint, base first",
            given.join(", "),
            wanted.join(", ")
        ));
    }
    raw.iter()
        .map(|truth| {
            let positive = |key: &str, values: &[f64; 6]| match values
                .iter()
                .find(|value| !(value.is_finite() && **value > 0.0))
            {
                Some(value) => {
                    Err(format!("[[truth]] {} {key} has {value}: must be positive", truth.joint))
                }
                None => Ok(()),
            };
            positive("stiffness", &truth.stiffness)?;
            positive("damping", &truth.damping)?;
            Ok(Bushing { stiffness: truth.stiffness, damping: truth.damping })
        })
        .collect()
}

impl Experiment {
    fn check(&self, model: &Model) -> Result<(), String> {
        let place = format!("[[experiment]] \"{}\"", self.name);
        if self.pose.len() != model.joints.len() {
            return Err(format!(
                "{place} pose has {} angles, but the model has {} joints",
                self.pose.len(),
                model.joints.len()
            ));
        }
        for (&angle, joint) in self.pose.iter().zip(&model.joints) {
            let [lower, upper] = joint.limits;
            if !(lower..=upper).contains(&angle) {
                return Err(format!(
                    "{place} pose: {angle} is outside the limits of {}, {lower} to {upper}",
                    joint.name
                ));
            }
        }
        match self.spindle_rpm.iter().find(|rpm| !(rpm.is_finite() && **rpm > 0.0)) {
            Some(rpm) => Err(format!("{place} spindle_rpm has {rpm}: must be positive")),
            None => Ok(()),
        }
    }
}

impl Cutting {
    fn check(&self) -> Result<(), String> {
        if self.teeth == 0 {
            return Err("[force] teeth is 0: must be at least 1".into());
        }
        if !(self.immersion_deg > 0.0 && self.immersion_deg <= 180.0) {
            return Err(format!(
                "[force] immersion_deg is {}: must be above 0 and at most 180",
                self.immersion_deg
            ));
        }
        not_negative("[force] peak_tangential_n", self.peak_tangential_n)?;
        not_negative("[force] radial_ratio", self.radial_ratio)?;
        not_negative("[force] axial_ratio", self.axial_ratio)?;
        not_negative("[force] roughness", self.roughness)
    }
}

impl Sampling {
    /// An experiment lasts at most this long, s: its fine grid is held in memory.
    const LONGEST_S: f64 = 120.0;

    fn check(&self) -> Result<(), String> {
        let within = |key: &str, value: f64, most: f64| {
            if value > 0.0 && value <= most {
                Ok(())
            } else {
                Err(format!("[measurement] {key} is {value}: must be above 0 and at most {most}"))
            }
        };
        within("rate_hz", self.rate_hz, 20_000.0)?;
        within("duration_s", self.duration_s, Self::LONGEST_S)?;
        let [lower, upper] = self.band_hz;
        if !(0.0 < lower && lower < upper && upper < self.rate_hz / 2.0) {
            return Err(format!(
                "[measurement] band_hz is [{lower}, {upper}]: must be 0 < lower < upper < rate_hz / 2"
            ));
        }
        not_negative(
            "[measurement] acceleration_noise_g_per_sqrt_hz",
            self.acceleration_noise_g_per_sqrt_hz,
        )?;
        not_negative("[measurement] force_noise_n_per_sqrt_hz", self.force_noise_n_per_sqrt_hz)
    }
}

fn not_negative(place: &str, value: f64) -> Result<(), String> {
    if value >= 0.0 && value.is_finite() {
        Ok(())
    } else {
        Err(format!("{place} is {value}: must not be negative"))
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use flexid_core::chain::Chain;
    use rand_core::SeedableRng;
    use rand_xoshiro::Xoshiro256PlusPlus;

    const TEXT: &str = include_str!("../../scenario/mill3.toml");

    /// The reference robot.
    pub(crate) fn model() -> Model {
        crate::urdf::import(include_str!("../../scenario/mill3.urdf"), "tcp").unwrap().model
    }

    /// The reference scenario and its robot.
    pub(crate) fn mill3() -> (Scenario, Chain) {
        let model = model();
        let scenario = Scenario::parse(Path::new("mill3.toml"), TEXT, &model).unwrap();
        (scenario, model.chain().unwrap())
    }

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
            ("rate_hz = 2000.0", "rate = 2000.0", "unknown field `rate`"),
            ("teeth = 2", "teeth = 0", "[force] teeth is 0"),
            (
                "joint = \"joint_3\"",
                "joint = \"wrist\"",
                "[[truth]] is given for the joints [joint_1, joint_2, wrist]",
            ),
            ("[4.8e7,", "[-4.8e7,", "[[truth]] joint_3 stiffness has -48000000: must be positive"),
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
            ("[600, 4200]", "[0, 4200]", "spindle_rpm has 0: must be positive"),
            (
                "[1.0e7, 2.0e8]",
                "[2.0e8, 1.0e7]",
                "[bounds] stiffness_translation: must be 0 < lower < upper",
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
    fn drawn_robots_and_poses_lie_in_their_ranges() {
        let (scenario, _) = mill3();
        let model = model();
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
        let mut sum = 0.0;
        for _ in 0..200 {
            for bushing in scenario.draw_truth(&mut rng) {
                for dof in 0..6 {
                    let [lower, upper] = scenario.bounds.stiffness[dof];
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
