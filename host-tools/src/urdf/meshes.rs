//! The mass of a data sheet, over links whose volumes are known by their meshes.
//!
//! One density for all is wrong: large castings are hollow, and wrists are full of gears. So each link has the geometric mean of two shares:
//! that of its volume, and that of the length of arm which it carries (`spread.rs`). The one knows the link, the other what it must bear, and
//! their errors hardly go together. Nothing here is fitted.

use flexid_core::imperfection::BASE_OVER_MOVING;
use flexid_pipeline::model::MassAccuracy;

use super::body::Body;
use super::spread::{Arm, of_length};

/// Lengths of the arm that no link is across, and by which not all links are smaller than it. A link of half the arm, in inches taken for m, is 20 across;
/// in mm it is 500.
const MOST_OVER_ARM: f64 = 20.0;
/// Range of the mean density of a robot's meshes, kg/m³: three times beyond those of the 30 robots of `accuracy`, 970 to 3360.
const DENSITY: [f64; 2] = [300.0, 10_000.0];

/// The sum of what is known and what is shared out, kg.
pub(super) struct Total<'a> {
    /// The robot by its data sheet, without its tool.
    pub(super) kg: f64,
    /// The name of it on the command line.
    pub(super) option: &'a str,
}

/// Bodies that move with a joint, or stand before the first.
#[derive(Clone, Copy, Default)]
pub(super) struct Part {
    /// Bodies with a mass in the file.
    pub(super) known: Body,
    /// Bodies without one, by their volume at a density of 1.
    pub(super) drawn: Body,
    /// Mass in the file of the links fixed beyond the first, kg.
    pub(super) beyond_kg: f64,
}

/// Mass of the tool in the file, kg: of what is fixed beyond the link of the last joint.
pub(super) fn tool(parts: &[Part]) -> f64 {
    parts.last().map_or(0.0, |part| part.beyond_kg)
}

/// The masses of the drawn bodies of the base and of each joint, kg, and the mean density of the moving ones, kg/m³.
///
/// # Errors
/// Nothing is left to share out.
pub(super) fn allot(
    base: &Part,
    parts: &[Part],
    arm: Option<&Arm>,
    total: &Total,
) -> Result<(f64, Vec<f64>), String> {
    let Total { kg, option } = total;
    let known =
        base.known.mass + parts.iter().map(|part| part.known.mass).sum::<f64>() - tool(parts);
    let left = kg - known;
    if left.is_nan() || left <= 0.0 {
        return Err(format!(
            "{option} {kg}: the links with a mass have {known:.1} kg, so that nothing is left for those with meshes: give the robot's own mass by its data \
             sheet"
        ));
    }
    let of_parts = |share: &dyn Fn(usize) -> f64| -> Vec<f64> {
        let share =
            |(index, part): (usize, &Part)| if part.drawn.mass > 0.0 { share(index) } else { 0.0 };
        parts.iter().enumerate().map(share).collect()
    };
    let volumes = of_parts(&|index| parts[index].drawn.mass);
    let carried = of_parts(&|index| arm.map_or(parts[index].drawn.mass, |arm| arm.share(index)));
    let [all, carries]: [f64; 2] = [volumes.iter().sum(), carried.iter().sum()];
    let weights: Vec<f64> =
        volumes.iter().zip(&carried).map(|(a, b)| (a * b / (all * carries)).sqrt()).collect();
    let moving: f64 = weights.iter().sum();
    let on_base = match (base.drawn.mass > 0.0, base.known.mass > 0.0) {
        (true, _) => (base.drawn.mass / all * BASE_OVER_MOVING).sqrt(),
        (false, true) => 0.0,
        // A base without a shape.
        (false, false) => BASE_OVER_MOVING * moving,
    };
    let scale = left / (moving + on_base);
    Ok((scale * on_base, weights.iter().map(|weight| scale * weight).collect()))
}

/// How far masses, inertias and centres by [`allot`] may be off, for an arm of this length, m: root mean squares over 30 robots with the inertials that
/// their maker verified (`tests/proof/mesh_masses.py`).
pub(super) fn accuracy(arm: f64) -> MassAccuracy {
    MassAccuracy { link_mass: 0.3, link_inertia: 0.4, centre_of_mass_m: of_length(0.035, arm) }
}

/// Returns whether a size in m is that of a link of an arm of this length, m.
pub(super) fn fits(size: f64, arm: f64) -> bool {
    size < MOST_OVER_ARM * arm
}

/// A doubt about the mean density of the meshes, kg/m³.
pub(super) fn doubt(density: f64) -> Option<String> {
    let [least, most] = DENSITY;
    (!(least..=most).contains(&density)).then(|| {
        format!("meshes and mass make a density of {density:.0} kg/m³ (usual: {least} to {most}): compare the scale of the meshes, and the mass, with the data sheet")
    })
}

/// A doubt about a base that has more than what moves, kg: in published robots it has a tenth to a third of the whole.
pub(super) fn doubt_of_base(on_base: f64, moving: f64, root: &str) -> Option<String> {
    (on_base > moving).then(|| {
        format!(
            "by its shapes the base gets {on_base:.0} kg, more than the {moving:.0} kg of what moves: if link '{root}' or what is fixed to it is a cell, a table \
             or a pedestal, take its <collision> and <visual> out"
        )
    })
}

#[cfg(test)]
mod tests;
