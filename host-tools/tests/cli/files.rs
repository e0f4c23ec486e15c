//! Robots, layouts of frames and tables as other programs write them, and files of other kinds in their place: what is imported, what is
//! said.

use std::fs;
use std::path::{Path, PathBuf};

use crate::setup::{edit, flexid, folder, stderr};

/// A file of `tests/faults`, by its name.
fn fault(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/faults").join(name)
}

/// Words that a command must print, and whether it must succeed.
enum Outcome {
    /// It succeeds, and says no more than this on stderr in a line beginning with "warning", each a part of one line.
    Warns(&'static [&'static str]),
    /// It refuses with one line that has this part.
    Refuses(&'static str),
}
use Outcome::{Refuses, Warns};

/// Imports `bytes` as `robot.urdf`.
fn imports(bytes: &[u8], tcp: &str, outcome: &Outcome) {
    let folder = folder();
    let folder = folder.path();
    fs::write(folder.join("robot.urdf"), bytes).unwrap();
    let output = flexid(folder, &format!("model import robot.urdf --tcp {tcp} -o m.toml"));
    let said = stderr(&output);
    match outcome {
        Warns(parts) => {
            assert!(output.status.success(), "{said}");
            assert_eq!(said.lines().count(), parts.len(), "{said}");
            for (line, part) in said.lines().zip(*parts) {
                assert!(line.starts_with("warning: ") && line.contains(part), "{line}, not {part}");
            }
        }
        Refuses(part) => {
            assert_eq!(output.status.code(), Some(2), "{said}");
            assert!(said.lines().count() == 1 && said.contains(part), "{said}, not {part}");
        }
    }
}

#[test]
fn robots_of_other_programs_are_imported_or_named() {
    let table = [
        ("xacro-tag-in-a-comment.urdf", "tcp", Warns(&[])),
        ("limit-without-velocity.urdf", "tcp", Warns(&[])),
        ("inertia-rounded-by-5e-4.urdf", "tcp", Warns(&[])),
        (
            "dummy-link-of-1e-8-kg.urdf",
            "tcp",
            Warns(&[
                "link 'hand' (0.00000001 kg) hangs beside the chain on 'h': lumped in rigidly",
                "the inertia of link 'hand' belongs to no body (principal moments ",
            ]),
        ),
        (
            "limits-in-degrees.urdf",
            "tcp",
            Warns(&[
                "limits beyond two turns (±12.57 rad) on joint 'joint_1' (-180 to 180 rad), 'joint_2' (-130 to 23 rad), \
                'joint_3' (-103 to 149 rad): in degrees? (limits of turning joints are in rad: divide degrees by 57.2958)",
            ]),
        ),
        (
            "inertia-thirty-times-too-large.urdf",
            "tip",
            Warns(&[
                "the inertia of the link on joint 'j2' is that of a solid ellipsoid of 2.84 m, though the link is 0.46 m long",
            ]),
        ),
        (
            "axis-attribute-misspelt.urdf",
            "tcp",
            Refuses("line 17: joint 'joint_2': <axis> has no attribute xyz; it has xzy"),
        ),
        (
            "mujoco-model-in-place-of-urdf.xml",
            "tcp",
            Refuses("is a MuJoCo model (MJCF), and no URDF: name the robot's URDF file"),
        ),
    ];
    for (file, tcp, outcome) in table {
        imports(&fs::read(fault(file)).unwrap(), tcp, &outcome);
    }
}

