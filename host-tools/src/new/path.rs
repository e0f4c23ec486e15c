//! A path of the tool under its forces, for `flexid compensate`.

use super::angles;
use flexid_pipeline::model::Model;

/// Number of places on the path.
const PLACES: usize = 5;
/// Part of the way to the next pose that the path goes.
const PART: f64 = 0.2;

/// Places from the first of `poses` towards the second, under the mean forces of a cut whose teeth press with `force`, N.
pub(super) fn text(model: &Model, poses: &[Vec<f64>], force: f64) -> String {
    let mut text = format!(
        "# Places along a path: joint angles, rad (m), and the force on the tool along the axes of the TCP, N. For `flexid compensate`.\n{},fx,fy,fz\n",
        angles(model).collect::<Vec<_>>().join(",")
    );
    let [from, to, ..] = poses else { return text };
    for place in 0..PLACES {
        let part = PART * place as f64 / (PLACES - 1) as f64;
        let angle = |(from, to): (&f64, &f64)| format!("{:.3}", from + part * (to - from));
        let pose: Vec<String> = from.iter().zip(to).map(angle).collect();
        // Radial and axial part as in the scenario.
        text +=
            &format!("{},{:.1},{:.1},{:.1}\n", pose.join(","), 0.4 * force, -force, 0.3 * force);
    }
    text
}
