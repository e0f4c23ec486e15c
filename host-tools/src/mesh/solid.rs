//! The body within triangles: sums over tetrahedra between each triangle and one point (Mirtich 1996).

use std::collections::HashMap;

use nalgebra::Matrix3;

use super::hull::{extent, hull};
use super::parts::outwards;
use super::weld::{WELD, cells};
use super::{MeshError, Point, Triangle};

/// Volume over that of the box around it, below which a mesh is flat: a sheet of a hundredth of a millimetre on a link of a metre.
const FLAT: f64 = 1e-5;

/// A body of density 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solid {
    /// Volume, m³.
    pub volume: f64,
    /// Centre, m.
    pub centre: Point,
    /// Inertia about the centre at a density of 1 kg/m³, kg m².
    pub inertia: Matrix3<f64>,
}

/// The surface that bounds a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outline {
    /// The mesh itself, which is closed.
    Closed,
    /// The convex hull of a mesh that is not closed.
    Open,
    /// The convex hull of a mesh whose closed parts hold one another, so that they would be counted twice.
    Nested,
}

impl Solid {
    /// The body within closed triangles, all of which look outwards or all inwards. `None` without a volume.
    pub fn new(triangles: &[Triangle]) -> Option<Self> {
        let (lower, upper) = extent(triangles.iter().flatten());
        let middle = 0.5 * (lower + upper);
        let (mut volume, mut first, mut second) = (0.0, Point::zeros(), Matrix3::zeros());
        for corners in triangles {
            let [a, b, c] = corners.map(|corner| corner - middle);
            let own = a.dot(&b.cross(&c)) / 6.0;
            let sum = a + b + c;
            volume += own;
            first += own / 4.0 * sum;
            let squares = [a, b, c, sum].map(|v| v * v.transpose());
            second += own / 20.0 * squares.into_iter().sum::<Matrix3<f64>>();
        }
        let size = upper - lower;
        if volume == 0.0 || volume.abs() < FLAT * (size.x * size.y * size.z) {
            return None;
        }
        let centre = first / volume;
        let about = second * volume.signum() - centre * centre.transpose() * volume.abs();
        let inertia = Matrix3::identity() * about.trace() - about;
        Some(Self { volume: volume.abs(), centre: centre + middle, inertia })
    }

    /// The body of a mesh: of itself if it is closed, of its convex hull otherwise.
    ///
    /// # Errors
    /// The mesh has no volume.
    pub fn of_mesh(triangles: &[Triangle]) -> Result<(Self, Outline), MeshError> {
        let mut corners: Vec<Point> = triangles.iter().flatten().copied().collect();
        let key = |own: &Point| [own.x, own.y, own.z].map(f64::to_bits);
        corners.sort_unstable_by_key(key);
        corners.dedup_by_key(|own| key(own));
        let hull = hull(&corners).ok_or(MeshError::Flat)?;
        let around = Self::new(&hull.triangles).ok_or(MeshError::Flat)?;
        if !is_closed(triangles) {
            return Ok((around, Outline::Open));
        }
        // The hull is moved by a millionth. One that leaves points out has no volume to compare with.
        let fits = |own: &Self| !hull.is_complete || own.volume < around.volume * (1.0 + WELD);
        let own = outwards(triangles).and_then(|all| Self::new(&all)).filter(fits);
        Ok(own.map_or((around, Outline::Nested), |own| (own, Outline::Closed)))
    }
}

