//! Structure of the exported text: names, escaping, comments, rows, refusals.

use flexid_export::{ExportError, Format, export};
use flexid_wire::report::Verdict;
use flexid_wire::text::clipped;
use roxmltree::{Document, Node};

use crate::scenario::{EARTH, Scenario};

/// Mill6 with a weak stiffness, an open damping and a fixed stiffness, and with names that have to be escaped.
fn difficult() -> Scenario {
    let mut scenario = Scenario::load("mill6", EARTH);
    let name = "arm <1> & \"it's\" 50%/2 \\ -- end-";
    scenario.model.name = name.to_string();
    scenario.model.joints[1].name = name.to_string();
    scenario.verdict = "consistent --> but\nin two lines--".to_string();
    let joint = &mut scenario.joints[1];
    joint.name = clipped(name);
    joint.stiffness_verdict[2] = Verdict::Weak;
    joint.stiffness_std[2] = Some(0.12 * joint.stiffness[2]);
    joint.damping_verdict[2] = Verdict::NotObservable;
    joint.damping_std[2] = None;
    joint.stiffness_verdict[5] = Verdict::Fixed;
    joint.stiffness_std[5] = None;
    scenario
}

const REMARKS: [&str; 3] = [
    "tz stiffness is weak: its standard deviation is 12 %",
    "tz damping is not observable: the data do not determine this value",
    "rz stiffness is fixed by the user: not identified",
];

fn elements<'a>(document: &'a Document, name: &'a str) -> Vec<Node<'a, 'a>> {
    document.descendants().filter(|node| node.has_tag_name(name)).collect()
}

/// Comments directly before an element.
fn comments_before(node: Node) -> Vec<String> {
    let before = node.prev_siblings().skip(1).filter(|node| !node.is_text());
    let comments = before.take_while(Node::is_comment).filter_map(|node| node.text());
    let mut comments: Vec<String> = comments.map(|text| text.trim().to_string()).collect();
    comments.reverse();
    comments
}

#[test]
fn mjcf_nests_the_bodies_and_orders_their_joints() {
    let scenario = Scenario::load("mill6", EARTH);
    let text = export(&scenario.robot(0), Format::Mjcf).unwrap();
    let document = Document::parse(&text).unwrap();
    let bodies = elements(&document, "body");
    assert_eq!(bodies.len(), 6);
    for (index, body) in bodies.iter().enumerate() {
        let parent = body.parent().unwrap();
        assert_eq!(parent.has_tag_name("worldbody"), index == 0);
        assert!(index == 0 || parent == bodies[index - 1]);
        let joints: Vec<Node> = body.children().filter(|node| node.has_tag_name("joint")).collect();
        let names: Vec<_> = joints.iter().map(|joint| joint.attribute("name").unwrap()).collect();
        let prefix = format!("joint_{}", index + 1);
        let expected = ["tx", "ty", "tz", "rx", "ry", "rz"].map(|dof| format!("{prefix}_{dof}"));
        assert_eq!(names, expected);
        for (dof, joint) in joints.iter().enumerate() {
            let number = |name| joint.attribute(name).unwrap().parse::<f64>().unwrap();
            assert_eq!(joint.attribute("type"), Some(if dof < 3 { "slide" } else { "hinge" }));
            assert_eq!(joint.attribute("axis"), Some(["1 0 0", "0 1 0", "0 0 1"][dof % 3]));
            assert_eq!(number("stiffness"), scenario.joints[index].stiffness[dof]);
            assert_eq!(number("damping"), scenario.joints[index].damping[dof]);
            assert!(comments_before(*joint).is_empty());
        }
    }
    let site = elements(&document, "site")[0];
    assert_eq!((site.attribute("name"), site.parent()), (Some("tcp"), Some(bodies[5])));
    let option = elements(&document, "option")[0];
    assert_eq!(option.attribute("gravity"), Some("0.0 0.0 -9.80665"));
    assert!(text.contains("0 of 72 parameters are not identified"));
}

#[test]
fn mjcf_escapes_names_and_says_what_is_not_identified() {
    let scenario = difficult();
    let text = export(&scenario.robot(0), Format::Mjcf).unwrap();
    let document = Document::parse(&text).unwrap();
    let name = &scenario.model.name;
    assert_eq!(document.root_element().attribute("model"), Some(name.as_str()));
    let joint = |dof: &str| {
        let name = format!("{name}_{dof}");
        let mut joints = elements(&document, "joint").into_iter();
        joints.find(|joint| joint.attribute("name") == Some(&name)).unwrap()
    };
    assert_eq!(comments_before(joint("tz")), REMARKS[..2]);
    assert_eq!(comments_before(joint("rz")), REMARKS[2..]);
    assert!(comments_before(joint("tx")).is_empty());
    assert!(text.contains("3 of 72 parameters are not identified"));
    assert!(text.contains("Verdict on the fit: consistent - -> but in two lines- -"));
}

