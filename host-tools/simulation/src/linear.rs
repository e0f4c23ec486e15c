//! The displacement of the linearised robot in a cut, from rest.
//!
//! With force and displacement weighted by `e^(−αt)`, `X(s) = H(s) F(s)` on the line `s = α + iω`. The inverse transform times
//! `e^(αt)` is the displacement. The force has nothing above half the sample rate ([`force`](crate::force)).

use std::f64::consts::TAU;

use fearless_simd::Level;
use flexid_core::chain::Chain;
use flexid_core::parameters::Bushing;
use flexid_core::receptance::lanes::{Kernel, Lanes, Precision as _};
use flexid_core::receptance::{Complex, Terms, receptance};
use flexid_core::sensors::Sensors;
use nalgebra::Vector3;
use realfft::RealFftPlanner;
use realfft::num_complex::Complex64 as Bin;

use crate::experiment::Cut;
use crate::force::OVERSAMPLING;

/// The product αT. The ringing after the record comes back damped by `e^(−αT)`, 1e-6, and rounding grows by `e^(αT)`, to 1e-10.
const DECAY: f64 = 14.0;
/// Lanes of the widest vector.
const WIDEST: usize = 8;
/// Packed entries of the receptance in each of its rows.
const ROWS: [[usize; 3]; 3] = [[0, 1, 3], [1, 2, 4], [3, 4, 5]];

/// Displacement of the TCP along its axes at rest, at the sample instants of `cut`, m. It is NaN where gravity leaves the robot no rest.
pub fn displacement(chain: &Chain, bushings: &[Bushing], cut: &Cut) -> Vec<Vector3<f64>> {
    let samples = cut.force.len().div_ceil(OVERSAMPLING);
    let linear = chain.linearise(&cut.pose, cut.gravity, bushings);
    let terms = linear.and_then(|linear| Terms::new(&linear, bushings, &Sensors::default()));
    let Ok(terms) = terms else { return vec![Vector3::repeat(f64::NAN); samples] };

    let decay = DECAY / samples as f64;
    let mut planner = RealFftPlanner::new();
    let (forward, inverse) = (planner.plan_fft_forward(samples), planner.plan_fft_inverse(samples));
    let mut spectra = [0, 1, 2].map(|axis| {
        let force = cut.force.iter().step_by(OVERSAMPLING).enumerate();
        let mut weighted: Vec<f64> =
            force.map(|(n, force)| force[axis] * (-decay * n as f64).exp()).collect();
        let mut spectrum = forward.make_output_vec();
        // Both buffers have the length that the plan needs.
        let _ = forward.process(&mut weighted, &mut spectrum);
        spectrum
    });
    let spacing = TAU * cut.rate_hz / samples as f64;
    let line = Line { terms: &terms, alpha: decay * cut.rate_hz, spacing, spectra: &mut spectra };
    f64::dispatch(Level::new(), line);
    let series = spectra.map(|mut spectrum| {
        let mut series = inverse.make_output_vec();
        // The transform of real numbers is real at both ends.
        spectrum[0].im = 0.0;
        if let Some(last) = spectrum.last_mut().filter(|_| samples.is_multiple_of(2)) {
            last.im = 0.0;
        }
        let _ = inverse.process(&mut spectrum, &mut series);
        series
    });
    let growth = |n: usize| (decay * n as f64).exp() / samples as f64;
    (0..samples).map(|n| Vector3::from_fn(|axis, _| series[axis][n]) * growth(n)).collect()
}

/// The kernel of `X = H F` on the line, in place.
struct Line<'a> {
    terms: &'a Terms<f64>,
    /// Real part of the line, 1/s.
    alpha: f64,
    /// Distance from bin to bin, rad/s.
    spacing: f64,
    spectra: &'a mut [Vec<Bin>; 3],
}

impl Kernel<f64> for Line<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes<Scalar = f64>>(self, like: V) {
        let Self { terms, alpha, spacing, spectra } = self;
        let bins = spectra[0].len();
        for first in (0..bins).step_by(V::WIDTH) {
            let omega: [f64; WIDEST] = std::array::from_fn(|lane| spacing * (first + lane) as f64);
            let entries = receptance(terms, Complex::new(like.fill(alpha), like.load(&omega)));
            let entries = entries.map(|entry| {
                let mut parts = [[0.0; WIDEST]; 2];
                entry.re.store(&mut parts[0]);
                entry.im.store(&mut parts[1]);
                parts
            });
            for lane in 0..V::WIDTH.min(bins - first) {
                let force = [0, 1, 2].map(|axis| spectra[axis][first + lane]);
                for (spectrum, row) in spectra.iter_mut().zip(ROWS) {
                    let moved = row.into_iter().zip(force).map(|(entry, force)| {
                        Bin::new(entries[entry][0][lane], entries[entry][1][lane]) * force
                    });
                    spectrum[first + lane] = moved.sum();
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use rand_core::SeedableRng as _;
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;
    use crate::experiment::tests::limp;
    use crate::reference::mill3;
    use crate::validation::displacement_error;

    /// The equation of motion, integrated in time, is linear for a force of a thousandth.
    #[test]
    fn a_small_force_moves_the_robot_as_integrated_in_time() {
        let (scenario, chain) = mill3();
        let sampling = &scenario.measurement;
        for (number, gravity) in [(0, 0.0), (1, -9.80665)] {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
            let experiment = &scenario.experiments[number];
            let mut cut = Cut::new(experiment, &scenario.cutting, sampling, &mut rng);
            cut.gravity = Vector3::new(0.0, 0.0, gravity);
            cut.force.iter_mut().for_each(|force| *force *= 1e-3);
            let integrated = cut.response(&chain, &scenario.truth).displacement;
            let found = displacement(&chain, &scenario.truth, &cut);
            let error = displacement_error(&integrated, &found, sampling.rate_hz, sampling.band_hz);
            assert!(error.iter().all(|&error| error < 2e-5), "{error:?}");
        }
    }

    #[test]
    fn a_robot_that_gravity_leaves_no_rest_is_not_a_number() {
        let (chain, limp, cut) = limp();
        let found = displacement(&chain, &limp, &cut);
        assert_eq!(found.len(), mill3().0.measurement.samples());
        assert!(found.iter().all(|own| own.x.is_nan()));
    }
}
