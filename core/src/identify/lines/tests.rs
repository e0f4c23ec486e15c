//! What is a line in a divided record, and what is not.

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng as _, SeedableRng as _};
use std::boxed::Box;

use super::*;
use crate::refine::tests::{chain, measurement};
use crate::spectrum::Spectrum;
use crate::stream::{Record, Stage};

/// Samples of a record.
const SAMPLES: usize = 4096;
const PARTS: usize = 16;
/// Bins of each of them, and most of all.
const EACH: usize = 28;
const BINS: usize = 512;
/// Mean square of the noise of both sensors over that of the accelerometer alone.
const OF_BOTH: f32 = 2.0;

struct Normal(Xoshiro256PlusPlus);

impl Normal {
    fn new(seed: u64) -> Self {
        Self(Xoshiro256PlusPlus::seed_from_u64(seed))
    }

    /// Complex noise of unit mean square.
    fn next(&mut self) -> [f64; 2] {
        let mut uniform = || ((self.0.next_u64() >> 11) as f64 + 0.5) / (1_u64 << 53) as f64;
        let radius = libm::sqrt(-libm::log(uniform()));
        let angle = core::f64::consts::TAU * uniform();
        [radius * libm::cos(angle), radius * libm::sin(angle)]
    }
}

/// A record along a path of so many parts, under a broad force.
fn experiment(parts: usize) -> Box<Experiment<BINS>> {
    let mut normal = Normal::new(1);
    let mut noise = |size: f64| {
        core::array::from_fn(|_| (0..SAMPLES).map(|_| (size * normal.next()[0]) as f32).collect())
    };
    let pose: heapless::Vec<f64, { crate::MAX_JOINTS }> = [0.4, -0.3].into_iter().collect();
    let stage = Stage { pose: pose.clone(), moves: 0.0, is_even: true };
    let record = Box::new(Record::<SAMPLES> {
        start_s: 0.0,
        pose,
        path: core::iter::repeat_n(stage, parts).collect(),
        since_s: 0.0,
        rate_hz: 500.0,
        force: noise(100.0),
        acceleration: noise(1.0),
        force_noise: [1.0; 3],
        acceleration_noise: [0.05; 3],
        force_noise_shape: Default::default(),
        acceleration_noise_shape: Default::default(),
        has_doubtful_rate: false,
        starts_at_rest: false,
        point: [0.0; 3],
    });
    let mut buffer = std::vec![0.0; SAMPLES];
    let buffer: &mut [f32; SAMPLES] = buffer.as_mut_slice().try_into().unwrap();
    Box::new(Experiment::new(&chain(), &measurement(), &record, buffer).unwrap())
}

/// Noise of both sensors, and what `further` adds to it at a place along an axis, in standard deviations of this noise.
fn left(
    experiment: &Experiment<BINS>,
    seed: u64,
    mut further: impl FnMut(usize, usize) -> [f64; 2],
) -> Box<Unexplained<BINS>> {
    let mut normal = Normal::new(seed);
    let mut left = Box::new(Unexplained {
        first_bin: experiment.first_bin,
        length: experiment.length(),
        residual: Spectrum::EMPTY,
        noise: experiment
            .broad_noise
            .each_ref()
            .map(|own| own.iter().map(|x| OF_BOTH * x).collect()),
        response: core::iter::repeat_n(1.0, experiment.bins()).collect(),
    });
    for axis in 0..3 {
        for place in 0..experiment.bins() {
            let deviation = libm::sqrt(f64::from(left.noise[axis][place]));
            let (noise, more) = (normal.next(), further(axis, place));
            let [re, im] = [0, 1].map(|part| (deviation * (noise[part] + more[part])) as f32);
            left.residual.re[axis].push(re).unwrap();
            left.residual.im[axis].push(im).unwrap();
        }
    }
    left
}

