//! Products of responses, one load per lane.
//!
//! The sums of a tile stay in registers while the bins pass, as in [`crate::linear::gram`].

use fearless_simd::Level;

use super::sums::{Sums, length, start};
use super::{Bin, KINDS, KINDS_OF_SEAM, LOADS, OTHER_KINDS, OTHERS};
use crate::receptance::Complex;
use crate::receptance::lanes::{Kernel, Lanes, Precision as _};

impl Sums {
    /// Adds some bins.
    #[inline(always)]
    pub(in crate::refine) fn add(&mut self, level: Level, bins: &[Bin]) {
        self.add_jumps(bins);
        f64::dispatch_in_registers(level, Tiles { sums: self, bins });
    }
}

/// Adds the products of some bins.
struct Tiles<'a> {
    sums: &'a mut Sums,
    bins: &'a [Bin],
}

impl Kernel<f64> for Tiles<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes<Scalar = f64>>(self, like: V) {
        let Self { sums, bins } = self;
        let rates: [Rates; crate::linear::gram::WIDEST] =
            core::array::from_fn(|bin| bins.get(bin).map_or_else(Rates::default, Rates::of));
        let rates = &rates[..bins.len()];
        for i in 0..sums.loads {
            let row = &mut sums.pairs[start(i)..start(i + 1)];
            for j in (0..=i).step_by(V::WIDTH) {
                if sums.has_unknowns {
                    store(&of_pair(like, bins, rates, i, j), row, length(i), j);
                } else {
                    store(&of_pair_of_seam(like, bins, rates, i, j), row, length(i), j);
                }
            }
        }
        for (other, sums_of_other) in sums.others.iter_mut().enumerate() {
            for i in (0..sums.loads).step_by(V::WIDTH) {
                let sums = of_other(like, bins, rates, other, i);
                store(&sums, sums_of_other.as_flattened_mut(), LOADS, i);
            }
        }
    }
}

/// Powers of ω.
#[derive(Clone, Copy, Debug, Default)]
struct Rates {
    omega: f64,
    square: f64,
    inverse: f64,
    inverse_square: f64,
}

impl Rates {
    fn of(bin: &Bin) -> Self {
        let omega = bin.omega;
        let inverse = 1.0 / omega;
        Self { omega, square: omega * omega, inverse, inverse_square: inverse * inverse }
    }
}

/// Adds the sums of each kind to those from `first` on.
#[inline(always)]
fn store<V: Lanes<Scalar = f64>>(sums: &[V], target: &mut [f64], length: usize, first: usize) {
    for (kind, sum) in sums.iter().enumerate() {
        let target = &mut target[kind * length + first..][..V::WIDTH];
        (sum.load(target) + *sum).store(target);
    }
}

/// `z_iᴴ z_j` of a bin, for as many j as there are lanes.
#[inline(always)]
fn product<V: Lanes<Scalar = f64>>(like: V, bin: &Bin, i: usize, j: usize) -> Complex<V> {
    let mut sum = Complex::zero(like);
    for [re, im] in &bin.loads {
        let own = Complex::new(like.fill(re[i]), like.fill(-im[i]));
        let other = Complex::new(like.load(&re[j..]), like.load(&im[j..]));
        sum = sum.add_mul(own, other);
    }
    sum
}

/// Sums of the seam: `Re M`, `Im M/ω`, `Re M/ω²`.
#[inline(always)]
fn of_pair_of_seam<V: Lanes<Scalar = f64>>(
    like: V,
    bins: &[Bin],
    rates: &[Rates],
    i: usize,
    j: usize,
) -> [V; KINDS_OF_SEAM] {
    assert!(i < LOADS && j + V::WIDTH <= LOADS && rates.len() == bins.len());
    let mut sums = [like.fill(0.0); KINDS_OF_SEAM];
    for number in 0..bins.len() {
        let (bin, rates) = (&bins[number], &rates[number]);
        let m = product(like, bin, i, j);
        sums[0] = sums[0] + m.re;
        sums[1] = m.im.mul_add(like.fill(rates.inverse), sums[1]);
        sums[2] = m.re.mul_add(like.fill(rates.inverse_square), sums[2]);
    }
    sums
}

