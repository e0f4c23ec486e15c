//! The bytes of every message.
//!
//! If a test here fails, programs in the field speak other bytes: raise `PROTOCOL_VERSION`, and add the new schema key below. The key of a
//! version that no release has may be replaced. The bytes of `Hello` and `Refused` must never change.

use std::fmt::Debug;

use flexid_wire::accuracy::Accuracy;
use flexid_wire::answer::*;
use flexid_wire::confidence::*;
use flexid_wire::directions::*;
use flexid_wire::explanation::*;
use flexid_wire::finding::Finding;
use flexid_wire::framing::{self, FRAME_BUFFER, MAX_FRAME, PREFIX};
use flexid_wire::left_over::{LeftOver, MAX_LEFT_OVER};
use flexid_wire::messages::*;
use flexid_wire::report::*;
use flexid_wire::residuals::{Meaning, Residuals};
use flexid_wire::spectra::{Band, MAX_BANDS, Spectra};
use flexid_wire::state::State;
use flexid_wire::text::clipped;
use flexid_wire::trouble::{BusFault, BusFaultKind, Trouble};
use flexid_wire::warning::*;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// The schema key of each protocol version; the last is the present one.
const SCHEMA_KEYS: [(u16, [u8; 8]); 15] = [
    (1, [27, 84, 154, 181, 40, 115, 78, 33]),
    (2, [228, 103, 188, 121, 18, 38, 118, 136]),
    (3, [199, 205, 85, 206, 40, 25, 67, 64]),
    (4, [36, 217, 217, 145, 110, 216, 69, 235]),
    (5, [18, 126, 187, 58, 40, 160, 246, 102]),
    (6, [168, 115, 231, 10, 187, 215, 178, 22]),
    (7, [164, 238, 162, 131, 174, 66, 220, 15]),
    (8, [55, 212, 26, 71, 23, 137, 159, 17]),
    (9, [178, 143, 119, 99, 46, 5, 169, 116]),
    (10, [20, 107, 33, 101, 102, 228, 157, 88]),
    (11, [38, 227, 52, 82, 59, 87, 202, 96]),
    (12, [120, 86, 121, 169, 189, 234, 115, 213]),
    (13, [72, 196, 183, 192, 63, 121, 25, 235]),
    (14, [212, 64, 106, 33, 110, 13, 55, 84]),
    (15, [186, 249, 66, 249, 69, 152, 2, 107]),
];

/// `message` is exactly these bytes, and these bytes are exactly `message`.
fn frozen<T: Serialize + DeserializeOwned + PartialEq + Debug>(message: T, hexadecimal: &str) {
    let mut buffer = [0; FRAME_BUFFER];
    let frame = framing::encode(&message, &mut buffer).unwrap();
    let text: String = frame.iter().map(|byte| format!("{byte:02x}")).collect();
    let expected: String = hexadecimal.split_whitespace().collect();
    assert_eq!(text, expected, "{message:?}");
    assert_eq!(framing::decode::<T>(&frame[PREFIX..]), Ok(message));
}

fn hello() -> Hello {
    Hello {
        protocol_version: 300,
        schema_key: [1, 2, 3, 4, 5, 6, 7, 8],
        software: clipped("flexid 0.1.0"),
    }
}

fn report() -> Report {
    use Verdict::{Identified, NotObservable, Weak};
    let joint = JointReport {
        name: clipped("joint_1"),
        stiffness: [1.0, 2.0, 3.0, 4.0, 5.0, 6.0],
        stiffness_std: [Some(0.5), None, Some(0.25), Some(1.0), Some(2.0), None],
        stiffness_verdict: [Identified, NotObservable, Weak, Identified, Identified, NotObservable],
        damping: [0.1, 0.2, 0.3, 0.4, 0.5, 0.6],
        damping_std: [None, Some(0.125), None, None, None, None],
        damping_verdict: [Weak, Identified, Identified, Identified, Identified, Identified],
    };
    Report {
        joints: [joint].into_iter().collect(),
        fit: Fit {
            records: 3,
            frames: 49_152,
            frames_lost: 7,
            ssp: 0.001,
            ssp_max: 0.01,
            consistency: 1.25,
            search_evaluations: 2000,
            refine_iterations: 6,
            starts: 1,
            bridged: 5,
            seconds: 2.5,
            acceptance: Acceptance::Consistent,
            found_by: FoundBy::Descent,
            random_searches: 3,
            branches: 4,
        },
        warnings: [Warning::BusErrors { errors: 300 }].into_iter().collect(),
    }
}

