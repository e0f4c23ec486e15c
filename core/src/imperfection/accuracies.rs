//! Standard deviations of the imperfections, and the entries of `[accuracy]` that state them.

use core::f64::consts::TAU;

use crate::chain::INERTIA_TOLERANCE;

/// Standard deviations of the imperfections of one sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SensorAccuracies {
    /// Logarithm of the gain of each axis.
    pub gain: f64,
    /// Part of each other axis in a reading.
    pub crosstalk: f64,
    /// Angle of mounting about each axis, rad.
    pub angle: f64,
    /// `1/ω²`, ω the natural frequency of the mounted sensor, s².
    pub resonance: f64,
    /// Corner frequency of a high-pass, rad/s.
    pub high_pass: f64,
}

/// Standard deviations of all imperfections. The default is zero for each: a perfect plant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Accuracies {
    /// Force sensor.
    pub force: SensorAccuracies,
    /// Accelerometer.
    pub accelerometer: SensorAccuracies,
    /// Delay of the acceleration after the force, s.
    pub delay: f64,
    /// Growth of that delay over a record, s/s.
    pub delay_drift: f64,
    /// Angle of the tool about each axis of the TCP, rad.
    pub tool_angle: f64,
    /// Place of the TCP along each of its axes, m.
    pub tool_centre_point: f64,
    /// Place of the accelerometer along each axis of the TCP, m.
    pub accelerometer_place: f64,
    /// Logarithm of the mass and inertia of each link.
    pub mass: f64,
    /// Centre of mass of each link along each axis, m.
    pub centre_of_mass: f64,
    /// Joint angle, rad (or m).
    pub joint_angle: f64,
    /// Delay of the joint angles after the force, s.
    pub joint_delay: f64,
    /// Place of each bushing along each axis of its link, m.
    pub elastic_centre: f64,
    /// Logarithm of the inertia of each link, beside that of its mass.
    pub inertia: f64,
    /// Part of all dampings that is hysteretic.
    pub hysteresis: f64,
    /// Relative growth of the stiffness of each drive from low to high frequencies.
    pub servo: f64,
    /// Relative growth of the stiffness of all drives with the load of gravity, per Nm (or N).
    pub load: f64,
    /// Delay of the acceleration in one record, beside [`Accuracies::delay`], s.
    pub record_delay: f64,
    /// Logarithm of all stiffnesses in one record.
    pub record_stiffness: f64,
    /// Compliance of a link in series with each joint but the first, along each axis, m/N.
    pub structure_translation: f64,
    /// Its compliance about each axis, rad/Nm.
    pub structure_rotation: f64,
    /// Compliance of the ground along each axis of the base, m/N; its damping over the square of its stiffness is 1e-4 s times that. The
    /// prior is 1.3 times as wide: compliances are never negative, and add up. A fixed first joint is the ground's own: it has that of a
    /// link.
    pub ground_translation: f64,
    /// Compliance of the ground about each axis, rad/Nm.
    pub ground_rotation: f64,
    /// Logarithm of the mass of the base, which is taken for [`BASE_OVER_MOVING`](super::BASE_OVER_MOVING) of the robot's.
    pub base_mass: f64,
    /// Stiffness of hoses between the ground and the TCP, N/m.
    pub hose: f64,
    /// Damping of the same, Ns/m.
    pub hose_damping: f64,
}

/// How an entry of `[accuracy]` states its value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// In SI units.
    Si,
    /// Growth per kNm (or kN), of one per Nm (or N).
    PerKilo,
    /// Natural frequency, Hz, of a `1/ω²`.
    Resonance,
    /// Corner frequency, Hz, of one in rad/s.
    Corner,
}

/// An entry of `[accuracy]`.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// Its key.
    pub key: &'static str,
    /// The accuracy that it states.
    pub own: fn(&mut Accuracies) -> &mut f64,
    /// Value of a robot that a careful integrator has set up.
    pub typical: f64,
    /// Largest value that may be stated. A larger error must be corrected itself. Infinite for a filter: the band has its limits.
    pub most: f64,
    /// Its unit, or an example, in words.
    pub unit: &'static str,
    /// How it states its value.
    pub form: Form,
    /// True if a real robot may be worse than typical by any number of times: structure, ground, clocks, filters, and growth with load. Others of
    /// these are refused before they are so loose.
    pub may_be_loose: bool,
}

const PART: &str = "0.01 is 1 %";

