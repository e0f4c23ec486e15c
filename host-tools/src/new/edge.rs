//! The configuration: the commented example, with the names of the robot's own files.

use flexid_pipeline::model::Model;

use super::{DBC, MODEL, Origin, SCENARIO, angles, quoted};

const EXAMPLE: &str = include_str!("../../scenario/edge.toml");

/// The configuration for the robot's bus and for `flexid simulate`.
pub(super) fn text(model: &Model, origin: &Origin<'_>) -> String {
    let changes = changes(model, origin);
    changes.iter().fold(EXAMPLE.to_owned(), |text, (from, to)| text.replacen(from, to, 1))
}

/// Pairs of the example's text and what stands in its place.
fn changes(model: &Model, origin: &Origin<'_>) -> Vec<(&'static str, String)> {
    let head = format!(
        "# What the daemon and `flexid` (simulate, identify, plan) must know of {}, as `flexid new` wrote it. For the real robot look through\n\
         # [bus], [signals], [measurement], [mounting] and [accuracy]. Lines that begin with # are off. Paths are relative to this file.\n",
        one_line(&model.name)
    );
    let signals: Vec<String> = angles(model).map(|name| quoted(&name)).collect();
    let mut changes = vec![
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
                one_line(origin.urdf)
            ),
        ),
        ("dbc = \"mill3.dbc\" ", format!("dbc = {} ", quoted(DBC))),
        ("joints = [\"q1\", \"q2\", \"q3\"] ", format!("joints = [{}] ", signals.join(", "))),
        (
            "# [simulation]\n# scenario = \"mill3.toml\"",
            format!("[simulation]\nscenario = {}", quoted(SCENARIO)),
        ),
        ("# q1,q2,q3 (rad)", format!("# {} (rad)", angles(model).collect::<Vec<_>>().join(","))),
    ];
    if let Some(spread) = origin.spread {
        changes.push(("# [accuracy]\n# assume = ", "[accuracy]\nassume = ".to_owned()));
        changes.push((
            "# centre_of_mass_m = 0.02           # of each link, along each axis (typical 0.005)\n",
            format!(
                "# The URDF file has no masses: those of the model are the data sheet's, spread by the length of arm that each joint carries. On 20 published\n\
                 # arms whose masses are known they are off by so much. Replace the model's masses and these lines by what you know better.\n\
                 link_mass = {:<23} # of each link, relative (typical 0.02)\n\
                 link_inertia = {:<20} # of each link, beside its mass: 0.7 is a factor of 2 (typical 0.05)\n\
                 centre_of_mass_m = {:<16} # of each link, along each axis (typical 0.005)\n",
                spread.mass,
                spread.inertia,
                spread.centre_of_mass_rounded_up()
            ),
        ));
    }
    changes
}

/// A name in a comment, which ends with its line.
fn one_line(name: &str) -> String {
    name.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::new::tests::mill3;
    use crate::urdf::SpreadAccuracy;

    #[test]
    fn the_example_has_each_line_that_is_changed_once() {
        let (model, _) = mill3();
        let spread = Some(SpreadAccuracy { mass: 0.3, inertia: 0.5, centre_of_mass_m: 0.1 });
        for (from, _) in changes(&model, &Origin { urdf: "r.urdf", spread }) {
            assert_eq!(EXAMPLE.matches(from).count(), 1, "{from}");
        }
    }

    /// A small arm of 0.29 m: 0.0145 m are no 0.01 m.
    #[test]
    fn an_accuracy_is_not_rounded_away() {
        for (accuracy, expected) in
            [(0.0145, "0.015"), (0.1, "0.1"), (0.101, "0.11"), (0.05, "0.05")]
        {
            let (model, _) = mill3();
            let spread = SpreadAccuracy { mass: 0.3, inertia: 0.5, centre_of_mass_m: accuracy };
            let text = text(&model, &Origin { urdf: "r.urdf", spread: Some(spread) });
            let line = format!("centre_of_mass_m = {expected} ");
            assert!(text.contains(&line), "{accuracy}: {text}");
        }
    }
}