fn confidence() -> Confidence {
    let joint = JointIntervals {
        name: clipped("joint_1"),
        stiffness_interval: [Some([0.5, 2.0]), None, None, None, None, None],
        damping_interval: [None, None, None, None, None, Some([0.25, 4.0])],
    };
    let nuisance = Nuisance {
        name: clipped("delay"),
        entry: Some(Accuracy::DelayS),
        accuracy: Some(2.0),
        unit: clipped("s"),
        value: 0.5,
        std: Some(0.25),
        interval: Some([0.0, 1.0]),
        verdict: Verdict::Identified,
    };
    let unknowns = ["joint_1 tx stiffness", "joint_1 rz damping", "delay"];
    let direction = WeakDirection {
        relative_std: Some(0.5),
        shares: [("joint_1 rz damping", 0.75), ("delay", -0.5)]
            .map(|(name, weight)| Share { name: clipped(name), weight })
            .into_iter()
            .collect(),
        of_nuisance: true,
    };
    let deviation = |entry, std| Deviation {
        entry,
        name: clipped("TCP z"),
        unit: clipped("m"),
        value: 0.5,
        std,
        accuracy: 0.25,
    };
    let explanation = Explanation {
        deviation: deviation(Accuracy::TcpM, Some(0.125)),
        times: 2.0,
        share: 0.75,
        evidence: 8.0,
        adopted: true,
        rivals: [deviation(Accuracy::StiffnessOfRecord, None)].into_iter().collect(),
    };
    let held_out =
        HeldOut { pose: [1.0, 2.0].into_iter().collect(), frac: [1.0, 0.5, 0.25], vaf: [-1.0; 3] };
    Confidence {
        joints: [joint].into_iter().collect(),
        nuisances: [nuisance].into_iter().collect(),
        explanations: [explanation].into_iter().collect(),
        correlations: Correlations {
            unknowns: unknowns.into_iter().map(clipped).collect(),
            percent: [-100, 0, 99].into_iter().collect(),
        },
        weak_directions: [direction].into_iter().collect(),
        residuals: Residuals {
            consistency: 1.25,
            whiteness: 8.5,
            structure: 1.5,
            size_objects: false,
            whiteness_objects: true,
            structure_objects: true,
            meaning: Meaning::SmallError,
        },
        left_over: [LeftOver::Direction { axis: 2, times: 2.5 }].into_iter().collect(),
        held_out: [held_out].into_iter().collect(),
        retired: 300,
        left_out: 2,
        robust_widening: Some(0.5),
    }
}

fn answer() -> Answer {
    let number = |value, interval| Some(Number { value, interval });
    Answer {
        pose: [1.0, 0.5].into_iter().collect(),
        record: Some(300),
        softest: ToolStiffness {
            stiffness: number(2.0, Some([1.0, 4.0])),
            direction: Some([1.0, 0.0, -0.5]),
        },
        stiffest: ToolStiffness { stiffness: None, direction: None },
        lowest_mode: LowestMode { frequency_hz: number(8.0, None), damping_ratio: None },
        drives: [Drive { joint: clipped("joint_1"), dof: 5, stiffness: None }]
            .into_iter()
            .collect(),
    }
}

#[test]
fn schema_key_belongs_to_the_protocol_version() {
    assert_eq!(SCHEMA_KEYS.last(), Some(&(PROTOCOL_VERSION, SCHEMA_KEY)));
}

#[test]
fn to_edge() {
    frozen(ToEdge::Hello(hello()), "18000000 00 ac02 0102030405060708 0c666c6578696420302e312e30");
}

