//! Functions to receptances, with a variance for each bin.
//!
//! The magnitude of a response H that n averages have estimated, with the coherence γ², has the relative standard deviation ε, as have its parts
//! (Bendat and Piersol, _Random Data_, 4th edition, 2010, section 9.1):
//!
//! ```text
//! ε² = (1 − γ²)/(2 n γ²)        E |ΔH|² = 2 (ε² + ε_r²) |H|² + 2 ε_a²
//! ```
//!
//! with the floors ε_r and ε_a that are stated. A bin without coherence has no weight.

use std::f64::consts::TAU;
use std::path::Path;

use flexid_core::spectrum::MeasuredBin;
use nalgebra::Complex;

use super::function::{Dof, Function, Grid, Kind};
use super::measured::Receptance;
use super::settings::Settings;
use super::unit::{Motion, Unit};
use crate::input::BadInput;
use crate::poses::Cut;

const AXES: [&str; 3] = ["X", "Y", "Z"];
/// Coherence that rounding leaves above 1.
const ROUNDING: f64 = 1e-6;

/// A function along axes of the TCP: axis and sign of the response, node, axis and sign of the force.
struct Placed<'a> {
    function: &'a Function,
    response: (usize, f64),
    node: i64,
    force: (usize, f64),
}

/// The receptances of a file at a pose: one for each node and direction of the force.
pub(super) fn assemble(
    file: &Path,
    functions: Vec<Function>,
    cut: &Cut,
    settings: &Settings,
    band_hz: [f64; 2],
) -> Result<Vec<Receptance>, BadInput> {
    let all = || -> Result<Vec<Receptance>, String> {
        let placed = place(&functions, cut, settings)?;
        let responses = || placed.iter().filter(|own| own.function.kind != Kind::Coherence);
        let mut forces: Vec<(i64, usize)> =
            responses().map(|own| (own.node, own.force.0)).collect();
        forces.sort_unstable();
        forces.dedup();
        let nodes: Vec<i64> = {
            let mut nodes: Vec<i64> = forces.iter().map(|(node, _)| *node).collect();
            nodes.dedup();
            nodes
        };
        let mut receptances = Vec::new();
        for (node, axis) in forces {
            let own = |other: &&Placed<'_>| (other.node, other.force.0) == (node, axis);
            let point = match settings.points.get(&node) {
                Some(point) => *point,
                None if nodes.len() == 1 => cut.point,
                None => {
                    return Err(format!(
                        "has forces at the nodes {}: state where each lies from the TCP, in m: [receptance.points_m] {node} = [0.0, 0.0, 0.0]",
                        listed(&nodes)
                    ));
                }
            };
            receptances.push(receptance(file, &placed, own, cut, point, axis, settings, band_hz)?);
        }
        Ok(receptances)
    };
    all().map_err(|message| BadInput::new(file, message))
}

/// Puts the functions along the axes of the TCP, at the node of the accelerometer.
fn place<'a>(
    functions: &'a [Function],
    cut: &Cut,
    settings: &Settings,
) -> Result<Vec<Placed<'a>>, String> {
    let mut nodes: Vec<i64> = functions
        .iter()
        .filter(|own| own.kind != Kind::Coherence)
        .map(|own| own.response.node)
        .collect();
    nodes.sort_unstable();
    nodes.dedup();
    let node = match (settings.response_node, nodes.as_slice()) {
        (Some(node), nodes) if nodes.contains(&node) => node,
        (None, [node]) => *node,
        (Some(node), nodes) => {
            return Err(format!(
                "has no response of node {node}, but of {}: correct [receptance] response_node",
                listed(nodes)
            ));
        }
        (None, nodes) => {
            return Err(format!(
                "has responses of the nodes {}: name the one where [mounting] has the accelerometer in [receptance] response_node",
                listed(nodes)
            ));
        }
    };
    let along = |own: &Dof, stated: usize, function: &Function, what: &str| {
        let direction = own.direction.or(cut.directions[stated]).ok_or_else(|| {
            format!(
                "{} does not say the direction of the {what}: write it into the list's column {} (x, -z)",
                function.place,
                ["force", "acceleration"][stated]
            )
        })?;
        let (axis, sign) = settings.axes[direction.axis];
        Ok::<_, String>((axis, sign * f64::from(direction.sign)))
    };
    let at_node = functions.iter().filter(|own| own.response.node == node);
    let placed = at_node.map(|function| {
        Ok(Placed {
            function,
            response: along(&function.response, 1, function, "response")?,
            node: function.reference.node,
            force: along(&function.reference, 0, function, "force")?,
        })
    });
    placed.collect()
}

