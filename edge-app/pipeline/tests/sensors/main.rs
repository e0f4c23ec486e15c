//! Layouts of sensors that can be bought, against cantools, another program that reads DBC files.
//!
//! `make.py` wrote the logs and what cantools reads in them, and says how to write them again.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use flexid_core::stream::Reading;
use flexid_pipeline::check::survey;
use flexid_pipeline::config::Config;
use flexid_pipeline::signals::{Clocks, Decoder, NoReading};
use flexid_pipeline::source::{CandumpLog, Flow, FrameSource as _};
use flexid_wire::misfits::{FrameId, Misfit, MisfitKind};
use flexid_wire::state::{Obstacle, State};

/// Samples of several frames that show the order of their frames.
const SHOWN: usize = 64;

/// Sensor (0: force, 1: acceleration), counter, axes in SI units.
type Sample = (usize, u32, [f64; 3]);

/// What flexid reads in a log.
struct Read {
    config: Config,
    samples: Vec<Sample>,
    left_out: u64,
    refused: Vec<NoReading>,
}

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/sensors").join(name)
}

fn read(name: &str) -> Read {
    let config = Config::load(&file(&format!("{name}.toml"))).unwrap();
    let log = fs::read(file(&format!("{name}.log"))).unwrap();
    let mut source = CandumpLog::new(Path::new(name), log.as_slice());
    let mut frames = Vec::new();
    while source.read(&mut frames, Duration::ZERO).unwrap() == Flow::Open {}
    let mut decoder = Decoder::new(&config.signals);
    let (mut samples, mut refused) = (Vec::new(), Vec::new());
    for arrival in frames {
        let note = |reading| match reading {
            Reading::Force { counter, value } => samples.push((0, counter, value.map(f64::from))),
            Reading::Acceleration { counter, value } => {
                samples.push((1, counter, value.map(f64::from)));
            }
            Reading::Joint { .. } | Reading::Setup(_) => {}
        };
        refused.extend(decoder.decode(arrival.time_s, &arrival.frame().unwrap(), note).err());
    }
    let left_out = decoder.left_out();
    Read { config, samples, left_out, refused }
}

/// What cantools reads in a log: the samples of which every frame is there. A sensor without a counter has the number of the sample.
fn expected(name: &str) -> Vec<Sample> {
    let text = fs::read_to_string(file(&format!("{name}.csv"))).unwrap();
    let sample = |line: &str| {
        let mut cells = line.split(',');
        let sensor = usize::from(cells.next() != Some("force"));
        let counter = cells.next().unwrap().parse().unwrap();
        (sensor, counter, [0, 1, 2].map(|_| cells.next().unwrap().parse().unwrap()))
    };
    text.lines().map(sample).collect()
}

/// Compares the samples of a log with those of cantools. Those of a sensor with several frames begin when their order is known.
fn compare(name: &str, has_several_frames: [bool; 2]) -> Read {
    let read = read(name);
    for sensor in [0, 1] {
        let of = |samples: &[Sample]| -> Vec<Sample> {
            samples.iter().filter(|(own, ..)| *own == sensor).copied().collect()
        };
        let skipped = if has_several_frames[sensor] { SHOWN } else { 0 };
        let (got, expected) = (of(&read.samples), of(&expected(name)));
        let expected = &expected[skipped..];
        assert_eq!(got.len(), expected.len(), "{name}, sensor {sensor}");
        let is_counted = match read.config.signals.clocks {
            Clocks::Common => true,
            Clocks::Own(bits) => bits[sensor].is_some(),
        };
        let begins_at = if is_counted { 0 } else { skipped as u32 };
        for ((_, counter, axes), (_, number, values)) in got.iter().zip(expected) {
            assert_eq!(*counter, number - begins_at, "{name}, sensor {sensor}");
            for (axis, value) in axes.iter().zip(values) {
                let is_same = (axis - value).abs() <= 1e-6 * value.abs().max(1e-3);
                let is_none = axis.is_nan() && value.is_nan();
                assert!(is_same || is_none, "{name}, {sensor}, {number}: {axis} for {value}");
            }
        }
    }
    read
}

