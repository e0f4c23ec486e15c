use heapless::Vec;

use super::*;

const SAMPLES: usize = 8192;
const STEP: f32 = 0.01;

struct Noises(u32);

impl Noises {
    /// Noise of unit variance.
    fn next(&mut self) -> f32 {
        let mut sum = 0.0;
        for _ in 0..12 {
            self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            sum += (self.0 >> 8) as f32 / (1 << 24) as f32;
        }
        sum - 6.0
    }
}

fn rounded(value: f32, step: f32) -> f32 {
    libm::roundf(value / step) * step
}

/// A cut that begins at a quarter of the record: teeth at a rate that rises, with nothing between them, and the ringing of the robot.
/// `noise` is the standard deviation of white noise.
fn cut(seed: u32, noise: f32, step: f32) -> [Vec<f32, SAMPLES>; 3] {
    let mut noises = Noises(seed);
    let turn = |n: f32| 0.02 * n + 1.5e-5 * n * n;
    core::array::from_fn(|axis| {
        (0..SAMPLES)
            .map(|n| {
                let time = n as f32 - SAMPLES as f32 / 4.0;
                let tooth = libm::sinf(turn(time) + 0.3 * axis as f32).max(0.0);
                let tooth = if time > 0.0 { tooth } else { 0.0 };
                let value = [300.0, -200.0, 60.0][axis] * tooth;
                rounded(value + noise * noises.next(), step)
            })
            .collect()
    })
}

fn slices(signals: &mut [Vec<f32, SAMPLES>; 3]) -> [&mut [f32]; 3] {
    signals.each_mut().map(|signal| signal.as_mut_slice())
}

/// Clipped and held ones: these signals are too sharp for spikes to be told.
fn of_force(signals: &mut [Vec<f32, SAMPLES>; 3]) -> Invalid {
    let mut signals = slices(signals);
    let (motions, rest) = Validity::new([STEP; 2]).of_force(&signals);
    remove_clipped_and_held(&mut signals, &motions, rest)
}

fn of_acceleration(validity: &mut Validity, signals: &mut [Vec<f32, SAMPLES>; 3]) -> Invalid {
    let mut signals = slices(signals);
    let motions = validity.of_acceleration(&signals);
    remove_clipped_and_held(&mut signals, &motions, Some(Rest::NONE))
}

#[test]
fn right_signals_stay_whatever_their_noise_and_their_step() {
    for seed in 1..10 {
        for noise in [0.0, 0.003, 0.05, 0.16, 3.0] {
            for step in [0.01, 0.1, 1.0, 10.0, 60.0] {
                for rests in
                    [[false; 3], [true, false, false], [true, true, false], [false, false, true]]
                {
                    let mut signals = cut(seed, noise, step);
                    for (signal, rests) in signals.iter_mut().zip(rests) {
                        if rests {
                            signal.fill(0.0);
                        }
                    }
                    let before = signals.clone();
                    let invalid = of_force(&mut signals);
                    assert_eq!(invalid, Invalid::default(), "{seed} {noise} {step} {rests:?}");
                    assert_eq!(signals, before);
                }
            }
        }
    }
}

#[test]
fn slow_tones_stay() {
    for size in [2.0, 30.0, 300.0] {
        for turn in [0.003, 0.0126, 0.05, 0.31, 0.97, 2.0] {
            for noise in [0.0, 0.003, 0.02] {
                let mut noises = Noises(7);
                let mut signals = core::array::from_fn(|axis| {
                    let tone = |n: usize| size * libm::sinf(turn * n as f32 + axis as f32);
                    (0..SAMPLES)
                        .map(|n| rounded(tone(n) + noise * noises.next(), STEP))
                        .collect::<Vec<f32, SAMPLES>>()
                });
                let invalid = of_acceleration(&mut Validity::new([STEP; 2]), &mut signals);
                assert_eq!(invalid, Invalid::default(), "{size} {turn} {noise}");
            }
        }
    }
}

#[test]
fn clipped_peaks_are_made_missing() {
    for (seed, limit, share) in [(1, 270.0, 0.05), (2, 150.0, 0.1)] {
        let mut signals = cut(seed, 0.16, STEP);
        let beyond = signals[0].iter().filter(|value| **value >= limit).count();
        assert!(beyond as f32 > share * SAMPLES as f32, "{beyond}");
        signals[0].iter_mut().for_each(|value| *value = value.min(limit));
        let invalid = of_force(&mut signals);
        assert_eq!((invalid.clipped, invalid.held), ([beyond, 0, 0], [0; 3]));
        assert!(invalid.clipped_are_many && !invalid.held_are_many);
        assert!(signals[0].iter().all(|value| value.is_nan() || *value < limit));
    }
}

/// Also at the lower end.
#[test]
fn one_clipped_sample_in_195_is_many() {
    let mut noises = Noises(3);
    let mut signals: [Vec<f32, SAMPLES>; 3] = core::array::from_fn(|_| {
        (0..SAMPLES).map(|_| rounded(20.0 * noises.next(), STEP)).collect()
    });
    signals[2].iter_mut().skip(100).step_by(400).for_each(|value| *value = -80.0);
    signals[2].iter_mut().skip(101).step_by(400).for_each(|value| *value = -80.0);
    let invalid = of_acceleration(&mut Validity::new([STEP; 2]), &mut signals);
    assert_eq!((invalid.clipped, invalid.held), ([0, 0, 42], [0; 3]));
    assert!(invalid.clipped_are_many, "one in 195");
}

