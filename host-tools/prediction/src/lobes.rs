//! Stability lobes: the depth of cut at which the tool begins to chatter, by spindle speed.
//!
//! The zero-order method (Altintas and Budak, "Analytical prediction of stability lobes in milling", CIRP Annals 44, 1995) takes the mean
//! of the cutting forces over a turn. With the receptance Φ(ω) in the plane of the cutter, two by two, the chatter frequency ω and the
//! limit of the depth b solve
//!
//! ```text
//! B (1 − e^{−iωT}) = 1/μ        μ: eigenvalue of α Φ(ω)        B = N K_t b / 4π        T = 60/(N n)
//! b = 2π / (N K_t Re μ)         ωT = θ + 2πk                   cot θ/2 = −Im μ / Re μ
//! ```
//!
//! for a speed n, turns a minute, where Re μ is positive. k numbers the lobes: waves that a tooth leaves for the next. The mean of the
//! forces is right for a wide cut with several teeth in it. In a narrow one period doubling adds lobes, which this method does not see.
//!
//! ```text
//! ∂ ln b = −Re ∂ ln μ − Re J ∂ω        Im J ∂ω = −Im ∂ ln μ        J = iT e^{−iωT}/(1 − e^{−iωT}) + d ln μ/dω
//! ```
//!
//! On a lobe the limit is smooth, so that its interval follows from the gradient (delta method). The lowest lobe counts. Where others lie
//! within its interval, the limit may be theirs: its interval then reaches from the least lower end of these lobes to their least upper
//! end. No lower end is below that of the worst speed: on the steep flank of a lobe the gradient alone would say so.

use std::f64::consts::{PI, TAU};

use nalgebra::{Complex, DVector, Matrix2, Matrix3x2, Vector2};
use rayon::prelude::*;
use serde::Serialize;

use crate::milling::Cutter;
use flexid_pipeline::dynamics::{Dynamics, Place};
use flexid_pipeline::dynamics::{PositiveEstimate, root as variance_root};

/// Samples of the receptance at the start, evenly spaced. Chosen: a mode of 1 % damping at 10 Hz is a tenth of a hertz wide, and refining
/// finds it, since its flanks reach far.
const FIRST: usize = 128;
/// Error of 1/μ midway between two samples, relative, at which an interval is not split further.
const SMOOTH: f64 = 1e-4;
/// Most rounds of splitting: to a thousandth of the first spacing.
const ROUNDS: usize = 10;
/// Part of an interval that a golden section keeps.
const GOLDEN: f64 = 0.618_033_988_749_895;
/// Golden sections in the search of the least depth. Chosen: the interval shrinks to a hundred-thousandth.
const SECTIONS: usize = 24;
/// Most waves between two teeth. Chosen: with more, the lobes leave no speed apart from the least depth.
const MOST_WAVES: f64 = 1e4;
/// Eigenvalue of α Φ, in parts of the other one, that is rounding.
const ROUNDING: f64 = 1e-9;

/// The two eigenvalues of α Φ at a frequency.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// 1/μ, N/m; infinite where a direction does not respond.
    pub stiffness: [Complex<f64>; 2],
    /// Covariance of real and imaginary part of ln μ.
    pub covariance: [Matrix2<f64>; 2],
}

/// Limit of the depth of cut.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Limit {
    /// Depth along the axis of the cutter, m. Deeper cuts chatter.
    pub depth_m: PositiveEstimate,
    /// Frequency of the chatter, Hz.
    pub chatter_hz: PositiveEstimate,
    /// Whole waves between two teeth.
    pub lobe: u32,
}

/// The lobes of a cutter on a structure.
#[derive(Clone, Debug)]
pub struct Lobes {
    cutter: Cutter,
    samples: Vec<Sample>,
    /// The limit of the worst speed.
    least: Option<PositiveEstimate>,
}

