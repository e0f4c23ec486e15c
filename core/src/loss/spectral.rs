//! The SSP of measured acceleration and the model's, straight from the spectra that the search reads: no
//! series in time is needed, and bins can be left out.

use fearless_simd::Level;
use heapless::Vec;

use crate::parameters::Bushings;
use crate::receptance::lanes::{Kernel, Lanes, Precision};
use crate::receptance::{Complex, Terms, receptance};
use crate::search::{MAX_EXPERIMENTS, MAX_LOSSES};
use crate::spectrum::Experiment;
use crate::spectrum::search::SearchSpectra;

/// [`ssp`] of every experiment, one after the other; those beyond [`MAX_EXPERIMENTS`] do not count.
pub fn losses<const B: usize>(
    experiments: &[Experiment<B>],
    bushings: &Bushings,
    level: Level,
) -> Vec<f32, MAX_LOSSES> {
    let experiments = experiments.iter().take(MAX_EXPERIMENTS);
    experiments.flat_map(|experiment| ssp(&experiment.search, bushings, level)).collect()
}

/// Surface similarity parameter of measured and modelled motion along each TCP axis, mean over the bins; the
/// same for displacement as for acceleration, since `s²` cancels.
pub fn ssp<const B: usize>(
    spectra: &SearchSpectra<B>,
    bushings: &Bushings,
    level: Level,
) -> [f32; 3] {
    let mut terms = spectra.terms.clone();
    terms.set_bushings(bushings);
    f32::dispatch(level, Ssp { spectra, terms: &terms })
}

struct Ssp<'a, const B: usize> {
    spectra: &'a SearchSpectra<B>,
    terms: &'a Terms<f32>,
}

impl<const B: usize> Kernel<f32> for Ssp<'_, B> {
    type Output = [f32; 3];

    #[inline(always)]
    fn run<V: Lanes<Scalar = f32>>(self, like: V) -> [f32; 3] {
        let Self { spectra, terms } = self;
        let at = |values: &Vec<f32, B>, first: usize| like.load(&values[first..]);
        let mut sums = [like.fill(0.0); 3];
        for first in (0..spectra.omega.len()).step_by(V::WIDTH) {
            let s = Complex::new(like.fill(spectra.alpha), at(&spectra.omega, first));
            let [xx, yx, yy, zx, zy, zz] = receptance(terms, s);
            let s2 = s * s;
            let force: [Complex<V>; 3] = core::array::from_fn(|axis| {
                let force = &spectra.force;
                Complex::new(at(&force.re[axis], first), at(&force.im[axis], first)) * s2
            });
            for (axis, row) in [[xx, yx, zx], [yx, yy, zy], [zx, zy, zz]].iter().enumerate() {
                let model = (row[0] * force[0]).plus(row[1], force[1]).plus(row[2], force[2]);
                let acceleration = &spectra.acceleration;
                let measured = Complex::new(
                    at(&acceleration.re[axis], first),
                    at(&acceleration.im[axis], first),
                );
                let gap = measured - model;
                let square = |z: Complex<V>| z.re.mul_add(z.re, z.im * z.im);
                // Filling bins are silent on both sides: 0 / tiny.
                let size = square(measured) + square(model) + like.fill(f32::MIN_POSITIVE);
                sums[axis] = sums[axis] + square(gap) / size;
            }
        }
        sums.map(|sum| {
            let mut lanes = [0.0; 16];
            sum.store(&mut lanes);
            lanes.iter().sum::<f32>() / spectra.bins as f32
        })
    }
}