fn listed(nodes: &[i64]) -> String {
    let names: Vec<String> = nodes.iter().map(i64::to_string).collect();
    names.join(", ")
}

/// The receptance of one force.
#[expect(clippy::too_many_arguments, reason = "all of one file")]
fn receptance<'a>(
    file: &Path,
    placed: &[Placed<'a>],
    own: impl Fn(&&Placed<'a>) -> bool,
    cut: &Cut,
    point: [f64; 3],
    force_axis: usize,
    settings: &Settings,
    band_hz: [f64; 2],
) -> Result<Receptance, String> {
    let mut axes: [Vec<MeasuredBin>; 3] = Default::default();
    let mut grid: Option<(Grid, &str)> = None;
    let of_force = || placed.iter().filter(&own);
    for response in of_force().filter(|own| own.function.kind != Kind::Coherence) {
        let function = response.function;
        let axis = response.response.0;
        let bins = function.values.len();
        if !axes[axis].is_empty() {
            return Err(format!(
                "{} is the second response along {} for a force along {}: keep one of them",
                function.place, AXES[axis], AXES[force_axis]
            ));
        }
        match grid {
            Some((grid, first)) if !grid.is_same(&function.grid, bins) => {
                return Err(format!(
                    "{} has other frequencies than {first}: export both over the same ones",
                    function.place
                ));
            }
            _ => grid = grid.or(Some((function.grid, &function.place))),
        }
        let is_own = |other: &&Placed<'_>| {
            other.function.kind == Kind::Coherence && other.response.0 == axis
        };
        let coherence = of_force().find(is_own).map(|own| own.function);
        axes[axis] = bins_of(response, coherence, settings, band_hz)?;
    }
    let (grid, first) = grid.ok_or("has no response")?;
    let length = axes.iter().map(Vec::len).max().unwrap_or_default();
    if axes.iter().any(|axis| !axis.is_empty() && axis.len() != length) {
        return Err(format!(
            "{first} has another number of frequencies than others: export all over the same ones"
        ));
    }
    let [lowest, highest] = [grid.hz(0), grid.hz(length - 1)];
    let [lower, upper] = band_hz;
    if lowest > upper || highest < lower {
        return Err(format!(
            "has frequencies from {lowest} to {highest} Hz, and none in [measurement] band_hz, {lower} to {upper} Hz: correct one of them"
        ));
    }
    Ok(Receptance {
        file: file.to_owned(),
        pose: cut.pose.clone(),
        point,
        force_axis,
        spacing_hz: grid.spacing_hz,
        first_hz: grid.first_hz,
        decay: settings.decay,
        axes,
    })
}

