//! Paths along which the robot fed: how modes, stiffness and receptance of the tool change on the way.

use flexid_pipeline::goes_on;
use maud::{Markup, html};
use nalgebra::Vector3;
use rayon::prelude::*;

use super::format::{count, number, pose};
use super::{AXES, Pose};
use crate::charts::panel::{Band, Curve, Labels, Panel};
use crate::charts::scale::Scale;
use crate::charts::{Colour, Drawn, Mark, legend, svg};
use crate::document::Document;
use crate::evidence::RecordEvidence;

/// Most paths that are drawn. Chosen: as many as poses.
const MOST_PATHS: usize = super::MOST_POSES;
/// Places along a path at which the robot is looked at. Chosen: modes change by about their size per radian, so that lines join these places.
const PLACES: usize = 9;
/// Lowest modes that are drawn. Chosen: more would cover each other.
const MOST_MODES: usize = 4;
/// Frequencies of a receptance.
const POINTS: usize = 120;
/// Heights of the rows of panels, pixels.
const HEIGHTS: [u32; 2] = [560, 520];
/// Width of what stands left of a panel with a description, pixels.
const LEFT: u32 = 194;

/// Records that follow each other in place.
struct Path<'a> {
    records: Vec<&'a RecordEvidence>,
    /// Joint angles of all parts, rad (m), and the way of the tool to each, m.
    parts: Vec<(&'a [f64], f64)>,
}

impl<'a> Path<'a> {
    fn new(document: &Document, records: &[&'a RecordEvidence]) -> Self {
        let chain = document.found.robot.chain();
        let (mut way_m, mut last) = (0.0, None::<Vector3<f64>>);
        let place = |angles: &'a Vec<f64>| {
            let tool = chain.tool(angles).translation.vector;
            way_m += last.map_or(0.0, |last| (tool - last).norm());
            last = Some(tool);
            (angles.as_slice(), way_m)
        };
        let parts = records.iter().flat_map(|record| &record.path).map(place).collect();
        Self { records: records.to_vec(), parts }
    }

    /// The robot at places along the path, with the way of the tool to each, mm.
    fn places<'d>(&self, document: &'d Document) -> Vec<(f64, Pose<'d>)> {
        let last = self.parts.len().saturating_sub(1);
        let most = PLACES.min(self.parts.len());
        let indices: Vec<usize> = (0..most).map(|own| own * last / (most - 1).max(1)).collect();
        let at = |index: usize| {
            let (angles, way_m) = self.parts[index];
            (1e3 * way_m, Pose::new(document, angles.to_vec()))
        };
        indices.into_par_iter().map(at).collect()
    }
}

pub(super) fn section(document: &Document) -> Markup {
    let records: Vec<&RecordEvidence> = document.further.records.iter().flatten().collect();
    let along: Vec<&RecordEvidence> =
        records.into_iter().filter(|record| !record.path.is_empty()).collect();
    let is_same = |one: &&RecordEvidence, other: &&RecordEvidence| {
        one.path.last().zip(other.path.first()).is_some_and(|(end, begin)| goes_on(end, begin))
    };
    let paths: Vec<Path<'_>> =
        along.chunk_by(is_same).map(|records| Path::new(document, records)).collect();
    if paths.is_empty() {
        return Markup::default();
    }
    html! {
        section #path {
            h2 { "Along the path" }
            p {
                "The robot fed while it cut. Each record is divided into parts, each with a pose of its own. These are the lowest modes, and the \
                 static stiffness of the tool along each of its axes, on the way of the tool, with 95\u{a0}% bands; below them the receptance at the start, in the middle and at \
                 the end of the path."
            }
            @for (index, path) in paths.iter().take(MOST_PATHS).enumerate() {
                (figure(document, index, path))
            }
            @if paths.len() > MOST_PATHS {
                p { (count(paths.len() - MOST_PATHS, "further path")) " not drawn." }
            }
        }
    }
}

fn figure(document: &Document, index: usize, path: &Path<'_>) -> Markup {
    let places = path.places(document);
    let numbers: Vec<String> = [path.records.first(), path.records.last()]
        .iter()
        .flatten()
        .map(|own| own.number.to_string())
        .collect();
    let records = match path.records.len() {
        1 => format!("record {}", numbers[0]),
        _ => format!("records {}", numbers.join(" to ")),
    };
    let length = path.parts.last().map_or(0.0, |(_, way_m)| 1e3 * way_m);
    let title = format!(
        "Path {}: {records}, {}, {} mm",
        index + 1,
        count(path.parts.len(), "part"),
        number(length)
    );
    let ends = [path.parts.first(), path.parts.last()]
        .map(|own| own.map_or_else(String::new, |(angles, _)| pose(angles)));
    html! {
        figure {
            figcaption { strong { (title) } ", from " (ends[0]) " to " (ends[1]) " rad (m)" }
            (chart(document, &places, length, &title))
            (legend(&[
                ("x, or at the start", Colour::Blue, Mark::Line),
                ("y, or in the middle", Colour::Orange, Mark::Line),
                ("z, or at the end", Colour::Green, Mark::Line),
            ]))
        }
    }
}

/// Colours of the axes of the tool, and of start, middle and end.
const COLOURS: [Colour; 3] = [Colour::Blue, Colour::Orange, Colour::Green];