/// Returns whether each edge of the triangles is passed as often in one direction as in the other, as that of a closed surface. Corners that
/// lie together are one.
fn is_closed(triangles: &[Triangle]) -> bool {
    let cell = cells(triangles);
    let mut edges = HashMap::new();
    for corners in triangles {
        let [a, b, c] = corners.each_ref().map(&cell);
        for (from, to) in [(a, b), (b, c), (c, a)] {
            if from < to {
                *edges.entry((from, to)).or_insert(0) += 1;
            } else if to < from {
                *edges.entry((to, from)).or_insert(0) -= 1;
            }
        }
    }
    edges.values().all(|passed| *passed == 0)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use nalgebra::{Rotation3, Vector3};

    use super::*;

    /// The box between two corners, by its twelve triangles.
    fn cuboid(lower: Point, upper: Point) -> Vec<Triangle> {
        let at = |own: usize| {
            Point::from_fn(|axis, _| if own >> axis & 1 == 0 { lower[axis] } else { upper[axis] })
        };
        let sides =
            [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        sides
            .iter()
            .flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]])
            .map(|own| own.map(|own| at(*own)))
            .collect()
    }

    fn is_near(solid: &Solid, volume: f64, centre: Point, inertia: Matrix3<f64>, tolerance: f64) {
        assert!((solid.volume / volume - 1.0).abs() < tolerance, "{} {volume}", solid.volume);
        assert!((solid.centre - centre).norm() < tolerance, "{}", solid.centre);
        assert!((solid.inertia - inertia).norm() < tolerance * inertia.norm(), "{}", solid.inertia);
    }

    fn of_box(size: Vector3<f64>) -> Matrix3<f64> {
        let square = size.component_mul(&size);
        Matrix3::from_diagonal(&square.map(|own| (square.sum() - own) * size.product() / 12.0))
    }

    #[test]
    fn a_box_has_its_own_inertia_wherever_it_is_and_however_it_is_turned() {
        let (lower, upper) = (Point::new(-0.1, 3.0, -0.2), Point::new(0.3, 3.2, 0.9));
        let (size, centre) = (upper - lower, 0.5 * (upper + lower));
        let mesh = cuboid(lower, upper);
        let inside_out: Vec<Triangle> = mesh.iter().map(|[a, b, c]| [*a, *c, *b]).collect();
        for mesh in [&mesh, &inside_out] {
            let (solid, outline) = Solid::of_mesh(mesh).unwrap();
            assert_eq!(outline, Outline::Closed);
            is_near(&solid, size.product(), centre, of_box(size), 1e-9);
        }
        let turn = Rotation3::new(Vector3::new(0.4, -1.1, 0.3));
        let turned: Vec<Triangle> = mesh.iter().map(|own| own.map(|own| turn * own)).collect();
        let inertia = turn * of_box(size) * turn.transpose();
        is_near(&Solid::of_mesh(&turned).unwrap().0, size.product(), turn * centre, inertia, 1e-9);
    }

    /// The tetrahedron of the axes: volume 1/6, centre 1/4, ∫x² = 1/60, ∫xy = 1/120.
    #[test]
    fn a_tetrahedron_has_its_own_inertia() {
        let [o, x, y, z] = [Point::zeros(), Point::x(), Point::y(), Point::z()];
        let solid = Solid::new(&[[o, y, x], [o, x, z], [o, z, y], [x, y, z]]).unwrap();
        let (own, other) = (2.0 / 60.0 - 2.0 / 6.0 / 16.0, -1.0 / 120.0 + 1.0 / 6.0 / 16.0);
        let inertia = Matrix3::from_fn(|row, column| if row == column { own } else { other });
        is_near(&solid, 1.0 / 6.0, Point::repeat(0.25), inertia, 1e-12);
    }

    /// A cylinder of 200 sides is a thousandth lighter than a round one.
    #[test]
    fn a_cylinder_is_nearly_round() {
        let (radius, length, sides) = (0.2, 0.7, 200);
        let rim = |own: usize, z: f64| {
            let (sin, cos) =
                (std::f64::consts::TAU * (own % sides) as f64 / sides as f64).sin_cos();
            Point::new(radius * cos, radius * sin, z)
        };
        let side = |own: usize| {
            let [a, b, c, d] =
                [rim(own, 0.0), rim(own + 1, 0.0), rim(own + 1, length), rim(own, length)];
            [[a, b, c], [a, c, d], [b, a, Point::zeros()], [d, c, Point::new(0.0, 0.0, length)]]
        };
        let mesh: Vec<Triangle> = (0..sides).flat_map(side).collect();
        let volume = PI * radius * radius * length;
        let across = volume * (radius * radius / 4.0 + length * length / 12.0);
        let inertia =
            Matrix3::from_diagonal(&Vector3::new(across, across, volume * radius * radius / 2.0));
        let (solid, outline) = Solid::of_mesh(&mesh).unwrap();
        assert_eq!(outline, Outline::Closed);
        is_near(&solid, volume, Point::new(0.0, 0.0, 0.5 * length), inertia, 1e-3);
        // Without its lid it is not closed, and its hull is the same.
        let open: Vec<Triangle> = mesh
            .into_iter()
            .enumerate()
            .filter(|(at, _)| at % 4 != 3)
            .map(|(_, own)| own)
            .collect();
        let (solid, outline) = Solid::of_mesh(&open).unwrap();
        assert_eq!(outline, Outline::Open);
        is_near(&solid, volume, Point::new(0.0, 0.0, 0.5 * length), inertia, 1e-3);
    }

    #[test]
    fn what_is_hollow_or_counted_twice_is_told_from_what_is_open() {
        let (small, large) = (Point::repeat(0.2), Point::repeat(1.0));
        let outer = cuboid(-large, large);
        let hollow = cuboid(-small, small).into_iter().map(|[a, b, c]| [a, c, b]);
        let hollow: Vec<Triangle> = outer.iter().copied().chain(hollow).collect();
        let (solid, outline) = Solid::of_mesh(&hollow).unwrap();
        assert_eq!(outline, Outline::Closed);
        assert!((solid.volume - (8.0 - 0.064)).abs() < 1e-9);
        let nested = [outer.clone(), cuboid(-0.9 * large, 0.9 * large)].concat();
        let (solid, outline) = Solid::of_mesh(&nested).unwrap();
        assert_eq!(outline, Outline::Nested);
        assert!((solid.volume / 8.0 - 1.0).abs() < 1e-4);
        let (solid, outline) = Solid::of_mesh(&outer[1..]).unwrap();
        assert_eq!(outline, Outline::Open);
        assert!((solid.volume / 8.0 - 1.0).abs() < 1e-4);
    }

    /// A part turned inside out beside, on a corner and within the box around a part with a notch, and a hollow.
    #[test]
    fn parts_count_once_however_they_look() {
        let inside_out = |mesh: Vec<Triangle>| -> Vec<Triangle> {
            mesh.into_iter().map(|[a, b, c]| [a, c, b]).collect()
        };
        let at = |lower: [f64; 3], upper: [f64; 3]| cuboid(Point::from(lower), Point::from(upper));
        let one = at([0.0; 3], [2.0, 1.0, 1.0]);
        let beside = at([3.0, 0.0, 0.0], [4.0, 1.0, 1.0]);
        let touching = at([2.0, 0.2, 0.2], [3.0, 0.8, 0.8]);
        let within = at([0.5; 3], [0.6; 3]);
        for (other, volume) in [(beside, 3.0), (touching, 2.36)] {
            for mesh in [
                [one.clone(), inside_out(other.clone())].concat(),
                [inside_out(one.clone()), other.clone()].concat(),
                [other.clone(), one.clone()].concat(),
            ] {
                let (solid, outline) = Solid::of_mesh(&mesh).unwrap();
                assert_eq!(outline, Outline::Closed);
                assert!((solid.volume - volume).abs() < 1e-9, "{}", solid.volume);
            }
        }
        let hollow = [one, inside_out(within)].concat();
        assert!((Solid::of_mesh(&hollow).unwrap().0.volume - 1.999).abs() < 1e-9);
    }

    /// A ball so fine that its hull is cut off is no nested one.
    #[test]
    fn a_fine_ball_is_closed() {
        let (rings, sides) = (100, 200);
        let at = |ring: usize, side: usize| {
            let (sin, cos) = (PI * ring as f64 / rings as f64).sin_cos();
            let (y, x) = (2.0 * PI * (side % sides) as f64 / sides as f64).sin_cos();
            let sin = if ring.is_multiple_of(rings) { 0.0 } else { sin };
            Point::new(sin * x, sin * y, cos)
        };
        let quad = |own: usize| {
            let (ring, side) = (own / sides, own % sides);
            let [a, b, c, d] =
                [at(ring, side), at(ring + 1, side), at(ring + 1, side + 1), at(ring, side + 1)];
            [[a, b, c], [a, c, d]]
        };
        let mesh: Vec<Triangle> = (0..rings * sides).flat_map(quad).collect();
        let (solid, outline) = Solid::of_mesh(&mesh).unwrap();
        assert_eq!(outline, Outline::Closed);
        assert!((solid.volume / (4.0 / 3.0 * PI) - 1.0).abs() < 1e-3, "{}", solid.volume);
    }

    #[test]
    fn what_is_flat_has_no_body() {
        let sheet =
            [[Point::zeros(), Point::x(), Point::y()], [Point::zeros(), Point::y(), Point::x()]];
        for flat in [&sheet[..], &[[Point::x(); 3]], &[]] {
            assert_eq!(Solid::of_mesh(flat), Err(MeshError::Flat));
        }
    }
}