/// The reference robot, with each text in place of another.
#[test]
fn variants_of_these_robots_are_imported_or_named() {
    let robot = fs::read_to_string(fault("limit-without-velocity.urdf")).unwrap();
    let axis = "<axis xyz=\"0 1 0\"/>";
    let second = "<limit lower=\"-2.3\" upper=\"0.4\" effort=\"0\" velocity=\"1.3\"/>";
    let table = [
        (
            axis,
            "<axis xyz=\"0 1,0 0\"/>",
            Refuses(
                "line 17: joint 'joint_2': <axis> has xyz=\"0 1,0 0\": must be 3 numbers, with decimal points",
            ),
        ),
        (
            axis,
            "<axis/>",
            Refuses("line 17: joint 'joint_2': <axis> has no attribute xyz; it has none"),
        ),
        (
            axis,
            "<axis xyz=\"0 1\"/>",
            Refuses("line 17: joint 'joint_2': <axis> has xyz=\"0 1\": must be 3 numbers\n"),
        ),
        (
            "<origin xyz=\"1.3 0 0\" rpy=\"0 0 0\"/>",
            "<origin xzy=\"1.3 0 0\"/>",
            Refuses("line 26: joint 'joint_3': <origin> has no attribute xyz; it has xzy"),
        ),
        ("<mass value=\"485\"/>", "", Refuses("line 21: link 'link_2': <inertial> has no <mass>")),
        (
            "<mass value=\"485\"/>",
            "<mass/>",
            Refuses("line 21: link 'link_2': <mass> has no attribute value; it has none"),
        ),
        (
            "ixx=\"14\"",
            "ixx=\"14 kg\"",
            Refuses("line 22: link 'link_2': <inertia> has ixx=\"14 kg\": must be a number\n"),
        ),
        ("<parent link=\"link_1\"/>", "", Refuses("line 15: joint 'joint_2': has no <parent>")),
        (
            " type=\"fixed\"",
            "",
            Refuses("joint 'tcp_joint': <joint> has no attribute type; it has name"),
        ),
        ("<link name=\"tcp\"/>", "<link/>", Refuses("a <link> has no name")),
        (
            second,
            "<limit lowr=\"-2.3\" upper=\"0.4\"/>",
            Refuses("line 18: joint 'joint_2': <limit> has no attribute lower; it has lowr, upper"),
        ),
        ("xyz=\"1.3 0 0\"", "xyz=\"${reach} 0 0\"", Refuses("is a xacro, a template for URDF")),
        (
            "<link name=\"base_link\"/>",
            "<xacro:base_link/>",
            Refuses("is a xacro, a template for URDF"),
        ),
        (
            "<robot name=\"mill3\">",
            "<sdf version=\"1.9\"><model name=\"mill3\"/></sdf>",
            Refuses("is a Gazebo model (SDF), and no URDF"),
        ),
        // What flexid does not use needs not be right.
        (
            "<link name=\"base_link\"/>",
            "<link name=\"base_link\"><visual><geometry><mesh/></geometry></visual></link>",
            Warns(&[]),
        ),
        (
            "<link name=\"base_link\"/>",
            "<!DOCTYPE robot><link name=\"base_link\"/>",
            Refuses("not a URDF: "),
        ),
        (
            "joint_1\" type=\"revolute\"",
            "joint_1\" type=\"continuous\"",
            Warns(&[
                "joint 'joint_1' is continuous, and its <limit> says -3.2 to 3.2 rad: taken as its limits",
            ]),
        ),
        (
            "<origin xyz=\"1.35 0 -0.30\" rpy=\"0 0 0\"/>",
            "<origin xyz=\"0 1.4 0\"/>",
            Warns(&[
                "the TCP lies on the axis of joint 'joint_3', so that a cut has no lever to turn that joint about it",
            ]),
        ),
        (
            "<link name=\"tcp\"/>",
            "<link name=\"tcp\"><inertial><mass value=\"1e-5\"/><inertia ixx=\"0\" ixy=\"0\" ixz=\"0\" iyy=\"0\" iyz=\"0\" izz=\"0\"/></inertial></link>",
            Warns(&[]),
        ),
    ];
    for (from, to, outcome) in table {
        let text = robot.replacen(from, to, 1);
        assert_ne!(text, robot, "{from}");
        imports(text.as_bytes(), "tcp", &outcome);
    }
    let marked: Vec<u8> =
        format!("\u{feff}{robot}").encode_utf16().flat_map(u16::to_le_bytes).collect();
    imports(&marked, "tcp", &Warns(&[]));
    imports(b"SQLite format 3\0", "tcp", &Refuses("robot.urdf: is a SQLite database, and no text"));
    imports(
        b"PK\x03\x04",
        "tcp",
        &Refuses("robot.urdf: is a workbook of Excel or another archive"),
    );
}

/// The links are listed to those who do not know yet what to write.
#[test]
fn without_options_the_links_are_listed_first() {
    let folder = folder();
    for (arguments, part) in [
        ("", "--tcp is missing: name the link at the tool's tip: the chains end in tcp;"),
        ("--tcp tcp", "-o MODEL.toml is missing: say where the model goes"),
    ] {
        let said =
            crate::setup::refused(folder.path(), &format!("model import mill3.urdf {arguments}"));
        assert!(said.contains(part), "{said}");
    }
}

/// Checks a configuration in whose folder `file` has these contents; the verdict and stderr.
fn checked(folder: &Path, file: &str, bytes: &[u8]) -> (bool, String) {
    fs::write(folder.join(file), bytes).unwrap();
    let output = flexid(folder, "check --config edge.toml");
    let said = String::from_utf8(output.stdout.clone()).unwrap() + &stderr(&output);
    (output.status.success(), said)
}

