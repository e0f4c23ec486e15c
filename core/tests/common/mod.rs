//! Random robots, and a dense model of them that shares nothing with the recursion: every degree of freedom is
//! an axis in the base frame, the mass matrix a sum over links, the receptance a 6J×6J solve.
#![allow(dead_code)]

pub(crate) mod fits;
pub(crate) mod milling;

use flexid_core::chain::{Chain, Joint, JointKind, Link};
use flexid_core::mounting::Mounting;
use flexid_core::parameters::{Bushing, Bushings};
use flexid_core::receptance::{self, PerDof, Response, Terms};
use nalgebra::{
    Complex, DMatrix, DVector, Isometry3, Matrix3, Translation3, Unit, UnitQuaternion, Vector3,
};
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// `y ← y + A x`. nalgebra's product allows for any stride, which keeps the compiler from using vectors.
pub(crate) fn add_product(a: &DMatrix<f64>, x: &DVector<f64>, y: &mut DVector<f64>) {
    let y = y.as_mut_slice();
    for (column, x) in a.as_slice().chunks_exact(y.len()).zip(x) {
        for (y, a) in y.iter_mut().zip(column) {
            *y += a * x;
        }
    }
}

pub(crate) struct Random(pub(crate) Xoshiro256PlusPlus);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(Xoshiro256PlusPlus::seed_from_u64(seed))
    }

    pub(crate) fn uniform(&mut self, lower: f64, upper: f64) -> f64 {
        lower + (upper - lower) * (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    pub(crate) fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform(0.0, 1.0)).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform(0.0, 1.0)).cos()
    }

    pub(crate) fn vector(&mut self, size: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.uniform(-size, size))
    }

    pub(crate) fn rotation(&mut self) -> UnitQuaternion<f64> {
        UnitQuaternion::from_scaled_axis(self.vector(2.0))
    }

    pub(crate) fn chain(&mut self, joints: usize) -> Chain {
        let joints: Vec<Joint> = (0..joints)
            .map(|_| {
                // Point masses about the centre make any inertia physical.
                let mut inertia = Matrix3::zeros();
                for _ in 0..6 {
                    let at = self.vector(0.6);
                    inertia +=
                        (Matrix3::identity() * at.norm_squared() - at * at.transpose()) * 50.0;
                }
                Joint {
                    origin: Isometry3::from_parts(
                        Translation3::from(self.vector(1.5)),
                        self.rotation(),
                    ),
                    axis: Unit::new_normalize(self.vector(1.0) + Vector3::new(0.0, 0.0, 1.2)),
                    kind: if self.uniform(0.0, 1.0) < 0.8 {
                        JointKind::Revolute
                    } else {
                        JointKind::Prismatic
                    },
                    link: Link {
                        mass: self.uniform(50.0, 600.0),
                        centre_of_mass: self.vector(0.6),
                        inertia,
                    },
                }
            })
            .collect();
        let tcp = Isometry3::from_parts(Translation3::from(self.vector(1.5)), self.rotation());
        Chain::new(&joints, tcp).expect("a random chain is physical")
    }

    /// A chain some of whose joints are fixed, at least one of them driven, and a pose of the driven ones.
    pub(crate) fn partly_fixed(&mut self, joints: usize) -> (Chain, Vec<f64>) {
        let chain = self.chain(joints);
        let driven = self.uniform(0.0, joints as f64) as usize;
        let mut own = chain.joints().to_vec();
        for (index, joint) in own.iter_mut().enumerate() {
            if index != driven && self.uniform(0.0, 1.0) < 0.5 {
                joint.kind = JointKind::Fixed;
            }
        }
        let driven = own.iter().filter(|joint| joint.kind != JointKind::Fixed).count();
        (Chain::new(&own, *chain.tcp()).expect("the same bodies"), self.pose(driven))
    }

    pub(crate) fn pose(&mut self, joints: usize) -> Vec<f64> {
        (0..joints).map(|_| self.uniform(-2.0, 2.0)).collect()
    }

    /// Sensors up to half a metre off, turned anyhow, and a tool of up to 20 kg.
    pub(crate) fn mounting(&mut self) -> Mounting {
        Mounting {
            accelerometer: self.vector(0.5),
            accelerometer_axes: self.rotation().to_rotation_matrix(),
            force_axes: self.rotation().to_rotation_matrix(),
            tool_mass: self.uniform(0.5, 20.0),
            tool_centre: self.vector(0.3),
        }
    }

    pub(crate) fn bushings(&mut self, joints: usize) -> Bushings {
        (0..joints)
            .map(|_| Bushing {
                stiffness: std::array::from_fn(|dof| {
                    if dof < 3 { self.uniform(1e7, 2e8) } else { self.uniform(1e6, 1e8) }
                }),
                damping: std::array::from_fn(|dof| {
                    if dof < 3 { self.uniform(1e3, 1e5) } else { self.uniform(1e2, 5e4) }
                }),
            })
            .collect()
    }
}

struct Axis {
    origin: Vector3<f64>,
    direction: Vector3<f64>,
    slide: bool,
}

