//! Robots with meshes on disk: boxes, whose bodies are known.

use std::fs;
use std::path::Path;

use flexid_pipeline::model::Model;
use tempfile::TempDir;

use super::super::{Base, Imported, Masses, UrdfError, import_with_masses};

/// The text of an STL file of the box between two corners.
fn stl(lower: [f64; 3], upper: [f64; 3]) -> String {
    let at = |own: usize| {
        [0, 1, 2].map(|axis| if own >> axis & 1 == 0 { lower[axis] } else { upper[axis] })
    };
    let sides =
        [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let vertex = |own: usize| {
        let [x, y, z] = at(own);
        format!("vertex {x} {y} {z}\n")
    };
    let facet = |corners: [usize; 3]| {
        let corners: String = corners.into_iter().map(vertex).collect();
        format!("facet normal 0 0 0\nouter loop\n{corners}endloop\nendfacet\n")
    };
    let facets: String =
        sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).map(facet).collect();
    format!("solid box\n{facets}endsolid box\n")
}

/// An arm of two links of 1 m and 0.5 m, base and links boxes; the second link's mesh is in mm.
const ROBOT: &str = r#"<robot name="r">
  <link name="base"><collision><geometry><box size="0.5 0.5 0.4"/></geometry></collision></link>
  <link name="upper"><visual><geometry><mesh filename="absent.stl"/></geometry></visual>
    <collision><origin xyz="0 0 0.5" rpy="0 0 1.5707963267948966"/><geometry><mesh filename="package://arm/meshes/upper.stl"/></geometry></collision></link>
  <link name="fore"><collision><geometry><mesh filename="meshes/fore.stl" scale="0.001 0.001 0.001"/></geometry></collision></link>
  <link name="hand"><collision><geometry><sphere radius="0.1"/></geometry></collision></link>
  <link name="tip"/>
  <joint name="a1" type="continuous"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.4"/></joint>
  <joint name="a2" type="continuous"><parent link="upper"/><child link="fore"/><origin xyz="0 0 1"/><axis xyz="0 1 0"/></joint>
  <joint name="a3" type="continuous"><parent link="fore"/><child link="hand"/><origin xyz="0.5 0 0"/><axis xyz="0 1 0"/></joint>
  <joint name="mount" type="fixed"><parent link="hand"/><child link="tip"/><origin xyz="0.1 0 0.2"/></joint>
</robot>"#;

fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let meshes = folder.path().join("arm/meshes");
    fs::create_dir_all(&meshes).unwrap();
    fs::create_dir(folder.path().join("arm/urdf")).unwrap();
    fs::write(meshes.join("upper.stl"), stl([-0.1, -0.2, -0.5], [0.1, 0.2, 0.5])).unwrap();
    fs::create_dir(folder.path().join("arm/urdf/meshes")).unwrap();
    let fore = folder.path().join("arm/urdf/meshes/fore.stl");
    fs::write(fore, stl([0.0, -50.0, -100.0], [500.0, 50.0, 100.0])).unwrap();
    folder
}

fn imported(folder: &TempDir, text: &str, kg: f64, payload_kg: f64) -> Result<Imported, UrdfError> {
    let urdf = folder.path().join("arm/urdf");
    let masses = Masses { total: Some((kg, "--total-mass")), folder: Some(&urdf), payload_kg };
    import_with_masses(text, "tip", Base::Rigid, &masses)
}

/// Corners in STL have single precision.
fn near(own: &[f64], wanted: &[f64]) {
    let off = own.iter().zip(wanted).map(|(own, wanted)| (own - wanted).abs()).fold(0.0, f64::max);
    assert!(own.len() == wanted.len() && off < 1e-5, "{own:?} {wanted:?}");
}

/// Volumes 0.1, 0.08, 0.01 and 4/3 π 0.001 m³; lengths carried 1.575, 0.575 and 0.075 m of 1.5; a fifth of what moves stands.
#[test]
fn each_link_has_the_mean_of_two_shares_and_the_body_of_its_mesh() {
    let folder = folder();
    let own = imported(&folder, ROBOT, 300.0, 0.0).unwrap();
    let joints = &own.model.joints;
    let volumes = [0.08, 0.01, 4.0 / 3.0 * std::f64::consts::PI * 0.001];
    let carried = [1.575, 0.575, 0.075];
    let shares: Vec<f64> =
        volumes.iter().zip(carried).map(|(v, c): (&f64, f64)| (v * c).sqrt()).collect();
    let base = (0.1 * 0.2 * carried.iter().sum::<f64>()).sqrt();
    let all = base + shares.iter().sum::<f64>();
    let masses: Vec<f64> = shares.iter().map(|share| 300.0 * share / all).collect();
    near(&joints.iter().map(|joint| joint.mass_kg).collect::<Vec<_>>(), &masses);
    // Turned by a quarter: its 0.2 m are along y, its 0.4 m along x.
    near(&joints[0].centre_of_mass_m, &[0.0, 0.0, 0.5]);
    let moments = [0.04 + 1.0, 0.16 + 1.0, 0.16 + 0.04].map(|own| masses[0] * own / 12.0);
    near(&joints[0].inertia_kg_m2, &[moments[0], moments[1], moments[2], 0.0, 0.0, 0.0]);
    near(&joints[1].centre_of_mass_m, &[0.25, 0.0, 0.0]);
    let moments = [0.01 + 0.04, 0.25 + 0.04, 0.25 + 0.01].map(|own| masses[1] * own / 12.0);
    near(&joints[1].inertia_kg_m2, &[moments[0], moments[1], moments[2], 0.0, 0.0, 0.0]);
    near(&joints[2].inertia_kg_m2[..3], &[0.4 * masses[2] * 0.01; 3]);

    let accuracy = own.model.accuracy.unwrap();
    assert_eq!(
        [accuracy.link_mass, accuracy.link_inertia, accuracy.centre_of_mass_m],
        [0.3, 0.4, 0.053]
    );
    let text = own.to_toml().unwrap();
    for line in [
        "# - 300 kg (--total-mass), base included, over links in proportion to",
        "# - link 'upper': upper.stl (closed), 8.000e-2 m³",
        "# - link 'hand': sphere, 4.189e-3 m³",
        "[accuracy]\nlink_mass = 0.3\n",
    ] {
        assert!(text.contains(line), "{line:?} is not in\n{text}");
    }
    assert_eq!(Model::parse(Path::new("m.toml"), &text).unwrap(), own.model);
}

