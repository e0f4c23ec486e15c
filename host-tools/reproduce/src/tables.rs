//! The results of a reproduction: `tables.json`, and all that the report shows.
//!
//! The same arguments on the same machine give the same results, except for `seconds`.

use serde::Serialize;

/// All tables and figures.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Tables {
    /// The run.
    pub run: Run,
    /// Every method, in the order of [`super::method::METHODS`].
    pub methods: Vec<MethodRow>,
    /// Every comparison that the paper makes, and those with the rivals.
    pub comparisons: Vec<Comparison>,
    /// Cost of the two kinds of sensitivities.
    pub sensitivity_cost: Vec<SensitivityCost>,
    /// Fig. 3.
    pub search: SearchIllustration,
    /// Fig. 5.
    pub displacement: DisplacementIllustration,
    /// Points that the paper leaves open, and the choices made here.
    pub choices: Vec<Choice>,
    /// Wall time of everything, s.
    pub seconds: f64,
}

/// The arguments of a run, and the numbers that follow from them.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Run {
    /// Seed of all random numbers.
    pub seed: u64,
    /// Number of robots drawn uniformly from the bounds. Not every method meets all of them.
    pub robots: usize,
    /// Iterations of the random search.
    pub iterations: u32,
    /// Evaluations per iteration.
    pub samples: u32,
    /// Evaluations that every search and every rival may spend on a robot, sensitivities not counted.
    pub evaluations: u64,
    /// Number of parameters of a robot, P.
    pub parameters: usize,
    /// Number of experiments from which a robot is identified, E.
    pub experiments: usize,
    /// Number of experiments on which a fit is tested.
    pub unseen: usize,
    /// File of the scenario; `None` for the reference scenario.
    pub scenario: Option<String>,
    /// SIMD level.
    pub simd: String,
}

/// Origin of a method.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Origin {
    /// A method of the paper, with the paper's figure beside it.
    Paper,
    /// A method that the paper dismisses, or does not try.
    Rival,
    /// A method of flexid's own.
    Flexid,
}

/// Results of one method.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MethodRow {
    /// Short name, unique.
    pub key: String,
    /// Name in the paper.
    pub name: String,
    /// Parts of the method.
    pub description: String,
    /// Origin of the method.
    pub origin: Origin,
    /// Parameter deviation (section 5.1) at the end, mean over the robots.
    pub deviation: Mean,
    /// Parameter deviation in the paper.
    pub paper_deviation: Option<f64>,
    /// Displacement error on the unseen experiments, median over directions and experiments (section 5.2), geometric
    /// mean over the robots; `None` for methods that are not tested on unseen experiments.
    pub displacement_error: Option<Mean>,
    /// Displacement error in the paper.
    pub paper_displacement_error: Option<f64>,
    /// Largest displacement error of any robot, direction and unseen experiment.
    pub largest_displacement_error: Option<f64>,
    /// Parameter deviation of each robot that the method met.
    pub deviations: Vec<f64>,
    /// Displacement error of each robot, median over directions and experiments.
    pub displacement_errors: Vec<f64>,
    /// Parameter deviation after each iteration, from 0 on; empty for a method without iterations.
    pub curve: Vec<CurvePoint>,
    /// Wall time of one robot on one core, mean, s.
    pub seconds: f64,
}

/// A mean over the robots, with the 95 % confidence interval of Student's t.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Mean {
    /// The mean.
    pub mean: f64,
    /// Lower and upper end of the interval.
    pub interval: [f64; 2],
}

/// A point of Fig. 4, at one iteration.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CurvePoint {
    /// Mean parameter deviation over the robots.
    pub mean: f64,
    /// Standard deviation over the robots.
    pub spread: f64,
}

/// The measure that is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Measure {
    /// Parameter deviation; effects are differences (in parts of the bound range).
    ParameterDeviation,
    /// Displacement error; effects are relative changes, tested as differences of logarithms.
    DisplacementError,
}

/// The verdict on the paper's claim in one comparison.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// The effect has the same sign and is significant.
    Agrees,
    /// The effect has the other sign and is significant.
    Contradicts,
    /// The effect is not significant.
    Undecided,
}

/// A paired test: the same robots, the same experiments, the same budget, two methods.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Key of the method.
    pub method: String,
    /// Key of the method with which it is compared.
    pub against: String,
    /// The measure that is compared.
    pub measure: Measure,
    /// Number of pairs. A pair is a robot.
    pub pairs: usize,
    /// Effect: the method minus the other, mean over the pairs. A negative effect is better.
    pub effect: f64,
    /// 95 % confidence interval of the effect.
    pub interval: [f64; 2],
    /// Two-sided p.
    pub p: f64,
    /// The paper's effect; `None` where the paper gives no figures.
    pub paper_effect: Option<f64>,
    /// Power of this test if the paper's effect were the true one.
    pub power: Option<f64>,
    /// Number of pairs that would give the test a power of 0.8.
    pub pairs_for_power: Option<u64>,
    /// Verdict on the paper's figures, or on its claim in words; `None` where the paper makes no claim.
    pub verdict: Option<Verdict>,
}

/// Cost of the sensitivities of the losses to the parameters.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SensitivityCost {
    /// Name: GSA or Jacobian.
    pub name: String,
    /// Evaluations of the model for one robot.
    pub evaluations: u64,
    /// Wall time of one robot on one core, mean, s.
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
    /// Number of the iteration.
    pub iteration: u32,
    /// Centre of the circle, fractions of the bounds.
    pub centre: [f64; 2],
    /// Radius, in bound ranges.
    pub radius: f64,
    /// Samples, fractions of the bounds.
    pub samples: Vec<[f64; 2]>,
    /// The best of the samples.
    pub best: [f64; 2],
}

/// Fig. 5: an unseen experiment of the first robot.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct DisplacementIllustration {
    /// Direction and experiment that are shown.
    pub title: String,
    /// Instants, s.
    pub time_s: Vec<f64>,
    /// Displacement of the reference, m.
    pub reference_m: Vec<f64>,
    /// Displacement of each fitted model, by the key of its method, m.
    pub models_m: Vec<(String, Vec<f64>)>,
}

/// One thing that the paper leaves open.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Choice {
    /// The open point.
    pub open: String,
    /// The choice made here.
    pub chosen: String,
    /// The reason.
    pub why: String,
}
