//! The SSP of the measured and the modelled acceleration, from thinned spectra. It needs no series in time, and bins can be left out.

use core::f64::consts::TAU;

use fearless_simd::Level;
use heapless::Vec;

use super::target::Target;
use crate::parameters::Bushings;
use crate::receptance::lanes::{Kernel, Lanes, Precision};
use crate::receptance::{Complex, Terms, accelerance, receptance};
use crate::search::{MAX_EXPERIMENTS, MAX_LOSSES};
use crate::spectrum::Experiment;
use crate::spectrum::thinned::ThinnedSpectra;

/// [`ssp`] of every experiment with its target, one after the other; experiments beyond [`MAX_EXPERIMENTS`] do not count.
pub fn losses<const B: usize>(
    targets: &[Target],
    experiments: &[Experiment<B>],
    bushings: &Bushings,
    level: Level,
) -> Vec<f32, MAX_LOSSES> {
    let pairs = targets.iter().zip(experiments).take(MAX_EXPERIMENTS);
    pairs.flat_map(|(target, one)| ssp(target, &one.thinned, bushings, level)).collect()
}

/// Surface similarity parameter of measured and modelled motion along each of the accelerometer's axes, mean over the bins. It is
/// the same for displacement and acceleration, since `s²` cancels.
pub fn ssp<const B: usize>(
    target: &Target,
    spectra: &ThinnedSpectra<B>,
    bushings: &Bushings,
    level: Level,
) -> [f32; 3] {
    Ssp {
        terms: &target.terms(bushings),
        alpha: spectra.alpha,
        omega: &spectra.omega,
        bins: spectra.bins,
        force: spectra.force.parts(),
        acceleration: spectra.acceleration.parts(),
    }
    .of(level)
}

/// Energies of measured and modelled acceleration: sums over the bins and the accelerometer's axes, (m/s)².
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Energies {
    /// Energy of the measured acceleration, noise included.
    pub measured: f32,
    /// Least and largest energy of the acceleration of all robots under the measured force. Infinity and zero without a robot.
    pub modelled: [f32; 2],
}

/// αT of the line on which the model's energy is summed. Its resonances are as wide there as the distance of the bins.
const ENERGY_DECAY: f64 = 7.0;
/// Number of lanes of the widest vector.
const GROUP: usize = 16;

/// [`Energies`] of one experiment with its target and some robots, along the axes that are measured. They show whether force and acceleration agree with the model's masses at all. They are
/// those of the whole record, and not of the search's damped line: where a cut begins slowly, its first tenth depends more on stiffnesses
/// than on masses.
pub fn energies<const B: usize>(
    target: &Target,
    experiment: &Experiment<B>,
    robots: &[Bushings],
    level: Level,
) -> Energies {
    // Whole groups; the last one is filled with zeros where there is room.
    let bins = experiment.bins().next_multiple_of(GROUP).min(B / GROUP * GROUP);
    let filled = |part: &Vec<f32, B>| {
        let mut part = part.clone();
        let _ = part.resize(bins, 0.0);
        part
    };
    let force = &experiment.force;
    let [re, im] = [&force.re, &force.im].map(|parts| parts.each_ref().map(filled));
    let omega: Vec<f32, B> = (0..bins).map(|bin| experiment.omega(bin) as f32).collect();
    let modelled = |bushings: &Bushings| {
        let modelled = Modelled {
            terms: &target.terms(bushings),
            alpha: (ENERGY_DECAY * experiment.spacing / TAU) as f32,
            omega: &omega,
            force: core::array::from_fn(|axis| [&re[axis][..], &im[axis][..]]),
            axes: [0, 1, 2].map(|axis| experiment.measures(axis)),
        };
        modelled.energy(level)
    };
    let measured = experiment.acceleration.parts();
    Energies {
        measured: measured.iter().flatten().copied().flatten().map(|part| part * part).sum(),
        modelled: robots
            .iter()
            .map(modelled)
            .fold([f32::INFINITY, 0.0], |[least, most], energy| {
                [least.min(energy), most.max(energy)]
            }),
    }
}