/// Axis and bin of each noise that has been raised, in each part.
fn raised(experiment: &Experiment<BINS>) -> std::vec::Vec<(usize, usize)> {
    let is_raised = |axis: usize, place: usize| {
        experiment.acceleration_noise[axis][place] > experiment.broad_noise[axis][place]
    };
    let all = (0..3).flat_map(|axis| (0..experiment.bins()).map(move |place| (axis, place)));
    let each = experiment.bins_of_part();
    all.filter(|(axis, place)| is_raised(*axis, *place))
        .map(|(a, place)| (a, place % each))
        .collect()
}

/// Another phase in each part, and 20 times the noise: the level is 21, known to a fifth by 13 degrees of freedom times two. The part of the
/// noise that is the force's stays as it is.
#[test]
fn a_line_raises_its_bins_alone() {
    let mut experiment = experiment(PARTS);
    let (axis, bin, times) = (1, 9, 20.0);
    let mut phases = Normal::new(7);
    let line = |own: usize, place: usize| {
        let [re, im] = phases.next();
        let size = libm::sqrt(times) / libm::hypot(re, im);
        if (own, place % EACH) == (axis, bin) { [size * re, size * im] } else { [0.0; 2] }
    };
    let left = left(&experiment, 2, line);
    assert!(raise(&mut experiment, &left));
    assert_eq!(raised(&experiment), [(axis, bin); PARTS]);
    for place in (0..PARTS).map(|part| part * EACH + bin) {
        let broad = experiment.broad_noise[axis][place];
        let level = (experiment.acceleration_noise[axis][place] - broad) / (OF_BOTH * broad);
        assert!((0.5 * times..1.5 * times).contains(&f64::from(level)), "{level}");
    }
    assert!(!raise(&mut experiment, &left), "the same line is no news");
}

/// Each axis responds to the force along all three by some ten standard deviations of the noise.
#[test]
fn a_response_to_the_force_raises_nothing() {
    let mut experiment = experiment(PARTS);
    let mut normal = Normal::new(3);
    let response: [[[f64; 2]; 3]; 3] =
        core::array::from_fn(|_| core::array::from_fn(|_| normal.next()));
    let size = experiment.rms_force() * experiment.length() / libm::sqrt(experiment.bins() as f64);
    let answer = |experiment: &Experiment<BINS>, axis: usize, place: usize| {
        let force = experiment.force.parts().map(|[re, im]| [re[place], im[place]].map(f64::from));
        let mut sum = [0.0; 2];
        for ([re, im], [g, h]) in force.into_iter().zip(response[axis]) {
            sum[0] += 1e2 / size * (g * re - h * im);
            sum[1] += 1e2 / size * (g * im + h * re);
        }
        sum
    };
    let left = left(&experiment, 2, |axis, place| answer(&experiment, axis, place));
    let answers = (0..experiment.bins()).map(|place| answer(&experiment, 0, place)[0]);
    let mean_square = answers.map(|own| own * own).sum::<f64>() / experiment.bins() as f64;
    assert!(mean_square > 100.0, "{mean_square}");
    assert!(!raise(&mut experiment, &left));
    assert!(raised(&experiment).is_empty());
}

/// 50,000 bins: 5 are expected, and more than 12 once in 500 times. None at all once in 150 times.
#[test]
fn noise_hardly_ever_raises_a_bin() {
    let plain = experiment(PARTS);
    let mut count = 0;
    for seed in 0..600 {
        let mut experiment = plain.clone();
        let left = left(&experiment, 100 + seed, |_, _| [0.0; 2]);
        raise(&mut experiment, &left);
        count += raised(&experiment).len() / PARTS;
    }
    assert!((1..=12).contains(&count), "{count} of 50,400 bins");
}

#[test]
fn a_few_parts_tell_no_line() {
    for (parts, tells) in [(2, false), (4, true)] {
        let mut experiment = experiment(parts);
        let left = left(&experiment, 2, |_, place| {
            [if place.is_multiple_of(2) { 20.0 } else { -20.0 }, 0.0]
        });
        assert_eq!(raise(&mut experiment, &left), tells, "{parts} parts");
    }
}