/// The equation of motion of the sagged chain, base frame.
pub(crate) struct Dense {
    axes: Vec<Axis>,
    links: Vec<(f64, Vector3<f64>, Matrix3<f64>)>,
    tcp: Isometry3<f64>,
    gravity: Vector3<f64>,
}

impl Dense {
    /// `sag`: six elongations per joint.
    pub(crate) fn new(
        chain: &Chain,
        pose: &[f64],
        gravity: Vector3<f64>,
        sag: &[[f64; 6]],
    ) -> Self {
        let mut axes = Vec::new();
        let mut links = Vec::new();
        let mut frame = Isometry3::identity();
        let mut angles = pose.iter();
        for (joint, sag) in chain.joints().iter().zip(sag) {
            frame *= match joint.kind {
                JointKind::Fixed => joint.origin,
                _ => joint.frame(*angles.next().expect("an angle for each driven joint")),
            };
            for dof in 0..6 {
                let direction = frame.rotation * Vector3::ith(dof % 3, 1.0);
                axes.push(Axis { origin: frame.translation.vector, direction, slide: dof < 3 });
                let along = Vector3::ith(dof % 3, sag[dof]);
                frame *= if dof < 3 {
                    Isometry3::from_parts(Translation3::from(along), UnitQuaternion::identity())
                } else {
                    Isometry3::rotation(along)
                };
            }
            // Slides move the origins of the turns after them.
            let from = axes.len() - 3;
            for axis in &mut axes[from..] {
                axis.origin = frame.translation.vector;
            }
            let turn = frame.rotation.to_rotation_matrix();
            links.push((
                joint.link.mass,
                (frame * nalgebra::Point3::from(joint.link.centre_of_mass)).coords,
                turn.matrix() * joint.link.inertia * turn.matrix().transpose(),
            ));
        }
        Self { axes, links, tcp: frame * chain.tcp(), gravity }
    }

    fn velocity(axis: &Axis, at: Vector3<f64>) -> Vector3<f64> {
        if axis.slide { axis.direction } else { axis.direction.cross(&(at - axis.origin)) }
    }

    /// Translation and rotation of the TCP, TCP axes, per degree of freedom: 6×6J.
    pub(crate) fn tip(&self) -> DMatrix<f64> {
        let back = self.tcp.rotation.inverse();
        DMatrix::from_fn(6, self.axes.len(), |row, dof| {
            let axis = &self.axes[dof];
            if row < 3 {
                (back * Self::velocity(axis, self.tcp.translation.vector))[row]
            } else if axis.slide {
                0.0
            } else {
                (back * axis.direction)[row - 3]
            }
        })
    }

    pub(crate) fn mass(&self) -> DMatrix<f64> {
        let mut mass = DMatrix::zeros(self.axes.len(), self.axes.len());
        for (link, &(m, centre, inertia)) in self.links.iter().enumerate() {
            for a in 0..6 * (link + 1) {
                for b in 0..6 * (link + 1) {
                    let (a_axis, b_axis) = (&self.axes[a], &self.axes[b]);
                    let turns = if a_axis.slide || b_axis.slide {
                        0.0
                    } else {
                        a_axis.direction.dot(&(inertia * b_axis.direction))
                    };
                    mass[(a, b)] += turns
                        + m * Self::velocity(a_axis, centre).dot(&Self::velocity(b_axis, centre));
                }
            }
        }
        mass
    }

    /// Second derivatives of the potential of gravity.
    pub(crate) fn gravity_stiffness(&self) -> DMatrix<f64> {
        let mut stiffness = DMatrix::zeros(self.axes.len(), self.axes.len());
        for (link, &(m, centre, _)) in self.links.iter().enumerate() {
            for b in 0..6 * (link + 1) {
                for a in 0..=b {
                    if !self.axes[a].slide {
                        let second =
                            self.axes[a].direction.cross(&Self::velocity(&self.axes[b], centre));
                        stiffness[(a, b)] -= m * self.gravity.dot(&second);
                    }
                }
            }
        }
        let upper = stiffness.clone();
        stiffness + upper.transpose() - DMatrix::from_diagonal(&upper.diagonal())
    }

    /// Generalised force of gravity.
    pub(crate) fn gravity_load(&self) -> Vec<f64> {
        (0..self.axes.len())
            .map(|dof| {
                let carried = self.links[dof / 6..].iter();
                carried.map(|l| l.0 * self.gravity.dot(&Self::velocity(&self.axes[dof], l.1))).sum()
            })
            .collect()
    }

    pub(crate) fn gravity_at_tip(&self) -> Vector3<f64> {
        self.tcp.rotation.inverse() * self.gravity
    }

    /// `(s²M + sD + K + gravity's)⁻¹`.
    pub(crate) fn compliance(
        &self,
        bushings: &[Bushing],
        s: Complex<f64>,
    ) -> DMatrix<Complex<f64>> {
        let mut stiffness = (self.gravity_stiffness()).map(Complex::from)
            + self.mass().map(Complex::from) * (s * s);
        for (joint, bushing) in bushings.iter().enumerate() {
            for dof in 0..6 {
                stiffness[(6 * joint + dof, 6 * joint + dof)] +=
                    bushing.stiffness[dof] + s * bushing.damping[dof];
            }
        }
        stiffness.try_inverse().expect("a damped robot has no pole on the axis")
    }

