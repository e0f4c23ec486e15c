//! The simulated robot against recordings of the same robot made with an independent physics engine, whose
//! equations are not linearised: pushed by the recorded force, it shows the recorded acceleration but for noise.

use std::fs::File;
use std::io::Read as _;
use std::path::Path;

use flate2::read::MultiGzDecoder;
use flexid::simulation::experiment::Cut;
use flexid::simulation::force::OVERSAMPLING;
use flexid::simulation::scenario::Scenario;
use flexid_core::stream::Reading;
use flexid_edge::config::Config;
use flexid_edge::source::{CandumpLog, Flow, FrameSource as _};
use nalgebra::Vector3;
use realfft::RealFftPlanner;

/// Force and acceleration of a recorded experiment, which lost no frame.
fn recorded(config: &Config, experiment: usize) -> [Vec<Vector3<f64>>; 2] {
    let file = format!(
        "{}/../tests/recordings/nominal/exp_{experiment:02}.log.gz",
        env!("CARGO_MANIFEST_DIR")
    );
    let mut text = Vec::new();
    MultiGzDecoder::new(File::open(&file).unwrap()).read_to_end(&mut text).unwrap();
    let mut log = CandumpLog::new(Path::new(&file), text.as_slice());
    let mut frames = Vec::new();
    while log.read(&mut frames, std::time::Duration::ZERO).unwrap() == Flow::Open {}
    let [mut force, mut acceleration] = [Vec::new(), Vec::new()];
    for arrival in &frames {
        let vector = |value: [f32; 3]| Vector3::from(value).cast();
        config
            .signals
            .decode(&arrival.frame, |reading| match reading {
                Reading::Force { value, .. } => force.push(vector(value)),
                Reading::Acceleration { value, .. } => acceleration.push(vector(value)),
                Reading::Joint { .. } => {}
            })
            .unwrap();
    }
    [force, acceleration]
}

/// What was between the samples of a band-limited signal that begins and ends at 0.
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

#[test]
fn moves_like_the_robot_of_an_independent_physics_engine() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenario");
    let config = Config::load(&folder.join("edge.toml")).unwrap();
    let scenario = Scenario::load(&folder.join("mill3.toml"), &config.model).unwrap();
    let chain = config.model.chain().unwrap();
    let noise = scenario.measurement.acceleration_noise();
    for (index, experiment) in scenario.experiments.iter().enumerate() {
        let [force, acceleration] = recorded(&config, index);
        let cut =
            Cut { pose: experiment.pose.clone(), rate_hz: config.rate_hz, force: fine(&force) };
        let response = cut.response(&chain, &scenario.truth).acceleration;
        assert_eq!(response.len(), acceleration.len());
        for axis in 0..3 {
            let rms = |values: &mut dyn Iterator<Item = f64>| {
                (values.map(|value| value * value).sum::<f64>() / response.len() as f64).sqrt()
            };
            let size = rms(&mut acceleration.iter().map(|a| a[axis]));
            let pairs = acceleration.iter().zip(&response);
            let left =
                rms(&mut pairs.map(|(recorded, simulated)| recorded[axis] - simulated[axis]));
            assert!(size > 10.0 * noise, "nothing to compare: {size} m/s²");
            assert!(
                left < 1.03 * noise,
                "{} axis {axis}: {left} m/s² left, noise {noise}",
                experiment.name
            );
        }
    }
}
