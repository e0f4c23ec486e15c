//! Tables of two published robots against their URDF files, which other people wrote.

use std::f64::consts::FRAC_PI_2;
use std::path::Path;

use flexid_pipeline::model::{Model, ModelJoint};
use nalgebra::Unit;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

use super::*;

const UR10E: &str = include_str!("../../tests/urdf/universal_ur10e.urdf");
const IIWA: &str = include_str!("../../tests/urdf/kuka_iiwa14.urdf");
const IIWA_TABLES: [(Convention, &str); 2] = [
    (Convention::Standard, include_str!("../../tests/dh/iiwa14-standard.csv")),
    (Convention::Modified, include_str!("../../tests/dh/iiwa14-modified.csv")),
];

fn imported(text: &str, convention: Convention) -> Result<Model, String> {
    let imported = import(text, "r", convention, None, Base::Rigid, &Masses::default());
    imported.map(|imported| imported.model).map_err(|error| error.to_string())
}

fn pose(xyz: [f64; 3], [roll, pitch, yaw]: [f64; 3]) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
    Isometry3::from_parts(Translation3::from(xyz), turn)
}

/// Poses of the links and of the TCP in the base, by definition.
fn poses(model: &Model, angles: &[f64]) -> Vec<Isometry3<f64>> {
    let mut at = Isometry3::identity();
    let mut poses = Vec::new();
    for (joint, angle) in model.joints.iter().zip(angles) {
        let axis = Unit::new_normalize(Vector3::from(joint.axis));
        at *= pose(joint.origin_xyz_m, joint.origin_rpy_rad);
        at *= UnitQuaternion::from_axis_angle(&axis, *angle);
        poses.push(at);
    }
    poses.push(at * pose(model.tcp.xyz_m, model.tcp.rpy_rad));
    poses
}

/// Centre of mass and inertia of a link in the base.
fn body(joint: &ModelJoint, at: &Isometry3<f64>) -> (Vector3<f64>, Matrix3<f64>) {
    let [xx, yy, zz, xy, xz, yz] = joint.inertia_kg_m2;
    let turn = at.rotation.to_rotation_matrix().into_inner();
    let inertia = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
    (
        (at * nalgebra::Point3::from(joint.centre_of_mass_m)).coords,
        turn * inertia * turn.transpose(),
    )
}

/// A table in CSV whose rows, but for fixed ones, have some mass.
fn with_masses(table: &str) -> String {
    let row = |(line, text): (usize, &str)| {
        let masses = if line == 0 {
            ";mass;cx;cy;cz;ixx;iyy;izz"
        } else if text.contains("fixed") {
            ";;;;;;;"
        } else {
            ";1;0;0;0;1;1;1"
        };
        format!("{text}{masses}\n")
    };
    table.lines().enumerate().map(row).collect()
}

/// The parameters that Universal Robots publishes of the UR10e, whose base is turned by half a turn in its URDF. In the modified convention a
/// and α are those of the row before.
const UR_STANDARD: &str = "\
joint; type; θ [deg]; d (mm); a_mm; alpha
base; fixed; 180; 0; 0; 0
shoulder_pan; ; q1; 180,7; 0; pi/2
shoulder_lift; ; q2; 0; -612,7; 0
elbow; ; q3; 0; -571,55; 0
wrist_1; ; q4; 174,15; 0; pi/2
wrist_2; ; q5; 119,85; 0; -pi/2
wrist_3; ; q6; 116,55; 0; 0
";
const UR_MODIFIED: &str = "
name = \"ur10e\"
[[joint]]
joint = \"base\"
type = \"fixed\"
theta_deg = 180
d = 0
a = 0
alpha = 0
[[joint]]
d = 0.1807
a = 0
alpha = 0
[[joint]]
d = 0
a = 0
alpha = \"pi/2\"
[[joint]]
d = 0
a_cm = -61.27
alpha = 0
[[joint]]
d = 0.17415
a = -0.57155
alpha = 0
[[joint]]
d = 0.11985
a = 0
alpha_deg = 90
[[joint]]
d = 0.11655
a = 0
alpha_deg = -90.0
";

