//! The layout of the frames, in which each joint has a frame of its own.

use std::fmt::Write as _;

use flexid_pipeline::model::{Kind, Model};

use super::angles;

const HEAD: &str = "VERSION \"\"

NS_ :

BS_:

BU_: SENSOR ROBOT EDGE

";

const ACCELERATION: &str = "\
BO_ 258 ACCELERATION: 8 SENSOR
 SG_ ax : 0|16@1- (0.01,0) [-327.68|327.67] \"m/s^2\" EDGE
 SG_ ay : 16|16@1- (0.01,0) [-327.68|327.67] \"m/s^2\" EDGE
 SG_ az : 32|16@1- (0.01,0) [-327.68|327.67] \"m/s^2\" EDGE
 SG_ AccelerationCounter : 48|16@1+ (1,0) [0|65535] \"\" EDGE
";

const TAIL: &str = "
CM_ BO_ 257 \"Force the tool exerts on the robot at the TCP, in TCP axes, every 0.5 ms.\";
CM_ BO_ 258 \"Acceleration of the TCP, in TCP axes, every 0.5 ms, same instants as FORCE.\";
CM_ BO_ 273 \"Joint angle, 10 Hz.\";
";

/// Identifier of the frame of the first joint.
const FIRST_JOINT: usize = 273;

/// The DBC file. Its forces are for cuts of `force`, N, which they resolve to a thousandth or finer.
pub(super) fn text(model: &Model, force: f64) -> String {
    let step = 10_f64.powf(force.log10().floor() - 3.0);
    let signal = |axis: &str, bit: u32| {
        let [lower, upper] = [-32768.0, 32767.0].map(|end| (1e6 * end * step).round() / 1e6);
        format!(" SG_ F{axis} : {bit}|16@1- ({step:e},0) [{lower}|{upper}] \"N\" EDGE\n")
    };
    let axes = [("x", 0), ("y", 16), ("z", 32)].map(|(axis, bit)| signal(axis, bit)).concat();
    let mut text = format!(
        "{HEAD}BO_ 257 FORCE: 8 SENSOR\n{axes} SG_ ForceCounter : 48|16@1+ (1,0) [0|65535] \"\" EDGE\n\n{ACCELERATION}"
    );
    for (index, (joint, name)) in model.driven().zip(angles(model)).enumerate() {
        let (identifier, number) = (FIRST_JOINT + index, index + 1);
        let unit = if joint.kind == Kind::Prismatic { "m" } else { "rad" };
        // Nothing fails where text grows.
        let _ = write!(
            text,
            "\nBO_ {identifier} JOINT_{number}: 6 ROBOT\n \
             SG_ {name} : 0|32@1- (1e-06,0) [-2147|2147] \"{unit}\" EDGE\n \
             SG_ Joint{number}Counter : 32|16@1+ (1,0) [0|65535] \"\" EDGE\n"
        );
    }
    text + TAIL
}
