//! Lines, delays and readings from arrivals that were made.

use nalgebra::Rotation3;
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::*;
use crate::clocks::line::{Frame, Line};
use crate::clocks::number::{Numbered, Sample};

/// How late a frame comes: mean of an exponential delay, part of stalls and the longest, s.
#[derive(Clone, Copy, Debug)]
struct Latency(f64, f64, f64);

const CAN: Latency = Latency(50e-6, 0.01, 1e-3);
const USB: Latency = Latency(300e-6, 0.05, 5e-3);
const UDP: Latency = Latency(1e-3, 0.1, 20e-3);
const RATE_HZ: f64 = 2000.0;

fn uniform(rng: &mut Xoshiro256PlusPlus) -> f64 {
    (rng.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
}

fn random(seed: u64) -> Xoshiro256PlusPlus {
    Xoshiro256PlusPlus::seed_from_u64(seed)
}

impl Latency {
    fn draw(self, rng: &mut Xoshiro256PlusPlus) -> f64 {
        let stall = if uniform(rng) < self.1 { self.2 * uniform(rng) } else { 0.0 };
        stall - self.0 * (1.0 - uniform(rng)).ln()
    }

    /// Arrivals, to the microsecond and in order, of frames that are sampled at these times.
    fn arrivals(
        self,
        sampled_s: impl Iterator<Item = f64>,
        rng: &mut Xoshiro256PlusPlus,
    ) -> Vec<f64> {
        let mut newest_s = 0.0_f64;
        let arrival = |sampled_s: f64| {
            newest_s = newest_s.max(sampled_s + self.draw(rng));
            (newest_s * 1e6).round() * 1e-6
        };
        sampled_s.map(arrival).collect()
    }
}

fn samples(arrivals: &[f64], first: u32, value: impl Fn(usize) -> [f32; 3]) -> Vec<Sample> {
    let sample = |(index, &time_s): (usize, &f64)| Sample {
        time_s,
        counter: first.wrapping_add(index as u32),
        value: value(index),
    };
    arrivals.iter().enumerate().map(sample).collect()
}

/// Frames of runs of some seconds with pauses of ten between, of a clock that is slow by 20 ppm, and their offsets.
fn runs(latency: Latency, seed: u64, seconds: &[f64]) -> (Vec<Frame>, Vec<f64>) {
    let mut rng = random(seed);
    let (mut frames, mut offsets, mut from_s) = (Vec::new(), Vec::new(), 0.1);
    for (run, seconds) in seconds.iter().enumerate() {
        from_s += 1e-3 * uniform(&mut rng);
        let count = (seconds * RATE_HZ) as i64;
        let sampled = (0..count).map(|number| from_s + number as f64 * (1.0 + 20e-6) / RATE_HZ);
        let arrivals = latency.arrivals(sampled, &mut rng);
        frames.extend((0..).zip(arrivals).map(|(number, time_s)| Frame { run, number, time_s }));
        offsets.push(from_s);
        from_s += seconds + 10.0;
    }
    (frames, offsets)
}

/// Over many seeds, errors over their deviations have a mean square of one.
#[test]
fn lines_are_right_and_their_deviations_honest() {
    const SEEDS: u64 = 40;
    for (latency, seconds, most_ppm) in [
        (CAN, &[5.0, 5.0, 5.0][..], 0.2),
        (USB, &[5.0, 5.0, 5.0], 2.0),
        (USB, &[60.0], 0.1),
        (UDP, &[60.0], 20.0),
    ] {
        let (mut slopes, mut offsets, mut worst) = (Vec::new(), Vec::new(), 0.0_f64);
        for seed in 0..SEEDS {
            let (frames, from_s) = runs(latency, seed, seconds);
            let line = Line::of(&frames, 1.0 / RATE_HZ).unwrap();
            let excess = line.period_s * RATE_HZ - 1.0 - 20e-6;
            worst = worst.max(1e6 * excess.abs());
            slopes.push(excess / line.drift_std);
            // The mean delay of the earliest is common to all runs.
            let off = |run: usize| {
                line.time_s(run, 0.5 * RATE_HZ * seconds[run])
                    - from_s[run]
                    - 0.5 * seconds[run] * (1.0 + 20e-6)
            };
            let offs: Vec<f64> = (0..seconds.len()).map(off).collect();
            let mean = offs.iter().sum::<f64>() / offs.len() as f64;
            if offs.len() > 1 {
                let scale = (1.0 - 1.0 / offs.len() as f64).sqrt();
                offsets.extend(
                    offs.iter().zip(&line.runs).map(|(own, run)| (own - mean) / run.std_s / scale),
                );
            }
        }
        let rms =
            |all: &[f64]| (all.iter().map(|own| own * own).sum::<f64>() / all.len() as f64).sqrt();
        println!(
            "{latency:?} {seconds:?}: worst {worst:.3} ppm, slopes {:.2}, offsets {:.2}",
            rms(&slopes),
            rms(&offsets)
        );
        assert!(worst < most_ppm, "{latency:?}: {worst}");
        assert!((0.1..1.3).contains(&rms(&slopes)), "{latency:?}: {}", rms(&slopes));
        assert!(
            offsets.is_empty() || (0.1..1.3).contains(&rms(&offsets)),
            "{latency:?}: {}",
            rms(&offsets)
        );
    }
}

/// Without a counter, and with one of eight bits, the same frames are missing that were lost.
#[test]
fn lost_frames_are_counted_and_stalls_are_not() {
    for latency in [CAN, USB] {
        for bits in [None, Some(8), Some(16)] {
            let mut rng = random(5);
            let is_lost = |number: usize| {
                number % 3001 == 3000
                    || (9000..9003).contains(&number)
                    || (20_000..20_400).contains(&number)
            };
            let sampled = (0..40_000).map(|number| 0.1 + number as f64 / RATE_HZ);
            let mut arrivals = latency.arrivals(sampled, &mut rng);
            // The sender is held up for 80 ms.
            let until_s = arrivals[30_160];
            arrivals[30_000..30_160].iter_mut().for_each(|own| *own = own.max(until_s));
            let all = samples(&arrivals, 0, |_| [0.0; 3]);
            let kept: Vec<Sample> =
                all.into_iter().filter(|own| !is_lost(own.counter as usize)).collect();
            let truth: Vec<i64> = kept.iter().map(|own| i64::from(own.counter)).collect();
            let span = bits.map_or(0, |bits| (1_u32 << bits) - 1);
            let wrapped: Vec<Sample> =
                kept.iter().map(|own| Sample { counter: own.counter & span, ..*own }).collect();
            let numbered = Numbered::of(&wrapped, bits);
            assert_eq!(numbered.frames.len(), truth.len());
            let off = numbered
                .frames
                .iter()
                .zip(&truth)
                .filter(|(own, truth)| own.run != 0 || own.number != **truth)
                .count();
            println!("{latency:?} {bits:?}: {off} wrong, scatter {:.3}", numbered.scatter);
            // Beside a loss, a frame that was held up may be taken for one behind it.
            let most = if bits.is_none() { 400 } else { 0 };
            assert!(off <= most, "{latency:?} {bits:?}: {off}");
        }
    }
}

#[test]
fn pauses_restarts_and_set_clocks_begin_runs() {
    let mut rng = random(7);
    let mut at = |from_s: f64, count: i32| {
        CAN.arrivals((0..count).map(|number| from_s + f64::from(number) / RATE_HZ), &mut rng)
    };
    let parts = [at(1.0, 8000), at(7.0, 8000), at(2.0, 8000), at(6.1, 8000)];
    let all: Vec<Sample> = parts
        .iter()
        .zip([0, 60_000, 5, 30_000])
        .flat_map(|(own, first)| samples(own, first, |_| [0.0; 3]))
        .collect();
    let wrapped: Vec<Sample> =
        all.iter().map(|own| Sample { counter: own.counter & 0xFFFF, ..*own }).collect();
    let numbered = Numbered::of(&wrapped, Some(16));
    assert_eq!(numbered.frames.last().unwrap().run, 3);
    let first: Vec<usize> =
        (0..4).map(|run| numbered.frames.iter().filter(|own| own.run == run).count()).collect();
    assert!(first.iter().all(|own| own.abs_diff(8000) < 3), "{first:?}");
}

/// Force and acceleration of a mass on a spring, whose true time is known: the force is milling from 1 s on.
struct Tool {
    tooth_hz: f64,
    harmonics: Vec<[f64; 3]>,
}

impl Tool {
    /// A tool with two teeth, whose turns get faster every four seconds. The highest of six harmonics lies below four tenths of the rate.
    fn at(rate_hz: f64) -> Self {
        let harmonics =
            (1..7).map(|order| [f64::from(order), 60.0 / f64::from(order), 0.7 * f64::from(order)]);
        Self { tooth_hz: 0.06 * rate_hz, harmonics: harmonics.collect() }
    }

    fn force(&self, t: f64) -> [f64; 3] {
        // It grows within half a second, so that nothing folds.
        let grown = ((t - 1.0) / 0.5).clamp(0.0, 1.0);
        let grown = 0.5 - 0.5 * (std::f64::consts::PI * grown).cos();
        let tooth_hz = self.tooth_hz + 5.0 * (t / 4.0).floor();
        let sum = |shift: f64| -> f64 {
            self.harmonics
                .iter()
                .map(|[order, size, phase]| {
                    size * (std::f64::consts::TAU * order * tooth_hz * (t - 1.0) + phase + shift)
                        .sin()
                })
                .sum()
        };
        [1.0, 0.6, 0.3]
            .map(|own| grown * own)
            .into_iter()
            .zip([0.0, 1.1, 2.0])
            .map(|(own, shift)| own * sum(shift))
            .collect::<Vec<_>>()
            .try_into()
            .unwrap()
    }

    /// The tool has 40 kg, moved by what acts along other axes too.
    fn acceleration(&self, t: f64) -> [f64; 3] {
        let [x, y, z] = self.force(t);
        [x / 40.0 + y / 300.0, y / 35.0, z / 50.0 - x / 400.0]
    }
}

/// A recording of 13 s with noise, the acceleration stamped late by `late_s`, and 20 ppm slow.
fn recording(late_s: f64, latency: Latency, rates: [f64; 2], bits: [Option<u32>; 2]) -> Recording {
    let mut rng = random(11);
    let tool = Tool::at(rates[0].min(rates[1]));
    let mut kept = Recording::new(expected(rates[0].min(rates[1]), bits));
    let mut all = Vec::new();
    for (sensor, pace) in [(0, 1.0), (1, 1.0 + 20e-6)] {
        let from_s = if sensor == 0 { 0.2 } else { 0.2137 };
        let count = (13.0 * rates[sensor]) as usize;
        let at = |number: usize| from_s + number as f64 * pace / rates[sensor];
        let late_s = if sensor == 0 { 0.0 } else { late_s };
        let arrivals =
            latency.arrivals((0..count).map(|number| 1.0 + at(number) + late_s), &mut rng);
        for (number, arrival_s) in arrivals.into_iter().enumerate() {
            let mut noise =
                |size: f64| size * ((0..12).map(|_| uniform(&mut rng)).sum::<f64>() - 6.0);
            let value = if sensor == 0 {
                tool.force(at(number)).map(|own| own + noise(0.2))
            } else {
                tool.acceleration(at(number)).map(|own| own + noise(0.005))
            };
            let value = value.map(|own| own as f32);
            let counter = number as u32 + 7 * sensor as u32;
            let reading = if sensor == 0 {
                Reading::Force { counter, value }
            } else {
                Reading::Acceleration { counter, value }
            };
            all.push((1.7e9 + arrival_s, reading));
        }
    }
    for step in 0..130 {
        all.push((
            1.7e9 + 1.0 + 0.1 * f64::from(step),
            Reading::Joint { index: 0, value: f64::from(step) },
        ));
    }
    all.sort_by(|one, other| one.0.total_cmp(&other.0));
    all.into_iter().for_each(|(time_s, reading)| kept.push(time_s, reading));
    kept
}

fn expected(rate_hz: f64, counter_bits: [Option<u32>; 2]) -> Expected {
    Expected {
        counter_bits,
        rate_hz,
        highest_hz: 200.0,
        record_samples: (4.096 * rate_hz) as usize,
        steps: [1e-4; 2],
        axes: [Rotation3::identity(); 2],
        seeks_delay: false,
    }
}

#[test]
fn delays_from_minus_to_plus_20_ms_are_found() {
    for late_s in [-20e-3, -7.5e-3, -1e-3, 0.0, 300e-6, 1e-3, 3e-3, 11e-3, 20e-3] {
        let found = recording(late_s, CAN, [RATE_HZ; 2], [None; 2]).tell().unwrap();
        let delay = found.delay.unwrap();
        println!("{late_s}: {delay:?}");
        assert!((delay.delay_s - late_s).abs() < 50e-6, "{late_s}: {delay:?}");
        assert!(delay.std_s < 50e-6);
    }
}

/// The readings that leave are those of one instant, at equal counters, and joint angles stay where they were.
#[test]
fn readings_leave_with_common_instants() {
    for (latency, rates) in
        [(CAN, [RATE_HZ; 2]), (USB, [RATE_HZ; 2]), (CAN, [1000.0, 2000.0]), (CAN, [7000.0, 1000.0])]
    {
        let mut kept = recording(3.1e-3, latency, rates, [None, Some(8)]);
        let found = kept.tell().unwrap_or_else(|untold| panic!("{rates:?}: {untold}"));
        println!("{found}");
        let tool = Tool::at(rates[0].min(rates[1]));
        let (mut count, mut joints, mut newest_s) = (0, 0, 0.0);
        let mut force = None;
        let (mut squares, mut moved) = (0.0, 0.0);
        kept.give(|time_s, reading| {
            assert!(time_s >= newest_s);
            newest_s = time_s;
            match reading {
                Reading::Joint { value, .. } => {
                    assert!((time_s - 1.7e9 - 1.0 - 0.1 * value).abs() < 1e-6);
                    joints += 1;
                }
                Reading::Force { counter, .. } => force = Some(counter),
                Reading::Acceleration { counter, value } => {
                    assert_eq!(force, Some(counter));
                    count += 1;
                    // Away from the steps of the force.
                    let t = time_s - 1.7e9 - 1.0;
                    if rates == [RATE_HZ; 2] && (1.1..3.9).contains(&t) {
                        let truth = tool.acceleration(t)[1];
                        squares += (f64::from(value[1]) - truth).powi(2);
                        moved += truth * truth;
                    }
                }
                Reading::Setup(_) => {}
            }
        });
        let slower = rates[0].min(rates[1]);
        assert!(joints == 130 && (count as f64) > 12.8 * slower, "{rates:?}: {joints} {count}");
        if moved > 0.0 {
            // 798 Hz, the highest, turns by a tenth of a radian in 20 µs.
            let off = (squares / moved).sqrt();
            println!("off by {off:.4}");
            assert!(off < 0.15, "{off}");
        }
        for (clock, rate_hz) in found.sensors.iter().zip(rates) {
            assert!((clock.rate_hz / rate_hz - 1.0).abs() < 30e-6, "{clock:?}");
        }
    }
}

/// The accelerometer is at the end of its range for a second.
#[test]
fn clipped_samples_are_left_out() {
    let mut recording = recording(3e-3, CAN, [RATE_HZ; 2], [None; 2]);
    let samples = &mut recording.kept.sensors[1];
    let range = samples.iter().map(|own| own.value[1]).fold(0.0, f32::max);
    let from_s = samples[0].time_s;
    let is_loud = |time_s: f64| (5.0..6.0).contains(&(time_s - from_s));
    let loud = samples.iter_mut().filter(|own| is_loud(own.time_s));
    loud.for_each(|own| own.value[1] = (2.0 * own.value[1]).min(range));
    recording.tell().unwrap();
    let judged = recording.judged();
    assert!(judged.clipped[4] > 50 && judged.refused_clipped > 0, "{judged:?}");
    assert_eq!(judged.clipped.iter().sum::<u64>(), judged.clipped[4]);
    let first_s = recording.kept.times_s.unwrap().0;
    let (mut loud, mut quiet) = (0, 0);
    recording.give(|time_s, reading| {
        if let Reading::Acceleration { .. } = reading {
            loud += u32::from(is_loud(time_s - first_s));
            quiet += u32::from((9.0..12.0).contains(&(time_s - first_s)));
        }
    });
    assert_eq!((loud, quiet), (0, 6000));
}

#[test]
fn what_cannot_be_told_has_a_reason_and_a_mend() {
    let untold = |mut kept: Recording| kept.tell().err().unwrap().to_string();
    let udp = untold(recording(1e-3, UDP, [RATE_HZ; 2], [None; 2]));
    assert!(udp.contains("scatter") && udp.contains("counter in [signals]"), "{udp}");
    let mut quiet = Recording::new(expected(RATE_HZ, [None; 2]));
    let mut rng = random(3);
    for number in 0..20_000 {
        let mut noise = || [0, 1, 2].map(|_| uniform(&mut rng) as f32);
        let time_s = f64::from(number) / RATE_HZ;
        quiet.push(time_s, Reading::Force { counter: 0, value: noise() });
        quiet.push(time_s + 1e-5, Reading::Acceleration { counter: 0, value: noise() });
    }
    let quiet = untold(quiet);
    assert!(quiet.contains("not coherent") && quiet.contains("[calibration] delay_s"), "{quiet}");
    let few = untold(Recording::new(expected(RATE_HZ, [None; 2])));
    assert!(few.contains("too few"), "{few}");
}
