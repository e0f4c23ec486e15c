//! The loads of a cut on the drives, which must exceed their friction if the joints are to slip.

use flexid_pipeline::dynamics::Robot;
use flexid_pipeline::model::Kind;
use flexid_prediction::compensation::jacobian;
use flexid_wire::words::InUnit;

use crate::evidence::RecordEvidence;

/// The largest force of the records and the largest load of each drive by it, for example `7.21 N (root mean square), which loads joint_1 with up
/// to 15.9 Nm and joint_2 with up to 12.0 Nm`. `None` without cuts.
pub fn loads(records: &[RecordEvidence], robot: &Robot) -> Option<String> {
    // The force of a modal test is not known.
    let cuts = || records.iter().filter(|own| !own.is_of_test);
    let force = cuts().map(|own| own.rms_force_n).reduce(f64::max)?;
    let driven = robot.model().driven().count();
    let mut loads = vec![0.0_f64; driven];
    for record in cuts().filter(|own| own.pose.len() == driven) {
        let jacobian = jacobian(robot.chain(), &record.pose);
        for (own, column) in loads.iter_mut().zip(jacobian.column_iter()) {
            *own = own.max(record.rms_force_n * column.fixed_rows::<3>(0).norm());
        }
    }
    let loads = robot.model().driven().zip(loads).map(|(joint, value)| {
        let unit = if joint.kind == Kind::Prismatic { "N" } else { "Nm" };
        format!("{} with up to {}", joint.name, InUnit { value, unit })
    });
    let loads: Vec<String> = loads.collect();
    let (last, first) = loads.split_last()?;
    let loads = match first {
        [] => last.clone(),
        _ => format!("{} and {last}", first.join(", ")),
    };
    let force = InUnit { value: force, unit: "N" };
    Some(format!("{force} (root mean square), which loads {loads}"))
}

/// The friction with which loads compare: README, "What it says".
pub const TYPICAL: &str = "the drives of large robots have a friction of 10 to 100 Nm";
