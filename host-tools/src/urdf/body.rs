//! Rigid bodies, lumped together with the parallel axis theorem.

use nalgebra::{Isometry3, Matrix3, Vector3};

/// Mass, first moment and inertia about the origin of one frame. They add up over bodies.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Body {
    /// Mass, kg.
    pub(super) mass: f64,
    /// Mass times centre of mass, kg m.
    first_moment: Vector3<f64>,
    /// Inertia about the origin of the frame, kg m².
    inertia: Matrix3<f64>,
}

/// Inertia of a point mass at `centre` about the origin, kg m².
fn steiner(mass: f64, centre: Vector3<f64>) -> Matrix3<f64> {
    mass * (Matrix3::identity() * centre.norm_squared() - centre * centre.transpose())
}

impl Body {
    /// A body of `mass` whose centre of mass has the pose `centre` in the frame, and whose `inertia` is
    /// about the centre of mass and along the axes of `centre`.
    pub(super) fn new(mass: f64, centre: &Isometry3<f64>, inertia: &Matrix3<f64>) -> Self {
        let turn = centre.rotation.to_rotation_matrix().into_inner();
        let position = centre.translation.vector;
        Self {
            mass,
            first_moment: mass * position,
            inertia: turn * inertia * turn.transpose() + steiner(mass, position),
        }
    }

    /// Adds a body that is given in the same frame.
    pub(super) fn add(&mut self, other: &Self) {
        self.mass += other.mass;
        self.first_moment += other.first_moment;
        self.inertia += other.inertia;
    }

    /// The body in a frame in which its own frame has this pose.
    pub(super) fn at(&self, pose: &Isometry3<f64>) -> Self {
        let centre = pose * Isometry3::from(self.centre_of_mass());
        Self::new(self.mass, &centre, &self.central_inertia())
    }

    /// The body of the same shape with `factor` times the mass.
    pub(super) fn scaled(&self, factor: f64) -> Self {
        Self {
            mass: factor * self.mass,
            first_moment: factor * self.first_moment,
            inertia: factor * self.inertia,
        }
    }

    /// Centre of mass, m; the origin for a body without mass.
    pub(super) fn centre_of_mass(&self) -> Vector3<f64> {
        if self.mass > 0.0 { self.first_moment / self.mass } else { Vector3::zeros() }
    }

    /// Inertia about the centre of mass along the axes of the frame, kg m².
    pub(super) fn central_inertia(&self) -> Matrix3<f64> {
        let inertia = self.inertia - steiner(self.mass, self.centre_of_mass());
        0.5 * (inertia + inertia.transpose())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    /// Mass, centre of mass and inertia about it of point masses, by definition.
    fn of_points(points: &[(f64, Vector3<f64>)]) -> (f64, Vector3<f64>, Matrix3<f64>) {
        let mass: f64 = points.iter().map(|(m, _)| m).sum();
        let centre = points.iter().map(|(m, p)| *m * p).sum::<Vector3<f64>>() / mass;
        let inertia = points
            .iter()
            .map(|(m, p)| {
                let cross = (p - centre).cross_matrix();
                *m * cross.transpose() * cross
            })
            .sum();
        (mass, centre, inertia)
    }

    fn point() -> impl Strategy<Value = (f64, Vector3<f64>)> {
        (0.1..50.0, prop::array::uniform3(-2.0..2.0)).prop_map(|(m, p)| (m, Vector3::from(p)))
    }

    proptest! {
        #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(1), ..Default::default() })]

        /// Two clouds of point masses, lumped as bodies in frames of their own, equal one cloud.
        #[test]
        fn lumps_like_the_points_that_it_is_made_of(
            near in prop::collection::vec(point(), 4..8),
            far in prop::collection::vec(point(), 4..8),
            shift in prop::array::uniform3(-3.0..3.0),
            turn in prop::array::uniform3(-3.0..3.0),
        ) {
            let pose = Isometry3::from_parts(
                Vector3::from(shift).into(),
                UnitQuaternion::from_scaled_axis(Vector3::from(turn)),
            );
            let body = |points: &[(f64, Vector3<f64>)], frame: &Isometry3<f64>| {
                let (mass, centre, inertia) = of_points(points);
                Body::new(mass, &(frame * Isometry3::from(centre)), &inertia)
            };
            let mut lumped = body(&near, &Isometry3::identity());
            lumped.add(&body(&far, &pose));
            let all: Vec<_> = near
                .iter()
                .copied()
                .chain(far.iter().map(|(m, p)| (*m, pose.transform_point(&(*p).into()).coords)))
                .collect();
            let (mass, centre, inertia) = of_points(&all);
            prop_assert!((lumped.mass - mass).abs() < 1e-9 * mass);
            prop_assert!((lumped.centre_of_mass() - centre).norm() < 1e-9);
            prop_assert!((lumped.central_inertia() - inertia).norm() < 1e-9 * inertia.norm());
        }
    }
}
