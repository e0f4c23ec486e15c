//! flexid's side of the comparison with its peers; `tests/peers/run` calls it, and has the other side.
//!
//! ```text
//! peers cut FOLDER         writes the force of each experiment of the reference scenario: cut-0.f64, ...
//! peers evaluate FOLDER    times one evaluation of the loss on the records: record-0.f64, ...
//! peers identify FOLDER    identifies the robot from the records
//! ```
//!
//! Files hold rows of little-endian numbers. `cut` has the force along the axes of the TCP, N, [`OVERSAMPLING`] rows
//! per sample of the sensors. `record` has force, N, and acceleration, m/s², one row per sample. Results are JSON,
//! one line on stdout. The program runs in one thread.

use std::fs;
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result, anyhow, bail};
use fearless_simd::Level;
use flexid_core::chain::Chain;
use flexid_core::identify::{Identifier, Phase};
use flexid_core::loss::spectral;
use flexid_core::loss::target::Target;
use flexid_core::mounting::Mounting;
use flexid_core::parameters::Bushings;
use flexid_core::sensors::Accelerometer;
use flexid_core::spectrum::{Experiment, Measurement};
use flexid_core::stream::Record;
use flexid_pipeline::model::Model;
use flexid_simulation::experiment::Cut;
use flexid_simulation::force::OVERSAMPLING;
use flexid_simulation::scenario::Scenario;
use flexid_simulation::validation::parameter_deviation;
use rand_core::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use serde_json::json;

/// Largest number of samples of a record.
const SAMPLES: usize = 8192;
/// Largest number of bins of a record.
const BINS: usize = 1024;
/// Distance of the bins that the search keeps. This many experiments, each shifted by a bin, have all bins.
const THINNING: usize = 4;
/// Number of timings, of which the best counts.
const TRIES: usize = 300;
/// Stiffnesses of the guess over the true ones. Its loss is reported.
const GUESS: f64 = 1.05;

/// The robot and what was done with it.
struct Reference {
    chain: Chain,
    scenario: Scenario,
}

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [command, folder] = arguments.as_slice() else {
        bail!("usage: peers cut|evaluate|identify FOLDER");
    };
    let (reference, folder) = (Reference::load()?, Path::new(folder));
    match command.as_str() {
        "cut" => reference.cut(folder),
        "evaluate" => reference.evaluate(&reference.records(folder)?),
        "identify" => reference.identify(&reference.records(folder)?),
        other => bail!("{other}: must be cut, evaluate or identify"),
    }
}

impl Reference {
    fn load() -> Result<Self> {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../host-tools/scenario");
        let model = Model::load(&folder.join("mill3-model.toml"))?;
        let scenario = Scenario::load(&folder.join("mill3.toml"), &model)?;
        Ok(Self { chain: model.chain()?, scenario })
    }

    fn cut(&self, folder: &Path) -> Result<()> {
        let Scenario { experiments, cutting, measurement, .. } = &self.scenario;
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
        for (index, experiment) in experiments.iter().enumerate() {
            let cut = Cut::new(experiment, cutting, measurement, &mut rng);
            let numbers = cut.force.iter().flat_map(|force| force.iter().copied());
            let bytes: Vec<u8> = numbers.flat_map(f64::to_le_bytes).collect();
            fs::write(folder.join(format!("cut-{index}.f64")), bytes)?;
        }
        println!("{}", json!({ "steps_a_sample": OVERSAMPLING }));
        Ok(())
    }

    fn evaluate(&self, records: &[Record<SAMPLES>]) -> Result<()> {
        let band_hz = self.scenario.measurement.band_hz;
        let [lowest, highest] = band_hz;
        let mut parts = Vec::new();
        for record in records {
            let hz_per_bin = record.rate_hz / record.force[0].len() as f64;
            let first = (lowest / hz_per_bin).ceil();
            for shift in 0..THINNING {
                let lowest = (first + shift as f64) * hz_per_bin;
                let part = self.experiment(record, [lowest, highest])?;
                let target = Target::new(&self.chain, &measurement(band_hz), part.site())?;
                parts.push((part, target));
            }
        }
        let bins: usize = parts.iter().map(|(part, _)| part.thinned.bins).sum();
        let mut guess: Bushings = self.scenario.truth.iter().copied().collect();
        for bushing in &mut guess {
            bushing.stiffness = bushing.stiffness.map(|k| GUESS * k);
        }
        let loss = |level| {
            let sum = |(part, target): &(Experiment<BINS>, Target)| {
                let ssp = spectral::ssp(target, &part.thinned, black_box(&guess), level);
                ssp.iter().sum::<f32>() * part.thinned.bins as f32
            };
            parts.iter().map(sum).sum::<f32>() / (3 * bins) as f32
        };
        let mut seconds = serde_json::Map::new();
        for (name, level) in levels() {
            let shortest = (0..TRIES).map(|_| {
                let start = Instant::now();
                black_box(loss(level));
                start.elapsed().as_secs_f64()
            });
            seconds.insert(name, shortest.fold(f64::INFINITY, f64::min).into());
        }
        let loss = loss(Level::new());
        println!("{}", json!({ "bins": bins, "guess": GUESS, "loss": loss, "seconds": seconds }));
        Ok(())
    }