/// All entries of `[accuracy]`, with what a careful integrator reaches, one standard deviation:
///
/// | imperfection                | standard deviation | source                                                              |
/// | --------------------------- | ------------------ | ------------------------------------------------------------------- |
/// | delay                       | 20 µs              | assumed: one twenty-fifth of a sample at 2 kHz, filters matched     |
/// | growth of the delay         | 2 ppm              | data sheets of two temperature-compensated clocks: 0.5 to 2.5 ppm   |
/// | gain, force                 | 0.5 %              | calibration certificates of piezoelectric dynamometers              |
/// | gain, acceleration          | 1 %                | calibration certificates, ISO 16063-21                              |
/// | crosstalk                   | 1 %                | data sheets of triaxial sensors: at most 2 to 3 %                   |
/// | angle, force                | 1.7 mrad (0.1°)    | assumed: a sensor between flanges with dowels                       |
/// | angle, acceleration         | 5 mrad (0.3°)      | assumed: a sensor mounted by hand along an edge                     |
/// | angle, tool                 | 1.7 mrad (0.1°)    | assumed: the flange of a tool changer                               |
/// | natural frequency           | 3 kHz              | data sheets of dynamometers with a spindle: 1.6 to 5 kHz            |
/// | high-pass                   | 0.1 Hz             | data sheets of IEPE sensors: 0.05 to 0.5 Hz                         |
/// | TCP, place of accelerometer | 1 mm, 2 mm         | four-point calibration; a ruler                                     |
/// | mass                        | 2 %                | assumed: CAD without cables, grease and paint                       |
/// | centre of mass              | 5 mm               | assumed, for the same reason                                        |
/// | joint angle                 | 1 mrad (0.06°)     | mastered robots: Nubiola and Bonev, 2013                            |
/// | delay of the joint angles   | 10 ms              | assumed: two cycles of a controller (RSI, EGM 4 ms; RTDE 2 ms). |
/// | elastic centre              | 10 mm              | assumed: a bearing beside its gear                                  |
/// | inertia                     | 5 %                | assumed: CAD of a link without its gears and motors                 |
/// | hysteretic part             | 30 %               | bolted and geared joints: Nashif, Jones and Henderson, 1985         |
/// | stiffness of drives         | 5 %                | assumed: a proportional position loop of 10 Hz on a stiff gear      |
/// | the same with the load      | 1 % per kNm        | assumed: gears that stiffen by some per cent up to the rated torque |
/// | delay of a record           | 5 µs               | assumed: sensors that start without a hardware trigger              |
/// | stiffness of a record       | 0.1 %              | assumed: a gear that warms up                                       |
/// | link                        | 1e-10 m/N          | assumed: cast links: 10 GN/m                                        |
/// |                             | 1e-10 rad/Nm       | assumed, for the same: 10 GNm/rad                                   |
/// | ground                      | 5e-10 m/N          | assumed: between concrete, 1e-10, and a steel pedestal, 1e-9        |
/// |                             | 1e-9 rad/Nm        | assumed: between concrete, 1e-10, and a steel pedestal, 2e-9        |
/// | mass of the base            | 50 %               | published files: 0.14 to 0.29 of the robot's, see above             |
/// | hoses                       | 1 kN/m             | assumed: cables and an air hose that pull with 10 N at 10 mm        |
/// |                             | 20 Ns/m            | assumed: a loss factor of about 1 at 10 Hz                          |
#[rustfmt::skip]
pub const ENTRIES: &[Entry; 33] = &[
    stated("delay_s", |all| &mut all.delay, 20e-6, 1e-3, "in s"),
    stated("delay_drift", |all| &mut all.delay_drift, 2e-6, 1e-3, "1e-6 is 1 ppm").loose(),
    stated("force_gain", |all| &mut all.force.gain, 0.005, 0.5, PART),
    stated("force_crosstalk", |all| &mut all.force.crosstalk, 0.01, 0.5, PART),
    stated("force_angle_rad", |all| &mut all.force.angle, 1.7e-3, 0.5, "in rad"),
    filter("force_resonance_hz", |all| &mut all.force.resonance, 3000.0, Form::Resonance),
    filter("force_high_pass_hz", |all| &mut all.force.high_pass, 0.1, Form::Corner),
    stated("acceleration_gain", |all| &mut all.accelerometer.gain, 0.01, 0.5, PART),
    stated("acceleration_crosstalk", |all| &mut all.accelerometer.crosstalk, 0.01, 0.5, PART),
    stated("accelerometer_angle_rad", |all| &mut all.accelerometer.angle, 5e-3, 0.5, "in rad"),
    filter("accelerometer_resonance_hz", |all| &mut all.accelerometer.resonance, 3000.0, Form::Resonance),
    filter("accelerometer_high_pass_hz", |all| &mut all.accelerometer.high_pass, 0.1, Form::Corner),
    stated("accelerometer_place_m", |all| &mut all.accelerometer_place, 2e-3, 0.5, "in m"),
    stated("tool_angle_rad", |all| &mut all.tool_angle, 1.7e-3, 0.5, "in rad"),
    stated("tcp_m", |all| &mut all.tool_centre_point, 1e-3, 0.5, "in m"),
    stated("link_mass", |all| &mut all.mass, 0.02, 0.5, PART),
    stated("centre_of_mass_m", |all| &mut all.centre_of_mass, 5e-3, 0.5, "in m"),
    stated("joint_angle_rad", |all| &mut all.joint_angle, 1e-3, 0.5, "in rad"),
    stated("joint_delay_s", |all| &mut all.joint_delay, 0.01, 1.0, "in s"),
    stated("elastic_centre_m", |all| &mut all.elastic_centre, 0.01, 0.5, "in m"),
    stated("link_inertia", |all| &mut all.inertia, INERTIA_TOLERANCE, 1.0, PART).loose(),
    stated("hysteresis", |all| &mut all.hysteresis, 0.3, 1.0, PART).loose(),
    stated("drive_growth", |all| &mut all.servo, 0.05, 1.0, PART).loose(),
    Entry { form: Form::PerKilo, ..stated("drive_growth_per_knm", |all| &mut all.load, 0.01, 0.5, PART).loose() },
    stated("delay_of_record_s", |all| &mut all.record_delay, 5e-6, 1e-3, "in s"),
    stated("stiffness_of_record", |all| &mut all.record_stiffness, 1e-3, 0.2, PART),
    stated("structure_m_per_n", |all| &mut all.structure_translation, 1e-10, 1e-6, "in m/N: 1e-10 is 1e10 N/m").loose(),
    stated("structure_rad_per_nm", |all| &mut all.structure_rotation, 1e-10, 1e-5, "in rad/Nm: 1e-10 is 1e10 Nm/rad").loose(),
    stated("ground_m_per_n", |all| &mut all.ground_translation, 5e-10, 1e-6, "in m/N: 1e-9 is 1e9 N/m").loose(),
    stated("ground_rad_per_nm", |all| &mut all.ground_rotation, 1e-9, 1e-5, "in rad/Nm: 1e-9 is 1e9 Nm/rad").loose(),
    stated("base_mass", |all| &mut all.base_mass, 0.5, 1.0, PART).loose(),
    stated("hose_n_per_m", |all| &mut all.hose, 1e3, 1e6, "in N/m"),
    stated("hose_ns_per_m", |all| &mut all.hose_damping, 20.0, 1e5, "in Ns/m"),
];

