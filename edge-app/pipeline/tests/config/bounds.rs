//! Bounds that are stated, and those that follow from the masses.

use super::{EDGE, MODEL, load};

/// Without bounds a bushing with all that it carries swings at 2 to 2000 Hz; narrower statements come after wider ones.
#[test]
fn bounds_follow_from_the_masses_unless_they_are_stated() {
    let (before, after) = EDGE.split_once("[bounds]").unwrap();
    let (bounds, _) = after.split_once("[bus]").unwrap();
    let whole = format!("[bounds]{bounds}");
    assert!(before.contains("[model]"));
    let with = |bounds: &str| load("edge.toml", &whole, bounds).map(|config| config.bounds);

    let default = with("").unwrap();
    let carried: f64 =
        MODEL.lines().filter_map(|line| line.strip_prefix("mass_kg = ")?.parse::<f64>().ok()).sum();
    let omega = std::f64::consts::TAU * 2.0;
    for (end, factor) in [(0, 1.0), (1, 1e6)] {
        let expected = carried * omega * omega * factor;
        assert!((default.joints[0].stiffness[1][end] / expected - 1.0).abs() < 1e-9);
    }
    assert!(default.joints[2].stiffness[0][0] < default.joints[0].stiffness[0][0]);

    let bounds = with(
        "[bounds]\nstiffness_rotation_nm_per_rad = [1e5, 1e8]\n\
         [bounds.joints.joint_2]\nstiffness_rotation_nm_per_rad = [2e5, 2e8]\n\
         [bounds.parameters]\n\"joint_2.stiffness.rz\" = [3e5, 3e8]\n\"joint_3.damping.tx\" = [4.0, 5.0]\n",
    )
    .unwrap();
    assert_eq!(bounds.joints[0].stiffness[3..], [[1e5, 1e8]; 3]);
    assert_eq!(bounds.joints[1].stiffness[3..], [[2e5, 2e8], [2e5, 2e8], [3e5, 3e8]]);
    assert_eq!(bounds.joints[2].damping[0], [4.0, 5.0]);
    assert_eq!(bounds.joints[1].stiffness[..3], default.joints[1].stiffness[..3]);

    for (wrong, said) in [
        (
            "[bounds.joints.joint_9]\n",
            "edge.toml: [bounds.joints]: the model has no joint \"joint_9\", it has joint_1, joint_2, joint_3",
        ),
        (
            "[bounds.joints.joint_1]\ndamping_rotation_nms_per_rad = [2.0, 1.0]\n",
            "edge.toml: [bounds.joints.joint_1] damping_rotation_nms_per_rad is [2e0, 1e0]: must be 1e-3 <= lower < upper <= 1e12",
        ),
        (
            "[bounds.parameters]\n\"joint_1.stiffness.xx\" = [1.0, 2.0]\n",
            "edge.toml: [bounds.parameters] has \"joint_1.stiffness.xx\": \"xx\" is no degree of freedom: one of tx, ty, tz, rx, ry, rz",
        ),
        (
            "[bounds.parameters]\n\"joint_1.stiffness.tx\" = [1.0, 1.0]\n",
            "edge.toml: [bounds.parameters] \"joint_1.stiffness.tx\" is [1e0, 1e0]: must be 1e-3 <= lower < upper <= 1e12",
        ),
    ] {
        assert_eq!(with(wrong).unwrap_err(), said);
    }
}
