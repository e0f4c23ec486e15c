//! Results and states as JSON: the file of `identify --json`, and the lines of `watch --json`.

use flexid_pipeline::clocks::FoundClocks;
use flexid_pipeline::document::{FindingJson, WithText};
use flexid_pipeline::report::StaticReport;
use flexid_pipeline::robot::FoundRobot;
use flexid_pipeline::shared::Shared;
use flexid_report::evidence::{Evidence, Origin};
use flexid_simulation::coverage::Coverage;
use flexid_wire::finding::Finding;
use flexid_wire::messages::Status;
use flexid_wire::report::{Acceptance, Fit, JointReport};
use flexid_wire::spectra::Spectra;
use flexid_wire::state::State;
use serde::{Deserialize, Serialize};

pub(crate) use flexid_prediction::document::SCHEMA;

/// A finding as JSON, with what only one command says.
#[derive(Serialize)]
pub(crate) struct ResultJson<'a> {
    #[serde(flatten)]
    finding: FindingJson<'a>,
    /// Doubts about the robot's model, as `check` says. Left out if nothing is, and of a daemon.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    model_warnings: Vec<String>,
    /// Each static test in the fit. Left out without static tests, and of a daemon.
    #[serde(skip_serializing_if = "Option::is_none")]
    static_tests: Option<&'a StaticReport>,
    /// Evidence that a report shows beside. Left out without records, and of a daemon.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    evidence: Option<&'a Evidence>,
    /// Clocks of the sensors. Left out if one counter counts the instants of both, and of a daemon.
    #[serde(skip_serializing_if = "Option::is_none")]
    clocks: Option<WithText<'a, FoundClocks>>,
    /// Intervals that hold the truth. Left out if that is not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    truth: Option<&'a Coverage>,
    /// Measured and modelled spectra of the newest record. Left out without records, and of a result that is not a daemon's.
    #[serde(skip_serializing_if = "Option::is_none")]
    spectra: Option<&'a Spectra>,
}

/// A conclusion from a fit, and how far it is to be trusted.
#[derive(Serialize)]
pub(crate) struct Judged<T> {
    schema: u32,
    /// Acceptance of the fit.
    verdict: Acceptance,
    #[serde(flatten)]
    value: T,
}

impl<T> Judged<T> {
    /// `value`, which follows from a fit.
    pub(crate) fn of(fit: &Fit, value: T) -> Self {
        Self { schema: SCHEMA, verdict: fit.acceptance, value }
    }
}

/// A status as JSON.
#[derive(Serialize)]
pub(crate) struct StatusJson<'a> {
    uptime_s: f64,
    model: &'a str,
    joints: u8,
    interface: &'a str,
    state: String,
    state_kind: &'a State,
    record_fraction: f32,
    newest_record_s: Option<f64>,
}

/// The version of a result. It is read first: the other entries of another version may be unreadable.
#[derive(Deserialize)]
pub(crate) struct VersionJson {
    /// Version of the result.
    #[serde(default = "first_schema")]
    pub(crate) schema: u32,
}

/// The entries of a result that a later command needs.
#[derive(Deserialize)]
pub(crate) struct FoundJson {
    /// Parameters of each joint, base first.
    pub(crate) joints: Vec<JointReport>,
    /// Quality of the fit.
    pub(crate) fit: Fit,
}

/// Version of results without this entry, which older programs have written.
fn first_schema() -> u32 {
    1
}

impl<'a> From<&'a Finding> for ResultJson<'a> {
    fn from(finding: &'a Finding) -> Self {
        Self {
            finding: finding.into(),
            model_warnings: Vec::new(),
            static_tests: None,
            evidence: None,
            clocks: None,
            truth: None,
            spectra: None,
        }
    }
}

impl<'a> ResultJson<'a> {
    /// The result with the doubts about the model.
    pub(crate) fn with_model_warnings(self, model_warnings: Vec<String>) -> Self {
        Self { model_warnings, ..self }
    }

    /// The result with the robot that predicts motion, and with what it shares with other findings of the robot.
    pub(crate) fn of_robot(
        self,
        robot: Option<&'a FoundRobot>,
        shared: Option<&'a Shared>,
    ) -> Self {
        Self { finding: self.finding.of_robot(robot, shared), ..self }
    }

    /// The result with the verdict of the fit of each static test.
    pub(crate) fn with_static_tests(self, static_tests: Option<&'a StaticReport>) -> Self {
        Self { static_tests, ..self }
    }