/// The entry with this key. All keys are known when this crate is compiled.
pub(super) const fn entry(key: &str) -> &'static Entry {
    let mut place = 0;
    while !is_same(ENTRIES[place].key, key) {
        place += 1;
    }
    &ENTRIES[place]
}

/// Returns whether two keys are the same.
const fn is_same(one: &str, other: &str) -> bool {
    let (one, other) = (one.as_bytes(), other.as_bytes());
    let mut place = 0;
    while place < one.len() && place < other.len() && one[place] == other[place] {
        place += 1;
    }
    place == one.len() && place == other.len()
}

/// An entry with its typical and its largest value.
const fn stated(
    key: &'static str,
    own: fn(&mut Accuracies) -> &mut f64,
    typical: f64,
    most: f64,
    unit: &'static str,
) -> Entry {
    Entry { key, own, typical, most, unit, form: Form::Si, may_be_loose: false }
}

/// An entry of a filter, with its typical frequency, Hz.
const fn filter(
    key: &'static str,
    own: fn(&mut Accuracies) -> &mut f64,
    typical: f64,
    form: Form,
) -> Entry {
    Entry { form, ..stated(key, own, typical, f64::INFINITY, "in Hz").loose() }
}

impl Entry {
    const fn loose(self) -> Self {
        Self { may_be_loose: true, ..self }
    }

    /// A stated value in SI units.
    pub fn si(&self, stated: f64) -> f64 {
        match self.form {
            Form::Si => stated,
            Form::PerKilo => 1e-3 * stated,
            Form::Resonance => {
                let omega = TAU * stated;
                1.0 / (omega * omega)
            }
            Form::Corner => TAU * stated,
        }
    }

    /// Its accuracy among these.
    pub fn of(&self, accuracies: &Accuracies) -> f64 {
        let mut all = *accuracies;
        *(self.own)(&mut all)
    }
}

impl Accuracies {
    /// Accuracies that a careful integrator reaches. [`ENTRIES`] state their sources.
    pub fn typical() -> Self {
        let mut all = Self::default();
        for entry in ENTRIES {
            *(entry.own)(&mut all) = entry.si(entry.typical);
        }
        all
    }

    /// Returns whether nothing may be off.
    pub fn are_perfect(&self) -> bool {
        *self == Self::default()
    }
}