#[test]
fn from_edge_hello() {
    frozen(
        FromEdge::Hello(hello()),
        "18000000 00 ac02 0102030405060708 0c666c6578696420302e312e30",
    );
}

#[test]
fn from_edge_refused() {
    frozen(
        FromEdge::Refused(Refusal { reason: clipped("too old") }),
        "09000000 01 07746f6f206f6c64",
    );
}

#[test]
fn from_edge_status() {
    frozen(
        FromEdge::Status(Status {
            uptime_s: 1.5,
            model: clipped("mill3"),
            joints: 3,
            interface: clipped("vcan0"),
            state: State::NoAngles([clipped("q2")].into_iter().collect()),
            record_fraction: 0.5,
            newest_record_s: Some(0.5),
        }),
        "28000000 02 000000000000f83f 056d696c6c33 03 057663616e30 07 01 027132 0000003f 01 000000000000e03f",
    );
}

#[test]
fn from_edge_progress() {
    frozen(
        FromEdge::Progress(Progress {
            phase: Phase::Refining,
            fraction: 0.5,
            starts: 2,
            search_evaluations: 4000,
            refine_iterations: 3,
            search_loss: 0.25,
            records: 4,
        }),
        "0f000000 03 02 0000003f 02 a01f 03 0000803e 04",
    );
}

#[test]
fn from_edge_bus_health() {
    frozen(
        FromEdge::BusHealth(BusHealth {
            state: BusState::Down,
            frames: 1,
            frames_lost: 2,
            bridged: 3,
            restarts: 4,
            repeated: 5,
            frames_wrong_length: 6,
            frames_unknown: 7,
            frames_not_data: 8,
            frames_clipped: 9,
            kernel_dropped: 10,
            receive_buffer_bytes: 425_984,
            samples_discarded: 11,
            refused: 12,
            wrong_rate: 13,
            measured_rate_hz: 2000.0,
            frames_per_second: 4030.0,
            fault: Some(BusFault { interface: clipped("vcan0"), kind: BusFaultKind::Down }),
            errors: BusErrors {
                bus_off: 14,
                restarted: 15,
                controller_passive: 16,
                controller_warning: 17,
                controller_overflow: 18,
                protocol: 19,
                no_acknowledgement: 20,
                transceiver: 21,
                lost_arbitration: 22,
                transmit_timeout: 23,
            },
            doubtful_rate: 24,
            measured_rate_std_hz: 0.5,
        }),
        "35000000 05 01 01 02 03 04 05 06 07 08 09 0a 80801a 0b 0c 0d 0000fa44 00000000007caf40 \
         01 057663616e30 02 0e0f1011121314151617 18 0000003f",
    );
}

#[test]
fn from_edge_finding() {
    frozen(
        FromEdge::Finding(Finding {
            report: report(),
            confidence: confidence(),
            answer: Some(answer()),
        }),
        "d4020000 04 01 076a6f696e745f31 000000000000f03f 0000000000000040 \
         0000000000000840 0000000000001040 0000000000001440 0000000000001840 \
         01000000000000e03f 00 01000000000000d03f 01000000000000f03f \
         010000000000000040 00 000201000002 9a9999999999b93f 9a9999999999c93f \
         333333333333d33f 9a9999999999d93f 000000000000e03f 333333333333e33f 00 \
         01000000000000c03f 00 00 00 00 010000000000 03 808003 07 fca9f1d24d62503f \
         7b14ae47e17a843f 000000000000f43f d00f 06 01 05 0000000000000440 00 01 03 04 01 \
         16 ac02 \
         01 076a6f696e745f31 01000000000000e03f0000000000000040 00 00 00 00 00 \
         00 00 00 00 00 01000000000000d03f0000000000001040 01 0564656c6179 0100 010000000000000040 0173 000000000000e03f \
         01000000000000d03f 010000000000000000000000000000f03f 00 \
         01 0c 05544350207a 016d 000000000000e03f 01000000000000c03f 000000000000d03f \
         0000000000000040 000000000000e83f 0000000000002040 01 \
         01 17 05544350207a 016d 000000000000e03f 00 000000000000d03f \
         03 146a6f696e745f312074782073746966666e657373 126a6f696e745f3120727a2064616d70696e67 \
         0564656c6179 03 9c 00 63 01 01000000000000e03f 02 126a6f696e745f3120727a2064616d70696e67 \
         0000403f 0564656c6179 000000bf 01 000000000000f43f 0000000000002140 000000000000f83f 00 01 01 08 \
         01 01 02 0000000000000440 \
         01 02 000000000000f03f 0000000000000040 000000000000f03f \
         000000000000e03f 000000000000d03f 000000000000f0bf 000000000000f0bf 000000000000f0bf \
         ac02 02 01000000000000e03f \
         01 02 000000000000f03f 000000000000e03f 01 ac02 \
         01 0000000000000040 01 000000000000f03f0000000000001040 01 000000000000f03f0000000000000000000000000000e0bf \
         00 00 01 0000000000002040 00 00 01 076a6f696e745f31 05 00",
    );
}

