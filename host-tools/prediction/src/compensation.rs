//! Joint offsets that take a deflection of the tool back.
//!
//! ```text
//! δq ← δq − A e        A = J_t⁺ + (J_r N)⁺ (R − J_r J_t⁺)        N = 1 − J_t⁺ J_t        e = T(q)⁻¹ T(q + δq) D
//! ```
//!
//! T is the pose of the tool by the exact kinematics. D is the deflection as a motion of the tool. e is what is left: three translations
//! above three rotations. J is the geometric Jacobian of the driven joints, split in the same way: J_t of translations and J_r of
//! rotations. R selects the rotations.
//!
//! The first step is that of the linearised kinematics. Further ones (Newton's) take back what they leave. The deflection is that of the
//! pose without offsets. What is left is as uncertain as the deflection, since offsets are commanded as they are.
//!
//! The translation comes first. The joints that it leaves free then take the rotation back (task priority: Siciliano and Slotine, "A
//! general framework for managing multiple tasks in highly redundant robotic systems", ICAR 1991). In a pseudoinverse a singular value σ
//! below ε counts as `ε²/σ`. The offsets then stay small near a singularity, and the result states what they leave (as damped least
//! squares do: Chiaverini, "Singularity-robust task-priority redundancy resolution", IEEE Transactions on Robotics and Automation 13,
//! 1997).

use flexid_core::chain::{Chain, JointKind};
use nalgebra::{DMatrix, DVector, Isometry3, Matrix3, Vector3, Vector6};
use serde::Serialize;

use flexid_pipeline::dynamics::Dynamics;
use flexid_pipeline::dynamics::Estimate;
use flexid_pipeline::dynamics::statics::{Compliance, Deflection};

/// Most steps. Chosen: each squares what is left, over the size of the robot, so that four leave rounding.
const STEPS: usize = 4;
/// ε: m or rad that the tool moves for a joint's rad (m). Chosen: three degrees from a wrist whose axes are aligned.
const SINGULAR: f64 = 0.05;

/// The offsets that take a deflection back.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Compensation {
    /// Deflection of the tool along its axes.
    pub deflection: Deflection,
    /// Deflection along the axes of the base.
    pub along_base: Deflection,
    /// To be added to the commanded joint angles, base first, rad (m).
    pub offsets: Vec<Estimate>,
    /// Deflection that is left then, along the axes of the tool, and as uncertain as the deflection.
    pub left: Deflection,
    /// True if the pose is so near a singularity that the offsets are held small.
    pub is_singular: bool,
}

/// The way from a deflection to the joint offsets.
struct Inverse {
    /// A, joints by deflections.
    matrix: DMatrix<f64>,
    is_singular: bool,
}

impl Compensation {
    /// Joint offsets that take the deflection under a wrench on the tool back: force, N, then torque, Nm, along its axes.
    pub fn of(at: &Dynamics<'_>, compliance: &Compliance, wrench: [f64; 6]) -> Self {
        let chain = at.robot().chain();
        let jacobian = jacobian(chain, at.pose());
        let inverse = Inverse::new(&jacobian);
        let own = DMatrix::identity(6, 6);
        let base = both(chain.tool(at.pose()).rotation.to_rotation_matrix().matrix());
        let of = |matrix: &DMatrix<f64>| Deflection::of(&at.moved(compliance, wrench, matrix));
        let deflection = of(&own);
        let linear = at.moved(compliance, wrench, &-&inverse.matrix);
        let (offsets, left) = taken_back(chain, at.pose(), &inverse, &deflection);
        let as_uncertain = |left: f64, of: &Estimate| Estimate::new(left, of.std);
        // What is left is nearly zero: it is known where its error is small beside what was taken back.
        let left_over = |first: usize, of: &[Estimate; 3]| {
            std::array::from_fn(|axis| Estimate {
                determined: of[axis].determined,
                ..as_uncertain(left[first + axis], &of[axis])
            })
        };
        Self {
            deflection,
            along_base: of(&base),
            offsets: beside_others(
                chain,
                offsets.iter().zip(&linear).map(|(own, of)| as_uncertain(*own, of)),
            ),
            left: Deflection {
                translation: left_over(0, &deflection.translation),
                rotation: left_over(3, &deflection.rotation),
            },
            is_singular: inverse.is_singular,
        }
    }
}

/// The offsets of the driven joints. An angle says something beside the length of all angles, a stroke beside that of all strokes.
fn beside_others(chain: &Chain, offsets: impl Iterator<Item = Estimate>) -> Vec<Estimate> {
    let kinds = chain.joints().iter().map(|joint| joint.kind);
    let driven = kinds.filter(|kind| *kind != JointKind::Fixed);
    let all: Vec<(JointKind, Estimate)> = driven.zip(offsets).collect();
    let length = |kind: JointKind| {
        let squares = all.iter().filter(|(own, _)| *own == kind).map(|(_, own)| own.value.powi(2));
        squares.sum::<f64>().sqrt()
    };
    all.iter().map(|(kind, own)| own.beside(length(*kind))).collect()
}

