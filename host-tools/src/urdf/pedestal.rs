//! The body between the ground and the first driven joint: a body that gives way against the ground.

use flexid_core::imperfection::BASE_OVER_MOVING;
use flexid_pipeline::model::{Kind, ModelJoint};
use nalgebra::Matrix3;

use super::body::Body;
use super::figures::{INERTIA_ORDER, tidy};

/// Name of the fixed joint.
pub(super) const NAME: &str = "pedestal";

/// Density of the cube that stands for a base, kg/m³. Assumed: a quarter of cast iron.
const DENSITY: f64 = 2000.0;

/// The body of a base whose mass nobody gives: a cube about the root's origin, for a robot with `moving_kg` beyond it.
pub(super) fn assumed(moving_kg: f64) -> Body {
    let mass = BASE_OVER_MOVING * moving_kg;
    let edge = (mass / DENSITY).cbrt();
    Body::new(mass, &Default::default(), &(Matrix3::identity() * (mass * edge * edge / 6.0)))
}

/// The fixed joint that carries `body`, at the root's origin.
pub(super) fn joint(body: &Body) -> ModelJoint {
    let inertia = body.central_inertia();
    ModelJoint {
        name: NAME.to_owned(),
        kind: Kind::Fixed,
        origin_xyz_m: [0.0; 3],
        origin_rpy_rad: [0.0; 3],
        axis: [0.0; 3],
        limits: [0.0; 2],
        mass_kg: tidy([body.mass])[0],
        centre_of_mass_m: tidy(body.centre_of_mass().into()),
        inertia_kg_m2: tidy(INERTIA_ORDER.map(|at| inertia[at])),
    }
}
