//! Made-up tables, for the tests of the page.

use super::super::tables::{
    Choice, Comparison, CurvePoint, DisplacementIllustration, Mean, Measure, MethodRow, Origin,
    Run, SearchIllustration, SearchIteration, SensitivityCost, Tables, Verdict,
};

/// Key, name, origin, the paper's parameter deviation and displacement error.
type Known = (&'static str, &'static str, Origin, Option<f64>, Option<f64>);

const METHODS: [Known; 10] = [
    ("baseline", "Baseline", Origin::Paper, Some(0.2657), Some(0.0367)),
    ("mse", "Mean Squared Error (MSE)", Origin::Paper, Some(0.2520), None),
    ("ssp", "Surface Similarity Parameter (SSP)", Origin::Paper, Some(0.2517), None),
    ("abg", "Adaptive Bounds Global (ABG)", Origin::Paper, Some(0.2766), None),
    ("adapted", "Baseline adapted", Origin::Paper, Some(0.2368), Some(0.0285)),
    ("gsa", "Global Sensitivity Analysis (GSA)", Origin::Paper, Some(0.2166), Some(0.0203)),
    ("jacobian", "Jacobian Sensitivity (Jacobian)", Origin::Paper, Some(0.2124), Some(0.0227)),
    ("ga", "Genetic algorithm", Origin::Rival, None, None),
    ("pso", "Particle swarm <optimization>", Origin::Rival, None, None),
    ("own", "Search & refinement", Origin::Flexid, None, None),
];

/// Tables of three robots and 20 iterations.
pub(super) fn tables() -> Tables {
    let methods: Vec<_> = METHODS.iter().enumerate().map(|(i, known)| row(i, *known)).collect();
    let against_baseline = methods[1..].iter().map(|row| {
        let paper = row.paper_deviation.map(|paper| paper - 0.2657);
        comparison(&row.key, "baseline", Measure::ParameterDeviation, paper)
    });
    let mut comparisons: Vec<_> = against_baseline.collect();
    let deviation = Measure::ParameterDeviation;
    comparisons.push(comparison("jacobian", "gsa", deviation, Some(-0.0042)));
    let error = Measure::DisplacementError;
    comparisons.push(comparison("jacobian", "baseline", error, Some(-0.3818)));
    comparisons[0].verdict = Some(Verdict::Contradicts);
    comparisons[1].verdict = Some(Verdict::Undecided);
    Tables {
        run: Run {
            seed: 7,
            robots: 3,
            iterations: 20,
            samples: 20,
            evaluations: 400,
            parameters: 36,
            experiments: 3,
            unseen: 5,
            scenario: None,
            simd: "avx2".to_owned(),
        },
        methods,
        comparisons,
        sensitivity_cost: [("GSA", 12_345, 3.5), ("Jacobian", 0, 0.0003)]
            .map(|(name, evaluations, seconds)| SensitivityCost {
                name: name.to_owned(),
                evaluations,
                seconds,
            })
            .to_vec(),
        search: search(),
        displacement: DisplacementIllustration {
            title: "x, experiment 4".to_owned(),
            time_s: (0..400).map(|i| f64::from(i) / 2000.0).collect(),
            reference_m: (0..400).map(|i| 4e-5 * (0.1 * f64::from(i)).sin()).collect(),
            models_m: vec![(
                "jacobian".to_owned(),
                (0..400).map(|i| 3.9e-5 * (0.1 * f64::from(i)).sin()).collect(),
            )],
        },
        choices: vec![Choice {
            open: "Samples per iteration".to_owned(),
            chosen: "20".to_owned(),
            why: "as many as < fit & run".to_owned(),
        }],
        seconds: 12.5,
    }
}

fn row(i: usize, (key, name, origin, paper, paper_error): Known) -> MethodRow {
    let deviation = 0.25 - 0.02 * i as f64;
    let mean = |mean: f64| Mean { mean, interval: [0.9 * mean, 1.1 * mean] };
    MethodRow {
        key: key.to_owned(),
        name: name.to_owned(),
        description: "MAE, scheduled".to_owned(),
        origin,
        deviation: mean(deviation),
        paper_deviation: paper,
        displacement_error: Some(mean(0.1 * deviation)),
        paper_displacement_error: paper_error,
        largest_displacement_error: Some(0.5 * deviation),
        deviations: vec![deviation; 3],
        displacement_errors: vec![0.1 * deviation; 3],
        curve: (0..=20)
            .map(|k| CurvePoint {
                mean: deviation + 0.1 * (-0.2 * f64::from(k)).exp(),
                spread: 0.01,
            })
            .collect(),
        seconds: 1.25,
    }
}

fn comparison(method: &str, against: &str, measure: Measure, paper: Option<f64>) -> Comparison {
    Comparison {
        method: method.to_owned(),
        against: against.to_owned(),
        measure,
        pairs: 3,
        effect: -0.02,
        interval: [-0.03, -0.01],
        p: 0.012,
        paper_effect: paper,
        power: paper.map(|_| 0.34),
        pairs_for_power: paper.map(|_| 41),
        verdict: (paper.is_some() || ["ga", "pso"].contains(&method)).then_some(Verdict::Agrees),
    }
}

fn search() -> SearchIllustration {
    let iteration = |iteration: u32, radius| SearchIteration {
        iteration,
        centre: [0.5, 0.5],
        radius,
        samples: vec![[0.4, 0.5], [0.6, 0.7]],
        best: [0.4, 0.5],
    };
    SearchIllustration {
        axes: ["stiffness rz, joint 1".to_owned(), "stiffness ry, joint 2".to_owned()],
        truth: [0.3, 0.6],
        loss: (0..12)
            .map(|i| (0..12).map(|j| f64::from((i - 7) * (i - 7) + j)).collect())
            .collect(),
        iterations: vec![iteration(1, 0.6), iteration(2, 0.4), iteration(3, 0.3)],
    }
}