fn angles() -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(-3.0..3.0, 7)
}

proptest! {
    #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(1), cases: 20, ..Default::default() })]

    /// In any pose the tip is where the URDF has it, and so are the bodies of all links.
    #[test]
    fn both_conventions_are_the_robot_of_the_urdf(angles in angles()) {
        let iiwa = urdf::import(IIWA, "iiwa_link_ee_kuka", Base::Rigid).unwrap().model;
        let truth = poses(&iiwa, &angles);
        for (convention, table) in IIWA_TABLES {
            let model = imported(table, convention).unwrap();
            prop_assert_eq!(model.joints.len(), 7);
            let own = poses(&model, &angles);
            prop_assert!((own[7].to_homogeneous() - truth[7].to_homogeneous()).norm() < 1e-9);
            for joint in 0..7 {
                let (mine, theirs) = (&model.joints[joint], &iiwa.joints[joint]);
                let ((centre, inertia), (other, wanted)) = (body(mine, &own[joint]), body(theirs, &truth[joint]));
                prop_assert!((centre - other).norm() < 1e-8 && (inertia - wanted).norm() < 1e-8, "{joint}");
                prop_assert_eq!(mine.mass_kg, theirs.mass_kg);
                prop_assert!((mine.limits[0] - theirs.limits[0]).abs() < 1e-4);
            }
        }
        let ur = urdf::import(UR10E, "tool0", Base::Rigid).unwrap().model;
        let truth = poses(&ur, &angles);
        let mass = "[[joint]]\nmass = 1\ncx = 0\ncy = 0\ncz = 0\nixx = 1\niyy = 1\nizz = 1\nd";
        for (convention, table) in [
            (Convention::Standard, with_masses(UR_STANDARD)),
            (Convention::Modified, UR_MODIFIED.replace("[[joint]]\nd", mass)),
        ] {
            let model = imported(&table, convention).unwrap();
            prop_assert_eq!(model.joints.len(), 6);
            let own = poses(&model, &angles);
            prop_assert!((own[6].to_homogeneous() - truth[6].to_homogeneous()).norm() < 1e-8, "{}", own[6]);
        }
    }
}

/// A slide, a tool with a mass, a total for the rest.
#[test]
fn a_total_is_spread_and_a_tool_keeps_its_mass() {
    let table = "i,type,theta [deg],d [mm],a [mm],alpha [deg],lower,upper,mass [kg],cx,cy,cz [mm],ixx,iyy,izz\n\
                 1,P,90,d1,0,90,0,2,,,,,,,\n\
                 2,,q2-90,0,500,0,-1,1,,,,,,,\n\
                 3,,q3,0,0,-90,-1,1,,,,,,,\n\
                 tool,fixed,0,300,100,0,,,12,0,0,-150,0.1,0.1,0.05\n";
    let masses = Masses {
        total: Some((120.0, "--total-mass")),
        folder: Some(Path::new("")),
        payload_kg: 0.0,
    };
    let imported = import(table, "r", Convention::Standard, None, Base::Rigid, &masses).unwrap();
    let model = imported.model;
    let kinds: Vec<_> =
        model.joints.iter().map(|joint| (joint.name.as_str(), joint.kind)).collect();
    use flexid_pipeline::model::Kind::{Prismatic, Revolute};
    assert_eq!(kinds, [("joint_1", Prismatic), ("joint_2", Revolute), ("joint_3", Revolute)]);
    assert_eq!((model.joints[0].limits, model.tcp.xyz_m.len()), ([0.0, 2.0], 3));
    // A sixth of 120 kg is the base's; the tool is beside the robot.
    let all: f64 = model.joints.iter().map(|joint| joint.mass_kg).sum();
    assert!((all - 112.0).abs() < 1e-6 && model.joints[2].mass_kg == 12.0, "{all}");
    assert!(model.accuracy.is_some() && imported.origins[0].contains("spread over links"));
    // Half a turn of α less: the tool's frame is at z = 300 mm, and its centre 150 mm before, both turned with frame 3.
    assert!(
        (Vector3::from(model.tcp.xyz_m) - Vector3::new(0.1, 0.3, 0.0)).norm() < 1e-9,
        "{:?}",
        model.tcp
    );
    assert!(
        (Vector3::from(model.joints[2].centre_of_mass_m) - Vector3::new(0.1, 0.15, 0.0)).norm()
            < 1e-9
    );
}

