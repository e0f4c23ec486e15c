use std::f64::consts::FRAC_PI_2;

use flexid_pipeline::model::Kind;
use nalgebra::{Translation3, UnitQuaternion};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

use super::*;

const MILL3: &str = include_str!("../../scenario/mill3.urdf");

fn mass(imported: &Imported) -> f64 {
    imported.model.joints.iter().map(|joint| joint.mass_kg).sum()
}

fn inertial(mass: f64, moments: [f64; 3]) -> String {
    let [x, y, z] = moments;
    format!(
        r#"<inertial><mass value="{mass}"/><inertia ixx="{x}" iyy="{y}" izz="{z}" ixy="0" ixz="0" iyz="0"/></inertial>"#
    )
}

/// A robot of the links `(name, contents)` and the joints `(name, type, parent, child, contents)`.
fn urdf(links: &[(&str, &str)], joints: &[(&str, &str, &str, &str, &str)]) -> String {
    let links: String = links
        .iter()
        .map(|(name, inside)| format!("<link name=\"{name}\">{inside}</link>\n"))
        .collect();
    let joints: String = joints
        .iter()
        .map(|(name, kind, parent, child, inside)| {
            format!(
                "<joint name=\"{name}\" type=\"{kind}\"><parent link=\"{parent}\"/>\
                 <child link=\"{child}\"/>{inside}</joint>\n"
            )
        })
        .collect();
    format!("<robot name=\"r\">\n{links}{joints}</robot>")
}

/// A robot of a base, a revolute arm with the contents `arm` of its link, and a tool frame.
fn one_joint(arm: &str, joint: &str) -> String {
    urdf(
        &[("base", ""), ("arm", arm), ("tool", "")],
        &[
            ("shoulder", "continuous", "base", "arm", joint),
            ("mount", "fixed", "arm", "tool", "<origin xyz=\"1 0 0\"/>"),
        ],
    )
}

#[test]
fn the_reference_robot_is_read_as_it_stands() {
    let robot = import(MILL3, "tcp", Base::Rigid).unwrap();
    assert_eq!(robot.warnings, Vec::<String>::new());
    let model = robot.model;
    assert_eq!(model.name, "mill3");
    let names: Vec<_> = model.joints.iter().map(|joint| joint.name.as_str()).collect();
    assert_eq!(names, ["joint_1", "joint_2", "joint_3"]);
    let second = &model.joints[1];
    assert_eq!(second.origin_xyz_m, [0.5, 0.0, 0.545]);
    assert_eq!(second.axis, [0.0, 1.0, 0.0]);
    assert_eq!(second.limits, [-2.3, 0.4]);
    assert_eq!(second.mass_kg, 485.0);
    assert_eq!(second.centre_of_mass_m, [0.6, -0.08, 0.02]);
    assert_eq!(second.inertia_kg_m2, [14.0, 95.0, 92.0, 0.0, 0.0, 0.0]);
    assert_eq!(model.tcp.xyz_m, [1.35, 0.0, -0.30]);
}

