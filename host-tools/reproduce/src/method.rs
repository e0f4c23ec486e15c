//! The methods that are compared: combinations of the small choices that the paper tests one by one, the rivals that
//! it dismissed, and flexid itself.

use flexid_core::search::{Shrinking, Strategy};

use super::displacement::Loss;
use super::rivals::{Minimise, cma_es, genetic, swarm};
use super::tables::Origin;

/// Evaluations per iteration.
pub const SAMPLES: u32 = 20;
/// Evaluations per iteration that look outside, for a method that does.
pub const OUTSIDE: u32 = 10;
/// Radius of the sphere in the first iteration, in bound ranges.
pub const FIRST: f32 = 1.0;
/// Radius after the last iteration of the scheduled search.
pub const LAST: f32 = 0.05;

/// One way to find the parameters.
#[derive(Clone, Copy, Debug)]
pub struct Method {
    /// Short name, unique.
    pub key: &'static str,
    /// Name in the paper.
    pub name: &'static str,
    /// Parts of the method.
    pub description: &'static str,
    /// Kind of the method.
    pub kind: Kind,
    /// Number of robots that the method meets in a full run. It gives a power of 0.8 at the paper's effects for the
    /// scatter between robots, as far as ten minutes on two cores allow. They do not allow it where the paper's
    /// effect is half a percent: for ABL (it would take 360), and for the Jacobian against GSA (690).
    pub robots: usize,
    /// The paper's parameter deviation, from its table 1 and the differences of its section 5.1.
    pub paper_deviation: Option<f64>,
    /// The paper's displacement error (table 3).
    pub paper_displacement_error: Option<f64>,
}

/// Kind of a method.
#[derive(Clone, Copy, Debug)]
pub enum Kind {
    /// The random search.
    Search(Variant),
    /// An existing optimiser, on the baseline's loss.
    Rival(Minimise),
    /// flexid: force and acceleration with the scenario's noise, search and refinement.
    Flexid,
}

/// A variant of the random search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Variant {
    /// Loss that is minimised.
    pub loss: Loss,
    /// Samples per iteration that look outside.
    pub outside: u32,
    /// Shrinking of the sphere.
    pub shrinking: Shrinking,
    /// Source of the sensitivities, which turn losses into parameters' losses.
    pub sensitivity: Sensitivity,
}

/// Source of the sensitivities.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sensitivity {
    /// No sensitivities.
    None,
    /// Sobol total-order indices of the losses.
    Global,
    /// The translational Jacobian.
    Jacobian,
}

const BASELINE: Variant = Variant {
    loss: Loss::Mae,
    outside: 0,
    shrinking: Shrinking::Scheduled { first: FIRST, last: LAST },
    sensitivity: Sensitivity::None,
};
const ADAPTED: Variant = Variant { loss: Loss::Ssp, outside: OUTSIDE, ..BASELINE };

/// All methods, the baseline first.
pub const METHODS: [Method; 13] = [
    paper(
        "baseline",
        "Baseline",
        "MAE, scheduled shrinking",
        BASELINE,
        130,
        [Some(0.2657), Some(0.0367)],
    ),
    paper(
        "mse",
        "Mean Squared Error (MSE)",
        "baseline with MSE",
        Variant { loss: Loss::Mse, ..BASELINE },
        110,
        [Some(0.2520), None],
    ),
    paper(
        "ssp",
        "Surface Similarity Parameter (SSP)",
        "baseline with SSP",
        Variant { loss: Loss::Ssp, ..BASELINE },
        115,
        [Some(0.2517), None],
    ),
    paper(
        "lo",
        "Look Outside (LO)",
        "baseline with Look Outside",
        Variant { outside: OUTSIDE, ..BASELINE },
        90,
        [Some(0.2441), None],
    ),
    paper(
        "abg",
        "Adaptive Bounds Global (ABG)",
        "baseline with one radius that follows the loss",
        Variant { shrinking: Shrinking::Global { first: FIRST, last: LAST }, ..BASELINE },
        130,
        [Some(0.2766), None],
    ),
    paper(
        "abl",
        "Adaptive Bounds Local (ABL)",
        "baseline with a radius for each parameter that follows the loss",
        Variant { shrinking: Shrinking::Local { first: FIRST, last: LAST }, ..BASELINE },
        80,
        [Some(0.2705), None],
    ),
    paper(
        "adapted",
        "Baseline adapted",
        "SSP, Look Outside, scheduled shrinking",
        ADAPTED,
        60,
        [Some(0.2368), Some(0.0285)],
    ),
    paper(
        "gsa",
        "Global Sensitivity Analysis (GSA)",
        "adapted, with Sobol total-order indices as sensitivities",
        Variant { sensitivity: Sensitivity::Global, ..ADAPTED },
        60,
        [Some(0.2166), Some(0.0203)],
    ),
    paper(
        "jacobian",
        "Jacobian Sensitivity (Jacobian)",
        "adapted, with Jacobian sensitivities",
        Variant { sensitivity: Sensitivity::Jacobian, ..ADAPTED },
        60,
        [Some(0.2124), Some(0.0227)],
    ),
    rival("ga", "Genetic algorithm", "on the baseline's MAE", genetic::minimise),
    rival("pso", "Particle swarm", "on the baseline's MAE", swarm::minimise),
    rival("cma_es", "CMA-ES", "on the baseline's MAE", cma_es::minimise),
    Method {
        key: "flexid",
        name: "flexid",
        description: "from force and acceleration with the scenario's noise: 100 iterations of its search, then \
                      refinement with the exact gradient, restarts included",
        kind: Kind::Flexid,
        robots: 60,
        paper_deviation: None,
        paper_displacement_error: None,
    },
];

const fn paper(
    key: &'static str,
    name: &'static str,
    description: &'static str,
    variant: Variant,
    robots: usize,
    [paper_deviation, paper_displacement_error]: [Option<f64>; 2],
) -> Method {
    let kind = Kind::Search(variant);
    Method { key, name, description, kind, robots, paper_deviation, paper_displacement_error }
}

const fn rival(
    key: &'static str,
    name: &'static str,
    description: &'static str,
    minimise: Minimise,
) -> Method {
    let (kind, robots) = (Kind::Rival(minimise), 20);
    let (paper_deviation, paper_displacement_error) = (None, None);
    Method { key, name, description, kind, robots, paper_deviation, paper_displacement_error }
}

impl Method {
    /// Returns whether the method is tested on unseen experiments: the methods that the paper tests so, and flexid.
    pub fn is_validated(&self) -> bool {
        self.paper_displacement_error.is_some() || self.origin() == Origin::Flexid
    }

    /// Origin of the method.
    pub fn origin(&self) -> Origin {
        match self.kind {
            Kind::Search(_) => Origin::Paper,
            Kind::Rival(_) => Origin::Rival,
            Kind::Flexid => Origin::Flexid,
        }
    }
}

impl Variant {
    /// Strategy of the variant's search.
    pub fn strategy(&self, iterations: u32) -> Strategy {
        let Self { outside, shrinking, .. } = *self;
        Strategy { iterations, samples: SAMPLES, outside, shrinking }
    }
}