impl Sample {
    /// A sample with the receptance in the plane of the cutter, m/N, and its derivatives by what is uncertain, whose covariance with those is
    /// `spread`: of two gradients.
    pub fn new(
        frequency_hz: f64,
        directional: &Matrix2<f64>,
        receptance: &Matrix2<Complex<f64>>,
        gradient: &[Matrix2<Complex<f64>>],
        spread: impl Fn(&DVector<f64>, &DVector<f64>) -> f64,
    ) -> Self {
        let directional = directional.map(Complex::from);
        let own = directional * receptance;
        let half = own.trace() / 2.0;
        let apart = (half * half - own.determinant()).sqrt();
        let mut values = [half + apart, half - apart];
        let largest = values[0].norm().max(values[1].norm());
        values
            .iter_mut()
            .filter(|own| own.norm() < ROUNDING * largest)
            .for_each(|own| *own = Complex::from(0.0));
        let covariance = [0, 1].map(|index| {
            let (value, other) = (values[index], values[1 - index]);
            // ∂μ = tr((A − μ' 1) ∂A) / (μ − μ'), with the other eigenvalue μ'.
            let projector = (own - Matrix2::identity() * other) / (value - other);
            let relative: Vec<Complex<f64>> = gradient
                .iter()
                .map(|change| (projector * directional * change).trace() / value)
                .collect();
            let [re, im]: [DVector<f64>; 2] = [
                DVector::from_iterator(relative.len(), relative.iter().map(|own| own.re)),
                DVector::from_iterator(relative.len(), relative.iter().map(|own| own.im)),
            ];
            let cross = spread(&re, &im);
            Matrix2::new(spread(&re, &re), cross, cross, spread(&im, &im))
        });
        let stiffness = values.map(|own| match own.norm() {
            0.0 => Complex::from(f64::INFINITY),
            _ => own.inv(),
        });
        Self { frequency_hz, stiffness, covariance }
    }

    /// Exchanges the eigenvalues if they continue those of `before` better then.
    fn matched(mut self, before: &Self) -> Self {
        let far = |a: usize, b: usize| {
            let (own, other) = (self.stiffness[a], before.stiffness[b]);
            match (own.norm().is_finite(), other.norm().is_finite()) {
                (true, true) => (own / other).ln().norm(),
                (false, false) => 0.0,
                _ => f64::INFINITY,
            }
        };
        if far(0, 1) + far(1, 0) < far(0, 0) + far(1, 1) {
            self.stiffness.swap(0, 1);
            self.covariance.swap(0, 1);
        }
        self
    }

    /// Returns whether a line from this sample to `end` passes `mid` closely.
    fn is_smooth(&self, mid: &Self, end: &Self) -> bool {
        let mid = mid.matched(self);
        let end = end.matched(&mid);
        (0..2).all(|own| {
            let value = mid.stiffness[own];
            let error = value - (self.stiffness[own] + end.stiffness[own]) / 2.0;
            // Where a direction does not respond, there is nothing to resolve.
            let error = error.norm();
            !error.is_finite() || error <= SMOOTH * value.norm()
        })
    }
}

impl Lobes {
    /// Samples a structure from `lower` to `upper`, Hz. `None` where it has no response.
    pub fn new(
        cutter: Cutter,
        [lower, upper]: [f64; 2],
        sample: impl Fn(f64) -> Option<Sample> + Sync,
    ) -> Option<Self> {
        let all = |places: Vec<f64>| -> Option<Vec<Sample>> {
            places.into_par_iter().map(&sample).collect()
        };
        let step = (upper - lower) / (FIRST - 1) as f64;
        let mut samples = all((0..FIRST).map(|index| lower + step * index as f64).collect())?;
        // Whether the interval behind a sample is to be split.
        let mut rough = vec![true; samples.len() - 1];
        for _ in 0..ROUNDS {
            if !rough.contains(&true) {
                break;
            }
            let between = samples.windows(2).zip(&rough).filter(|(_, rough)| **rough);
            let places =
                between.map(|(pair, _)| (pair[0].frequency_hz + pair[1].frequency_hz) / 2.0);
            let mut middles = all(places.collect())?.into_iter();
            let (mut finer, mut rougher) = (vec![samples[0]], Vec::new());
            for (pair, rough) in samples.windows(2).zip(&rough) {
                if let Some(mid) = rough.then(|| middles.next()).flatten() {
                    let split = !pair[0].is_smooth(&mid, &pair[1]);
                    finer.push(mid);
                    rougher.push(split);
                    rougher.push(split);
                } else {
                    rougher.push(false);
                }
                finer.push(pair[1]);
            }
            (samples, rough) = (finer, rougher);
        }
        for place in 1..samples.len() {
            samples[place] = samples[place].matched(&samples[place - 1]);
        }
        let mut lobes = Self { cutter, samples, least: None };
        lobes.least = lobes.worst(sample);
        Some(lobes)
    }