    pub(crate) fn receptance(
        &self,
        bushings: &[Bushing],
        s: Complex<f64>,
    ) -> DMatrix<Complex<f64>> {
        let tip = self.tip().rows(0, 3).map(Complex::from);
        &tip * self.compliance(bushings, s) * tip.transpose()
    }
}

/// The scenario's robot, as its URDF has it.
pub(crate) fn mill3() -> Chain {
    let link = |mass, centre: [f64; 3], moments: [f64; 3]| Link {
        mass,
        centre_of_mass: Vector3::from(centre),
        inertia: Matrix3::from_diagonal(&Vector3::from(moments)),
    };
    let joint = |origin: [f64; 3], axis, link| Joint {
        origin: Translation3::from(Vector3::from(origin)).into(),
        axis,
        kind: JointKind::Revolute,
        link,
    };
    let joints = [
        joint(
            [0.0, 0.0, 0.5],
            Vector3::z_axis(),
            link(558.0, [0.18, 0.02, 0.25], [45.0, 55.0, 48.0]),
        ),
        joint(
            [0.5, 0.0, 0.545],
            Vector3::y_axis(),
            link(485.0, [0.6, -0.08, 0.02], [14.0, 95.0, 92.0]),
        ),
        joint(
            [1.3, 0.0, 0.0],
            Vector3::y_axis(),
            link(451.0, [0.55, 0.03, -0.02], [16.0, 88.0, 86.0]),
        ),
    ];
    Chain::new(&joints, Translation3::new(1.35, 0.0, -0.3).into())
        .expect("the scenario is physical")
}

/// The scenario's one plausible robot.
pub(crate) fn nominal() -> Bushings {
    let stiffness = [
        [6.0e7, 6.6e7, 4.5e7, 3.2e7, 2.9e7, 2.3e6],
        [7.0e7, 5.2e7, 6.1e7, 4.1e7, 8.6e6, 3.7e7],
        [4.8e7, 5.5e7, 6.4e7, 2.6e7, 2.8e6, 2.2e7],
    ];
    let damping = [
        [2.1e4, 2.4e4, 1.7e4, 1.1e4, 0.9e4, 1.9e3],
        [2.6e4, 1.9e4, 2.2e4, 1.3e4, 3.4e3, 1.2e4],
        [1.5e4, 1.8e4, 2.3e4, 0.8e4, 1.2e3, 0.7e4],
    ];
    stiffness
        .into_iter()
        .zip(damping)
        .map(|(stiffness, damping)| Bushing { stiffness, damping })
        .collect()
}

/// The scenario's bounds.
pub(crate) fn bounds() -> flexid_core::parameters::Bounds {
    flexid_core::parameters::Bounds::new([1e7, 2e8], [1e6, 1e8], [1e3, 1e5], [1e2, 5e4])
        .expect("the scenario's bounds are ranges")
}

/// The scenario's experiments: pose, spindle speeds, feed axis.
pub(crate) const EXPERIMENTS: [([f64; 3], [f64; 2], usize); 3] = [
    ([0.0, -0.45, 0.95], [600.0, 4200.0], 0),
    ([0.7, -1.1, 1.9], [900.0, 5400.0], 1),
    ([-0.6, -0.2, 0.35], [600.0, 3000.0], 2),
];

/// Mean absolute error over the bound ranges (paper, section 5.1).
pub(crate) fn parameter_deviation(found: &Bushings, truth: &Bushings) -> f64 {
    let bounds = bounds();
    let mut sum = 0.0;
    for (found, truth) in found.iter().zip(truth) {
        for dof in 0..6 {
            let [lower, upper] = bounds.joints[0].stiffness[dof];
            sum += (found.stiffness[dof] - truth.stiffness[dof]).abs() / (upper - lower);
            let [lower, upper] = bounds.joints[0].damping[dof];
            sum += (found.damping[dof] - truth.damping[dof]).abs() / (upper - lower);
        }
    }
    sum / (12 * truth.len()) as f64
}

/// The scenario's measurement: 2 to 200 Hz, no gravity, accelerometer in fixed axes.
pub(crate) const MEASUREMENT: flexid_core::spectrum::Measurement =
    flexid_core::spectrum::Measurement {
        band_hz: [2.0, 200.0],
        gravity: [0.0; 3],
        accelerometer: flexid_core::sensors::Accelerometer::Inertial,
        mounting: Mounting::AT_TCP,
    };

/// Bins that the scenario's records need.
pub(crate) const BINS: usize = 832;

/// One bin with a seam (its load on every bushing, N and Nm times seconds), to a force in Ns.
pub(crate) fn respond(
    terms: &Terms<f64>,
    s: receptance::Complex<f64>,
    force: &[receptance::Complex<f64>; 3],
    seam: &PerDof<f64>,
) -> Response<f64> {
    let mut response = Response::new(0.0);
    response.evaluate(terms, s, force, Some(seam));
    response
}