/// The spindle in the file is beside the robot's own mass, and so is a payload: a cylinder up to the tip.
#[test]
fn what_has_a_mass_keeps_it() {
    let folder = folder();
    let bare = imported(&folder, ROBOT, 300.0, 0.0).unwrap().model;
    let spindle = r#"<link name="tip"><inertial><origin xyz="0 0 -0.1"/><mass value="12"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>"#;
    let model = imported(&folder, &ROBOT.replace(r#"<link name="tip"/>"#, spindle), 300.0, 8.0)
        .unwrap()
        .model;
    for joint in 0..2 {
        assert_eq!(model.joints[joint], bare.joints[joint]);
    }
    let [last, hand] = [&model, &bare].map(|model| &model.joints[2]);
    near(&[last.mass_kg], &[hand.mass_kg + 20.0]);
    let centre = [0.1, 0.0, 0.1]
        .iter()
        .zip([0.05, 0.0, 0.1])
        .map(|(spindle, own)| (12.0 * spindle + 8.0 * own) / last.mass_kg);
    near(&last.centre_of_mass_m, &centre.collect::<Vec<_>>());
    // A link in the middle keeps its own, and the others share what is left.
    let heavy = spindle.replace("tip", "fore").replace("\"12\"", "\"100\"");
    let fore = ROBOT.lines().find(|line| line.contains("name=\"fore\"")).unwrap();
    let model = imported(&folder, &ROBOT.replace(fore, &heavy), 300.0, 0.0).unwrap().model;
    assert_eq!(model.joints[1].mass_kg, 100.0);
    let all: f64 = model.joints.iter().map(|joint| joint.mass_kg).sum();
    assert!((180.0..200.0 + 100.0).contains(&all), "{all}");
}

/// The hand's own mass is the robot's, that of a spindle fixed to it is beside.
#[test]
fn what_is_fixed_beyond_the_last_link_is_the_tool() {
    let folder = folder();
    let of = |link: &str, kg: f64| {
        let line =
            ROBOT.lines().find(|line| line.contains(&format!("<link name=\"{link}\""))).unwrap();
        let body = format!(
            r#"<link name="{link}"><inertial><mass value="{kg}"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>"#
        );
        ROBOT.replace(line, &body)
    };
    let all = |text: &str, kg: f64| -> f64 {
        let joints = imported(&folder, text, kg, 0.0).unwrap().model.joints;
        joints.iter().map(|joint| joint.mass_kg).sum()
    };
    let error = imported(&folder, &of("hand", 300.0), 290.0, 0.0).unwrap_err().to_string();
    assert!(error.starts_with("--total-mass 290: the links with a mass have 300.0 kg"), "{error}");
    assert!(all(&of("tip", 300.0), 290.0) > 450.0);
}

/// A cell on the root takes what is the robot's.
#[test]
fn a_base_of_more_than_half_is_doubted() {
    let folder = folder();
    let text = ROBOT.replace("0.5 0.5 0.4", "3 3 1");
    let warnings = imported(&folder, &text, 300.0, 0.0).unwrap().warnings;
    assert!(
        warnings.iter().any(|own| own.starts_with("by its shapes the base gets ")),
        "{warnings:?}"
    );
    let warnings = imported(&folder, ROBOT, 300.0, 0.0).unwrap().warnings;
    assert!(!warnings.iter().any(|own| own.contains("the base gets")), "{warnings:?}");
}

/// A flat payload would have any inertia.
#[test]
fn a_payload_that_is_wider_than_long_is_a_ball() {
    let folder = folder();
    let text = ROBOT.replace("0.1 0 0.2", "0 0 0.001");
    let own = imported(&folder, &text, 300.0, 40.0).unwrap();
    let said = "the TCP 'tip' lies 0.001 m from joint 'a3', nearer than a payload of 40 kg is wide";
    assert!(own.warnings.iter().any(|own| own.starts_with(said)), "{:?}", own.warnings);
    // A ball of 0.01 m³ has a radius of 0.134 m.
    let bare = imported(&folder, &text, 300.0, 0.0).unwrap();
    let [with, without] = [&own, &bare].map(|own| own.model.joints[2].inertia_kg_m2[0]);
    assert!((with - without - 0.4 * 40.0 * 0.1336_f64.powi(2)).abs() < 1e-3, "{with} {without}");
}

#[test]
fn a_mesh_that_is_open_is_its_hull_with_a_warning() {
    let folder = folder();
    let whole = imported(&folder, ROBOT, 300.0, 0.0).unwrap();
    let mesh = folder.path().join("arm/meshes/upper.stl");
    let text = fs::read_to_string(&mesh).unwrap();
    let first = &text[text.find("facet").unwrap()..text.find("endfacet\n").unwrap() + 9];
    fs::write(&mesh, text.replacen(first, "", 1)).unwrap();
    let open = imported(&folder, ROBOT, 300.0, 0.0).unwrap();
    let said = "the mesh upper.stl of link 'upper' is not closed: its convex hull is taken";
    assert!(open.warnings.iter().any(|own| own == said), "{:?}", open.warnings);
    assert!(!whole.warnings.iter().any(|own| own.contains("closed")), "{:?}", whole.warnings);
    let off = open.model.joints[0].mass_kg / whole.model.joints[0].mass_kg - 1.0;
    assert!(off.abs() < 1e-4, "{off}");
}

#[test]
fn mistakes_have_their_mend() {
    let folder = folder();
    let flat = stl([0.0; 3], [1.0, 1.0, 0.0]);
    fs::write(folder.path().join("arm/urdf/meshes/flat.stl"), flat).unwrap();
    let whole = stl([0.0; 3], [1.0; 3]);
    fs::write(folder.path().join("arm/urdf/meshes/cut.stl"), &whole[..whole.len() / 2]).unwrap();
    let replaced = |from: &str, to: &str| {
        assert!(ROBOT.contains(from), "{from}");
        ROBOT.replace(from, to)
    };
    for (text, kg, says) in [
        (ROBOT.to_owned(), 0.0, "--total-mass 0: must be positive"),
        (ROBOT.to_owned(), f64::NAN, "--total-mass NaN: must be positive"),
        (
            replaced("package://arm/", "package://leg/"),
            300.0,
            "link 'upper': no mesh \"package://leg/meshes/upper.stl\": no folder leg with meshes/upper.stl is in ",
        ),
        (replaced("meshes/fore.stl", "fore.stl"), 300.0, "link 'fore': no mesh \"fore.stl\": "),
        (
            replaced(" scale=\"0.001 0.001 0.001\"", ""),
            300.0,
            "the largest shape, of link 'fore', is 547.723 m across, and the arm 1.50 m long: put the right scale",
        ),
        (
            replaced("0.001 0.001 0.001", "0.001 0.001"),
            300.0,
            "<mesh> has scale=\"0.001 0.001\": must be 3 numbers",
        ),
        (
            replaced("meshes/fore.stl", "meshes/flat.stl"),
            300.0,
            "flat.stl: is flat, without a volume",
        ),
        (
            replaced("<sphere radius=\"0.1\"/>", "<capsule radius=\"0.1\" length=\"1\"/>"),
            300.0,
            "<geometry> has <capsule>: must be <mesh>, <box>, <cylinder> or <sphere>; or give the link an <inertial>",
        ),
        (replaced("meshes/fore.stl", "meshes/cut.stl"), 300.0, "cut.stl: is no STL file: "),
        (replaced("meshes/fore.stl", "meshes"), 300.0, "link 'fore': no mesh \"meshes\": "),
        (
            replaced("radius=\"0.1\"", "radius=\"-0.1\""),
            300.0,
            "link 'hand' has a box, cylinder or sphere whose sizes are not all positive",
        ),
        (
            replaced("<collision><geometry><sphere radius=\"0.1\"/></geometry></collision>", ""),
            300.0,
            "no mass on link 'hand' (moved by 'a3'), and no <collision> or <visual> from whose volume it follows",
        ),
    ] {
        let error = imported(&folder, &text, kg, 0.0).unwrap_err().to_string();
        assert!(error.contains(says) && !error.contains('\n'), "{says:?} is not in {error}");
    }
    let error = imported(&folder, ROBOT, 300.0, -1.0).unwrap_err().to_string();
    assert!(error.starts_with("--payload -1: must be no less than 0"), "{error}");
    let doubtful = imported(&folder, ROBOT, 3.0, 0.0).unwrap().warnings;
    assert!(doubtful.iter().any(|own| own.contains("make a density of ")), "{doubtful:?}");
    // Without --total-mass nobody looks at a mesh.
    let error = super::super::import(ROBOT, "tip", Base::Rigid).unwrap_err();
    assert!(matches!(error, UrdfError::NoMass(_)));
}