    /// Identifies the robot, from records in memory to the estimate.
    fn identify(&self, records: &[Record<SAMPLES>]) -> Result<()> {
        let start = Instant::now();
        let band_hz = self.scenario.measurement.band_hz;
        let mut experiments: Vec<_> =
            records.iter().map(|one| self.experiment(one, band_hz)).collect::<Result<_>>()?;
        let mut identifier = Box::new(Identifier::new(
            self.chain.clone(),
            self.scenario.bounds,
            measurement(band_hz),
            Level::new(),
            Xoshiro256PlusPlus::seed_from_u64(1),
        ));
        identifier.renew(&experiments);
        while identifier.step(&mut experiments) != Phase::Settled {}
        let seconds = start.elapsed().as_secs_f64();
        let (estimate, progress) = (identifier.estimate(), identifier.progress());
        let estimate = estimate.context("the identification came to no estimate")?;
        let Scenario { truth, bounds, .. } = &self.scenario;
        let report = json!({
            "seconds": seconds,
            "starts": progress.effort.starts,
            "search_evaluations": progress.effort.search_evaluations,
            "refine_iterations": progress.effort.refine_iterations,
            "consistency": estimate.consistency,
            "parameter_deviation": parameter_deviation(truth, &estimate.bushings, bounds),
        });
        println!("{report}");
        Ok(())
    }

    fn experiment(&self, record: &Record<SAMPLES>, band_hz: [f64; 2]) -> Result<Experiment<BINS>> {
        let mut buffer = [0.0; SAMPLES];
        Experiment::new(&self.chain, &measurement(band_hz), record, &mut buffer)
            .map_err(|error| anyhow!("a record has no spectrum: {error:?}"))
    }

    fn records(&self, folder: &Path) -> Result<Vec<Record<SAMPLES>>> {
        let experiments = self.scenario.experiments.iter().enumerate();
        experiments
            .map(|(index, experiment)| {
                let file = folder.join(format!("record-{index}.f64"));
                self.record(&experiment.pose, &file)
            })
            .collect()
    }

    fn record(&self, pose: &[f64], file: &PathBuf) -> Result<Record<SAMPLES>> {
        let sampling = &self.scenario.measurement;
        let bytes = fs::read(file).with_context(|| file.display().to_string())?;
        let (numbers, _) = bytes.as_chunks::<8>();
        let numbers: Vec<f32> = numbers.iter().map(|&one| f64::from_le_bytes(one) as f32).collect();
        let (rows, _) = numbers.as_chunks::<6>();
        if rows.len() > SAMPLES {
            bail!("{}: has {} samples: must have at most {SAMPLES}", file.display(), rows.len());
        }
        let column = |index: usize| rows.iter().map(|row| row[index]).collect();
        Ok(Record {
            start_s: 0.0,
            pose: pose.iter().copied().collect(),
            path: Default::default(),
            since_s: 0.0,
            rate_hz: sampling.rate_hz,
            force: [column(0), column(1), column(2)],
            acceleration: [column(3), column(4), column(5)],
            force_noise: [sampling.force_noise() as f32; 3],
            acceleration_noise: [sampling.acceleration_noise() as f32; 3],
            force_noise_shape: Default::default(),
            acceleration_noise_shape: Default::default(),
            has_doubtful_rate: false,
            starts_at_rest: true,
            point: [0.0; 3],
        })
    }
}

fn measurement(band_hz: [f64; 2]) -> Measurement {
    Measurement {
        band_hz,
        gravity: [0.0; 3],
        accelerometer: Accelerometer::Inertial,
        mounting: Mounting::AT_TCP,
    }
}

/// The SIMD level of the processor, and AVX2 if the processor has more.
fn levels() -> Vec<(String, Level)> {
    let detected = Level::new();
    #[allow(unused_mut)]
    let mut levels = vec![detected];
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    if let (Some(_), Some(avx2)) = (detected.as_avx512(), detected.as_avx2()) {
        levels.push(Level::Avx2(avx2));
    }
    let name = |level| format!("{level:?}").split('(').next().unwrap_or_default().to_string();
    levels.into_iter().map(|level| (name(level), level)).collect()
}
