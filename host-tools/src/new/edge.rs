//! The configuration: the commented example, with the names of the robot's own files.

use flexid_pipeline::model::Model;

use super::{DBC, MODEL, SCENARIO, angles, quoted};

const EXAMPLE: &str = include_str!("../../scenario/edge.toml");

/// The configuration for the robot's bus and for `flexid simulate`.
pub(super) fn text(model: &Model, urdf: &str) -> String {
    let changes = changes(model, urdf);
    changes.iter().fold(EXAMPLE.to_owned(), |text, (from, to)| text.replacen(from, to, 1))
}

/// Pairs of the example's text and what stands in its place.
fn changes(model: &Model, urdf: &str) -> Vec<(&'static str, String)> {
    let head = format!(
        "# What the daemon and `flexid` (simulate, identify, plan) must know of {}, as `flexid new` wrote it. For the real robot look through\n\
         # [bus], [signals], [measurement], [mounting] and [accuracy]. Lines that begin with # are off. Paths are relative to this file.\n",
        one_line(&model.name)
    );
    let signals: Vec<String> = angles(model).map(|name| quoted(&name)).collect();
    vec![
        (
            "# An example to start from: what the daemon and `flexid` (simulate, identify, plan) must know of a robot that mills.\n\
             # Replace names and numbers by your robot's; lines that begin with # are off. Paths are relative to this file.\n",
            head,
        ),
        (
            "file = \"mill3-model.toml\"           # written by `flexid model import mill3.urdf --tcp tcp -o mill3-model.toml`\n",
            format!(
                "file = {:<28} # of {}, as `flexid model import` writes it\n",
                quoted(MODEL),
                one_line(urdf)
            ),
        ),
        ("dbc = \"mill3.dbc\" ", format!("dbc = {} ", quoted(DBC))),
        ("joints = [\"q1\", \"q2\", \"q3\"] ", format!("joints = [{}] ", signals.join(", "))),
        (
            "# [simulation]\n# scenario = \"mill3.toml\"",
            format!("[simulation]\nscenario = {}", quoted(SCENARIO)),
        ),
        ("# q1,q2,q3 (rad)", format!("# {} (rad)", angles(model).collect::<Vec<_>>().join(","))),
    ]
}

/// A name in a comment, which ends with its line.
fn one_line(name: &str) -> String {
    name.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::new::tests::mill3;

    #[test]
    fn the_example_has_each_line_that_is_changed_once() {
        let (model, _) = mill3();
        for (from, _) in changes(&model, "r.urdf") {
            assert_eq!(EXAMPLE.matches(from).count(), 1, "{from}");
        }
    }
}
