//! What a reproduction found: `tables.json`, and all that the report shows.
//!
//! Everything but `seconds` is the same again for the same arguments on the same machine.

use serde::Serialize;

/// All tables and figures.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Tables {
    /// What was run.
    pub run: Run,
    /// Every method, in the order of [`super::method::METHODS`].
    pub methods: Vec<MethodRow>,
    /// Every comparison that the paper makes, and those with the rivals.
    pub comparisons: Vec<Comparison>,
    /// What the two kinds of sensitivities cost.
    pub sensitivity_cost: Vec<SensitivityCost>,
    /// Fig. 3.
    pub search: SearchIllustration,
    /// Fig. 5.
    pub displacement: DisplacementIllustration,
    /// What the paper leaves open, and what is chosen here.
    pub choices: Vec<Choice>,
    /// Wall time of everything, s.
    pub seconds: f64,
}

/// The arguments, and what follows from them.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Run {
    /// Of everything random.
    pub seed: u64,
    /// Robots drawn uniformly from the bounds; not every method meets all of them.
    pub robots: usize,
    /// Of the random search.
    pub iterations: u32,
    /// Evaluations an iteration.
    pub samples: u32,
    /// Evaluations that every search and every rival may spend on a robot, sensitivities not counted.
    pub evaluations: u64,
    /// Parameters of a robot, P.
    pub parameters: usize,
    /// Experiments that are identified from, E.
    pub experiments: usize,
    /// Experiments that a fit is tried on.
    pub unseen: usize,
    /// The scenario's file; none: the reference scenario.
    pub scenario: Option<String>,
    /// SIMD level.
    pub simd: String,
}

/// Where a method comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Origin {
    /// The paper's, with the paper's figure beside it.
    Paper,
    /// Dismissed by the paper, or not tried there.
    Rival,
    /// flexid's own.
    Flexid,
}

/// How one method did.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MethodRow {
    /// Short name, unique.
    pub key: String,
    /// As the paper calls it.
    pub name: String,
    /// What it consists of.
    pub description: String,
    /// Whose it is.
    pub origin: Origin,
    /// Parameter deviation (section 5.1) at the end, mean over the robots.
    pub deviation: Mean,
    /// The paper's.
    pub paper_deviation: Option<f64>,
    /// Displacement error on the unseen experiments, median over directions and experiments (section 5.2): geometric
    /// mean over the robots; none of methods that the paper does not validate.
    pub displacement_error: Option<Mean>,
    /// The paper's.
    pub paper_displacement_error: Option<f64>,
    /// Largest displacement error of any robot, direction and unseen experiment.
    pub largest_displacement_error: Option<f64>,
    /// Parameter deviation of each robot that the method met.
    pub deviations: Vec<f64>,
    /// Displacement error of each robot, median over directions and experiments.
    pub displacement_errors: Vec<f64>,
    /// Parameter deviation after each iteration, from 0 on: empty where there are no iterations to speak of.
    pub curve: Vec<CurvePoint>,
    /// Wall time of one robot on one core, mean, s.
    pub seconds: f64,
}

/// A mean over the robots, with the 95 % confidence interval of Student's t.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Mean {
    /// The mean.
    pub mean: f64,
    /// Lower and upper end.
    pub interval: [f64; 2],
}

/// Fig. 4 at one iteration.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CurvePoint {
    /// Mean parameter deviation over the robots.
    pub mean: f64,
    /// Standard deviation over the robots.
    pub spread: f64,
}

/// What is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Measure {
    /// Parameter deviation; effects are differences (in parts of the bound range).
    ParameterDeviation,
    /// Displacement error; effects are relative changes, tested as differences of logarithms.
    DisplacementError,
}

/// Where we stand to the paper in one comparison.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// The same sign, and significant.
    Agrees,
    /// The other sign, and significant.
    Contradicts,
    /// Not significant.
    Undecided,
}

/// A paired test: the same robots, the same experiments, the same budget, two methods.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Key of the method.
    pub method: String,
    /// Key of what it is compared with.
    pub against: String,
    /// Of what.
    pub measure: Measure,
    /// Pairs: robots.
    pub pairs: usize,
    /// Method minus the other, mean over the pairs; negative is better.
    pub effect: f64,
    /// Its 95 % confidence interval.
    pub interval: [f64; 2],
    /// Two-sided.
    pub p: f64,
    /// The paper's effect; none where the paper gives no figures.
    pub paper_effect: Option<f64>,
    /// Power of this test if the paper's effect were the true one.
    pub power: Option<f64>,
    /// Pairs that would give it a power of 0.8.
    pub pairs_for_power: Option<u64>,
    /// Where we stand to the paper's figures, or to what it says in words; none where it says nothing.
    pub verdict: Option<Verdict>,
}

/// What it costs to know which loss tells of which parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SensitivityCost {
    /// GSA or Jacobian.
    pub name: String,
    /// Evaluations of the model for one robot.
    pub evaluations: u64,
    /// Of one robot on one core, mean, s.
    pub seconds: f64,
}

/// Fig. 3: a search over two parameters, while all others are known.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct SearchIllustration {
    /// The two parameters.
    pub axes: [String; 2],
    /// The truth, as fractions of the bounds.
    pub truth: [f64; 2],
    /// Loss on an even grid over the bounds, `[row][column]`, rows along the second parameter from its lower bound.
    pub loss: Vec<Vec<f64>>,
    /// Some iterations, in order.
    pub iterations: Vec<SearchIteration>,
}

/// One hypersphere, here a circle.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SearchIteration {
    /// Its number.
    pub iteration: u32,
    /// Centre of the circle, fractions of the bounds.
    pub centre: [f64; 2],
    /// Radius, in bound ranges.
    pub radius: f64,
    /// Samples, fractions of the bounds.
    pub samples: Vec<[f64; 2]>,
    /// The best of them.
    pub best: [f64; 2],
}

/// Fig. 5: an unseen experiment of the first robot.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct DisplacementIllustration {
    /// What is shown: the direction and the experiment.
    pub title: String,
    /// Instants, s.
    pub time_s: Vec<f64>,
    /// Displacement of the reference, m.
    pub reference_m: Vec<f64>,
    /// That of each fitted model, by the key of its method, m.
    pub models_m: Vec<(String, Vec<f64>)>,
}

/// One thing that the paper leaves open.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Choice {
    /// What is open.
    pub open: String,
    /// What is done here.
    pub chosen: String,
    /// Why.
    pub why: String,
}
