//! The simulated robot against recordings of the same robot made with an independent physics engine: pushed
//! by the recorded force, it shows the recorded acceleration but for noise.

#[path = "../../tests/common/mod.rs"]
mod common;

use std::fs::{self, File};
use std::io::Read as _;
use std::path::Path;
use std::time::Duration;

use flate2::read::MultiGzDecoder;
use flexid_core::stream::Reading;
use flexid_pipeline::config::Config;
use flexid_pipeline::signals::Decoder;
use flexid_pipeline::source::{CandumpLog, Flow, FrameSource as _};
use flexid_simulation::experiment::Cut;
use flexid_simulation::force::OVERSAMPLING;
use flexid_simulation::scenario::Scenario;
use flexid_simulation::truth;
use nalgebra::{DMatrix, DVector, Vector3};
use realfft::RealFftPlanner;
use serde_json::Value;
use tempfile::TempDir;

/// The force has nothing above, in parts of the sample rate.
const FORCE_BAND: f64 = 0.41;

/// A sample, or none where its frame was lost.
type Samples = Vec<Option<Vector3<f64>>>;

/// The files of a recording and of the scenario that its configuration names, side by side.
fn assembled(recording: &str) -> TempDir {
    let folder = common::folder();
    let recordings = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/recordings");
    // It has an edge.toml of its own.
    common::copy(&Path::new(recordings).join(recording), folder.path());
    folder
}

/// Force and acceleration of every experiment, `len` samples each.
fn recorded(config: &Config, folder: &Path, len: usize) -> Vec<[Samples; 2]> {
    let mut logs: Vec<_> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    logs.retain(|file| file.extension().is_some_and(|extension| extension == "gz"));
    logs.sort();
    let mut text = Vec::new();
    for log in &logs {
        MultiGzDecoder::new(File::open(log).unwrap()).read_to_end(&mut text).unwrap();
    }
    let mut log = CandumpLog::new(folder, text.as_slice());
    let mut frames = Vec::new();
    while log.read(&mut frames, Duration::ZERO).unwrap() == Flow::Open {}

    let truth = fs::read_to_string(folder.join("truth.json")).unwrap();
    let truth: Value = serde_json::from_str(&truth).unwrap();
    let experiments = truth["experiments"].as_array().unwrap();
    let mut recorded: Vec<_> =
        experiments.iter().map(|_| [0, 1].map(|_| -> Samples { vec![None; len] })).collect();
    let (mut experiment, mut last_s) = (0, frames[0].time_s);
    let mut decoder = Decoder::new(&config.signals);
    for arrival in &frames {
        // Experiments are a second of silence apart.
        experiment += usize::from(arrival.time_s > last_s + 0.5);
        last_s = arrival.time_s;
        // Counters start anywhere and wrap.
        let first = experiments[experiment]["seq_start"].as_u64().unwrap() as u16;
        let mut keep = |channel: usize, counter: u32, value: [f32; 3]| {
            let sample = usize::from((counter as u16).wrapping_sub(first));
            recorded[experiment][channel][sample] = Some(Vector3::from(value).cast());
        };
        let decoded =
            decoder.decode(arrival.time_s, &arrival.frame().unwrap(), |reading| match reading {
                Reading::Force { counter, value } => keep(0, counter, value),
                Reading::Acceleration { counter, value } => keep(1, counter, value),
                Reading::Joint { .. } | Reading::Setup(_) => {}
            });
        decoded.unwrap();
    }
    recorded
}