/// The offsets that take a deflection back, and what they leave of it. Near a singularity one step is made: further ones would make the
/// offsets large.
fn taken_back(
    chain: &Chain,
    pose: &[f64],
    inverse: &Inverse,
    deflection: &Deflection,
) -> (DVector<f64>, Vector6<f64>) {
    let values = |of: &[Estimate; 3]| Vector3::from(of.map(|own| own.value));
    let deflected = Isometry3::new(values(&deflection.translation), values(&deflection.rotation));
    let wanted = chain.tool(pose).inverse();
    let left = |offsets: &DVector<f64>| {
        let moved: Vec<f64> = pose.iter().zip(offsets).map(|(q, offset)| q + offset).collect();
        let left = wanted * chain.tool(&moved) * deflected;
        let rotation = left.rotation.scaled_axis();
        Vector6::from_iterator(left.translation.vector.iter().chain(&rotation).copied())
    };
    let mut offsets = DVector::zeros(pose.len());
    for _ in 0..if inverse.is_singular { 1 } else { STEPS } {
        offsets -= &inverse.matrix * left(&offsets);
    }
    let left = left(&offsets);
    (offsets, left)
}

impl Inverse {
    fn new(jacobian: &DMatrix<f64>) -> Self {
        let joints = jacobian.ncols();
        let [of_translation, of_rotation] =
            [0, 3].map(|first| jacobian.rows(first, 3).into_owned());
        let (first, is_first_singular) = pseudoinverse(&of_translation, joints.min(3));
        let rest = DMatrix::identity(joints, joints) - &first * &of_translation;
        let (second, is_second_singular) =
            pseudoinverse(&(&of_rotation * rest), joints.saturating_sub(3).min(3));
        let mut matrix = DMatrix::zeros(joints, 6);
        matrix.columns_mut(0, 3).copy_from(&(&first - &second * &of_rotation * &first));
        matrix.columns_mut(3, 3).copy_from(&second);
        Self { matrix, is_singular: is_first_singular || is_second_singular }
    }
}

/// `V diag(σ / max(σ, ε)²) Uᵀ` over the `rank` largest singular values, and whether one of these is below ε.
fn pseudoinverse(matrix: &DMatrix<f64>, rank: usize) -> (DMatrix<f64>, bool) {
    let svd = matrix.clone().svd(true, true);
    let (Some(u), Some(v)) = (svd.u, svd.v_t) else { unreachable!("both were asked for") };
    let mut inverse = DMatrix::zeros(matrix.ncols(), matrix.nrows());
    let mut is_singular = false;
    for (place, value) in svd.singular_values.iter().enumerate().take(rank) {
        is_singular |= *value < SINGULAR;
        inverse += v.row(place).transpose()
            * u.column(place).transpose()
            * (value / value.max(SINGULAR).powi(2));
    }
    (inverse, is_singular)
}

/// Geometric Jacobian of the driven joints, without sag: translation and rotation of the tool along its axes, m and rad per rad (m).
pub fn jacobian(chain: &Chain, pose: &[f64]) -> DMatrix<f64> {
    let all = chain.drive_jacobian(pose);
    DMatrix::from_fn(6, pose.len(), |row, joint| all[(row, joint)])
}

/// A rotation of translations and rotations.
fn both(rotation: &Matrix3<f64>) -> DMatrix<f64> {
    let mut matrix = DMatrix::zeros(6, 6);
    for first in [0, 3] {
        matrix.view_mut((first, first), (3, 3)).copy_from(rotation);
    }
    matrix
}

#[cfg(test)]
mod tests {
    use flexid_core::chain::{Joint, Link};

    use super::*;

    #[test]
    fn the_translation_comes_first_and_singular_directions_stay_small() {
        // Two joints: one moves the tool along x and turns it, the other moves it by a hair along y.
        let mut jacobian = DMatrix::zeros(6, 2);
        (jacobian[(0, 0)], jacobian[(5, 0)], jacobian[(1, 1)]) = (2.0, 1.0, 1e-4);
        let inverse = Inverse::new(&jacobian);
        assert!(inverse.is_singular);
        let matrix = inverse.matrix;
        assert!((matrix[(0, 0)] - 0.5).abs() < 1e-12);
        assert!((matrix[(1, 1)] - 1e-4 / SINGULAR.powi(2)).abs() < 1e-12);
        assert!(matrix.columns(3, 3).amax() < 1e-12, "{matrix}");
    }

    /// An axis that slides, and two that turn.
    #[test]
    fn an_offset_is_determined_beside_those_of_its_kind() {
        let joint = |kind| Joint {
            origin: Isometry3::identity(),
            axis: Vector3::z_axis(),
            kind,
            link: Link {
                mass: 1.0,
                centre_of_mass: Vector3::zeros(),
                inertia: Matrix3::identity(),
            },
        };
        let [slides, turns] = [JointKind::Prismatic, JointKind::Revolute].map(joint);
        let chain = Chain::new(&[slides, turns, turns], Isometry3::identity()).unwrap();
        let determined = |turn: f64| -> Vec<bool> {
            let offsets = [(5e-3, 1e-4), (1e-4, 2e-3), (turn, 1e-5)];
            let offsets = offsets.into_iter().map(|(value, std)| Estimate::new(value, std));
            beside_others(&chain, offsets).iter().map(|own| own.determined).collect()
        };
        assert_eq!(determined(1e-4), [true, false, true]);
        assert_eq!(determined(5e-3), [true; 3]);
    }
}