fn chart(document: &Document, places: &[(f64, Pose<'_>)], length: f64, title: &str) -> Markup {
    let way = Scale::round([0.0, length.max(1.0)]);
    let receptances = receptances(document, places);
    let [high, low] = HEIGHTS;
    let label = format!("Modes, stiffness and receptance: {title}");
    svg(high + low, &label, |canvas| {
        let (width, _) = canvas.dim_in_pixel();
        let half = width / 2;
        let area = |left: u32, top: u32, width: u32, height: u32| {
            canvas.clone().shrink((left as i32, top as i32), (width, height))
        };
        modes(places, &way).draw(&area(0, 0, half, high))?;
        stiffness(places, &way).draw(&area(half, 0, half, high))?;
        let column = (width - LEFT) / 3;
        let y = Scale::decades(receptances.iter().flatten().flat_map(|(_, own)| *own));
        let x = Scale::logarithmic(document.found.robot.band_hz());
        for axis in 0..3 {
            let (left, wide) = match axis {
                0 => (0, LEFT + column),
                _ => (LEFT + axis as u32 * column, column),
            };
            let curve = |(colour, own): (Colour, &Vec<(f64, [f64; 3])>)| Curve {
                colour,
                width: 4,
                points: own.iter().map(|(hz, sizes)| (*hz, Some(sizes[axis]))).collect(),
            };
            let panel = Panel {
                x: x.clone(),
                y: y.clone(),
                title: format!("{0} per force {0}", AXES[axis]),
                labels: Labels {
                    x: Some("frequency / Hz".to_owned()),
                    y: (axis == 0).then(|| "m/N".to_owned()),
                },
                bands: Vec::new(),
                curves: COLOURS.into_iter().zip(&receptances).map(curve).collect(),
            };
            panel.draw(&area(left, high, wide, low))?;
        }
        Drawn::Ok(())
    })
}

/// Sizes of the receptance along each axis of the tool, m/N, by frequency, Hz, at the start, in the middle and at the end.
fn receptances(document: &Document, places: &[(f64, Pose<'_>)]) -> Vec<Vec<(f64, [f64; 3])>> {
    let [lower, upper] = document.found.robot.band_hz();
    let last = places.len().saturating_sub(1);
    let of = |index: usize| {
        let frequency =
            |point: usize| lower * (upper / lower).powf(point as f64 / (POINTS - 1) as f64);
        let at = |point: usize| {
            let own = places[index].1.dynamics.as_ref()?.receptance(frequency(point))?;
            Some((own.frequency_hz, [0, 1, 2].map(|axis| own.magnitude[axis][axis].value)))
        };
        (0..POINTS).into_par_iter().filter_map(at).collect()
    };
    [0, last / 2, last].map(of).into()
}

/// The lowest natural frequencies on the way.
fn modes(places: &[(f64, Pose<'_>)], way: &Scale) -> Panel {
    let mode = |mode: usize| {
        places
            .iter()
            .filter_map(move |(way, pose)| Some((*way, &pose.modes.get(mode)?.frequency_hz)))
    };
    let band = |own| Band {
        colour: Colour::Grey,
        points: mode(own).map(|(way, hz)| (way, hz.interval)).collect(),
    };
    let curve = |own| Curve {
        colour: Colour::Blue,
        width: 4,
        points: mode(own).map(|(way, hz)| (way, Some(hz.value))).collect(),
    };
    Panel {
        x: way.clone(),
        y: Scale::around((0..MOST_MODES).flat_map(mode).map(|(_, hz)| hz.value)),
        title: "lowest modes".to_owned(),
        labels: Labels { x: Some("way of the tool / mm".into()), y: Some("Hz".into()) },
        bands: (0..MOST_MODES).map(band).collect(),
        curves: (0..MOST_MODES).map(curve).collect(),
    }
}

/// The static stiffness of the tool along each of its axes on the way, N/µm.
fn stiffness(places: &[(f64, Pose<'_>)], way: &Scale) -> Panel {
    let compliance = |pose: &Pose<'_>| {
        let dynamics = pose.dynamics.as_ref()?;
        let own = dynamics.compliance_estimates(&dynamics.compliance()?);
        Some([0, 1, 2].map(|axis| own[axis][axis]))
    };
    let all: Vec<_> =
        places.iter().filter_map(|(way, pose)| Some((*way, compliance(pose)?))).collect();
    let inverse = |compliance: f64| 1e-6 / compliance;
    let band = |axis: usize| {
        let known =
            all.iter().filter(move |(_, own)| own[axis].determined && own[axis].interval[0] > 0.0);
        let ends = |(way, own): &(f64, [_; 3])| {
            let own: &flexid_prediction::Estimate = &own[axis];
            (*way, [inverse(own.interval[1]), inverse(own.interval[0])])
        };
        Band { colour: COLOURS[axis], points: known.map(ends).collect() }
    };
    let curve = |axis: usize| Curve {
        colour: COLOURS[axis],
        width: 4,
        points: all
            .iter()
            .map(|(way, own)| (*way, own[axis].determined.then(|| inverse(own[axis].value))))
            .collect(),
    };
    let values = all.iter().flat_map(|(_, own)| own.iter().map(|own| inverse(own.value)));
    Panel {
        x: way.clone(),
        y: Scale::around(values.collect::<Vec<_>>().into_iter()),
        title: "stiffness along each axis".to_owned(),
        labels: Labels { x: Some("way of the tool / mm".into()), y: Some("N/µm".into()) },
        bands: (0..3).map(band).collect(),
        curves: (0..3).map(curve).collect(),
    }
}
