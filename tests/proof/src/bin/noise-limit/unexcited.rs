//! A parameter that no pose excites is never called identified. The robot's joints, centres of mass and TCP lie on
//! one vertical line. Its joints turn about the line, so that no force at the TCP turns a bushing about it.

use anyhow::Result;
use flexid_core::chain::{Chain, Joint, JointKind, Link};
use nalgebra::{Matrix3, Translation3, Vector3};
use rayon::prelude::*;

use crate::figure::Figure;
use crate::find::{Task, find};
use crate::linear::motion;
use crate::records::{Sensors, Signals};
use crate::study::{Purpose, Study, random};

/// Indices of the stiffness and the damping about the line, among a joint's twelve parameters.
const ABOUT: [usize; 2] = [5, 11];

pub(crate) fn prove(study: &Study, robots: usize, _details: bool) -> Result<Vec<Figure>> {
    let chain = upright()?;
    let cuts = study.cuts();
    let one = |robot: u64| -> Result<[usize; 2]> {
        let truth = study.robot(robot);
        let mut sensors = Sensors::new(study, random(Purpose::Noise, robot))?;
        let mut records = Vec::new();
        for cut in &cuts[robot as usize % cuts.len()] {
            let motion = motion(&chain, &truth, cut);
            records.push(sensors.measure(&Signals::new(&cut.pose, &motion))?);
        }
        let task = Task { chain: &chain, ..study.task() };
        let found = find(&task, &records, random(Purpose::Search, robot).0)?;
        let claimed = |about: bool| {
            let claims = (0..found.verdicts.len()).filter(|index| found.identifies(*index));
            claims.filter(|index| ABOUT.contains(&(index % 12)) == about).count()
        };
        Ok([claimed(true), claimed(false)])
    };
    let claims = (0..robots as u64).into_par_iter().map(one).collect::<Result<Vec<_>>>()?;
    let [wrong, others] =
        [0, 1].map(|which| claims.iter().map(|claim| claim[which]).sum::<usize>());
    let joints = chain.joints().len();
    Ok(vec![
        Figure::count(
            "parameters that no pose excites, called identified",
            ABOUT.len() * joints * robots,
            wrong == 0,
            wrong,
            "none",
        ),
        // This figure shows that the verdict is possible.
        Figure::count(
            "the others",
            10 * joints * robots,
            others * 4 > 10 * joints * robots,
            others,
            "more than a quarter",
        ),
    ])
}

fn upright() -> Result<Chain> {
    let joint = |height, mass, moments: [f64; 3]| Joint {
        origin: Translation3::new(0.0, 0.0, height).into(),
        axis: Vector3::z_axis(),
        kind: JointKind::Revolute,
        link: Link {
            mass,
            centre_of_mass: Vector3::new(0.0, 0.0, 0.3),
            inertia: Matrix3::from_diagonal(&Vector3::from(moments)),
        },
    };
    let joints = [
        joint(0.5, 558.0, [45.0, 55.0, 48.0]),
        joint(0.7, 485.0, [40.0, 50.0, 30.0]),
        joint(0.6, 451.0, [35.0, 30.0, 25.0]),
    ];
    Chain::new(&joints, Translation3::new(0.0, 0.0, 0.8).into())
        .map_err(|error| anyhow::anyhow!("the upright robot: {error:?}"))
}