/// The base of the UR10e's file weighs 4 kg, that of the reference robot has no mass.
#[test]
fn a_pedestal_is_the_body_before_the_first_movable_joint() {
    let file = format!("{}/tests/urdf/universal_ur10e.urdf", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(file).unwrap();
    let [rigid, pedestal] = [Base::Rigid, Base::Pedestal].map(|base| import(&text, "tool0", base));
    let (rigid, pedestal) = (rigid.unwrap(), pedestal.unwrap());
    assert_eq!(pedestal.warnings, rigid.warnings);
    assert_eq!(pedestal.model.joints[1..], rigid.model.joints);
    let base = &pedestal.model.joints[0];
    assert_eq!((base.name.as_str(), base.kind, base.mass_kg), ("pedestal", Kind::Fixed, 4.0));

    let assumed = import(MILL3, "tcp", Base::Pedestal).unwrap();
    let base = &assumed.model.joints[0];
    assert_eq!(base.mass_kg, 0.2 * (558.0 + 485.0 + 451.0));
    // A cube of 2000 kg/m³ has m (m/2000)^(2/3) / 6 about each axis.
    let moment = 298.8 * (298.8_f64 / 2000.0).powf(2.0 / 3.0) / 6.0;
    assert!((base.inertia_kg_m2[0] - moment).abs() < 1e-9 && base.inertia_kg_m2[3] == 0.0);
    assert_eq!(assumed.warnings.len(), 1);
    assert!(assumed.warnings[0].contains("the pedestal is taken as 298.8 kg"));
}

#[test]
fn published_arms_give_a_model_or_a_clear_reason() {
    let arm = |name: &str, tcp: &str| {
        let file = format!("{}/tests/urdf/{name}.urdf", env!("CARGO_MANIFEST_DIR"));
        import(&std::fs::read_to_string(file).unwrap(), tcp, Base::Rigid)
    };
    let iiwa = arm("kuka_iiwa14", "iiwa_link_ee").unwrap();
    let mend = "add a link for spindle, sensor and tool, up to its tip";
    let bare = format!("the link on joint 'iiwa_joint_7' weighs 0.3 kg ({mend})");
    assert_eq!((iiwa.model.joints.len(), &iiwa.warnings[..]), (7, &[bare][..]));
    assert!((mass(&iiwa) - 17.5).abs() < 0.1);
    let ur10e = arm("universal_ur10e", "tool0").unwrap();
    let bare =
        "the TCP lies at joint 'wrist_3_joint', so that a cut has no lever to turn that joint";
    assert_eq!(
        (ur10e.model.joints.len(), &ur10e.warnings[..]),
        (6, &[format!("{bare} ({mend})")][..])
    );
    let kr16 = arm("kuka_kr16_2", "tool0").unwrap();
    let masses =
        "every moving link weighs 2 kg: are these placeholders? (compare masses and inertias";
    assert!(kr16.warnings[0].starts_with(masses));
    let inertias = "every moving link has the same inertia: are these placeholders?";
    assert!(kr16.warnings[1].starts_with(inertias));
    assert!(kr16.warnings[2].starts_with("12 kg of moving mass does not fit a reach of 1.77 m"));
    let kr210 = arm("kuka_kr210l150", "tool0").unwrap();
    assert!(kr210.warnings[0].starts_with("3306 kg of moving mass does not fit"));
    let bare = "the TCP 'tool0' is by its name the flange, without a tool";
    assert_eq!(&kr210.warnings[1..], &[format!("{bare} ({mend})")][..]);
    let irb6640 = arm("abb_irb6640_185_280", "tool0").unwrap_err().to_string();
    assert!(
        irb6640.starts_with("no mass on link 'link_1' (moved by 'joint_1'), link 'link_2'")
            && irb6640.ends_with("<inertia ixx=.../> about its centre of mass"),
        "{irb6640}"
    );
}

#[test]
fn what_cannot_be_simulated_is_refused_with_place_and_mend() {
    let body = inertial(10.0, [1.0, 1.0, 1.0]);
    let arm = |inside: &str| one_joint(inside, "");
    let reason = |text: &str, tcp: &str| import(text, tcp, Base::Rigid).unwrap_err().to_string();
    let table = [
        (reason("<robot", "tool"), "not a URDF: "),
        (reason("", "tool"), "not a URDF: "),
        (
            reason(
                "<robot xmlns:xacro=\"http://ros.org/wiki/xacro\"><xacro:include filename=\"a\"/></robot>",
                "tool",
            ),
            "is a xacro, a template for URDF: expand it first with `xacro IN.xacro > robot.urdf` ",
        ),
        (
            reason(&arm(&body), "gripper"),
            "--tcp gripper: no such link; the file has base, arm, tool",
        ),
        (reason(&arm(&body), "base"), "no movable joint between the root and 'base'"),
        (reason(&arm(""), "tool"), "no mass on link 'arm' (moved by 'shoulder')"),
        (reason(&arm(&inertial(-1.0, [1.0; 3])), "tool"), "link 'arm' has the mass -1.0 kg"),
        (
            reason(&arm(&inertial(1e308, [1.0; 3])), "tool"),
            "link 'arm' has the mass 1e308 kg: must be positive and at most 1e6",
        ),
        (reason(&arm(&inertial(f64::NAN, [1.0; 3])), "tool"), "link 'arm' has the number NaN"),
        (
            reason(&arm(&inertial(1.0, [0.0; 3])), "tool"),
            "the inertia of link 'arm' belongs to no body",
        ),
        (
            reason(&arm(&inertial(1.0, [1.0, 1.0, 2.5])), "tool"),
            "the inertia of link 'arm' belongs to no body: principal moments 1.0000, 1.0000, 2.5000",
        ),
        (reason(&arm(&inertial(1.0, [-1.0, 1.0, 1.0])), "tool"), "the inertia of link 'arm'"),
        (
            reason(&one_joint(&body, "<axis xyz=\"0 0 0\"/>"), "tool"),
            "joint 'shoulder' has a zero <axis>",
        ),
        (
            reason(&one_joint(&body, "<mimic joint=\"elbow\"/>"), "tool"),
            "joint 'shoulder' mimics 'elbow'",
        ),
        (
            reason(&arm(&body).replace("continuous", "floating"), "tool"),
            "joint 'shoulder' is floating",
        ),
        (
            reason(&arm(&body).replace("parent link=\"arm\"", "parent link=\"leg\""), "tool"),
            "joint 'mount' names link 'leg', which the file does not define",
        ),
        (
            reason(&arm(&body).replace("link name=\"tool\"", "link name=\"arm\""), "tool"),
            "link 'arm' is defined twice",
        ),
        (
            reason(&arm(&body).replace("parent link=\"base\"", "parent link=\"tool\""), "tool"),
            "link 'arm' hangs on a ring of joints",
        ),
        (
            reason(&arm(&body).replace("child link=\"tool\"", "child link=\"arm\""), "arm"),
            "link 'arm' is the child of two joints, 'shoulder' and 'mount'",
        ),
        (
            reason(&arm(&body).replace("</robot>", "<link name=\"leg\"/></robot>"), "tool"),
            "the file has 2 roots (base, leg)",
        ),
    ];
    for (said, wanted) in table {
        assert!(said.starts_with(wanted), "said {said:?}, not {wanted:?}");
        assert!(!said.contains('\n'), "{said:?} is more than one line");
    }
}

#[test]
fn eight_joints_are_one_too_many() {
    let body = inertial(10.0, [1.0, 1.0, 1.0]);
    let names: Vec<String> = (0..9).map(|index| format!("l{index}")).collect();
    let links: Vec<_> = names.iter().map(|name| (name.as_str(), body.as_str())).collect();
    let joints: Vec<_> = names
        .windows(2)
        .map(|pair| (pair[1].as_str(), "continuous", pair[0].as_str(), pair[1].as_str(), ""))
        .collect();
    let error = import(&urdf(&links, &joints), "l8", Base::Rigid).unwrap_err().to_string();
    assert_eq!(error, "8 movable joints between the root and 'l8': at most 7 are supported");
    assert_eq!(import(&urdf(&links, &joints), "l7", Base::Rigid).unwrap().model.joints.len(), 7);
    let error = import(&urdf(&links, &joints), "l7", Base::Pedestal).unwrap_err().to_string();
    assert!(error.starts_with("7 movable joints and a pedestal: at most 7 joints"), "{error}");
    let on_pedestal = import(&urdf(&links, &joints), "l6", Base::Pedestal).unwrap();
    assert_eq!(on_pedestal.model.joints.len(), 7);
    let mut named = joints.clone();
    named[0].0 = "pedestal";
    let error = import(&urdf(&links, &named), "l6", Base::Pedestal).unwrap_err().to_string();
    assert_eq!(error, "joint 'pedestal' is defined twice: rename one");
    assert!(import(&urdf(&links, &named), "l6", Base::Rigid).is_ok());
}

#[test]
fn branches_are_lumped_in_and_said() {
    let body = inertial(10.0, [1.0, 1.0, 1.0]);
    let text = urdf(
        &[("base", ""), ("arm", &body), ("motor", &body), ("gripper", &body), ("tool", "")],
        &[
            (
                "lift",
                "prismatic",
                "base",
                "arm",
                "<axis xyz=\"0 0 3\"/><limit lower=\"0\" upper=\"1\" velocity=\"1\"/>",
            ),
            ("bolts", "fixed", "arm", "motor", "<origin xyz=\"0 2 0\"/>"),
            ("fin\nger", "revolute", "tool", "gripper", "<origin xyz=\"0 0 0\"/>"),
            ("mount", "fixed", "arm", "tool", "<origin xyz=\"1 0 0\"/>"),
        ],
    );
    let robot = import(&text, "tool", Base::Rigid).unwrap();
    let lift = &robot.model.joints[0];
    assert_eq!((lift.kind, lift.axis, lift.limits), (Kind::Prismatic, [0.0, 0.0, 1.0], [0.0, 1.0]));
    assert_eq!(lift.mass_kg, 30.0);
    let [x, y, z] = lift.centre_of_mass_m;
    assert!((x - 1.0 / 3.0).abs() < 1e-12 && (y - 2.0 / 3.0).abs() < 1e-12 && z == 0.0);
    // About x: three bodies of 1 kg m², 10 kg at y = 2 and 20 kg at y = 0 about y = 2/3.
    assert!((lift.inertia_kg_m2[0] - (3.0 + 10.0 * 16.0 / 9.0 + 20.0 * 4.0 / 9.0)).abs() < 1e-9);
    for said in [
        "joint 'fin ger' is not between the root and the TCP: held at 0",
        "link 'gripper' (10 kg) hangs beside the chain on 'fin ger': lumped in rigidly",
        "link 'motor' (10 kg) hangs beside the chain on 'bolts': lumped in rigidly",
    ] {
        assert!(robot.warnings.iter().any(|warning| warning == said), "{:?}", robot.warnings);
    }
}

#[test]
fn fixed_joints_before_a_drive_end_up_in_its_origin() {
    let body = inertial(10.0, [1.0, 1.0, 1.0]);
    let text = urdf(
        &[("world", ""), ("base", &body), ("arm", &body)],
        &[
            (
                "stand",
                "fixed",
                "world",
                "base",
                "<origin xyz=\"0 0 1\" rpy=\"0 0 1.5707963267948966\"/>",
            ),
            (
                "shoulder",
                "continuous",
                "base",
                "arm",
                "<origin xyz=\"1 0 0\" rpy=\"0.3 -0.2 0.1\"/>",
            ),
        ],
    );
    let chain = import(&text, "arm", Base::Rigid).unwrap().model.chain().unwrap();
    let wanted = Isometry3::from_parts(
        Translation3::new(0.0, 1.0, 1.0),
        UnitQuaternion::from_euler_angles(0.0, 0.0, FRAC_PI_2)
            * UnitQuaternion::from_euler_angles(0.3, -0.2, 0.1),
    );
    assert!((chain.joints()[0].origin.to_homogeneous() - wanted.to_homogeneous()).norm() < 1e-11);
    assert_eq!(chain.joints()[0].link.mass, 10.0, "the base does not move");
}

/// Half a turn about z is the quaternion 0 0 1 0, which URDF has since version 1.1.
#[test]
fn a_turn_may_be_a_quaternion() {
    let body = inertial(10.0, [1.0, 1.0, 1.0]);
    let turned = |turn: &str| {
        let text = one_joint(&body, &format!("<origin xyz=\"1 2 3\" {turn}/>"));
        import(&text, "tool", Base::Rigid).unwrap().model.chain().unwrap().joints()[0].origin
    };
    let [quaternion, angles] =
        ["quat_xyzw=\"0 0 2 0\"", "rpy=\"0 0 3.141592653589793\""].map(turned);
    assert!((quaternion.to_homogeneous() - angles.to_homogeneous()).norm() < 1e-11);
}

/// The frame of the fourth joint of KUKA's robots lies in the centre of the wrist, before which the forearm lies.
#[test]
fn a_forearm_lies_behind_its_origin() {
    let body = |x: &str| {
        format!(
            r#"<inertial><origin xyz="{x} 0 0"/><mass value="100"/><inertia ixx="2" iyy="12" izz="12" ixy="0" ixz="0" iyz="0"/></inertial>"#
        )
    };
    let (arm, forearm, hand) = (body("0.6"), body("-0.55"), body("0.3"));
    let arms = |forearm: &str| {
        let links =
            [("base", ""), ("arm", &*arm), ("forearm", forearm), ("hand", &*hand), ("tip", "")];
        let text = urdf(
            &links,
            &[
                ("a3", "continuous", "base", "arm", "<origin xyz=\"0 0 1\"/><axis xyz=\"0 1 0\"/>"),
                (
                    "a4",
                    "continuous",
                    "arm",
                    "forearm",
                    "<origin xyz=\"1.3 0 0\"/><axis xyz=\"1 0 0\"/>",
                ),
                ("a5", "continuous", "forearm", "hand", "<axis xyz=\"0 1 0\"/>"),
                ("mount", "fixed", "hand", "tip", "<origin xyz=\"0.5 0 0.2\"/>"),
            ],
        );
        import(&text, "tip", Base::Rigid).unwrap().warnings
    };
    assert!(
        !arms(&forearm).iter().any(|said| said.contains("0.00 m long")),
        "{:?}",
        arms(&forearm)
    );
    let beside = forearm.replace("-0.55 0 0", "0 2.6 0");
    let said = "the centre of mass of the link on joint 'a4' lies 2.60 m from the joint, though the link is 1.30 m long";
    assert!(arms(&beside).iter().any(|own| own.starts_with(said)), "{:?}", arms(&beside));
}

proptest! {
    #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(1), ..Default::default() })]

    /// The import reads or refuses a file with a byte range cut out or overwritten, and never panics.
    #[test]
    fn a_damaged_file_never_panics(
        at in 0..MILL3.len(),
        length in 0..40_usize,
        patch in "[ -~]{0,8}",
    ) {
        let mut bytes = MILL3.as_bytes().to_vec();
        let end = (at + length).min(bytes.len());
        bytes.splice(at..end, patch.bytes());
        let _ = import(&String::from_utf8_lossy(&bytes), "tcp", Base::Rigid);
    }
}
