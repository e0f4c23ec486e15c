//! The spectra that a daemon sends of a simulated cut, against a Fourier transform of what was simulated.

use std::collections::BTreeMap;
use std::io::{self, BufRead as _, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;
use std::time::Duration;

use console::strip_ansi_codes;
use flexid_core::stream::Reading;
use flexid_edge::daemon;
use flexid_edge::server::Listener;
use flexid_pipeline::config::{Config, Listen};
use flexid_pipeline::signals::Decoder;
use flexid_pipeline::source::{Arrival, Flow, FrameSource, SourceHealth};
use flexid_pipeline::stop::Stop;
use flexid_simulation::experiment::Cut;
use flexid_simulation::scenario::Scenario;
use flexid_simulation::transmission::{Quality, transmit};
use rand_core::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use realfft::RealFftPlanner;
use serde_json::Value;

use super::terminal::Terminal;

/// Number of bands.
const BANDS: f64 = 60.0;
/// Start of the time of the frames, s.
const START_S: f64 = 1e9;

/// A bus that carries some frames and then nothing.
struct Bus(std::vec::IntoIter<Arrival>);

impl FrameSource for Bus {
    fn read(&mut self, batch: &mut Vec<Arrival>, timeout: Duration) -> io::Result<Flow> {
        let before = batch.len();
        batch.extend(self.0.by_ref().take(50));
        if batch.len() == before {
            thread::sleep(timeout);
        }
        Ok(Flow::Open)
    }

    fn health(&self) -> SourceHealth {
        SourceHealth::default()
    }
}

/// Runs `test` beside a daemon that hears these frames; it gets the path of the daemon's socket.
fn with_daemon<T>(config: &Config, frames: Vec<Arrival>, test: impl FnOnce(&Path) -> T) -> T {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flexid.sock");
    let listeners = [Listener::bind(&Listen::Unix(path.clone())).unwrap()];
    let stop = Stop::new();
    let mut bus = Bus(frames.into_iter());
    thread::scope(|scope| {
        scope.spawn(|| daemon::run(config, &mut bus, &listeners, &stop).unwrap());
        let outcome = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| test(&path)));
        stop.request();
        outcome.unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    })
}

/// The first report of a daemon, as `watch --json` prints it.
fn report(path: &Path) -> Value {
    let mut watch = Command::new(env!("CARGO_BIN_EXE_flexid"))
        .args(["watch", &format!("unix:{}", path.display()), "--json", "--timeout", "120"])
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let lines = BufReader::new(watch.stdout.take().unwrap()).lines();
    let mut lines = lines.map(|line| serde_json::from_str::<Value>(&line.unwrap()).unwrap());
    let report = lines.find(|line| line.get("fit").is_some());
    // It may have ended already.
    let _ = watch.kill();
    watch.wait().unwrap();
    report.expect("no report came")
}

/// Amplitude spectral densities of one side in the bands: frequency, Hz, and that of each signal, per √Hz.
fn densities(signals: &[Vec<f64>; 3], rate_hz: f64, band_hz: [f64; 2]) -> Vec<(f64, [f64; 3])> {
    let samples = signals[0].len();
    let seconds = samples as f64 / rate_hz;
    let forward = RealFftPlanner::<f64>::new().plan_fft_forward(samples);
    let powers = signals.each_ref().map(|signal| {
        let (mut signal, mut spectrum) = (signal.clone(), forward.make_output_vec());
        forward.process(&mut signal, &mut spectrum).unwrap();
        spectrum.into_iter().map(|own| 2.0 * own.norm_sqr() / (rate_hz * samples as f64)).collect()
    });
    let powers: [Vec<f64>; 3] = powers;
    let bins: Vec<usize> = (1..samples / 2)
        .filter(|bin| (band_hz[0]..=band_hz[1]).contains(&(*bin as f64 / seconds)))
        .collect();
    let [first, last] = [bins[0], bins[bins.len() - 1]].map(|bin| bin as f64);
    let mut bands: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for bin in bins {
        let place = BANDS * (bin as f64 / first).log10() / (last / first).log10();
        bands.entry((place as usize).min(BANDS as usize - 1)).or_default().push(bin);
    }
    let of_band = |bins: &Vec<usize>| {
        let product: f64 =
            bins.iter().map(|bin| (*bin as f64 / seconds).powf(1.0 / bins.len() as f64)).product();
        let density = |axis: usize| {
            let mean = bins.iter().map(|bin| powers[axis][*bin]).sum::<f64>() / bins.len() as f64;
            mean.sqrt()
        };
        (product, [0, 1, 2].map(density))
    };
    bands.values().map(of_band).collect()
}