    /// The result with the evidence that a report shows, and its origin.
    pub(crate) fn with_evidence(self, evidence: Option<&'a Evidence>, origin: &'a Origin) -> Self {
        Self { evidence, finding: self.finding.from_origin(origin), ..self }
    }

    /// The result with the clocks of the sensors.
    pub(crate) fn with_clocks(self, clocks: Option<&'a FoundClocks>) -> Self {
        Self { clocks: clocks.map(WithText::from), ..self }
    }

    /// The result with the intervals that hold the truth.
    pub(crate) fn with_truth(self, truth: Option<&'a Coverage>) -> Self {
        Self { truth, ..self }
    }

    /// The result with the spectra that a daemon sends beside it.
    pub(crate) fn with_spectra(self, spectra: Option<&'a Spectra>) -> Self {
        Self { spectra, ..self }
    }
}

impl<'a> From<&'a Status> for StatusJson<'a> {
    fn from(status: &'a Status) -> Self {
        let Status { uptime_s, model, joints, interface, state, record_fraction, newest_record_s } =
            status;
        Self {
            uptime_s: *uptime_s,
            model,
            joints: *joints,
            interface,
            state: state.to_string(),
            state_kind: state,
            record_fraction: *record_fraction,
            newest_record_s: *newest_record_s,
        }
    }
}

#[cfg(test)]
mod tests {
    use flexid_wire::accuracy::Accuracy;
    use flexid_wire::directions::{Share, WeakDirection};
    use flexid_wire::explanation::{Deviation, Explanation};
    use flexid_wire::left_over::LeftOver;
    use flexid_wire::text::clipped;
    use flexid_wire::warning::Warning;
    use serde_json::json;

    use super::*;
    use crate::show::page::tests::finding;

    #[test]
    fn a_result_has_the_contracted_names() {
        let mut finding = finding(1);
        finding.report.warnings =
            [Warning::ImposedParameters, Warning::BusErrors { errors: 3 }].into_iter().collect();
        let share = Share { name: clipped("joint_1 tx stiffness"), weight: 0.75 };
        finding.confidence.weak_directions = [WeakDirection {
            relative_std: Some(0.5),
            shares: [share].into_iter().collect(),
            of_nuisance: false,
        }]
        .into_iter()
        .collect();
        let deviation = Deviation {
            entry: Accuracy::TcpM,
            name: clipped("TCP z"),
            unit: clipped("m"),
            value: 3e-3,
            std: Some(5e-5),
            accuracy: 1e-3,
        };
        finding.confidence.explanations = [Explanation {
            deviation,
            times: 2.5,
            share: 0.75,
            evidence: 12.5,
            adopted: false,
            rivals: Default::default(),
        }]
        .into_iter()
        .collect();
        finding.confidence.left_over =
            [LeftOver::Direction { axis: 2, times: 2.25 }].into_iter().collect();
        let json = serde_json::to_value(ResultJson::from(&finding)).unwrap();
        let expected = json!({
            "schema": 2,
            "joints": [{
                "name": "joint_1",
                "stiffness": [6e7, 6e7, 6e7, 6e7, 6e7, 6e7],
                "stiffness_std": [5e5, 5e5, 5e5, 5e5, 5e5, 5e5],
                "stiffness_verdict":
                    ["identified", "identified", "identified", "identified", "identified", "identified"],
                "damping": [2e4, 2e4, 2e4, 2e4, 2e4, 2e4],
                "damping_std": [1e3, 1e3, 1e3, 1e3, 1e3, 1e3],
                "damping_verdict": ["weak", "weak", "weak", "weak", "weak", "weak"],
            }],
            "fit": {
                "records": 3, "frames": 49152, "frames_lost": 0, "ssp": 0.001, "ssp_max": 0.02, "consistency": 1.0,
                "search_evaluations": 2000, "refine_iterations": 12, "starts": 1, "bridged": 0, "seconds": 1.2,
                "acceptance": "consistent", "found_by": "descent", "random_searches": 0, "branches": 1,
            },
            "warnings": [
                "what [parameters] fixes or ties may not be so: see without it",
                "the bus reported 3 errors",
            ],
            "warning_kinds": ["imposed_parameters", { "bus_errors": { "errors": 3 } }],
            "confidence": {
                "joints": [{
                    "name": "joint_1",
                    "stiffness_interval":
                        [[5.9e7, 6.1e7], [5.9e7, 6.1e7], [5.9e7, 6.1e7], [5.9e7, 6.1e7], [5.9e7, 6.1e7], [5.9e7, 6.1e7]],
                    "damping_interval":
                        [[1.8e4, 2.2e4], [1.8e4, 2.2e4], [1.8e4, 2.2e4], [1.8e4, 2.2e4], [1.8e4, 2.2e4], [1.8e4, 2.2e4]],
                }],
                "nuisances": [],
                "explanations": [{
                    "deviation": {
                        "entry": "tcp_m", "name": "TCP z", "unit": "m", "value": 3e-3, "std": 5e-5, "accuracy": 1e-3,
                    },
                    "times": 2.5, "share": 0.75, "evidence": 12.5, "adopted": false, "rivals": [],
                    "text": "TCP z 3.00 ± 0.05 mm explains 75 % of the misfit: 2.5 times its accuracy (tcp_m, 1.00 mm)",
                    "alike": null,
                    "alternatives": null,
                    "remedy": "measure the TCP and correct it in the model, or state tcp_m as it is",
                }],
                "correlations": { "unknowns": [], "percent": [] },
                "weak_directions": [{
                    "relative_std": 0.5,
                    "shares": [{ "name": "joint_1 tx stiffness", "weight": 0.75 }],
                    "of_nuisance": false,
                    "text": "joint_1 tx stiffness is hardly determined by these poses (standard deviation 50 %)",
                }],
                "residuals": {
                    "consistency": 1.0, "whiteness": 0.0, "structure": 0.0,
                    "size_objects": false, "whiteness_objects": false, "structure_objects": false,
                    "meaning": "noise", "text": "noise explains them (χ²/dof 1.00)",
                },
                "left_over": [{
                    "direction": { "axis": 2, "times": 2.25 },
                    "text": "direction z: 2.2 times the others: gain, axis or cable of that axis",
                }],
                "held_out": [],
                "retired": 0,
                "left_out": 0,
                "robust_widening": null,
            },
            "answer": {
                "pose": [0.1, -0.45, 0.95], "record": 3,
                "softest": {
                    "stiffness": { "value": 3.81e5, "interval": [0.98 * 3.81e5, 1.02 * 3.81e5] },
                    "direction": [0.71, 0.02, -0.7],
                },
                "stiffest": {
                    "stiffness": { "value": 8.7e5, "interval": [0.98 * 8.7e5, 1.02 * 8.7e5] },
                    "direction": [0.0, 1.0, 0.03],
                },
                "lowest_mode": {
                    "frequency_hz": { "value": 6.33, "interval": [0.98 * 6.33, 1.02 * 6.33] },
                    "damping_ratio": { "value": 0.011, "interval": [0.98 * 0.011, 1.02 * 0.011] },
                },
                "drives": [{ "joint": "joint_1", "dof": 5, "stiffness": null }],
                "text": "tool 0.381 (±2.0 %) to 0.870 N/µm (±2.0 %), lowest mode 6.33 Hz (±2.0 %), damping 1.10 % (1.08 to 1.12 %), at the pose of record 3",
            },
        });
        assert_eq!(json, expected);
    }