/// Input of the modelled energy.
struct Modelled<'a> {
    terms: &'a Terms<f32>,
    alpha: f32,
    omega: &'a [f32],
    /// Real and imaginary parts of each axis; filling bins are zero.
    force: [[&'a [f32]; 2]; 3],
    /// The axes of the acceleration that are measured.
    axes: [bool; 3],
}

impl Modelled<'_> {
    /// Compiled once: not again for each number of bins, in each crate.
    fn energy(self, level: Level) -> f32 {
        f32::dispatch(level, self)
    }
}

impl Kernel<f32> for Modelled<'_> {
    type Output = f32;

    #[inline(always)]
    fn run<V: Lanes<Scalar = f32>>(self, like: V) -> f32 {
        let Self { terms, alpha, omega, force, axes } = self;
        let mut sum = like.fill(0.0);
        for first in (0..omega.len()).step_by(V::WIDTH) {
            let s = Complex::new(like.fill(alpha), like.load(&omega[first..]));
            let force = force
                .map(|[re, im]| Complex::new(like.load(&re[first..]), like.load(&im[first..])));
            let mut rows = [[Complex::zero(like); 3]; 3];
            accelerance(terms, s, &mut rows);
            for (row, _) in rows.iter().zip(axes).filter(|(_, is_measured)| *is_measured) {
                let model = (row[0] * force[0]).add_mul(row[1], force[1]).add_mul(row[2], force[2]);
                sum = sum + model.square();
            }
        }
        let mut lanes = [0.0; 16];
        sum.store(&mut lanes);
        lanes.iter().sum()
    }
}

/// Spectra as slices, so that there is one kernel for all capacities.
struct Ssp<'a> {
    terms: &'a Terms<f32>,
    alpha: f32,
    omega: &'a [f32],
    /// Number of bins without the filling.
    bins: usize,
    /// Real and imaginary parts of the force, each axis.
    force: [[&'a [f32]; 2]; 3],
    /// Real and imaginary parts of the acceleration, each axis.
    acceleration: [[&'a [f32]; 2]; 3],
}

impl Ssp<'_> {
    fn of(self, level: Level) -> [f32; 3] {
        f32::dispatch(level, self)
    }
}

impl Kernel<f32> for Ssp<'_> {
    type Output = [f32; 3];

    #[inline(always)]
    fn run<V: Lanes<Scalar = f32>>(self, like: V) -> [f32; 3] {
        if self.terms.collocated {
            self.compare::<V, true>(like)
        } else {
            self.compare::<V, false>(like)
        }
    }
}

impl Ssp<'_> {
    #[inline(always)]
    fn compare<V: Lanes<Scalar = f32>, const COLLOCATED: bool>(self, like: V) -> [f32; 3] {
        let Self { terms, alpha, omega, bins, force, acceleration } = self;
        let at = |[re, im]: [&[f32]; 2], first: usize| {
            Complex::new(like.load(&re[first..]), like.load(&im[first..]))
        };
        let mut sums = [like.fill(0.0); 3];
        for first in (0..omega.len()).step_by(V::WIDTH) {
            let s = Complex::new(like.fill(alpha), like.load(&omega[first..]));
            let (rows, pushed) = if COLLOCATED {
                let [xx, yx, yy, zx, zy, zz] = receptance(terms, s);
                let s2 = s * s;
                let pushed =
                    [at(force[0], first) * s2, at(force[1], first) * s2, at(force[2], first) * s2];
                ([[xx, yx, zx], [yx, yy, zy], [zx, zy, zz]], pushed)
            } else {
                let mut rows = [[Complex::zero(like); 3]; 3];
                accelerance(terms, s, &mut rows);
                (rows, [at(force[0], first), at(force[1], first), at(force[2], first)])
            };
            for (axis, row) in rows.iter().enumerate() {
                let model =
                    (row[0] * pushed[0]).add_mul(row[1], pushed[1]).add_mul(row[2], pushed[2]);
                let measured = at(acceleration[axis], first);
                // Filling bins are zero on both sides: 0 / tiny.
                let size = measured.square() + model.square() + like.fill(f32::MIN_POSITIVE);
                sums[axis] = sums[axis] + (measured - model).square() / size;
            }
        }
        sums.map(|sum| {
            let mut lanes = [0.0; 16];
            sum.store(&mut lanes);
            lanes.iter().sum::<f32>() / bins as f32
        })
    }
}