#[test]
fn the_numbers_are_those_of_the_simulated_cut() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenario/mill3-edge.toml");
    let config = Config::load(&file).unwrap();
    let scenario = Scenario::of(&config).unwrap();
    let sampling = &scenario.measurement;
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let cut = Cut::new(&scenario.experiments[0], &scenario.cutting, sampling, &mut rng);
    let true_motion = cut.response(&config.model.chain().unwrap(), &scenario.truth);
    let quality = Quality { noise: 1.0, drop: 0.0 };
    let pose = |_| cut.pose.clone();
    let sent = transmit(&true_motion, pose, sampling, quality, &config.signals, &mut rng).unwrap();
    let mut measured: [Vec<f64>; 3] = Default::default();
    let mut decoder = Decoder::new(&config.signals);
    for frame in &sent.frames {
        let take = |reading: Reading| {
            if let Reading::Acceleration { value, .. } = reading {
                measured.iter_mut().zip(value).for_each(|(all, own)| all.push(own.into()));
            }
        };
        decoder.decode(frame.time_s, &frame.frame, take).unwrap();
    }
    let frames =
        sent.frames.iter().map(|frame| Arrival::of_frame(START_S + frame.time_s, frame.frame));
    let report = with_daemon(&config, frames.collect(), |path| {
        let report = report(path);
        let mut terminal = Terminal::watch(path, "", &[("NO_COLOR", "1")]);
        terminal.until("[1 overview]");
        terminal.press("3");
        let screen = terminal.screen("acceleration x, (m/s²)/√Hz, record 1");
        // To be looked at; README.md shows it.
        let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join("watch.txt");
        std::fs::write(file, strip_ansi_codes(&screen).replace('\r', "")).unwrap();
        terminal.press("q");
        terminal.end();
        report
    });
    let spectra = &report["spectra"];
    assert_eq!((&spectra["record"], report["fit"]["records"].as_u64()), (&Value::from(1), Some(1)));

    let band_hz = scenario.measurement.band_hz;
    let of_samples = densities(&measured, sampling.rate_hz, band_hz);
    let truth =
        [0, 1, 2].map(|axis| true_motion.acceleration.iter().map(|own| own[axis]).collect());
    let of_truth = densities(&truth, sampling.rate_hz, band_hz);
    // Of one side, (m/s²)/√Hz.
    let own_noise = sampling.acceleration_noise() * (2.0 / sampling.rate_hz).sqrt();
    let (mut errors, mut noises): (Vec<f64>, Vec<f64>) = Default::default();
    let bands = spectra["bands"].as_array().unwrap();
    assert_eq!(bands.len(), of_samples.len());
    for (band, ((hz, samples), (_, truth))) in bands.iter().zip(of_samples.iter().zip(&of_truth)) {
        let frequency_hz = band["frequency_hz"].as_f64().unwrap();
        for axis in 0..3 {
            let of = |name: &str| band[name][axis].as_f64().unwrap();
            let [measured, modelled, noise] = ["measured", "modelled", "noise"].map(of);
            // Floats of the wire, and steps of the signals.
            assert!((measured / samples[axis] - 1.0).abs() < 1e-3, "{hz} Hz {axis}: {measured}");
            // Some noise has passed into the model, most where few bins determine a resonance.
            errors.push((modelled - truth[axis]) / noise);
            noises.push(noise / own_noise);
        }
        assert!((frequency_hz / hz - 1.0).abs() < 1e-6, "{frequency_hz}");
    }
    let mean_square = errors.iter().map(|own| own * own).sum::<f64>() / errors.len() as f64;
    println!("modelled less true: {:.3} of the noise", mean_square.sqrt());
    assert!(mean_square.sqrt() < 0.25, "{errors:?}");
    assert!(errors.iter().all(|own| own.abs() < 2.0), "{errors:?}");
    // That of the force adds little to the accelerometer's, and more at a resonance.
    noises.sort_by(f64::total_cmp);
    let [least, median, most] = [0, noises.len() / 2, noises.len() - 1].map(|place| noises[place]);
    assert!(least > 0.95 && median < 1.1 && most < 2.0, "{noises:?}");
}