/// Constants beside a joint's variable, in deg and as parts of π.
#[test]
fn a_variable_may_have_a_constant() {
    for (theta, turned) in [
        ("q1", 0.0),
        ("q1+pi/2", FRAC_PI_2),
        ("q1 - π/2", -FRAC_PI_2),
        ("pi/2+theta_1", FRAC_PI_2),
        ("θ1 - 90", -FRAC_PI_2),
        ("q1-9e+1", -FRAC_PI_2),
        ("-1.8e-4 + q + 1.8e-4", 0.0),
        ("-3*pi/4", -1.5 * FRAC_PI_2),
        ("90", FRAC_PI_2),
    ] {
        let body = "mass,cx,cy,cz,ixx,iyy,izz\n";
        let table = format!("theta [deg],d,a,alpha,{body}{theta},0.5,1,0,1,0,0,0,1,1,1\n");
        let tip = imported(&table, Convention::Standard).unwrap().tcp.xyz_m;
        let wanted = Vector3::new(turned.cos(), turned.sin(), 0.5);
        assert!((Vector3::from(tip) - wanted).norm() < 1e-9, "{theta}: {tip:?}");
    }
}

/// A mass of the last joint's own row is the robot's, not its tool's.
#[test]
fn the_last_link_is_no_tool() {
    let table = "theta,d,a,alpha,mass,cx,cy,cz,ixx,iyy,izz\n\
                 q1,1,0,0,,,,,,,\n\
                 q2,0,1,0,40,0,0,0,1,1,1\n";
    let of = |kg: f64| {
        let masses = Masses {
            total: Some((kg, "--total-mass")),
            folder: Some(Path::new("")),
            payload_kg: 0.0,
        };
        let imported = import(table, "r", Convention::Modified, None, Base::Rigid, &masses);
        imported.map(|own| own.model.joints.iter().map(|joint| joint.mass_kg).sum::<f64>())
    };
    // A sixth is the base's.
    assert!((of(240.0).unwrap() - 200.0).abs() < 1e-6);
    let error = of(40.0).unwrap_err().message;
    assert!(error.starts_with("--total-mass 40: the links with a mass have 40.0 kg"), "{error}");
}

