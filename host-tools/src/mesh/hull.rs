//! The convex hull of points (quickhull: Barber, Dobkin, Huhdanpaa 1996).
//!
//! Points are moved by a millionth of their extent before (a joggle), so that no four lie in a plane, and no case is special.

use std::collections::HashSet;

use super::{Point, Triangle};

/// Part of the extent by which points are moved. Seventeen times the rounding of single precision, 2^-24, in a mesh, and nothing of its
/// volume.
const JOGGLE: f64 = 1e-6;
/// Largest number of faces, at which the hull is taken as it is: one so fine misses half a per cent of a ball.
const MOST_FACES: usize = 8_000;

/// A face of the hull, counter-clockwise as seen from outside.
struct Face {
    corners: [usize; 3],
    normal: Point,
    offset: f64,
    /// The points outside of it that are outside of no face before.
    outside: Vec<usize>,
}

/// The convex hull of points.
pub(super) struct Hull {
    pub(super) triangles: Vec<Triangle>,
    /// False if points are left outside, as the hull has too many faces.
    pub(super) is_complete: bool,
}

/// The convex hull of points, or `None` if they lie in one plane.
pub(super) fn hull(points: &[Point]) -> Option<Hull> {
    let points = joggled(points);
    let point = |index: usize| points[index];
    let first = tetrahedron(&points)?;
    let mut faces: Vec<Face> = first.map(|corners| Face::new(corners, &points)).into();
    assign(&mut faces, 0, 0..points.len(), &points);
    while let Some(next) = faces.iter().position(|face| !face.outside.is_empty()) {
        if faces.len() > MOST_FACES {
            break;
        }
        let height = |own: &usize| faces[next].height(&points[*own]);
        let farthest =
            faces[next].outside.iter().copied().max_by(|a, b| height(a).total_cmp(&height(b)));
        let Some(apex) = farthest else { break };
        let (seen, hidden): (Vec<Face>, Vec<Face>) =
            faces.into_iter().partition(|face| face.height(&point(apex)) > 0.0);
        faces = hidden;
        let edges = |face: &Face| {
            let [a, b, c] = face.corners;
            [(a, b), (b, c), (c, a)]
        };
        let all: HashSet<(usize, usize)> = seen.iter().flat_map(edges).collect();
        let fresh = faces.len();
        let horizon = seen.iter().flat_map(edges).filter(|(a, b)| !all.contains(&(*b, *a)));
        faces.extend(horizon.map(|(a, b)| Face::new([a, b, apex], &points)));
        let open = seen.into_iter().flat_map(|face| face.outside).filter(|own| *own != apex);
        assign(&mut faces, fresh, open, &points);
    }
    let triangles = faces.iter().map(|face| face.corners.map(point)).collect();
    Some(Hull { triangles, is_complete: faces.iter().all(|face| face.outside.is_empty()) })
}

impl Face {
    fn new(corners: [usize; 3], points: &[Point]) -> Self {
        let [a, b, c] = corners.map(|index| points[index]);
        let normal = (b - a).cross(&(c - a));
        Self { corners, normal, offset: normal.dot(&a), outside: Vec::new() }
    }

    /// How far a point lies outside of the face, times twice its area.
    fn height(&self, point: &Point) -> f64 {
        self.normal.dot(point) - self.offset
    }
}

/// Gives each point to the first face from `fresh` on outside of which it lies. One that is outside of none is within the hull.
fn assign(
    faces: &mut [Face],
    fresh: usize,
    open: impl IntoIterator<Item = usize>,
    points: &[Point],
) {
    for index in open {
        let outside =
            |face: &&mut Face| !face.corners.contains(&index) && face.height(&points[index]) > 0.0;
        if let Some(face) = faces[fresh..].iter_mut().find(outside) {
            face.outside.push(index);
        }
    }
}

/// The faces of a tetrahedron of points that are far apart.
fn tetrahedron(points: &[Point]) -> Option<[[usize; 3]; 4]> {
    let farthest = |from: &dyn Fn(&Point) -> f64| {
        let (index, most) =
            points.iter().map(from).enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
        Some((index, most))
    };
    let (a, _) = farthest(&|own| own.x)?;
    let (b, extent) = farthest(&|own| (own - points[a]).norm())?;
    let line = points[b] - points[a];
    let (c, area) = farthest(&|own| (own - points[a]).cross(&line).norm())?;
    let normal = line.cross(&(points[c] - points[a]));
    let height = |own: &Point| normal.dot(&(own - points[a]));
    let (d, volume) = farthest(&|own| height(own).abs())?;
    // The joggle gives a plane, a line and a point some thickness.
    let thin = 10.0 * JOGGLE * extent;
    if extent == 0.0 || area <= thin * extent || volume <= thin * area {
        return None;
    }
    // The fourth corner lies behind the first face.
    let (b, c) = if height(&points[d]) > 0.0 { (c, b) } else { (b, c) };
    Some([[a, b, c], [a, d, b], [b, d, c], [c, d, a]])
}