/// The bins of a response.
fn bins_of(
    response: &Placed<'_>,
    coherence: Option<&Function>,
    settings: &Settings,
    band_hz: [f64; 2],
) -> Result<Vec<MeasuredBin>, String> {
    let function = response.function;
    let place = &function.place;
    let Settings { averages, relative_floor, absolute_floor, decay, unit, .. } = settings;
    let Kind::Response(stated) = &function.kind else { return Ok(Vec::new()) };
    let unit: Unit = match (unit, stated) {
        (Some(unit), _) | (None, Ok(unit)) => *unit,
        (None, Err(reason)) => {
            return Err(format!(
                "{place} {reason}: state [receptance] unit, such as {}",
                Unit::EXAMPLES
            ));
        }
    };
    let has_floor = *relative_floor > 0.0 || *absolute_floor > 0.0;
    if let Some(other) = coherence
        && (!other.grid.is_same(&function.grid, function.values.len())
            || other.values.len() != function.values.len())
    {
        return Err(format!(
            "{} has other frequencies than {place}: export both over the same ones",
            other.place
        ));
    }
    let coherence = match (coherence, averages) {
        (Some(coherence), Some(averages)) => Some((coherence, *averages)),
        (Some(coherence), None) if !has_floor => {
            return Err(format!(
                "{} says how certain {place} is if the number of averages is known: state [receptance] averages, or relative_floor",
                coherence.place
            ));
        }
        (None, _) if !has_floor => {
            return Err(format!(
                "{place} has no coherence (function type 6, or a column coherence): export it, or state [receptance] relative_floor, such as 0.02"
            ));
        }
        _ => None,
    };
    let in_band = |index: usize| (band_hz[0]..=band_hz[1]).contains(&function.grid.hz(index));
    if let Some((coherence, _)) = coherence {
        let own = || (0..coherence.values.len()).filter(|index| in_band(*index));
        if own().count() > 0 && own().all(|index| coherence.values[index][0] == 0.0) {
            return Err(format!(
                "{} is 0 at all frequencies of band_hz: it was not computed; export it again, or leave [receptance] averages out and state relative_floor",
                coherence.place
            ));
        }
    }
    let sign = response.response.1 * response.force.1;
    let of_motion = match unit.motion {
        Motion::Displacement => 2,
        Motion::Velocity => 1,
        Motion::Acceleration => 0,
    };
    let mut bins = Vec::with_capacity(function.values.len());
    for (index, [re, im]) in function.values.iter().enumerate() {
        let s = Complex::new(*decay, TAU * function.grid.hz(index));
        let own = Complex::new(*re, *im) * (sign * unit.size) * s.powu(of_motion);
        let mut relative = relative_floor * relative_floor;
        let mut is_known = own.re.is_finite() && own.im.is_finite();
        if let Some((coherence, averages)) = coherence {
            let square = coherence.values[index][0];
            if !(square.is_nan() || (0.0..=1.0 + ROUNDING).contains(&square)) {
                return Err(format!(
                    "{} is {square} at {} Hz: a coherence lies between 0 and 1; correct it",
                    coherence.place,
                    function.grid.hz(index)
                ));
            }
            is_known &= square > 0.0;
            let square = square.min(1.0);
            relative += (1.0 - square) / (2.0 * averages * square);
        }
        let variance = 2.0 * (relative * own.norm_sqr() + absolute_floor * absolute_floor);
        if is_known && variance <= 0.0 && own.norm_sqr() > 0.0 && in_band(index) {
            return Err(format!(
                "{place} has a coherence of 1 at {} Hz, as if it had no error: state [receptance] relative_floor as well, such as 0.01",
                function.grid.hz(index)
            ));
        }
        let is_known = is_known && variance > 0.0;
        bins.push(MeasuredBin {
            accelerance: if is_known { [own.re, own.im] } else { [0.0; 2] },
            variance: if is_known { variance } else { f64::INFINITY },
        });
    }
    // A bin without weight has the value of the one before it: it stands in sums that do not weigh.
    let known = bins.iter().find(|bin| bin.variance.is_finite());
    let mut last = known.map_or([0.0; 2], |bin| bin.accelerance);
    for bin in &mut bins {
        if bin.variance.is_finite() {
            last = bin.accelerance;
        }
        bin.accelerance = last;
    }
    if !(0..bins.len()).any(|index| in_band(index) && bins[index].variance.is_finite())
        && (0..bins.len()).any(in_band)
    {
        return Err(format!("{place} has no value in band_hz: export it again"));
    }
    Ok(bins)
}

#[cfg(test)]
mod tests;