/// Many clipped samples look like spikes to each other: none is counted twice.
#[test]
fn spikes_are_sought_where_little_is_clipped() {
    for (limit, are_many) in [(49.99, false), (45.0, true)] {
        let mut noises = Noises(3);
        let mut signals: [Vec<f32, SAMPLES>; 3] = core::array::from_fn(|axis| {
            let tone = |n: usize| 50.0 * libm::sinf(0.1 * n as f32 + axis as f32);
            (0..SAMPLES).map(|n| rounded(tone(n) + 0.1 * noises.next(), STEP)).collect()
        });
        signals[1].iter_mut().for_each(|value| *value = value.min(limit));
        signals[2][3000] += 20.0;
        let invalid = Validity::new([STEP; 2]).remove_from_acceleration(&mut slices(&mut signals));
        assert_eq!(invalid.are_many(), are_many, "{invalid:?}");
        assert_eq!(invalid.spikes[2], usize::from(!are_many), "{invalid:?}");
    }
}

/// A cut of which every second sample is missing shows no rest at its start.
#[test]
fn a_start_without_neighbours_is_no_rest() {
    let mut signals = cut(2, 0.16, STEP).map(|signal| {
        let cut = &signal[SAMPLES / 4..];
        let value = |n: usize| if n.is_multiple_of(2) { cut[n] } else { f32::NAN };
        (0..cut.len()).map(value).collect()
    });
    let motions = [Motion::none(STEP); 3];
    assert_eq!(Rest::of(&slices(&mut signals), &motions), None);
}

#[test]
fn an_axis_that_sticks_is_held() {
    let mut signals = cut(4, 0.16, STEP);
    let last = signals[1][5000];
    signals[1][5000..].fill(last);
    let invalid = of_force(&mut signals);
    assert_eq!((invalid.clipped, invalid.held), ([0; 3], [0, SAMPLES - 5001, 0]));
    assert!(invalid.held_are_many && !invalid.clipped_are_many);
}

/// An axis that moved in an earlier record, and is stuck throughout this one.
#[test]
fn an_axis_that_is_stuck_for_a_whole_record_is_held() {
    let mut earlier = Validity::new([STEP; 2]);
    let mut stuck = cut(5, 0.16, STEP);
    stuck[2].fill(1.5);
    assert_eq!(of_acceleration(&mut earlier, &mut stuck.clone()), Invalid::default());
    assert_eq!(of_acceleration(&mut earlier, &mut cut(6, 0.16, STEP)), Invalid::default());
    let invalid = of_acceleration(&mut earlier, &mut stuck.clone());
    assert_eq!(invalid.held, [0, 0, SAMPLES - 1]);
    assert!(invalid.held_are_many);
    // A cut that hardly moves the others may leave this one at rest.
    for signal in &mut stuck[..2] {
        signal.iter_mut().for_each(|value| *value = rounded(0.1 * *value, STEP));
    }
    assert_eq!(of_acceleration(&mut earlier, &mut stuck), Invalid::default());
}

#[test]
fn a_sensor_at_half_of_the_rate_is_held() {
    for axes in [0..3, 1..2] {
        let mut signals = cut(8, 0.16, STEP);
        for signal in &mut signals[axes.clone()] {
            (1..SAMPLES).step_by(2).for_each(|n| signal[n] = signal[n - 1]);
        }
        let invalid = of_force(&mut signals);
        for axis in 0..3 {
            let held = invalid.held[axis];
            assert_eq!(held > SAMPLES / 8, axes.contains(&axis), "{axes:?}: {:?}", invalid.held);
        }
        assert!(invalid.held_are_many && invalid.clipped == [0; 3]);
    }
}

/// The accelerometer rests, in coarse steps, while a bus loses one frame in five; then the robot moves.
#[test]
fn rest_on_a_lossy_bus_is_not_held() {
    let mut noises = Noises(3);
    let mut signals: [Vec<f32, SAMPLES>; 3] = core::array::from_fn(|_| {
        let size = |n: usize| if n < SAMPLES / 2 { 0.1 * STEP } else { 20.0 };
        (0..SAMPLES).map(|n| rounded(size(n) * noises.next(), STEP)).collect()
    });
    for n in (0..SAMPLES).step_by(5) {
        signals.iter_mut().for_each(|signal| signal[n] = f32::NAN);
    }
    let invalid = of_acceleration(&mut Validity::new([STEP; 2]), &mut signals);
    assert_eq!(invalid, Invalid::default());
}

/// A sensor that is now and then late for its frame.
#[test]
fn few_repeated_samples_are_few() {
    let mut signals = cut(9, 0.16, STEP);
    let late = (SAMPLES / 3..SAMPLES).step_by(250);
    for signal in &mut signals {
        late.clone().for_each(|n| signal[n] = signal[n - 1]);
    }
    let invalid = of_force(&mut signals);
    // Some fall between two teeth.
    assert_eq!((invalid.held, invalid.held_are_many), ([15; 3], false));
    assert_eq!(late.filter(|&n| signals[0][n].is_nan()).count(), 15);
}

#[test]
fn chance_is_bounded_from_above() {
    // Of 10 tosses of a coin all are heads once in 1024 times, and of 30 once in 1e9.
    assert!(!beyond_chance(10, 10, 0.5) && beyond_chance(30, 30, 0.5));
    assert!(!beyond_chance(0, 0, 0.5) && !beyond_chance(500, 1000, 0.5));
    // Five standard deviations and a half.
    assert!(!beyond_chance(550, 1000, 0.5) && beyond_chance(600, 1000, 0.5));
}
