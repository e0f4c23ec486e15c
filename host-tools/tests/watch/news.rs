//! The messages of the daemon.

use flexid_wire::confidence::{Confidence, Correlations, JointIntervals};
use flexid_wire::finding::Finding;
use flexid_wire::messages::{BusErrors, BusHealth, BusState, FromEdge, Phase, Progress, Status};
use flexid_wire::report::{Acceptance, Fit, FoundBy, JointReport, Report, Verdict};
use flexid_wire::residuals::{Meaning, Residuals};
use flexid_wire::spectra::{Band, Spectra};
use flexid_wire::state::State;
use flexid_wire::text::clipped;
use flexid_wire::trouble::BusFault;

pub(crate) fn progress(phase: Phase, records: u64) -> FromEdge {
    FromEdge::Progress(Progress {
        phase,
        fraction: 0.5,
        starts: 2,
        search_evaluations: 2000,
        refine_iterations: 8,
        search_loss: 0.1,
        records,
    })
}

pub(crate) fn finding(acceptance: Acceptance, records: u64) -> Finding {
    let joint = JointReport {
        name: clipped("joint_1"),
        stiffness: [6.0e7; 6],
        stiffness_std: [Some(1.0e4), None, Some(1.0e4), Some(1.0e4), Some(1.0e4), Some(1.0e4)],
        stiffness_verdict: [Verdict::Identified; 6],
        damping: [2.0e4; 6],
        damping_std: [Some(1.0e2); 6],
        damping_verdict: [Verdict::Weak; 6],
    };
    let fit = Fit {
        records,
        frames: 16_384 * records,
        frames_lost: 3,
        ssp: 1e-3,
        ssp_max: 2e-3,
        consistency: 1.01,
        search_evaluations: 2000,
        refine_iterations: 8,
        starts: 2,
        bridged: 3,
        seconds: 1.5,
        acceptance,
        found_by: FoundBy::Descent,
        random_searches: 0,
        branches: 1,
    };
    let joints = [joint].into_iter().collect();
    let report = Report { joints, fit, warnings: Default::default() };
    Finding { report, confidence: confidence(), answer: None }
}

pub(crate) fn report(acceptance: Acceptance, records: u64) -> FromEdge {
    FromEdge::Finding(finding(acceptance, records))
}

fn confidence() -> Confidence {
    let joint = JointIntervals {
        name: clipped("joint_1"),
        stiffness_interval: [Some([5.9e7, 6.1e7]); 6],
        damping_interval: [None; 6],
    };
    Confidence {
        joints: [joint].into_iter().collect(),
        nuisances: Default::default(),
        correlations: Correlations {
            unknowns: ["a", "b"].map(clipped).into_iter().collect(),
            percent: [97].into_iter().collect(),
        },
        explanations: Default::default(),
        weak_directions: Default::default(),
        residuals: Residuals {
            consistency: 1.01,
            whiteness: 0.5,
            structure: 0.05,
            size_objects: false,
            whiteness_objects: false,
            structure_objects: false,
            meaning: Meaning::Noise,
        },
        left_over: Default::default(),
        held_out: Default::default(),
        retired: 24,
        left_out: 0,
        robust_widening: None,
    }
}

/// Spectra with one resonance, which the model has a little too low.
pub(crate) fn spectra(record: u64) -> FromEdge {
    let band = |index: usize| {
        let frequency_hz = 2.0 * 100_f32.powf(index as f32 / 59.0);
        let at = |resonance_hz: f32| {
            let ratio = frequency_hz / resonance_hz;
            0.02 * ratio * ratio / ((1.0 - ratio * ratio).powi(2) + 0.01 * ratio * ratio).sqrt()
        };
        Band { frequency_hz, measured: [at(20.0); 3], modelled: [at(16.0); 3], noise: [1e-3; 3] }
    };
    FromEdge::Spectra(Spectra {
        record,
        pose: [0.0, -0.45, 0.95].into_iter().collect(),
        band_hz: [2.0, 200.0],
        bands: (0..60).map(band).collect(),
    })
}

/// A report in which nothing is determined.
pub(crate) fn unobserved() -> FromEdge {
    let mut unobserved = finding(Acceptance::Consistent, 3);
    for joint in &mut unobserved.report.joints {
        joint.stiffness_verdict = [Verdict::NotObservable; 6];
    }
    FromEdge::Finding(unobserved)
}

pub(crate) fn bus(state: BusState, fault: Option<BusFault>) -> FromEdge {
    FromEdge::BusHealth(BusHealth {
        state,
        frames: 1000,
        frames_lost: 3,
        bridged: 2,
        restarts: 1,
        repeated: 0,
        frames_wrong_length: 812,
        frames_unknown: 0,
        frames_not_data: 0,
        frames_clipped: 0,
        kernel_dropped: 0,
        receive_buffer_bytes: 0,
        samples_discarded: 77,
        refused: 0,
        wrong_rate: 0,
        measured_rate_hz: 0.0,
        frames_per_second: 0.0,
        fault,
        errors: BusErrors::default(),
        doubtful_rate: 0,
        measured_rate_std_hz: 0.0,
    })
}

pub(crate) fn status(state: State) -> FromEdge {
    FromEdge::Status(Status {
        uptime_s: 1.0,
        model: clipped("mill3"),
        joints: 3,
        interface: clipped("vcan0"),
        state,
        record_fraction: 0.25,
        newest_record_s: None,
    })
}