#[test]
fn layouts_of_other_programs_are_read_or_named() {
    let read = |name| fs::read(fault(name)).unwrap();
    let whole = fs::read_to_string(folder().path().join("mill3.dbc")).unwrap();
    let symbols = "mill3.dbc: is not a DBC file: it is a symbol file of PEAK (`pip install 'canmatrix[sym]'; canconvert IN.sym \
        OUT.dbc` makes a DBC file of it): name the right one";
    let utf_16: Vec<u8> = whole.encode_utf16().flat_map(u16::to_be_bytes).collect();
    let mixed =
        format!("{whole}CM_ BO_ 257 \"says \\\"N\\\" here\";\nCM_ BO_ 258 \"C:\\robot\\\" ;\n");
    let values = format!("{whole}VAL_ 257 Fx 0 \"\u{8868}\\\" 1 \"C:\\\" ;\n");
    let twice = whole.replace("SG_ Fy :", "SG_ Fx :");
    let again = whole.replace("BO_ 258 ACCELERATION", "BO_ 257 FORCE");
    let table: [(&[u8], &str); 10] = [
        (&read("comment-ends-with-backslash.dbc"), ""),
        (&read("utf8-byte-order-mark.dbc"), ""),
        (&utf_16, ""),
        (mixed.as_bytes(), ""),
        (values.as_bytes(), ""),
        (
            &read("two-messages-of-one-name.dbc"),
            "[signals] force: \"Fx\" is in messages 257 and 600 of mill3.dbc: write \"257.Fx\" or \"600.Fx\"",
        ),
        (twice.as_bytes(), "mill3.dbc: signal Fx is twice in message FORCE: rename one"),
        (again.as_bytes(), "mill3.dbc: messages FORCE and FORCE share the identifier 257"),
        (&read("peak-symbol-file.sym"), symbols),
        (
            b"\xD4\xC3\xB2\xA1\x02\0\x04\0",
            "mill3.dbc: is not a DBC file: it is a capture of Wireshark or tcpdump (pcap)",
        ),
    ];
    for (bytes, part) in table {
        let folder = folder();
        let (is_read, said) = checked(folder.path(), "mill3.dbc", bytes);
        assert!(is_read == part.is_empty() && said.contains(part), "{said}, not {part}");
    }
    // The advice about two messages of one name ends there: the counter is the one beside the axes.
    let folder = folder();
    let config = folder.path().join("edge.toml");
    for name in ["Fx", "Fy", "Fz"] {
        edit(&config, &format!("\"{name}\""), &format!("\"257.{name}\""));
    }
    let (is_read, said) =
        checked(folder.path(), "mill3.dbc", &read("two-messages-of-one-name.dbc"));
    assert!(is_read, "{said}");
}

#[test]
fn tables_of_other_programs_are_read_or_named() {
    let read = |name| fs::read_to_string(fault(name)).unwrap();
    let sheet = read("static-excel-sep-line.csv");
    let semicolons = sheet.replace(',', ";");
    let late = sheet.replace("0.7,", "x,");
    for (text, is_ready, part) in [
        (sheet.as_str(), true, "4 static tests"),
        (&semicolons, true, "4 static tests"),
        (&sheet.replace("sep=,", "\"sep=,\""), true, "4 static tests"),
        (&late, false, "static.csv:4: column q1 is \"x\""),
        (
            &read("static-displacements-in-mm.csv"),
            false,
            "line 4 of [static] file: 88.0 mm under 200 N, and the softest robot within [bounds] gives way by ",
        ),
        ("<mujoco/>\n", false, "static.csv: is a MuJoCo model (MJCF), and no table"),
    ] {
        let folder = folder();
        edit(
            &folder.path().join("edge.toml"),
            "[search]",
            "[static]\nfile = \"static.csv\"\n\n[search]",
        );
        let (is_read, said) = checked(folder.path(), "static.csv", text.as_bytes());
        let said = said.split_whitespace().collect::<Vec<_>>().join(" ");
        let part = part.trim_end();
        assert!(is_read == is_ready && said.contains(part), "{said}, not {part}");
    }
}

/// A model whose limits are in degrees, as `check` meets it with and without angles.
#[test]
fn limits_in_degrees_are_doubted_and_prove_nothing() {
    let folder = folder();
    let folder = folder.path();
    edit(&folder.join("mill3-model.toml"), "limits = [-3.2, 3.2]", "limits = [-180.0, 180.0]");
    let simulated = flexid(folder, "simulate --config edge.toml --experiments 1 --candump o.log");
    assert!(simulated.status.success(), "{}", stderr(&simulated));
    let output = flexid(folder, "check --config edge.toml o.log");
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(said.contains("limits beyond two turns"), "{said}");
    assert!(!said.contains("all joint angles are within the limits"), "{said}");
}