/// The points, each moved by a part of their extent that depends on its number alone.
fn joggled(points: &[Point]) -> Vec<Point> {
    let (lower, upper) = extent(points.iter());
    let size = JOGGLE * (upper - lower).norm();
    // Weyl's sequence in three dimensions: equidistributed, and without a plane.
    let of = |index: usize, ratio: f64| (index as f64 * ratio).fract() - 0.5;
    let moved = |(index, point): (usize, &Point)| {
        point
            + size
                * Point::new(
                    of(index, 0.819_172_513),
                    of(index, 0.671_043_607),
                    of(index, 0.549_700_478),
                )
    };
    points.iter().enumerate().map(moved).collect()
}

/// Lowest and highest coordinates, m; zeros for no points.
pub(crate) fn extent<'a>(points: impl Iterator<Item = &'a Point>) -> (Point, Point) {
    let both = |(lower, upper): (Point, Point), own: &Point| (lower.inf(own), upper.sup(own));
    points.map(|own| (*own, *own)).reduce(|all, (own, _)| both(all, &own)).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    use super::super::Solid;
    use super::*;

    fn point() -> impl Strategy<Value = Point> {
        prop::array::uniform3(-1.0..1.0).prop_map(Point::from)
    }

    /// Largest height of a point over a face, and volume of the hull by tetrahedra from any point.
    fn checked(points: &[Point]) -> (f64, f64) {
        let Hull { triangles: hull, is_complete } = hull(points).unwrap();
        assert!(is_complete);
        let mut volume = 0.0;
        let mut most = f64::NEG_INFINITY;
        for [a, b, c] in &hull {
            let normal = (b - a).cross(&(c - a)).normalize();
            most = points.iter().map(|own| normal.dot(&(own - a))).fold(most, f64::max);
            volume += a.dot(&b.cross(c)) / 6.0;
        }
        // Euler: twice as many faces as corners, less four.
        let corners: HashSet<[u64; 3]> =
            hull.iter().flatten().map(|own| [own.x, own.y, own.z].map(f64::to_bits)).collect();
        assert_eq!(hull.len(), 2 * corners.len() - 4);
        (most, volume)
    }

    proptest! {
        #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(1), cases: 100, ..Default::default() })]

        /// No point lies outside, and the hull of the corners of a parallelepiped with points within has its volume.
        #[test]
        fn it_holds_all_points_and_no_more(
            within in prop::collection::vec(prop::array::uniform3(0.0..1.0), 0..60),
            edges in prop::array::uniform3(point()),
        ) {
            let [u, v, w] = edges;
            let exact = u.dot(&v.cross(&w)).abs();
            prop_assume!(exact > 0.05);
            let at = |[a, b, c]: [f64; 3]| u * a + v * b + w * c;
            let corners = (0..8).map(|own| at([own & 1, own >> 1 & 1, own >> 2].map(f64::from)));
            let points: Vec<Point> = corners.chain(within.into_iter().map(at)).collect();
            let (most, volume) = checked(&points);
            prop_assert!(most < 1e-5, "{most}");
            prop_assert!((volume / exact - 1.0).abs() < 1e-4, "{volume} {exact}");
        }

        #[test]
        fn it_holds_any_cloud(points in prop::collection::vec(point(), 8..200)) {
            prop_assert!(checked(&points).0 < 1e-5);
        }
    }

    /// Points of a grid, many in each plane and line, and each of them twice.
    #[test]
    fn the_hull_of_a_grid_is_its_box() {
        let of = |index: usize| {
            Point::new((index % 5) as f64, (index / 5 % 5) as f64, (index / 25 % 5) as f64)
        };
        let points: Vec<Point> = (0..250).map(of).collect();
        let (most, volume) = checked(&points);
        assert!(most < 1e-5 && (volume / 64.0 - 1.0).abs() < 1e-5, "{most} {volume}");
    }

    #[test]
    fn what_is_flat_has_none() {
        let line: Vec<Point> = (0..9).map(|own| Point::new(f64::from(own), 2.0, 0.0)).collect();
        let plane: Vec<Point> =
            (0..9).map(|own| Point::new(f64::from(own % 3), f64::from(own / 3), 1.0)).collect();
        for points in [vec![], vec![Point::x(); 5], line, plane] {
            assert!(hull(&points).is_none());
        }
    }

    /// A ball of 30,000 points, all of them corners of its hull.
    #[test]
    fn a_fine_ball_is_met() {
        let golden = std::f64::consts::PI * (3.0 - 5_f64.sqrt());
        let count = 30_000;
        let of = |index: usize| {
            let z = 1.0 - (2 * index + 1) as f64 / count as f64;
            let (sin, cos) = (index as f64 * golden).sin_cos();
            Point::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z)
        };
        let points: Vec<Point> = (0..count).map(of).collect();
        let hull = hull(&points).unwrap();
        assert!(!hull.is_complete);
        let ball = Solid::new(&hull.triangles).unwrap();
        let exact = 4.0 / 3.0 * std::f64::consts::PI;
        assert!((ball.volume / exact - 1.0).abs() < 7e-3, "{}", ball.volume);
    }
}
