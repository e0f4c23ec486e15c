//! Imperfections of a fit as entries of a plant, and back.

use std::f64::consts::TAU;

use flexid_core::chain::Chain;
use flexid_core::imperfection::{BASE_OVER_MOVING, Imperfection, Sensor};

use super::{Hose, Pedestal, Plant};

/// Stiffness of ground that does not give way, N/m and Nm/rad.
const RIGID: f64 = 1e14;
/// Mass of a base that is none, kg.
const LIGHT_KG: f64 = 1e-3;

impl Plant {
    /// Gives the plant of a robot with so many joints, all driven, an imperfection. Drives grow alike in all plants, and crosstalk is the same between all axes. A
    /// single record, the mass of a base on rigid ground, and what a low-pass does beside its delay have no entry.
    pub fn add(&mut self, imperfection: Imperfection, value: f64, joints: usize) {
        use Imperfection as I;
        let Self { accelerometer, tool, robot, joints: bushings, .. } = self;
        match imperfection {
            I::Delay => accelerometer.clock.late_s = value,
            // The clock of the force sensor is slower.
            I::DelayDrift => accelerometer.clock.ppm = -1e6 * value,
            I::Gain(of, axis) => self.sensor(of).gain[axis] = value.exp(),
            I::Crosstalk(of, ..) => self.sensor(of).crosstalk = value,
            I::Turn(of, axis) => self.sensor(of).angle_rad[axis] = value,
            I::Resonance(of) => self.sensor(of).resonance_hz = 1.0 / (TAU * value.sqrt()),
            I::HighPass(of) => self.sensor(of).high_pass_hz = value / TAU,
            I::AccelerometerPlace(axis) => accelerometer.offset_m[axis] = value,
            I::ToolTurn(axis) => tool.angle_rad[axis] = value,
            I::ToolCentrePoint(axis) => tool.tcp_m[axis] = value,
            I::Mass(link) => *of(&mut robot.mass, link, joints, 1.0) = value.exp(),
            I::Inertia(link, entry) => of(&mut robot.spread, link, joints, [0.0; 6])[entry] = value,
            I::JointAngle(joint) => *of(&mut robot.joint_angle_rad, joint, joints, 0.0) = value,
            I::JointDelay => robot.joint_delay_s = value,
            I::CentreOfMass(link, axis) => {
                of(&mut robot.centre_of_mass_m, link, joints, [0.0; 3])[axis] = value;
            }
            I::ElasticCentre(joint, axis) => {
                of(&mut robot.elastic_centre_m, joint, joints, [0.0; 3])[axis] = value;
            }
            I::Hysteresis => bushings.hysteretic = value,
            I::Servo(_) => bushings.servo = value,
            I::Load => bushings.loaded_per_knm = 1e3 * value,
            I::Ground(dof) => self.ground().stiffness[dof] = 1.0 / value.max(1.0 / RIGID),
            I::GroundDamping(dof) => {
                let Pedestal { stiffness, damping, .. } = self.ground();
                damping[dof] = value * stiffness[dof] * stiffness[dof];
            }
            I::Hose => self.hose().stiffness_n_per_m = value,
            I::HoseDamping => self.hose().damping_ns_per_m = value,
            I::BaseMass
            | I::RecordDelay(_)
            | I::RecordStiffness(_)
            | I::Dispersion
            | I::RollOff => {}
        }
    }