/// The force with the lost samples such that, with them, least is left where the force has nothing: above
/// [`FORCE_BAND`].
fn mended(samples: &Samples) -> Vec<Vector3<f64>> {
    let len = samples.len();
    let mut force: Vec<_> = samples.iter().map(|sample| sample.unwrap_or_default()).collect();
    let lost: Vec<_> = (0..len).filter(|&n| samples[n].is_none()).collect();
    // What passes a band above the force's, of a unit sample.
    let inverse = RealFftPlanner::<f64>::new().plan_fft_inverse(len);
    let (mut passes, mut above) = (inverse.make_input_vec(), inverse.make_output_vec());
    passes[(FORCE_BAND * len as f64) as usize..].fill((1.0 / len as f64).into());
    inverse.process(&mut passes, &mut above).unwrap();
    let above = |a: usize, b: usize| above[(len + a - b) % len];
    let among = DMatrix::from_fn(lost.len(), lost.len(), |a, b| above(lost[a], lost[b]));
    for axis in 0..3 {
        let seen = |at: usize| (0..len).map(|n| above(at, n) * force[n][axis]).sum::<f64>();
        let rest = DVector::from_iterator(lost.len(), lost.iter().map(|&at| -seen(at)));
        let values = among.clone().cholesky().unwrap().solve(&rest);
        lost.iter().zip(&values).for_each(|(&at, &value)| force[at][axis] = value);
    }
    force
}

/// The values between the samples of a band-limited signal that begins and ends at 0.
fn fine(samples: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let (coarse, fine) = (samples.len(), OVERSAMPLING * samples.len());
    let mut planner = RealFftPlanner::<f64>::new();
    let (forward, inverse) = (planner.plan_fft_forward(coarse), planner.plan_fft_inverse(fine));
    let mut out = vec![Vector3::zeros(); fine];
    for axis in 0..3 {
        let mut signal: Vec<_> = samples.iter().map(|sample| sample[axis]).collect();
        let mut spectrum = forward.make_output_vec();
        forward.process(&mut signal, &mut spectrum).unwrap();
        let mut padded = inverse.make_input_vec();
        let nyquist = spectrum.len() - 1;
        padded[..nyquist].copy_from_slice(&spectrum[..nyquist]);
        let mut signal = inverse.make_output_vec();
        inverse.process(&mut padded, &mut signal).unwrap();
        for (out, value) in out.iter_mut().zip(signal) {
            out[axis] = value / coarse as f64;
        }
    }
    out
}

/// RMS of what is left of the acceleration, over the noise that was added to it: the worst axis.
fn left_over(recording: &str) -> f64 {
    let folder = assembled(recording);
    let config = Config::load(&folder.path().join("edge.toml")).unwrap();
    let scenario = Scenario::load(&folder.path().join("mill3.toml"), &config.model).unwrap();
    let bushings =
        truth::load(&folder.path().join("truth.json"), &config).unwrap().whole().unwrap();
    let chain = config.model.chain().unwrap();
    let noise = scenario.measurement.acceleration_noise();
    let recorded = recorded(&config, folder.path(), scenario.measurement.samples());
    let mut worst = 0.0_f64;
    for (experiment, [force, acceleration]) in scenario.experiments.iter().zip(&recorded) {
        let cut = Cut {
            pose: experiment.pose.clone(),
            course: None,
            gravity: config.gravity.into(),
            accelerometer: config.accelerometer,
            mounting: config.mounting,
            rate_hz: config.rate_hz,
            force: fine(&mended(force)),
        };
        let response = cut.response(&chain, &bushings).acceleration;
        let pairs = || {
            let pairs = acceleration.iter().zip(&response);
            pairs.filter_map(|(recorded, simulated)| Some((recorded.as_ref()?, simulated)))
        };
        for axis in 0..3 {
            let count = pairs().count() as f64;
            let rms = |sum: f64| (sum / count).sqrt();
            let size = rms(pairs().map(|(recorded, _)| recorded[axis].powi(2)).sum());
            let left = rms(pairs().map(|(a, b)| (a[axis] - b[axis]).powi(2)).sum());
            println!("{recording}, {} axis {axis}: {:.3} noises", experiment.name, left / noise);
            assert!(size > 10.0 * noise, "nothing to compare: {size} m/s²");
            worst = worst.max(left / noise);
        }
    }
    worst
}

#[test]
fn moves_like_the_robot_of_an_independent_physics_engine() {
    let left = left_over("nominal");
    assert!(left < 1.03, "{left} times the noise");
}

/// Another robot, which sags, with an accelerometer that turns with the tool; 0.5 % of the frames are lost.
#[test]
fn moves_like_it_under_gravity() {
    let left = left_over("gravity_drops");
    assert!(left < 1.04, "{left} times the noise");
}