/// What the simulator sends, the daemon reads: forces through the matrix as well.
#[test]
fn what_is_encoded_is_decoded() {
    for name in ["ati-xsens", "wacoh-pcan", "robotous-floats", "can-fd", "jr3-mbed"] {
        let signals = Config::load(&file(&format!("{name}.toml"))).unwrap().signals;
        let mut decoder = Decoder::new(&signals);
        let mut read = [Vec::new(), Vec::new()];
        let values = [[100.0, -20.0, 3.0], [1.0, -5.0, 0.5]];
        for counter in 0..100 {
            let readings = [
                Reading::Force { counter, value: values[0] },
                Reading::Acceleration { counter, value: values[1] },
            ];
            for (place, frame) in signals.encode(&readings).unwrap().iter().enumerate() {
                let time_s = 1e-3 * f64::from(counter) + 1e-4 * place as f64;
                let note = |reading| match reading {
                    Reading::Force { value, .. } => read[0].push(value),
                    Reading::Acceleration { value, .. } => read[1].push(value),
                    Reading::Joint { .. } | Reading::Setup(_) => {}
                };
                decoder.decode(time_s, frame, note).unwrap();
            }
        }
        let steps = [signals.force_resolution, signals.acceleration_resolution];
        for ((read, value), step) in read.iter().zip(values).zip(steps) {
            assert!(read.len() >= 100 - SHOWN, "{name}: {}", read.len());
            for (own, expected) in read.iter().flatten().zip(value.iter().cycle()) {
                let error = (own - expected).abs();
                assert!(error <= step.max(1e-6 * expected.abs()), "{name}: {own} for {expected}");
            }
        }
    }
}

/// Gauges and a matrix, two frames a sample that are asked for; a counter in a frame of its own. No halves of two samples are put together.
#[test]
fn ati_and_xsens() {
    let read = compare("ati-xsens", [true, true]);
    assert_eq!(read.config.signals.clocks, Clocks::Own([None, Some(16)]));
    assert_eq!(read.left_out, 10, "the other half of each sample that lost one");
    // A request has no data. The time of the sample is not read.
    let requests = read.refused.iter().filter(|why| **why == NoReading::NotData).count();
    let others = read.refused.iter().filter(|why| **why == NoReading::UnknownId).count();
    assert_eq!((requests, others, read.refused.len()), (97, 100, 197));
    // Rounding of the gauges, as noise: the third row.
    let step = [1.8612, 0.0412, 1.8823, 0.0331, 1.8714, 0.0256_f64];
    let step = step.iter().map(|own| own * own).sum::<f64>().sqrt();
    assert!((f64::from(read.config.signals.force_resolution) / step - 1.0).abs() < 1e-6);
    assert_eq!(read.config.signals.axes[..3], ["force x", "force y", "force z"]);
}

/// Unsigned with an offset, big-endian, an extended identifier; mG.
#[test]
fn wacoh_and_pcan_gps() {
    let read = compare("wacoh-pcan", [false, false]);
    assert_eq!(read.config.signals.clocks, Clocks::Own([None, None]));
    assert_eq!((read.left_out, read.refused.len()), (0, 0));
}

/// Floats of both byte orders, without a unit; the frame of the higher identifier comes first; a value that is no number.
#[test]
fn robotous_and_floats() {
    let read = compare("robotous-floats", [false, true]);
    assert_eq!(read.config.signals.clocks, Clocks::Own([None, Some(16)]));
    assert_eq!(read.left_out, 4);
    let step = 9.80665 * f32::EPSILON;
    assert!((read.config.signals.acceleration_resolution / step - 1.0).abs() < 1e-6);
}

/// 46 bytes in a frame of 48, numbers of 32 and 64 bits, kN, one counter of both.
#[test]
fn can_fd() {
    let read = compare("can-fd", [false, false]);
    assert_eq!(
        (read.config.signals.clocks, read.config.signals.counter_bits),
        (Clocks::Common, 32)
    );
    assert_eq!((read.left_out, read.refused.len()), (0, 0));
}

/// Two counters of 16 bits that begin apart, and a frame of moments that is not read.
#[test]
fn jr3_and_xsens() {
    let read = compare("jr3-mbed", [false, true]);
    assert_eq!(read.config.signals.clocks, Clocks::Own([Some(16), Some(16)]));
    assert_eq!(read.left_out, 2);
    assert_eq!(read.refused, vec![NoReading::UnknownId; 99 + 100]);
    // A lost frame is a gap in the counter, also where this begins anew.
    let of_force = read.samples.iter().filter(|(sensor, ..)| *sensor == 0);
    let counters: Vec<u16> = of_force.map(|(_, counter, _)| *counter as u16).collect();
    let expected =
        (0..100).filter(|sample| *sample != 70).map(|sample| 65480_u16.wrapping_add(sample));
    assert_eq!(counters, expected.collect::<Vec<_>>());
}

/// A sensor of which one frame never comes has no sample, and is not silent.
#[test]
fn a_frame_that_never_comes_is_named() {
    let config = Config::load(&file("ati-xsens.toml")).unwrap();
    let line = |number| format!("(1767000000.{:06}) can0 200#0000EDBFF5F9F5DF\n", 1000 * number);
    let log: String = (0..1000).map(line).collect();
    let mut source = CandumpLog::new(Path::new("half.log"), log.as_bytes());
    let survey = survey(&config, &mut source, |_| {}).unwrap();
    let (id, kind) = (FrameId::Standard(0x200), MisfitKind::Incomplete);
    let misfit = Misfit { id, kind, frames: 896, others_fit: true };
    assert_eq!(survey.state, State::Obstacle(Obstacle::Misfit(misfit)));
}