#[test]
fn from_edge_spectra() {
    let band = Band {
        frequency_hz: 2.0,
        measured: [1.0, 0.5, 0.25],
        modelled: [2.0, 4.0, 8.0],
        noise: [0.125, 0.0, -1.0],
    };
    frozen(
        FromEdge::Spectra(Spectra {
            record: 300,
            pose: [1.0, 0.5].into_iter().collect(),
            band_hz: [2.0, 0.5],
            bands: [band].into_iter().collect(),
        }),
        "45000000 06 ac02 02 000000000000f03f 000000000000e03f 00000040 0000003f 01 00000040 \
         0000803f 0000003f 0000803e 00000040 00008040 00000041 0000003e 00000000 000080bf",
    );
}

#[test]
fn variants_keep_their_numbers() {
    frozen([Verdict::Identified, Verdict::Weak, Verdict::NotObservable], "03000000 000102");
    frozen([Verdict::Fixed], "01000000 03");
    frozen(
        [Acceptance::Consistent, Acceptance::ModelSuspect, Acceptance::Unsettled],
        "03000000 000102",
    );
    frozen(
        [Phase::Waiting, Phase::Searching, Phase::Refining, Phase::Settled],
        "04000000 00010203",
    );
    frozen([BusState::Up, BusState::Down, BusState::Gone], "03000000 000102");
    frozen([BusState::BusOff], "01000000 03");
    frozen(
        [FoundBy::Refinement, FoundBy::Descent, FoundBy::RandomSearch, FoundBy::Branch],
        "04000000 00010203",
    );
}

#[test]
fn json_names_of_variants() {
    let names = |json: &str, expected: &[&str]| {
        assert_eq!(serde_json::from_str::<Vec<String>>(json).unwrap(), expected);
    };
    let verdicts = [Verdict::Identified, Verdict::Weak, Verdict::NotObservable, Verdict::Fixed];
    names(
        &serde_json::to_string(&verdicts).unwrap(),
        &["identified", "weak", "not_observable", "fixed"],
    );
    let acceptances = [Acceptance::Consistent, Acceptance::ModelSuspect, Acceptance::Unsettled];
    names(
        &serde_json::to_string(&acceptances).unwrap(),
        &["consistent", "model_suspect", "unsettled"],
    );
}

/// Every string and list full, every number as long as it gets.
#[test]
fn the_fullest_finding_fits_a_frame() {
    let (report, confidence) = (fullest_report(), fullest_confidence());
    let finding = Finding { report, confidence, answer: Some(fullest_answer()) };
    let mut buffer = [0; FRAME_BUFFER];
    let frame = framing::encode(&FromEdge::Finding(finding), &mut buffer).unwrap();
    assert!((30_000..=MAX_FRAME).contains(&frame.len()), "{}", frame.len());
}

#[test]
fn the_fullest_spectra_are_a_small_message() {
    let band = Band { frequency_hz: 1.0, measured: [1.0; 3], modelled: [1.0; 3], noise: [1.0; 3] };
    let spectra = Spectra {
        record: u64::MAX,
        pose: std::iter::repeat_n(1.0, MAX_JOINTS).collect(),
        band_hz: [1.0, 2.0],
        bands: std::iter::repeat_n(band, MAX_BANDS).collect(),
    };
    let mut buffer = [0; FRAME_BUFFER];
    let frame = framing::encode(&FromEdge::Spectra(spectra), &mut buffer).unwrap();
    assert!((2400..2500).contains(&frame.len()), "{}", frame.len());
}