    /// Lowest and highest spindle speed, turns a minute, of which the samples speak: those at which the teeth pass within the frequencies that were
    /// sampled, and a tooth leaves at most ten thousand waves. Where the teeth pass faster than all modes that were sampled vibrate, these hardly chatter,
    /// and the limit is that of modes beyond.
    pub fn speeds(&self) -> [f64; 2] {
        let ends = [self.samples.first(), self.samples.last()];
        let [lower, upper] = ends.map(|own| own.map_or(0.0, |own| own.frequency_hz));
        [lower.max(upper / MOST_WAVES), upper].map(|hz| 60.0 * hz / f64::from(self.cutter.teeth))
    }

    /// The limit at a spindle speed within [`speeds`](Self::speeds), turns a minute. `None` where no depth chatters within the frequencies.
    pub fn limit(&self, rpm: f64) -> Option<Limit> {
        let period = 60.0 / (f64::from(self.cutter.teeth) * rpm);
        let all: Vec<Limit> = self.crossings(period).collect();
        let by_depth = |a: &&Limit, b: &&Limit| a.depth_m.value.total_cmp(&b.depth_m.value);
        let mut lowest = *all.iter().min_by(by_depth)?;
        let [_, reach] = lowest.depth_m.interval;
        let mut ends = lowest.depth_m.interval;
        for own in all.iter().filter(|own| own.depth_m.value <= reach) {
            for (least, end) in ends.iter_mut().zip(own.depth_m.interval) {
                *least = least.min(end);
            }
        }
        let floor = self.least.map_or(0.0, |least| least.interval[0]);
        lowest.depth_m.interval = [ends[0].max(floor), ends[1]];
        Some(lowest)
    }

    /// The limit of the worst speed, m: shallower cuts are stable at all [`speeds`](Self::speeds). `None` where no depth chatters within the
    /// frequencies.
    pub fn least(&self) -> Option<PositiveEstimate> {
        self.least
    }

    /// The limit of the worst speed: by golden section between the samples beside the least one.
    fn worst(&self, sample: impl Fn(f64) -> Option<Sample>) -> Option<PositiveEstimate> {
        let depths =
            self.samples.iter().map(|own| self.shallowest(own).map_or(f64::INFINITY, |own| own.0));
        let (place, _) = depths.enumerate().min_by(|(_, a), (_, b)| a.total_cmp(b))?;
        let hz = |place: usize| self.samples[place.min(self.samples.len() - 1)].frequency_hz;
        let [mut low, mut high] = [hz(place.saturating_sub(1)), hz(place + 1)];
        let depth = |hz: f64| {
            let shallowest = sample(hz).and_then(|own| self.shallowest(&own));
            shallowest.map_or(f64::INFINITY, |(depth, _)| depth)
        };
        for _ in 0..SECTIONS {
            let reach = (high - low) * GOLDEN;
            let [first, last] = [high - reach, low + reach];
            if depth(first) < depth(last) { high = last } else { low = first }
        }
        let worst = sample((low + high) / 2.0)?;
        let (depth, own) = self.shallowest(&worst)?;
        // At the least depth ∂ ln b = −∂ ln Re μ.
        let stiffness = worst.stiffness[own];
        let along = Vector2::new(1.0, stiffness.im / stiffness.re);
        let std = variance_root(along.dot(&(worst.covariance[own] * along)));
        Some(PositiveEstimate::new(depth, std))
    }

    /// The least depth at the frequency of a sample, and the place of its eigenvalue. `None` where no depth chatters.
    fn shallowest(&self, sample: &Sample) -> Option<(f64, usize)> {
        let all = sample.stiffness.iter().enumerate();
        all.filter(|(_, own)| own.re > 0.0 && own.norm().is_finite())
            .map(|(place, own)| (self.depth(*own), place))
            .min_by(|(a, _), (b, _)| a.total_cmp(b))
    }

