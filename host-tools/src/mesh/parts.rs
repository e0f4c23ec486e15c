//! The parts of a closed mesh: shells, some of which hold hollows, and some of which are drawn inside out.

use std::collections::HashMap;
use std::f64::consts::PI;

use super::hull::extent;
use super::weld::cells;
use super::{Point, Triangle};

/// Largest number of points of a part that tell whether it lies within another. More than half of them decide: where one in five is on the wrong side, as
/// those on a face where both touch may be, they are wrong once in 140 (binomial).
const MOST_PROBES: usize = 16;
/// Largest number of solid angles that are computed for a mesh: some seconds.
const MOST_ANGLES: usize = 100_000_000;

/// A closed surface whose corners hang together.
struct Part {
    triangles: Vec<Triangle>,
    /// Volume within it, negative if it looks inwards, m³.
    volume: f64,
    lower: Point,
    upper: Point,
}

impl Part {
    fn new(triangles: Vec<Triangle>) -> Self {
        let (lower, upper) = extent(triangles.iter().flatten());
        let middle = 0.5 * (lower + upper);
        let tetrahedron = |corners: &Triangle| {
            let [a, b, c] = corners.map(|corner| corner - middle);
            a.dot(&b.cross(&c)) / 6.0
        };
        let volume = triangles.iter().map(tetrahedron).sum();
        Self { triangles, volume, lower, upper }
    }

    /// Points that tell where the part lies: middles of triangles.
    fn probes(&self) -> impl Iterator<Item = Point> {
        let step = self.triangles.len().div_ceil(MOST_PROBES).max(1);
        self.triangles.iter().step_by(step).map(|[a, b, c]| (a + b + c) / 3.0)
    }

    /// Returns whether the box around both is one around this part.
    fn may_hold(&self, other: &Self) -> bool {
        let least = self.lower.inf(&other.lower) == self.lower;
        least && self.upper.sup(&other.upper) == self.upper
    }

    /// Returns whether most of the `other` lies within this part: the solid angle of a surface is 4π from within, and 0 from outside
    /// (Van Oosterom, Strackee 1983).
    fn holds(&self, other: &Self) -> bool {
        let angle = |from: Point| -> f64 {
            let of = |corners: &Triangle| {
                let [a, b, c] = corners.map(|corner| corner - from);
                let [u, v, w] = [a, b, c].map(|own| own.norm());
                let across = u * v * w + a.dot(&b) * w + b.dot(&c) * u + c.dot(&a) * v;
                2.0 * a.dot(&b.cross(&c)).atan2(across)
            };
            self.triangles.iter().map(of).sum()
        };
        let all: f64 = other.probes().map(|probe| angle(probe).abs()).sum();
        all > 2.0 * PI * other.probes().count() as f64
    }
}

/// The triangles, where each part that lies within no other looks outwards. A part that looks against the largest is a hollow only within
/// another. `None` if the parts are too many to tell.
pub(super) fn outwards(triangles: &[Triangle]) -> Option<Vec<Triangle>> {
    let parts = parts(triangles);
    let largest = parts.iter().map(|part| part.volume).max_by(|a, b| a.abs().total_cmp(&b.abs()));
    let sign = largest.unwrap_or_default().signum();
    let (solid, against): (Vec<&Part>, Vec<&Part>) =
        parts.iter().partition(|part| part.volume * sign >= 0.0);
    let mut angles = 0;
    let mut all: Vec<Triangle> = solid.iter().flat_map(|part| part.triangles.clone()).collect();
    for part in against {
        let around = || solid.iter().filter(|other| other.may_hold(part));
        angles += around().map(|other| other.triangles.len()).sum::<usize>() * MOST_PROBES;
        if angles > MOST_ANGLES {
            return None;
        }
        if around().any(|other| other.holds(part)) {
            all.extend(&part.triangles);
        } else {
            all.extend(part.triangles.iter().map(|[a, b, c]| [*a, *c, *b]));
        }
    }
    Some(all)
}

/// The parts of triangles that hang together by their corners.
fn parts(triangles: &[Triangle]) -> Vec<Part> {
    let cell = cells(triangles);
    let mut around: HashMap<[i64; 3], Vec<usize>> = HashMap::new();
    for (index, corner) in
        triangles.iter().enumerate().flat_map(|(index, own)| own.map(|own| (index, own)))
    {
        around.entry(cell(&corner)).or_default().push(index);
    }
    let mut is_taken = vec![false; triangles.len()];
    let mut parts = Vec::new();
    for first in 0..triangles.len() {
        let (mut own, mut open) = (Vec::new(), vec![first]);
        while let Some(index) = open.pop() {
            if !std::mem::replace(&mut is_taken[index], true) {
                own.push(triangles[index]);
                open.extend(
                    triangles[index]
                        .iter()
                        .filter_map(|corner| around.remove(&cell(corner)))
                        .flatten(),
                );
            }
        }
        if !own.is_empty() {
            parts.push(Part::new(own));
        }
    }
    parts
}