fn full<const N: usize>() -> heapless::String<N> {
    clipped("x".repeat(1000))
}

fn fullest_report() -> Report {
    let joint = JointReport {
        name: full(),
        stiffness_std: [Some(1.0); 6],
        damping_std: [Some(1.0); 6],
        ..report().joints[0].clone()
    };
    // The longest kind of warning.
    let trouble = Trouble::OtherBuses { file: full(), bus: full(), frames: u64::MAX };
    Report {
        joints: std::iter::repeat_n(joint, MAX_JOINTS).collect(),
        fit: Fit {
            records: u64::MAX,
            frames: u64::MAX,
            frames_lost: u64::MAX,
            search_evaluations: u64::MAX,
            refine_iterations: u64::MAX,
            starts: u32::MAX,
            random_searches: u32::MAX,
            branches: u32::MAX,
            bridged: u64::MAX,
            ..report().fit
        },
        warnings: std::iter::repeat_n(Warning::Trouble(trouble), MAX_WARNINGS).collect(),
    }
}

fn fullest_answer() -> Answer {
    let number = Some(Number { value: 1.0, interval: Some([1.0; 2]) });
    let tool = ToolStiffness { stiffness: number, direction: Some([1.0; 3]) };
    let drive = Drive { joint: full(), dof: 5, stiffness: number };
    Answer {
        pose: std::iter::repeat_n(1.0, MAX_JOINTS).collect(),
        record: Some(u64::MAX),
        softest: tool,
        stiffest: tool,
        lowest_mode: LowestMode { frequency_hz: number, damping_ratio: number },
        drives: std::iter::repeat_n(drive, MAX_JOINTS).collect(),
    }
}

fn fullest_confidence() -> Confidence {
    let some = confidence();
    let intervals = JointIntervals {
        name: full(),
        stiffness_interval: [Some([1.0, 2.0]); 6],
        damping_interval: [Some([1.0, 2.0]); 6],
    };
    let nuisance = Nuisance { name: full(), unit: full(), ..some.nuisances[0].clone() };
    let direction = WeakDirection {
        relative_std: Some(1.0),
        shares: std::iter::repeat_n(Share { name: full(), weight: 1.0 }, MAX_SHARES).collect(),
        of_nuisance: true,
    };
    let deviation =
        Deviation { name: full(), unit: full(), ..some.explanations[0].deviation.clone() };
    let explanation = Explanation {
        rivals: std::iter::repeat_n(deviation.clone(), MAX_RIVALS).collect(),
        deviation,
        ..some.explanations[0]
    };
    let left_over = LeftOver::Record {
        record: u8::MAX,
        pose: std::iter::repeat_n(1.0, MAX_JOINTS).collect(),
        times: 2.0,
    };
    let held_out = HeldOut {
        pose: std::iter::repeat_n(1.0, MAX_JOINTS).collect(),
        ..some.held_out[0].clone()
    };
    Confidence {
        joints: std::iter::repeat_n(intervals, MAX_JOINTS).collect(),
        nuisances: std::iter::repeat_n(nuisance, MAX_NUISANCES).collect(),
        correlations: Correlations {
            unknowns: std::iter::repeat_n(full(), MAX_UNKNOWNS).collect(),
            percent: std::iter::repeat_n(-100, MAX_PAIRS).collect(),
        },
        explanations: std::iter::repeat_n(explanation, MAX_EXPLANATIONS).collect(),
        weak_directions: std::iter::repeat_n(direction, MAX_DIRECTIONS).collect(),
        left_over: std::iter::repeat_n(left_over, MAX_LEFT_OVER).collect(),
        held_out: std::iter::repeat_n(held_out, MAX_HELD_OUT).collect(),
        retired: u64::MAX,
        left_out: u64::MAX,
        ..some
    }
}
