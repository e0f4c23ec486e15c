//! Every kind of warning, state and residual: its bytes, its JSON, and its line for people, as `lines.txt` holds them.
//!
//! If a test here fails for the bytes, raise `PROTOCOL_VERSION` and mend `lines.txt`. Scripts rely on the names in the JSON.

use std::fmt::{Debug, Display};
use std::str::Lines;

use flexid_wire::accuracy::Accuracy;
use flexid_wire::axes::{SignedAxis, WrongAxes};
use flexid_wire::explanation::Deviation;
use flexid_wire::implausible::*;
use flexid_wire::left_over::LeftOver;
use flexid_wire::misfits::*;
use flexid_wire::rate::*;
use flexid_wire::residuals::*;
use flexid_wire::state::*;
use flexid_wire::text::clipped;
use flexid_wire::trouble::*;
use flexid_wire::unused::*;
use flexid_wire::warning::*;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// The frozen lines that have not been compared yet.
struct Frozen(Lines<'static>);

impl Frozen {
    /// Compares all variants of an enum, in their order: `values` has each of them once.
    fn all<T>(&mut self, name: &str, values: &[T])
    where
        T: Serialize + DeserializeOwned + PartialEq + Debug + Display,
    {
        for (number, value) in values.iter().enumerate() {
            let bytes = self.one(name, value);
            assert_eq!(usize::from(bytes[0]), number, "{value:?} is not the next variant");
        }
        // Zeros are the fields of any variant.
        let mut next = [0; 64];
        next[0] = values.len() as u8;
        let next = postcard::take_from_bytes::<T>(&next);
        assert!(next.is_err(), "{name} has a variant that is not tested: {next:?}");
    }

    /// Compares one value. Returns its bytes.
    fn one<T>(&mut self, name: &str, value: &T) -> Vec<u8>
    where
        T: Serialize + DeserializeOwned + PartialEq + Debug + Display,
    {
        let mut buffer = [0; 1024];
        let bytes = postcard::to_slice(value, &mut buffer).unwrap().to_vec();
        assert_eq!(postcard::from_bytes::<T>(&bytes).as_ref(), Ok(value));
        let json = serde_json::to_string(value).unwrap();
        assert_eq!(serde_json::from_str::<T>(&json).as_ref().unwrap(), value);
        let line = value.to_string();
        assert!(!line.is_empty() && !line.contains('\n'), "{line:?}");
        let hexadecimal: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        for part in [format!("{name} {hexadecimal}"), format!("  {json}"), format!("  {line}")] {
            assert_eq!(self.0.next(), Some(part.as_str()), "{value:?}");
        }
        bytes
    }
}

fn signals(frames: &[u64]) -> Signals {
    let names = ["Fx", "Fy", "Fz"].map(clipped).into_iter();
    names.zip(frames).map(|(signal, frames)| SignalFrames { signal, frames: *frames }).collect()
}

fn implausible() -> [Implausible; 8] {
    let joint = BeyondLimits {
        signal: clipped("q2"),
        joint: clipped("joint_2"),
        slides: false,
        value: 57.3,
        limits: [Some(-2.1), Some(2.1)],
        in_other_unit: true,
        others: 2,
    };
    [
        Implausible::BeyondLimits(joint),
        Implausible::GravityDenied {
            reading: 9.79,
            by: GravityDenial::Inertial,
            file: clipped("edge.toml"),
        },
        Implausible::GravityInUnit { reading: 1.01, unit: AccelerationUnit::G },
        Implausible::Stuck(signals(&[8192])),
        Implausible::Flat(signals(&[21, 20])),
        Implausible::Spikes(signals(&[1, 9, 3])),
        Implausible::Clipped(WrongSamples { signals: signals(&[840, 12]), refused: 2 }),
        Implausible::Held(WrongSamples { signals: signals(&[15]), refused: 0 }),
    ]
}

fn misfit(kind: MisfitKind) -> Misfit {
    Misfit { id: FrameId::Standard(0x101), kind, frames: 640, others_fit: false }
}

fn unknown_frames() -> UnknownFrames {
    let came = [(FrameId::Extended(0x0CF0_0400), 8193), (FrameId::Standard(0x7FF), 12)];
    UnknownFrames {
        expected: [0x101, 0x102, 0x111].map(FrameId::Standard).into_iter().collect(),
        more_expected: 2,
        came: came.map(|(id, frames)| IdFrames { id, frames }).into_iter().collect(),
        more_came: 0,
    }
}

fn rate() -> WrongRate {
    WrongRate { file: clipped("edge.toml"), rate_hz: 2000.0, measured_hz: 2004.0 }
}

fn bus_fault(kind: BusFaultKind) -> BusFault {
    BusFault { interface: clipped("can0"), kind }
}

fn residuals(
    meaning: Meaning,
    [size_objects, whiteness_objects, structure_objects]: [bool; 3],
) -> Residuals {
    Residuals {
        consistency: 2.125,
        whiteness: 0.5,
        structure: 0.14,
        size_objects,
        whiteness_objects,
        structure_objects,
        meaning,
    }
}

fn on_bounds(parameters: usize) -> OnBounds {
    let ends = [End::Lower, End::Upper].into_iter().cycle().take(parameters);
    let on_bound =
        |(dof, end)| OnBound { parameter: clipped(format_args!("joint_1 r{dof} damping")), end };
    ends.enumerate().map(|(dof, end)| on_bound((dof, end))).collect()
}

fn line(frequency_hz: f64, amplitude: f64, records: u32) -> Line {
    Line { frequency_hz, amplitude, records }
}

fn warnings() -> Vec<Warning> {
    let [joint, ..] = implausible();
    vec![
        Warning::Disproportion { ratio: 0.1, suspect: WrongUnit::AccelerationInG },
        Warning::Implausible(joint),
        Warning::UnsureMinimum(UnsureCause::FewPoses { directions: 8, or_more: true }),
        Warning::FewStaticTests,
        Warning::UnsettledStaticTests,
        Warning::OnStatedBounds { parameters: on_bounds(3), advice: BoundsAdvice::Widen },
        Warning::Objection(Objection::WrongModel { consistency: 84.25 }),
        Warning::ImposedParameters,
        Warning::StaticTestsOff { deviations: 3.5 },
        Warning::OnMassBounds(on_bounds(9)),
        Warning::RecordsContradict,
        Warning::RobotChanged { forgotten: 3 },
        Warning::Trouble(Trouble::Bus(bus_fault(BusFaultKind::Gone))),
        Warning::MoreTroubles { troubles: 1 },
        Warning::Unused(Unused::Unfinished { records: 2 }),
        Warning::Repeated { records: 4, again: 24, original: 4 },
        Warning::WrongRate { records: 1, rate: rate(), used: RateUsed::Measured },
        Warning::AtLimit(signals(&[3, 1])),
        Warning::MadeRoom { records: 5, poses: 1 },
        Warning::TooShort { records: 2 },
        Warning::WrongLength {
            frames: 641,
            worst: misfit(MisfitKind::Length { got: 7, expected: 8 }),
        },
        Warning::Misfit(misfit(MisfitKind::Incomplete)),
        Warning::BusErrors { errors: 300 },
        Warning::NoRecord(State::NoForce),
        Warning::StaticOutlier { line: 12, deviations: 6.5, chance: 0.000244140625 },
        Warning::Lines {
            lines: [line(50.0, 0.015, 3), line(167.79, 0.25, 1)].into_iter().collect(),
            more: 1,
        },
        Warning::Contradicted { deviation: tcp(), times: 3.125, rivals: 2 },
        Warning::WrongAxes(WrongAxes {
            share: 0.0859375,
            force: None,
            acceleration: Some([signed(0, true), signed(2, false), signed(1, false)]),
        }),
        Warning::LouderCut { axis: 2, from_hz: 100.25, to_hz: 150.5, times: 2.25, records: 3 },
        Warning::AssumedPerfect,
    ]
}

fn signed(axis: u8, negative: bool) -> SignedAxis {
    SignedAxis { axis, negative }
}

fn tcp() -> Deviation {
    Deviation {
        entry: Accuracy::TcpM,
        name: clipped("TCP z"),
        unit: clipped("m"),
        value: 3.125e-3,
        std: Some(0.0625e-3),
        accuracy: 1e-3,
    }
}

fn states() -> Vec<State> {
    let [_, _, _, stuck, ..] = implausible();
    let implausible = Some(stuck);
    vec![
        State::NoFrames,
        State::OnlyErrors { errors: 7, interface: clipped("can0") },
        State::BusFault(bus_fault(BusFaultKind::Down)),
        State::Obstacle(Obstacle::NotFinite { readings: 12 }),
        State::UnknownFrames(unknown_frames()),
        State::NoForce,
        State::NoAcceleration,
        State::NoAngles(["joint_1", "joint_3"].map(clipped).into_iter().collect()),
        State::AwaitingRecord { seconds: 4.096, faint_force_n: Some(0.25), implausible: None },
        State::AngleStopped { joint: clipped("joint_3"), implausible: None },
        State::Measuring { implausible },
        State::Unused(Unused::Refused { records: 1, first: RecordFault::NoForce }),
        State::SensorSilent(Sensor::Force),
        State::AngleNotAvailable { joint: clipped("joint_2"), value: 2147.483647 },
    ]
}

#[test]
fn every_kind_is_frozen() {
    let mut frozen = Frozen(include_str!("lines.txt").lines());
    frozen.all("Warning", &warnings());
    frozen.all("State", &states());
    frozen.all("Implausible", &implausible());
    for (value, limits) in [(-0.25, [Some(0.0), None]), (0.75, [None, Some(0.5)])] {
        let slide = BeyondLimits {
            signal: clipped("z"),
            joint: clipped("lift"),
            slides: true,
            value,
            limits,
            in_other_unit: false,
            others: 0,
        };
        frozen.one("BeyondLimits", &slide);
    }
    for kind in
        [MisfitKind::Length { got: 7, expected: 8 }, MisfitKind::Remote, MisfitKind::Incomplete]
    {
        frozen.one("Misfit", &misfit(kind));
    }
    frozen.one("UnknownFrames", &unknown_frames());
    let obstacles = [
        Obstacle::Misfit(misfit(MisfitKind::Remote)),
        Obstacle::WrongRate(rate()),
        Obstacle::CounterStandsStill { sensor: Sensor::Force, frames: 639 },
        Obstacle::CountersApart { jumps: 12 },
        Obstacle::NotFinite { readings: 12 },
        Obstacle::Clipped { frames: 12 },
        Obstacle::CountersJump { jumps: 7, lost: 1 },
    ];
    frozen.all("Obstacle", &obstacles);
    frozen.all(
        "RateUsed",
        &[
            RateUsed::Measured,
            RateUsed::Configured,
            RateUsed::TooFast,
            RateUsed::Uncertain { std_hz: 0.5 },
        ],
    );
    frozen.all(
        "Trouble",
        &[
            Trouble::Bus(bus_fault(BusFaultKind::Down)),
            Trouble::BusBroken(clipped("Input/output error (os error 5)")),
            Trouble::RecordingBroken(clipped(
                "a.log:2: cannot be read: worn out: copy or record it again",
            )),
            Trouble::Unreadable(clipped(
                "b.log:2: cannot be read: worn out: copy or record it again",
            )),
            Trouble::Garbage {
                file: clipped("a.log"),
                line: 2,
                fault: LineFault::Timestamp,
                lines: 5,
                of: 7,
            },
            Trouble::OtherBuses { file: clipped("a.log"), bus: clipped("can0"), frames: 2 },
            Trouble::Stamps { file: clipped("a.log"), fault: StampFault::Jump, frames: 2 },
            Trouble::Dropped { file: clipped("a.log"), frames: 15 },
        ],
    );
    for kind in [
        BusFaultKind::ManyErrors,
        BusFaultKind::ErrorPassive,
        BusFaultKind::Down,
        BusFaultKind::BusOff,
        BusFaultKind::Gone,
    ] {
        frozen.one("BusFault", &bus_fault(kind));
    }
    frozen.all(
        "LineFault",
        &[
            LineFault::EndsEarly,
            LineFault::Timestamp,
            LineFault::DeviceName,
            LineFault::Frame,
            LineFault::Direction,
            LineFault::NotText,
        ],
    );
    let unused = [
        Unused::Refused { records: 2, first: RecordFault::Bins(3) },
        Unused::Unfinished { records: 1 },
    ];
    frozen.all("Unused", &unused);
    frozen.all(
        "RecordFault",
        &[
            RecordFault::NoEquilibrium {
                joint: clipped("joint_2"),
                pose: [0.5, -1.25].into_iter().collect(),
            },
            RecordFault::Pose(4),
            RecordFault::Samples(100),
            RecordFault::Bins(3),
            RecordFault::NotFinite,
            RecordFault::NoForce,
            RecordFault::Uneven,
        ],
    );
    let consistency = 2.125;
    frozen.all(
        "Objection",
        &[
            Objection::StaticMisfit { consistency },
            Objection::LoudNoise { consistency: 0.02 },
            Objection::WrongMinimum { consistency, structure: Some(0.18) },
            Objection::WrongModel { consistency },
            Objection::SlightlyWrongModel { consistency },
            Objection::NoisierCut { consistency },
            Objection::Structure { structure: 0.18 },
            Objection::Distortion { consistency, part: 0.25 },
        ],
    );
    let both = [true; 3];
    let size = [true, false, false];
    let structure = [false, true, true];
    let none = [false; 3];
    for (meaning, objects) in [
        (Meaning::Noise, none),
        // There is a structure that does not matter.
        (Meaning::Noise, [false, true, false]),
        (Meaning::NoisierCut, [true, true, false]),
        (Meaning::StaticNoise, none),
        (Meaning::StaticMisfit, size),
        (Meaning::LoudNoise, none),
        (Meaning::StaticTests, none),
        (Meaning::WrongMinimum, both),
        (Meaning::WrongModel, both),
        (Meaning::NoisierCut, size),
        (Meaning::SmallError, structure),
    ] {
        frozen.one("Residuals", &residuals(meaning, objects));
    }
    frozen.all(
        "LeftOver",
        &[
            LeftOver::Frequency { from_hz: 63.5, to_hz: 89.8, times: 3.4 },
            LeftOver::Direction { axis: 2, times: 2.2 },
            LeftOver::Record { record: 2, pose: [0.3, -0.45].into_iter().collect(), times: 2.0 },
            LeftOver::Time { from: 0.875, to: 1.0, times: 1.75 },
            LeftOver::Force { exponent: 3.0, std: 0.25 },
            LeftOver::Stiffness { growth: 0.03125, std: 0.0078125 },
            LeftOver::Distortion { part: 0.25 },
        ],
    );
    frozen.one("LeftOver", &LeftOver::Force { exponent: 0.0, std: 0.25 });
    frozen.all("GravityDenial", &[GravityDenial::NoGravity, GravityDenial::Inertial]);
    frozen.all(
        "AccelerationUnit",
        &[AccelerationUnit::G, AccelerationUnit::MilliG, AccelerationUnit::MillimetrePerS2],
    );
    frozen.all("Sensor", &[Sensor::Force, Sensor::Acceleration]);
    frozen.all(
        "WrongUnit",
        &[
            WrongUnit::ForceInMilli,
            WrongUnit::AccelerationInG,
            WrongUnit::ForceInKiloOrAccelerationInMilli,
        ],
    );
    frozen
        .all("BoundsAdvice", &[BoundsAdvice::Widen, BoundsAdvice::AddTests, BoundsAdvice::Remove]);
    let unsure = [
        UnsureCause::Other,
        UnsureCause::FewPoses { directions: 1, or_more: false },
        UnsureCause::Noise { ssp: 0.25 },
    ];
    for cause in unsure {
        frozen.one("UnsureMinimum", &Warning::UnsureMinimum(cause));
    }
    frozen.one("Repeated", &Warning::Repeated { records: 1, again: 24, original: 4 });
    let unknown = WrongAxes { share: 0.5, force: None, acceleration: None };
    frozen.one("WrongAxes", &Warning::WrongAxes(unknown));
    frozen.one("MadeRoom", &Warning::MadeRoom { records: 1, poses: 0 });
    assert_eq!(frozen.0.next(), None);
}