    /// The imperfections that move the robot of `chain`, whose joints are all driven.
    pub fn imperfections(&self, chain: &Chain) -> Vec<(Imperfection, f64)> {
        use Imperfection as I;
        let Self { tool, robot, joints: bushings, pedestal, hose, .. } = self;
        let mut all = Vec::new();
        if let Some(ground) = pedestal {
            let moving_kg: f64 = chain.joints().iter().map(|joint| joint.link.mass).sum();
            all.push((I::BaseMass, (ground.mass_kg / (BASE_OVER_MOVING * moving_kg)).ln()));
            for dof in 0..6 {
                let compliance = 1.0 / ground.stiffness[dof];
                all.push((I::Ground(dof), compliance));
                all.push((I::GroundDamping(dof), ground.damping[dof] * compliance * compliance));
            }
        }
        if let Some(hose) = hose {
            all.push((I::Hose, hose.stiffness_n_per_m));
            all.push((I::HoseDamping, hose.damping_ns_per_m));
        }
        for axis in 0..3 {
            all.push((I::ToolTurn(axis), tool.angle_rad[axis]));
            all.push((I::ToolCentrePoint(axis), tool.tcp_m[axis]));
        }
        for joint in 0..chain.joints().len() {
            let of = |values: &[f64], none: f64| values.get(joint).copied().unwrap_or(none);
            all.push((I::Mass(joint), of(&robot.mass, 1.0).ln()));
            let spread = robot.spread.get(joint).copied().unwrap_or_default();
            let common = of(&robot.inertia, 1.0).ln();
            let of_axes = |entry| if entry < 3 { common } else { 0.0 };
            all.extend((0..6).map(|own| (I::Inertia(joint, own), spread[own] + of_axes(own))));
            all.push((I::JointAngle(joint), of(&robot.joint_angle_rad, 0.0)));
            all.push((I::Servo(joint), bushings.servo));
            for axis in 0..3 {
                let of = |values: &[[f64; 3]]| values.get(joint).map_or(0.0, |own| own[axis]);
                all.push((I::CentreOfMass(joint, axis), of(&robot.centre_of_mass_m)));
                all.push((I::ElasticCentre(joint, axis), of(&robot.elastic_centre_m)));
            }
        }
        all.push((I::Hysteresis, bushings.hysteretic));
        all.push((I::Load, 1e-3 * bushings.loaded_per_knm));
        all
    }

    fn sensor(&mut self, of: Sensor) -> &mut super::Sensor {
        match of {
            Sensor::Force => &mut self.force_sensor,
            Sensor::Accelerometer => &mut self.accelerometer,
        }
    }

    fn ground(&mut self) -> &mut Pedestal {
        let rigid = Pedestal { mass_kg: LIGHT_KG, stiffness: [RIGID; 6], damping: [0.0; 6] };
        self.pedestal.get_or_insert(rigid)
    }

    fn hose(&mut self) -> &mut Hose {
        self.hose.get_or_insert(Hose { stiffness_n_per_m: 0.0, damping_ns_per_m: 0.0 })
    }
}

/// The entry of a joint in a list that has one per joint, or none.
fn of<T: Clone>(list: &mut Vec<T>, joint: usize, joints: usize, none: T) -> &mut T {
    list.resize(joints, none);
    &mut list[joint]
}

#[cfg(test)]
mod tests {
    use flexid_core::chain::JointKind;
    use flexid_core::imperfection::possible;

    use super::*;
    use crate::reference::mill3;

    /// Each imperfection that moves the robot is found again, by itself. Drives are alike, and the base has a mass of its own.
    #[test]
    fn a_plant_has_what_it_is_given() {
        use Imperfection as I;
        let (_, chain) = mill3();
        let joints: Vec<JointKind> = chain.joints().iter().map(|joint| joint.kind).collect();
        let of_robot = possible(&joints, 1).filter(|own| own.is_of_robot() && *own != I::BaseMass);
        for given in of_robot {
            let mut plant = Plant::default();
            plant.add(given, 1e-3, joints.len());
            let found = plant.imperfections(&chain);
            assert!(found.iter().any(|(own, _)| *own == given), "{given:?}");
            for (own, value) in found.into_iter().filter(|(own, _)| *own != I::BaseMass) {
                let is_given = own == given || matches!((own, given), (I::Servo(_), I::Servo(_)));
                let expected = if is_given { 1e-3 } else { 0.0 };
                assert!((value - expected).abs() < 1e-12, "{given:?}: {own:?} {value}");
            }
        }
    }
}