/// Sums of the seam, and `Re P, ω Im P, Im P/ω` of `P = M q_j`, `Re P', ω Im P', Im P'/ω` of `P' = M* q_i`, and `Re R, ω Im R, ω² Re R` of
/// `R = q_i* P`.
#[inline(always)]
fn of_pair<V: Lanes<Scalar = f64>>(
    like: V,
    bins: &[Bin],
    rates: &[Rates],
    i: usize,
    j: usize,
) -> [V; KINDS] {
    assert!(i < LOADS && j + V::WIDTH <= LOADS && rates.len() == bins.len());
    let mut sums = [like.fill(0.0); KINDS];
    for number in 0..bins.len() {
        let (bin, rates) = (&bins[number], &rates[number]);
        let [re, im] = &bin.elongations;
        let (omega, inverse) = (like.fill(rates.omega), like.fill(rates.inverse));
        let m = product(like, bin, i, j);
        sums[0] = sums[0] + m.re;
        sums[1] = m.im.mul_add(inverse, sums[1]);
        sums[2] = m.re.mul_add(like.fill(rates.inverse_square), sums[2]);
        let own = Complex::new(like.fill(re[i]), like.fill(im[i]));
        let back = m.conjugate() * own;
        sums[6] = sums[6] + back.re;
        sums[7] = back.im.mul_add(omega, sums[7]);
        sums[8] = back.im.mul_add(inverse, sums[8]);
        let p = m * Complex::new(like.load(&re[j..]), like.load(&im[j..]));
        sums[3] = sums[3] + p.re;
        sums[4] = p.im.mul_add(omega, sums[4]);
        sums[5] = p.im.mul_add(inverse, sums[5]);
        let r = own.conjugate() * p;
        sums[9] = sums[9] + r.re;
        sums[10] = r.im.mul_add(omega, sums[10]);
        sums[11] = r.re.mul_add(like.fill(rates.square), sums[11]);
    }
    sums
}

/// Sums of a jump or the residual x and as many loads as there are lanes: `Re M, Im M/ω, Re M/ω², ω Im M` of `M = z_iᴴ x`, and
/// `Re Q, ω Im Q, Im Q/ω, ω² Re Q` of `Q = q_i* M`.
#[inline(always)]
fn of_other<V: Lanes<Scalar = f64>>(
    like: V,
    bins: &[Bin],
    rates: &[Rates],
    other: usize,
    i: usize,
) -> [V; OTHER_KINDS] {
    assert!(other < OTHERS && i + V::WIDTH <= LOADS && rates.len() == bins.len());
    let mut sums = [like.fill(0.0); OTHER_KINDS];
    for number in 0..bins.len() {
        let (bin, rates) = (&bins[number], &rates[number]);
        let (omega, inverse) = (like.fill(rates.omega), like.fill(rates.inverse));
        let mut m = Complex::zero(like);
        for axis in 0..3 {
            let (own, [re, im]) = (&bin.loads[axis], &bin.others[other][axis]);
            let own = Complex::new(like.load(&own[0][i..]), -like.load(&own[1][i..]));
            m = m.add_mul(own, Complex::new(like.fill(*re), like.fill(*im)));
        }
        sums[0] = sums[0] + m.re;
        sums[1] = m.im.mul_add(inverse, sums[1]);
        sums[2] = m.re.mul_add(like.fill(rates.inverse_square), sums[2]);
        sums[3] = m.im.mul_add(omega, sums[3]);
        let [re, im] = &bin.elongations;
        let q = Complex::new(like.load(&re[i..]), -like.load(&im[i..])) * m;
        sums[4] = sums[4] + q.re;
        sums[5] = q.im.mul_add(omega, sums[5]);
        sums[6] = q.im.mul_add(inverse, sums[6]);
        sums[7] = q.re.mul_add(like.fill(rates.square), sums[7]);
    }
    sums
}