    /// b of 1/μ.
    fn depth(&self, stiffness: Complex<f64>) -> f64 {
        let Cutter { teeth, tangential, .. } = self.cutter;
        let scale = TAU / (f64::from(teeth) * tangential);
        // 1 / Re μ.
        scale * stiffness.norm_sqr() / stiffness.re
    }

    /// All solutions for this time between two teeth, s.
    fn crossings(&self, period: f64) -> impl Iterator<Item = Limit> {
        self.samples.windows(2).flat_map(move |pair| {
            [0, 1].into_iter().flat_map(move |own| self.between(pair, own, period))
        })
    }

    /// Solutions of an eigenvalue between two samples.
    fn between(&self, pair: &[Sample], own: usize, period: f64) -> Vec<Limit> {
        let [from, to] = [pair[0], pair[1]];
        let [start, end] = [from.stiffness[own], to.stiffness[own]];
        let is_possible = |value: Complex<f64>| value.re > 0.0 && value.norm().is_finite();
        if !is_possible(start) || !is_possible(end) {
            return Vec::new();
        }
        let at = |part: f64| start + (end - start) * part;
        let hz = |part: f64| from.frequency_hz + (to.frequency_hz - from.frequency_hz) * part;
        let waves = |part: f64| {
            let stiffness = at(part);
            hz(part) * period - stiffness.re.atan2(stiffness.im) / PI
        };
        let [first, last] = [waves(0.0), waves(1.0)];
        let [low, high] = [first.min(last), first.max(last)];
        let mut found = Vec::new();
        let mut lobe = low.ceil().max(0.0);
        // The end belongs to the next interval.
        while lobe < high || (lobe == high && first == high) {
            let part = root(|part| waves(part) - lobe);
            let covariance = from.covariance[own] * (1.0 - part) + to.covariance[own] * part;
            let omega = TAU * hz(part);
            let slope = (end - start) / (TAU * (to.frequency_hz - from.frequency_hz));
            let turn = Complex::cis(-omega * period);
            let per_omega =
                Complex::i() * period * turn / (Complex::from(1.0) - turn) - slope / at(part);
            let along = Vector2::new(-1.0, per_omega.re / per_omega.im);
            let std = variance_root(along.dot(&(covariance * along)));
            let frequency_std = variance_root(covariance[(1, 1)]) / (per_omega.im.abs() * omega);
            found.push(Limit {
                depth_m: PositiveEstimate::new(self.depth(at(part)), std),
                chatter_hz: PositiveEstimate::new(hz(part), frequency_std),
                lobe: lobe as u32,
            });
            lobe += 1.0;
        }
        found
    }
}

impl Lobes {
    /// The lobes of a cutter whose [plane](crate::milling::plane) this is, with chatter frequencies from `lower` to `upper`, Hz. `None` where
    /// the robot has no response.
    pub fn of(
        at: &Dynamics<'_>,
        cutter: Cutter,
        plane: &Matrix3x2<f64>,
        band_hz: [f64; 2],
    ) -> Option<Self> {
        let directional = cutter.directional();
        let plane = plane.map(Complex::from);
        let covariance = at.robot().covariance();
        let sample = |hz| {
            let place = Place::At(Complex::new(0.0, TAU * hz));
            let response = at.response(place, 3)?;
            let of_plane = |own: &nalgebra::DMatrix<Complex<f64>>| -> Matrix2<Complex<f64>> {
                plane.transpose() * own.fixed_view::<3, 3>(0, 0) * plane
            };
            let gradient: Vec<_> = at.gradient(place, &response).iter().map(of_plane).collect();
            let spread = |a: &DVector<f64>, b: &DVector<f64>| a.dot(&(covariance * b));
            Some(Sample::new(hz, &directional, &of_plane(&response.value), &gradient, spread))
        };
        Self::new(cutter, band_hz, sample)
    }
}

/// Place between 0 and 1 where a function that changes its sign there is zero.
fn root(function: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    let rises = function(1.0) > function(0.0);
    // To the last digit of a double.
    for _ in 0..53 {
        let mid = (low + high) / 2.0;
        if (function(mid) > 0.0) == rises { high = mid } else { low = mid }
    }
    (low + high) / 2.0
}
