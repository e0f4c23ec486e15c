use core::f64::consts::TAU;

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng as _, SeedableRng as _};

use super::*;

const BINS: usize = 800;
const RECORDS: usize = 3;
/// Spacing of the bins, Hz.
const SPACING: f64 = 0.25;
const FIRST: usize = 8;

struct Noise(Xoshiro256PlusPlus);

impl Noise {
    /// Parts of unit variance.
    fn next(&mut self) -> [f64; 2] {
        let mut uniform = || (self.0.next_u32() as f64 + 0.5) / 4_294_967_296.0;
        let (radius, angle) = ((-2.0 * uniform().ln()).sqrt(), TAU * uniform());
        [radius * angle.cos(), radius * angle.sin()]
    }
}

/// Margins of noise, `shape` times as large in a bin of a record along an axis.
fn margins(seed: u64, shape: impl Fn(usize, usize, usize) -> f64) -> Margins {
    let mut noise = Noise(Xoshiro256PlusPlus::seed_from_u64(seed));
    let mut margins = Margins::new([2.0, 202.0]);
    for record in 0..RECORDS {
        margins.begin(OfRecord::new(&[record as f64], 100.0), true);
        for bin in 0..BINS {
            let white = core::array::from_fn(|axis| {
                noise.next().map(|part| part * shape(record, bin, axis))
            });
            margins.take((FIRST + bin) as f64 * SPACING, &white);
        }
    }
    margins
}

/// Of a thousand reports of noise hardly any names a place.
#[test]
fn noise_is_left_everywhere() {
    let all = (0..1000).map(|seed| margins(seed, |_, _, _| 1.0).left_over());
    let named: std::vec::Vec<_> = all.filter(|left_over| !left_over.is_empty()).collect();
    assert!(named.len() <= 4, "{named:?}");
}

/// Sixteen hundred eighths, of which 5.375 of eight are independent, know their variance to `√(2/1075)`, 4 %.
#[test]
fn eighths_of_noise_scatter_as_stated() {
    let (mut sum, mut count) = (0.0, 0.0);
    for seed in 0..200 {
        let cells = margins(seed, |_, _, _| 1.0).time.cells();
        let mean = cells.iter().map(Cell::mean_square).sum::<f64>() / EIGHTHS as f64;
        for cell in cells {
            sum += (cell.mean_square() / mean - 1.0).powi(2) * cell.count / 2.0;
            count += 1.0;
        }
    }
    let variance = sum / count;
    // Less the part of the mean.
    let expected = 1.0 - 1.0 / SPREAD_OF_MEAN;
    assert!((variance / expected - 1.0).abs() < 0.12, "{variance}, not {expected}");
}

/// The mean of the eight is the power of as many bins as there are: 5.375 times as many as each has.
const SPREAD_OF_MEAN: f64 = 5.375;

#[test]
fn each_margin_names_its_own_place() {
    let named = |shape: &dyn Fn(usize, usize, usize) -> f64| margins(1, shape).left_over();
    // Half octaves from 2 Hz on: the twelfth of thirteen is 99 to 142 Hz.
    let [LeftOver::Frequency { from_hz, to_hz, times }] =
        named(&|_, bin, _| if (480..560).contains(&bin) { 2.0 } else { 1.0 })[..]
    else {
        panic!("not in a band alone")
    };
    assert!(from_hz < 130.0 && to_hz > 135.0 && to_hz / from_hz < 1.5, "{from_hz} {to_hz}");
    assert!(times > 2.0 && times < 3.5, "{times}");
    let [LeftOver::Direction { axis: 2, times }] =
        named(&|_, _, axis| if axis == 2 { 2.0 } else { 1.0 })[..]
    else {
        panic!("not along z alone")
    };
    assert!((times - 4.0).abs() < 0.4, "{times}");
    let [LeftOver::Record { record: 1, times }] =
        named(&|record, _, _| if record == 1 { 2.0 } else { 1.0 })[..]
    else {
        panic!("not in a record alone")
    };
    assert!((times - 4.0).abs() < 0.4, "{times}");
}

/// A residual that lasts for an eighth of the record, by a discrete Fourier transform of its own.
#[test]
fn a_part_of_the_records_is_named() {
    for eighth in [0, 5, 7] {
        let mut noise = Noise(Xoshiro256PlusPlus::seed_from_u64(7));
        let mut margins = Margins::new([2.0, 202.0]);
        for record in 0..RECORDS {
            margins.begin(OfRecord::new(&[record as f64], 100.0), true);
            let samples: std::vec::Vec<[[f64; 2]; 3]> =
                (0..BINS / 8).map(|_| [0; 3].map(|_| noise.next())).collect();
            for bin in 0..BINS {
                let white = core::array::from_fn(|axis| {
                    let mut sum = noise.next();
                    for (index, sample) in samples.iter().enumerate() {
                        let time = (eighth * BINS / 8 + index) as f64 / BINS as f64;
                        let (sin, cos) = (-TAU * (FIRST + bin) as f64 * time).sin_cos();
                        let [re, im] = sample[axis];
                        let scale = 2.0 / (BINS as f64).sqrt();
                        sum[0] += scale * (re * cos - im * sin);
                        sum[1] += scale * (re * sin + im * cos);
                    }
                    sum
                });
                margins.take((FIRST + bin) as f64 * SPACING, &white);
            }
        }
        let [LeftOver::Time { from, to, times }] = margins.left_over()[..] else {
            panic!("{:?}", margins.left_over())
        };
        assert_eq!([from, to], [eighth as f64 / 8.0, (eighth + 1) as f64 / 8.0]);
        // Five times the noise in its eighth, of which the kernel leaves two thirds or so.
        assert!(times > 2.5 && times < 5.0, "{times}");
    }
}