#[test]
fn mistakes_name_the_line_and_the_mend() {
    let head = "joint,theta,d,a,alpha\n";
    for (table, line, says) in [
        (
            format!("{head}A1,0,0.4,0.025,-90\n"),
            Some(2),
            "row of A1: alpha is -90 rad: in deg? Head the column alpha [deg]",
        ),
        (format!("{head}A1,0,400,0.025,0\n"), Some(2), "d is 400 m: in mm? Head the column d [mm]"),
        (
            format!("{head}A1,0,0,0,x\n"),
            Some(2),
            "alpha is \"x\": must be a number, as -90, pi/2 or q2-90",
        ),
        (format!("{head}A1,0,0,0,NaN\n"), Some(2), "alpha is \"NaN\": must be a number"),
        (format!("{head}A1,0,0,0\n"), Some(2), "has 4 fields, and the head 5 columns"),
        ("joint,theta,d,a,alpha\n".into(), None, "has no rows"),
        (
            "joint,theta,d,a,alpha,a_mm\n1,0,0,0,0,0\n".into(),
            Some(2),
            "column a is there twice: keep one",
        ),
        (
            "joint,theta,d,a,alpha [grad]\n".into(),
            Some(1),
            "has the unit grad: must be one of rad, deg, °",
        ),
        ("joint,theta,d,a,beta\n".into(), Some(1), "column \"beta\" is none of joint, type, theta"),
        ("joint,theta,d,a\n1,0,0,0\n".into(), None, "has no column alpha"),
        (
            "joint,theta,d,a,alpha,mass\n1,0,0,0,0,5\n".into(),
            Some(2),
            "has a mass without ixx, iyy, izz [kg m2]",
        ),
        (
            "joint,theta,d,a,alpha,mass\n1,0,0,0,0,-5\n".into(),
            Some(2),
            "mass is -5 kg: must be positive",
        ),
        ("joint,theta,d,a,alpha,lower\n1,0,0,0,0,-5\n".into(), Some(2), "has one limit"),
        (
            format!("{head}A1,q1,0,q2,0\n"),
            Some(2),
            "a is \"q2\": a joint's variable stands in theta",
        ),
        (
            format!("{head}A1,q1,d1,0,0\n"),
            Some(2),
            "d is \"d1\": a joint's variable stands in theta",
        ),
        (format!("{head}A1,pi/2-q1,0,0,0\n"), Some(2), "theta is \"pi/2-q1\": must be a number"),
        (format!("{head}A1,0,pi,0,0\n"), Some(2), "d is \"pi\": must be a number"),
        (
            "joint,type,theta,d,a,alpha\nA1,P,q1,0,0,0\n".into(),
            Some(2),
            "theta is \"q1\": a joint's variable stands in theta where type is revolute, in d",
        ),
        (
            "joint,theta,d,a,alpha,mass,ixx,iyy,izz,cx\n1,0,0,0,0,5,1,1,1,0\n".into(),
            Some(2),
            "has a mass without cx, cy, cz",
        ),
        ("joint,theta,d,a,alpha,cx\n1,0,0,0,0,0.1\n".into(), Some(2), "has cx without a mass"),
        (
            "type,d,a,alpha,lower [deg],upper [deg]\nP,0,0,0,0,1\n".into(),
            Some(2),
            "slides, and the unit of lower is not that of a length: head the column lower without",
        ),
        (
            "d,a,alpha,lower [mm],upper [mm]\n0,0,0,0,1\n".into(),
            Some(2),
            "turns, and the unit of lower is not that of an angle",
        ),
        (
            "joint,type,d,a,alpha\n1,ball,0,0,0\n".into(),
            Some(2),
            "type is \"ball\": must be revolute, prismatic or fixed",
        ),
        (format!("{head}A1,0,0.1,0,0\n"), None, "no mass on A1: add columns mass [kg]"),
        (format!("{head}A1,0,0.1,0,0\nA1,0,0.1,0,0\n"), None, "link 'A1' is defined twice"),
        (String::new(), None, "has no rows"),
        ("[[joint]]\na = 1\nalpha = 0\nd = 0\ntheta = \n".into(), Some(5), ""),
        ("[[joint]]\nb = 1\n".into(), None, "[[joint]] 1: column \"b\" is none of"),
        ("robot = 1\n[[joint]]\na = 1\n".into(), None, "unknown key `robot`"),
    ] {
        let error =
            import(&table, "r", Convention::Modified, None, Base::Rigid, &Masses::default())
                .unwrap_err();
        assert!(error.message.contains(says) && error.line == line, "{table}: {error:?}");
    }
    assert!(is_table(head) && is_table(UR_STANDARD) && is_table(UR_MODIFIED));
    assert!(!is_table(IIWA) && !is_table("name = \"a\"\n") && !is_table(""));
}