#[test]
fn scripts_escape_names_and_say_what_is_not_identified() {
    let scenario = difficult();
    for (format, mark, name) in [
        (Format::Drake, "# ", r#""arm <1> & \"it's\" 50%/2 \\ -- end-""#),
        (Format::Simscape, "% ", r#"'arm <1> & "it''s" 50%/2 \ -- end-'"#),
    ] {
        let text = export(&scenario.robot(0), format).unwrap();
        assert!(text.contains(name), "{format}: {name} is not in the text");
        for remark in REMARKS {
            let line = format!("{mark}{}: {remark}\n", scenario.model.name);
            assert_eq!(text.matches(&line).count(), 1, "{format}: {line}");
        }
        let verdict = format!("{mark}Verdict on the fit: consistent --> but in two lines--\n");
        assert!(text.contains(&verdict), "{format}");
    }
}

#[test]
fn the_table_has_a_row_per_parameter() {
    let scenario = difficult();
    let text = export(&scenario.robot(0), Format::Csv).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), 1 + 72);
    assert_eq!(lines[0], "joint,dof,kind,value,std,unit,verdict");
    assert_eq!(lines[1], "joint_1,tx,stiffness,260000000.0,2600000.0,N/m,identified");
    assert_eq!(lines[12], "joint_1,rz,damping,1400.0,28.0,Nms/rad,identified");
    let name = r#""arm <1> & ""it's"" 50%/2 \ -- end-""#;
    assert_eq!(lines[15], format!("{name},tz,stiffness,310000000.0,37200000.0,N/m,weak"));
    assert_eq!(lines[21], format!("{name},tz,damping,28000.0,,Ns/m,not_observable"));
}

/// A rod whose largest moment exceeds the sum of the others, because a file rounds. MuJoCo refuses it.
#[test]
fn an_inertia_on_the_edge_is_raised_and_named() {
    let mut scenario = Scenario::load("mill3", [0.0; 3]);
    scenario.model.joints[2].inertia_kg_m2 = [1.0, 2.0, 3.000_001, 0.0, 0.0, 0.0];
    let text = export(&scenario.robot(0), Format::Mjcf).unwrap();
    let document = Document::parse(&text).unwrap();
    let inertial = elements(&document, "inertial")[2];
    let inertia: Vec<f64> = inertial
        .attribute("fullinertia")
        .unwrap()
        .split(' ')
        .map(|number| number.parse().unwrap())
        .collect();
    assert!(inertia[0] + inertia[1] > inertia[2] && inertia[2] < 3.000_01, "{inertia:?}");
    assert_eq!(text.matches("kg m^2 larger than in the model").count(), 1);
}

#[test]
fn a_robot_too_soft_for_gravity_is_exported_and_says_so() {
    let mut scenario = Scenario::load("mill3", EARTH);
    scenario.joints[1].stiffness[4] = 0.0;
    let text = export(&scenario.robot(0), Format::Mjcf).unwrap();
    assert!(text.contains("No equilibrium is known with these values: "), "{text}");
    assert!(!text.contains("<key"), "{text}");
}

#[test]
fn contradictions_are_refused() {
    type Mistake = fn(&mut Scenario);
    let table: [(Mistake, &str); 7] = [
        (|s| s.joints.truncate(2), "the fit has 2 joints, and the model 3"),
        (
            |s| s.joints[1].name = clipped("x"),
            r#"the fit has joint "x" where the model has "joint_2""#,
        ),
        (|s| s.poses[0].truncate(1), "the pose has 1 angles: give one per driven joint, 3"),
        (|s| s.poses[0][2] = f64::NAN, "the pose has a number that is not finite"),
        (|s| s.gravity[0] = f64::INFINITY, "the gravity has a number that is not finite"),
        (|s| s.joints[2].damping[3] = -1.0, r#"joint "joint_3": damping rx is -1: must be finite"#),
        (|s| s.model.joints[0].mass_kg = 0.0, r#"the model joint "joint_1": mass_kg is 0"#),
    ];
    for (mistake, message) in table {
        let mut scenario = Scenario::load("mill3", [0.0; 3]);
        mistake(&mut scenario);
        for format in Format::ALL {
            let error: ExportError = export(&scenario.robot(0), format).unwrap_err();
            let error = error.to_string();
            assert!(error.starts_with(message), "{error:?} should start with {message:?}");
        }
    }
}