    #[test]
    fn a_result_of_an_older_program_is_read() {
        let mut json = serde_json::to_value(ResultJson::from(&finding(2))).unwrap();
        for schema in [Some(1), None] {
            json["schema"] = json!(schema);
            if schema.is_none() {
                json.as_object_mut().unwrap().remove("schema");
            }
            let version: VersionJson = serde_json::from_value(json.clone()).unwrap();
            let found: FoundJson = serde_json::from_value(json.clone()).unwrap();
            assert_eq!((version.schema, found.joints.len(), found.fit.records), (1, 2, 3));
        }
    }

    #[test]
    fn a_status_has_its_state_in_words_and_as_a_kind() {
        let status = Status {
            uptime_s: 1.5,
            model: clipped("mill3"),
            joints: 3,
            interface: clipped("vcan0"),
            state: State::NoAngles([clipped("q2")].into_iter().collect()),
            record_fraction: 0.5,
            newest_record_s: None,
        };
        let expected = json!({
            "uptime_s": 1.5, "model": "mill3", "joints": 3, "interface": "vcan0",
            "state": "waiting for joint angles: q2 not seen", "state_kind": { "no_angles": ["q2"] },
            "record_fraction": 0.5, "newest_record_s": null,
        });
        assert_eq!(serde_json::to_value(StatusJson::from(&status)).unwrap(), expected);
        // The sample of the manual.
        let line = json!({ "status": expected });
        let manual = include_str!("../docs/live.md");
        let sample = manual.lines().find(|line| line.starts_with("{\"status\"")).unwrap();
        assert_eq!(serde_json::from_str::<serde_json::Value>(sample).unwrap(), line);
    }
}
