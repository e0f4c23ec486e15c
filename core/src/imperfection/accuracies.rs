//! Standard deviations of the imperfections.

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

impl Accuracies {
    /// Accuracies that a careful integrator reaches.
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
    pub fn typical() -> Self {
        let squared_period = |hz: f64| 1.0 / (TAU * hz * TAU * hz);
        Self {
            force: SensorAccuracies {
                gain: 0.005,
                crosstalk: 0.01,
                angle: 1.7e-3,
                resonance: squared_period(3000.0),
                high_pass: TAU * 0.1,
            },
            accelerometer: SensorAccuracies {
                gain: 0.01,
                crosstalk: 0.01,
                angle: 5e-3,
                resonance: squared_period(3000.0),
                high_pass: TAU * 0.1,
            },
            delay: 20e-6,
            delay_drift: 2e-6,
            tool_angle: 1.7e-3,
            tool_centre_point: 1e-3,
            accelerometer_place: 2e-3,
            mass: 0.02,
            centre_of_mass: 5e-3,
            joint_angle: 1e-3,
            elastic_centre: 0.01,
            inertia: INERTIA_TOLERANCE,
            hysteresis: 0.3,
            servo: 0.05,
            load: 1e-5,
            record_delay: 5e-6,
            record_stiffness: 1e-3,
            structure_translation: 1e-10,
            structure_rotation: 1e-10,
            ground_translation: 5e-10,
            ground_rotation: 1e-9,
            base_mass: 0.5,
            hose: 1e3,
            hose_damping: 20.0,
        }
    }

    /// Returns whether nothing may be off.
    pub fn are_perfect(&self) -> bool {
        *self == Self::default()
    }
}
