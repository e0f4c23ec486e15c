//! The bins of a record, as many at a time as a vector has lanes.

use core::ops::Range;

use heapless::Vec;

use super::model::Model;
use super::seam::{ORDERS, powers};
use crate::linear::gram::WIDEST;
use crate::receptance::Complex;
use crate::receptance::lanes::Lanes;
use crate::spectrum::{Experiment, Kind, Part};

/// The bins of one record.
#[derive(Clone)]
pub(super) struct Bins<'a> {
    kind: Kind,
    spacing: f64,
    first_bin: usize,
    /// Distance of the bins that count, 1 where all do.
    every: usize,
    /// Number of parts of the record.
    parts: usize,
    /// Per axis mean squares of what the movement still leaves. Empty where the robot stands.
    movement: [&'a [f32]; 3],
    /// ω₀: the lowest angular frequency of the record.
    lowest: f64,
    /// Per axis real and imaginary parts.
    force: [[&'a [f32]; 2]; 3],
    acceleration: [[&'a [f32]; 2]; 3],
    /// Derivative of the acceleration by its drift.
    drift: [[&'a [f32]; 2]; 3],
    /// Per axis mean squares.
    force_noise: [&'a [f32]; 3],
    acceleration_noise: [&'a [f32]; 3],
}

impl<'a> Bins<'a> {
    /// The bins of a part of an experiment.
    pub(super) fn of<const B: usize>(experiment: &'a Experiment<B>, part: &Part<'_>) -> Self {
        let whole = Self {
            kind: experiment.kind,
            spacing: experiment.spacing,
            first_bin: experiment.first_bin,
            every: 1,
            parts: experiment.divided,
            movement: experiment.movement.left.each_ref().map(Vec::as_slice),
            lowest: experiment.omega(0),
            force: experiment.force.parts(),
            acceleration: experiment.acceleration.parts(),
            drift: experiment.drift.parts(),
            force_noise: experiment.force_noise.each_ref().map(Vec::as_slice),
            acceleration_noise: experiment.acceleration_noise.each_ref().map(Vec::as_slice),
        };
        Self { first_bin: experiment.first_bin, ..whole.some(part.bins.clone()) }
    }

    /// The first bin, and then one out of `every`.
    pub(super) fn thinned<const B: usize>(
        experiment: &'a Experiment<B>,
        part: &Part<'_>,
        every: usize,
    ) -> Self {
        Self { every, ..Self::of(experiment, part) }
    }

    /// All bins, with the noise of the acceleration that has no lines.
    pub(super) fn without_lines<const B: usize>(
        experiment: &'a Experiment<B>,
        part: &Part<'_>,
    ) -> Self {
        let broad = experiment.broad_noise.each_ref().map(|axis| &axis[part.bins.clone()]);
        Self { acceleration_noise: broad, ..Self::of(experiment, part) }
    }

    /// Some of the bins that count.
    pub(super) fn some(&self, bins: Range<usize>) -> Self {
        let all = self.force[0][0].len();
        let bins = bins.start * self.every..all.min(bins.end * self.every);
        let cut =
            |axes: &[[&'a [f32]; 2]; 3]| axes.map(|parts| parts.map(|part| &part[bins.clone()]));
        let cut_noise = |axes: &[&'a [f32]; 3]| axes.map(|axis| &axis[bins.clone()]);
        Self {
            kind: self.kind,
            spacing: self.spacing,
            first_bin: self.first_bin + bins.start,
            every: self.every,
            parts: self.parts,
            movement: self.movement.map(|axis| axis.get(bins.clone()).unwrap_or_default()),
            lowest: self.lowest,
            force: cut(&self.force),
            acceleration: cut(&self.acceleration),
            drift: cut(&self.drift),
            force_noise: cut_noise(&self.force_noise),
            acceleration_noise: cut_noise(&self.acceleration_noise),
        }
    }

    /// Number of the bins that count.
    pub(super) fn bins(&self) -> usize {
        self.force[0][0].len().div_ceil(self.every)
    }

    /// A value of the bin of this number, among those that count.
    #[inline(always)]
    fn at(&self, values: &[f32], bin: usize) -> f64 {
        f64::from(values[bin * self.every])
    }

    /// Real and imaginary part of the acceleration along each axis.
    #[inline(always)]
    pub(super) fn measured(&self, bin: usize) -> [[f64; 2]; 3] {
        let mut measured = [[0.0; 2]; 3];
        for axis in 0..3 {
            for part in 0..2 {
                measured[axis][part] = self.at(self.acceleration[axis][part], bin);
            }
        }
        measured
    }

    /// Square of the acceleration in standard deviations of its noise, of all bins and axes.
    pub(super) fn square(&self) -> f64 {
        let of_axis = |axis: usize| {
            (0..self.bins()).map(move |bin| {
                let [re, im] = self.acceleration[axis].map(|part| self.at(part, bin));
                (re * re + im * im) / self.at(self.acceleration_noise[axis], bin)
            })
        };
        (0..3).flat_map(of_axis).sum()
    }

    /// Real and imaginary part of what this drift adds to the acceleration along each axis.
    #[inline(always)]
    pub(super) fn drifted(&self, drift: f64, bin: usize) -> [[f64; 2]; 3] {
        let mut drifted = [[0.0; 2]; 3];
        if drift != 0.0 {
            for axis in 0..3 {
                for part in 0..2 {
                    drifted[axis][part] = drift * self.at(self.drift[axis][part], bin);
                }
            }
        }
        drifted
    }

    /// Mean squares of the noise of the force, as a sensor of no gain and no filter would have it, and of the acceleration. The
    /// second includes `η² |A|²/3`, the error of the model that the weights allow for, and the error by the movement.
    #[inline(always)]
    pub(super) fn noise(&self, model: &Model, bin: usize) -> [[f64; 3]; 2] {
        let Model { force_gain, force_filter, relative_error, .. } = model;
        let filtered = if force_filter.is_none() {
            1.0
        } else {
            force_filter.inverse(Complex::new(self.decay(), self.omega(bin))).square()
        };
        let mut error = 0.0;
        if *relative_error != 0.0 {
            let measured = self.measured(bin);
            let square: f64 = measured.as_flattened().iter().map(|part| part * part).sum();
            error = relative_error * relative_error * square / 3.0;
        }
        let mut noise = [[0.0; 3]; 2];
        for axis in 0..3 {
            let gain = force_gain[axis];
            noise[0][axis] = filtered * self.at(self.force_noise[axis], bin) / (gain * gain);
            let moves =
                self.movement[axis].get(bin * self.every).map_or(0.0, |own| f64::from(*own));
            noise[1][axis] = self.at(self.acceleration_noise[axis], bin) + error + moves;
        }
        noise
    }

    /// Number of parts of the record.
    pub(super) fn parts(&self) -> f64 {
        self.parts as f64
    }

    /// ω₀: the lowest angular frequency of the record.
    pub(super) fn lowest(&self) -> f64 {
        self.lowest
    }

    /// Returns whether the spectra have an end.
    pub(super) fn has_seam(&self) -> bool {
        self.kind == Kind::Record
    }

    /// Returns whether the bins lie on the imaginary axis: no window has damped the signals.
    pub(super) fn is_on_axis(&self) -> bool {
        self.decay() == 0.0
    }

    /// Real part of s, 1/s.
    fn decay(&self) -> f64 {
        match self.kind {
            Kind::Record => 0.0,
            Kind::Receptance { decay, .. } => decay,
        }
    }

    fn omega(&self, bin: usize) -> f64 {
        self.kind.first() + (self.first_bin + bin * self.every) as f64 * self.spacing
    }
}

/// One bin per lane; the last bin is repeated where the band ends.
pub(super) struct Batch<V> {
    pub(super) s: Complex<V>,
    pub(super) inverse_s: Complex<V>,
    /// Force as measured, later as best known.
    pub(super) force: [Complex<V>; 3],
    /// Derivative of the acceleration by its drift. Zero until it is [loaded](Batch::load_drift).
    pub(super) drift: [Complex<V>; 3],
    /// Powers of s/ω₀ of each lane, ω₀ the lowest angular frequency of the band.
    pub(super) powers: [[f64; ORDERS]; WIDEST],
}

impl<V: Lanes<Scalar = f64>> Batch<V> {
    #[inline(always)]
    pub(super) fn new(like: V, record: &Bins<'_>, model: &Model, first: usize) -> Self {
        let force_gain = &model.force_gain;
        let last = record.bins() - 1;
        let gather = |value: &dyn Fn(usize) -> f64| gather(like, first, last, value);
        let s = Complex { re: like.fill(record.decay()), im: gather(&|bin| record.omega(bin)) };
        let inverse_s = match record.is_on_axis() {
            true => Complex::new(like.fill(0.0), gather(&|bin| -1.0 / record.omega(bin))),
            false => s.reciprocal(),
        };
        let mut force: [Complex<V>; 3] = core::array::from_fn(|axis| Complex {
            re: gather(&|bin| record.at(record.force[axis][0], bin) / force_gain[axis]),
            im: gather(&|bin| record.at(record.force[axis][1], bin) / force_gain[axis]),
        });
        let mut of_ratio = [[0.0; ORDERS]; WIDEST];
        for (lane, of_ratio) in of_ratio[..V::WIDTH].iter_mut().enumerate() {
            *of_ratio = powers(record.omega((first + lane).min(last)) / record.lowest);
        }
        if !model.force_filter.is_none() {
            let inverse = model.force_filter.inverse(s);
            for force in &mut force {
                *force = *force * inverse;
            }
        }
        Self { s, inverse_s, force, drift: [Complex::zero(like); 3], powers: of_ratio }
    }

    /// Loads the derivative of the acceleration by its drift, in the bins from `first` on.
    #[inline(always)]
    pub(super) fn load_drift(&mut self, record: &Bins<'_>, first: usize) {
        let (like, last) = (self.s.re, record.bins() - 1);
        for (drift, parts) in self.drift.iter_mut().zip(&record.drift) {
            drift.re = gather(like, first, last, &|bin| record.at(parts[0], bin));
            drift.im = gather(like, first, last, &|bin| record.at(parts[1], bin));
        }
    }
}

/// The values of the bins from `first` on, not beyond the last one.
#[inline(always)]
fn gather<V: Lanes<Scalar = f64>>(
    like: V,
    first: usize,
    last: usize,
    value: &dyn Fn(usize) -> f64,
) -> V {
    let mut lanes = [0.0; WIDEST];
    for (lane, target) in lanes[..V::WIDTH].iter_mut().enumerate() {
        *target = value((first + lane).min(last));
    }
    like.load(&lanes)
}

/// Real and imaginary parts, lane by lane.
#[inline(always)]
pub(super) fn spill<V: Lanes<Scalar = f64>>(value: Complex<V>) -> [[f64; WIDEST]; 2] {
    [value.re, value.im].map(|part| {
        let mut lanes = [0.0; WIDEST];
        part.store(&mut lanes);
        lanes
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use rand_xoshiro::Xoshiro256PlusPlus;
    use rand_xoshiro::rand_core::SeedableRng as _;

    use super::super::tests::{BINS, SAMPLES, chain, measurement, record};
    use super::*;

    proptest! {
        /// Bin k of a part of those that count is a bin of the record: with its frequency, force, reading and noise.
        #[test]
        fn one_bin_out_of_several_counts(every in 1..6_usize, from in 0..5_usize, count in 1..6_usize) {
            let record = record(&mut Xoshiro256PlusPlus::seed_from_u64(1));
            let whole = Experiment::<BINS>::new(&chain(), &measurement(), &record, &mut [0.0; SAMPLES]);
            let whole = whole.unwrap();
            let only = whole.parts().next().unwrap();
            let (all, some) = (Bins::of(&whole, &only), Bins::thinned(&whole, &only, every));
            prop_assert_eq!(some.bins(), all.bins().div_ceil(every));
            let part = some.some(from..from + count);
            prop_assert_eq!(part.bins(), count);
            for bin in 0..count {
                let own = (from + bin) * every;
                prop_assert_eq!(part.omega(bin), all.omega(own));
                prop_assert_eq!(part.measured(bin), all.measured(own));
                prop_assert_eq!(part.drifted(2.0, bin), all.drifted(2.0, own));
                for axis in 0..3 {
                    let values = [part.force[axis][0], part.force_noise[axis], part.acceleration_noise[axis]];
                    let expected = [all.force[axis][0], all.force_noise[axis], all.acceleration_noise[axis]];
                    prop_assert_eq!(values.map(|own| part.at(own, bin)), expected.map(|whole| f64::from(whole[own])));
                }
            }
        }
    }
}
