//! The receptance at every bin of a line `s = α + iω`. It is computed at every bin where it is sharp. Where it is
//! smooth, it is computed at every fourth bin, the nodes, and interpolated between them.
//!
//! A mode rings for `1/σ`, and its peak is `σ + α` wide. The higher modes of a robot die out within a fraction of a
//! record, so that their peaks are many bins wide, and more than half of all bins add no information. The module
//! tests this at each node: the receptance is smooth where the neighbours of a node predict it. The interpolation, by
//! the polynomial through six nodes, then errs by no more than single precision does.

use fearless_simd::Level;
use flexid_core::receptance::lanes::{Kernel, Lanes, Precision};
use flexid_core::receptance::{Complex, Terms, receptance};

/// Distance from node to node, bins.
const STRIDE: usize = 4;
/// Number of nodes in a group, the width of the widest vector.
const GROUP: usize = 16;
/// Largest error with which the cubic through its neighbours, twice as far apart, may predict a node, in parts of its
/// size. The error at the bins between the nodes is then a hundredth of that.
const PREDICTED: f32 = 7e-3;
/// Number of nodes to each side of the predicted one.
const REACH: usize = 3;
/// Packed entries of the receptance in each of its rows.
pub(super) const ROWS: [[usize; 3]; 3] = [[0, 1, 3], [1, 2, 4], [3, 4, 5]];

/// Real and imaginary parts of the receptance's packed entries, `xx yx yy zx zy zz`, m/N, place by place.
pub(super) type Entries = [[Vec<f32>; 2]; 6];

/// The bins in the order in which their receptance is kept: all bins below the nodes, the nodes, their first
/// followers, their second followers, and so on. Some bins have two places, which agree.
pub(super) struct Line {
    alpha: f32,
    /// Bin of each place. Some places have a bin that does not exist.
    pub(super) bins: Vec<usize>,
    /// Imaginary parts of the complex frequencies of all places, rad/s.
    omega: Vec<f32>,
    /// Number of places before the nodes.
    head: usize,
    nodes: usize,
    /// Weights of the six nodes that make each follower: two before the node that it follows, that node, and three
    /// after.
    weights: [[f32; 6]; STRIDE - 1],
}

impl Line {
    /// A line of `bins` bins from 0, `spacing` rad/s apart, at a real part of `alpha`.
    pub(super) fn new(alpha: f64, spacing: f64, bins: usize) -> Self {
        // The last follower of a node that has enough neighbours is the last bin.
        let nodes = (bins / STRIDE + REACH) / GROUP * GROUP;
        let followed = nodes.saturating_sub(2 * REACH);
        let first_node = (bins - followed * STRIDE).saturating_sub(REACH * STRIDE);
        let head = (bins - followed * STRIDE).next_multiple_of(GROUP);
        let follower = |place: usize| {
            let (follower, node) = (place / nodes, place % nodes);
            let is_followed = follower == 0 || (REACH..nodes - REACH).contains(&node);
            // A place past the end has no bin.
            if is_followed { first_node + node * STRIDE + follower } else { bins }
        };
        let bins: Vec<_> = (0..head).chain((0..STRIDE * nodes).map(follower)).collect();
        Self {
            alpha: alpha as f32,
            omega: bins.iter().map(|&bin| (spacing * bin as f64) as f32).collect(),
            bins,
            head,
            nodes,
            weights: std::array::from_fn(|follower| {
                let at = (follower + 1) as f64 / STRIDE as f64;
                weights([-2.0, -1.0, 0.0, 1.0, 2.0, 3.0], at)
            }),
        }
    }

    /// Computes the receptance of `terms` at all places into `entries`. Returns how many of them are computed by the
    /// recursion.
    pub(super) fn receptance(
        &self,
        terms: &Terms<f32>,
        level: Level,
        entries: &mut Entries,
    ) -> usize {
        // The last group of nodes reaches beyond the last place.
        let room = self.bins.len() + GROUP;
        entries.iter_mut().flatten().for_each(|values| values.resize(room, 0.0));
        let mut places: Vec<usize> = (0..self.head + self.nodes).collect();
        f32::dispatch(level, Compute { line: self, terms, places: &places, entries });
        let computed = places.len();
        let followed = self.nodes.saturating_sub(2 * REACH);
        let mut misses = vec![0.0; followed.next_multiple_of(GROUP)];
        f32::dispatch(level, Follow { line: self, misses: &mut misses, entries });
        // A node's followers lie between it and the next.
        let is_sharp = |node: usize| {
            !misses[node..(node + 2).min(followed)]
                .iter()
                .all(|&miss| miss <= PREDICTED * PREDICTED)
        };
        let sharp = (0..followed).filter(|&node| is_sharp(node));
        places.clear();
        places.extend(sharp.flat_map(|node| {
            (1..STRIDE).map(move |follower| self.head + follower * self.nodes + REACH + node)
        }));
        f32::dispatch(level, Compute { line: self, terms, places: &places, entries });
        computed + places.len()
    }
}

/// Lagrange's weights: the polynomial through values at `nodes` is, at `at`, the sum of the values with these
/// weights.
fn weights<const N: usize>(nodes: [f64; N], at: f64) -> [f32; N] {
    nodes.map(|node| {
        let others = nodes.into_iter().filter(|&other| other != node);
        others.map(|other| (at - other) / (node - other)).product::<f64>() as f32
    })
}

/// The kernel that runs the recursion at these places.
struct Compute<'a> {
    line: &'a Line,
    terms: &'a Terms<f32>,
    places: &'a [usize],
    entries: &'a mut Entries,
}

impl Kernel<f32> for Compute<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes<Scalar = f32>>(self, like: V) {
        let Self { line, terms, places, entries } = self;
        for places in places.chunks(V::WIDTH) {
            let mut lanes = [1.0; GROUP];
            for (lane, &place) in lanes.iter_mut().zip(places) {
                *lane = line.omega[place];
            }
            let s = Complex::new(like.fill(line.alpha), like.load(&lanes));
            for (entry, parts) in receptance(terms, s).into_iter().zip(entries.iter_mut()) {
                for (part, values) in [entry.re, entry.im].into_iter().zip(parts) {
                    part.store(&mut lanes);
                    for (&place, &lane) in places.iter().zip(&lanes) {
                        values[place] = lane;
                    }
                }
            }
        }
    }
}

/// The kernel that makes all followers from the nodes, as if these were smooth, and computes by how much the
/// neighbours of each node miss it.
struct Follow<'a> {
    line: &'a Line,
    /// Squares of the misses, in parts of the node's size, from the first node with enough neighbours on.
    misses: &'a mut [f32],
    entries: &'a mut Entries,
}

impl Kernel<f32> for Follow<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes<Scalar = f32>>(self, like: V) {
        let Self { line, misses, entries } = self;
        for first in (0..misses.len()).step_by(V::WIDTH) {
            // Values written beyond the last node with enough neighbours are not used.
            let node = line.head + REACH + first;
            let parts = entries.each_ref().map(|entry| {
                entry.each_ref().map(|values| {
                    let at = |place: usize| like.load(&values[place..]);
                    let near = at(node - 1) + at(node + 1);
                    let far = at(node - 3) + at(node + 3);
                    let predicted =
                        near.mul_add(like.fill(9.0 / 16.0), far * like.fill(-1.0 / 16.0));
                    let miss = predicted - at(node);
                    [miss * miss, at(node) * at(node)]
                })
            });
            let mut ratios = like.fill(0.0);
            for row in ROWS {
                let [miss, size] = [0, 1].map(|which| {
                    let squares = row.map(|entry| parts[entry][0][which] + parts[entry][1][which]);
                    squares[0] + squares[1] + squares[2]
                });
                ratios = ratios + miss / size;
            }
            ratios.store(&mut misses[first..]);
            for values in entries.iter_mut().flatten() {
                let six = [0, 1, 2, 3, 4, 5].map(|n| like.load(&values[node + n - 2..]));
                for (follower, weights) in (1..).zip(&line.weights) {
                    let mut sum = like.fill(0.0);
                    for (value, &weight) in six.iter().zip(weights) {
                        sum = value.mul_add(like.fill(weight), sum);
                    }
                    sum.store(&mut values[node + follower * line.nodes..]);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::reference::mill3;
    use flexid_core::parameters::{Bounds, Bushings};
    use flexid_core::sensors::Sensors;
    use nalgebra::Vector3;
    use rand_core::SeedableRng as _;
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    #[test]
    fn every_bin_has_its_place() {
        for bins in [1, 15, 16, 17, 60, 64, 100, 411, 820, 821, 3000] {
            let line = Line::new(1.0, 0.5, bins);
            let mut places = vec![0; bins];
            for &bin in line.bins.iter().filter(|&&bin| bin < bins) {
                places[bin] += 1;
            }
            assert!(places.iter().all(|&count| (1..=2).contains(&count)), "{bins}: {places:?}");
            assert!(
                line.head < 64 + STRIDE * 2 * REACH + GROUP,
                "{bins}: {} before the nodes",
                line.head
            );
        }
    }

    #[test]
    fn polynomials_of_their_degree_are_met() {
        let nodes = [-2.0, -1.0, 0.0, 1.0, 2.0, 3.0];
        for degree in 0..6 {
            let sum: f64 = weights(nodes, 0.25)
                .iter()
                .zip(nodes)
                .map(|(&w, x)| f64::from(w) * x.powi(degree))
                .sum();
            assert!((sum - 0.25_f64.powi(degree)).abs() < 1e-5, "{degree}: {sum}");
        }
    }

    /// The shortest lines are tested as well.
    #[test]
    fn every_place_is_filled() {
        let (scenario, chain) = mill3();
        let bushings: Bushings = scenario.truth.iter().copied().collect();
        let linear =
            chain.linearise(&scenario.experiments[0].pose, Vector3::zeros(), &bushings).unwrap();
        let terms = Terms::new(&linear, &bushings, &Sensors::default()).unwrap();
        for bins in [1, 40, 52, 60, 100, 130, 820] {
            let line = Line::new(1.6, 1.5 * 820.0 / bins as f64, bins);
            let mut entries = Entries::default();
            line.receptance(&terms, Level::new(), &mut entries);
            for (place, _) in line.bins.iter().enumerate().filter(|&(_, &bin)| bin < bins) {
                assert!(entries.iter().all(|[re, _]| re[place] != 0.0), "{bins}: {place}");
            }
        }
    }

    /// The test compares every bin of every row with the recursion in double precision. It limits what thinning adds
    /// to the errors of single precision, with the damping of the bounds, and with hardly any, for which no bin is
    /// thinned.
    #[test]
    fn what_is_not_computed_is_not_missed() {
        let (mut scenario, chain) = mill3();
        let (alpha, spacing, bins) = (1.6, 1.534, 820);
        let line = Line::new(alpha, spacing, bins);
        let usual = scenario.bounds;
        let [slides, turns] = [0, 3].map(|dof| usual.joints[0].stiffness[dof]);
        let faint = Bounds::new(slides, turns, [1.0, 2.0], [1.0, 2.0]).unwrap();
        for (bounds, most_missed, most_computed) in [(usual, 2e-4, 0.5), (faint, 5e-3, 1.1)] {
            scenario.bounds = bounds;
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(4);
            let (mut worst, mut squares, mut computed) = (0.0_f64, 0.0, 0);
            const ROBOTS: usize = 30;
            for robot in 0..ROBOTS {
                let bushings: Bushings = scenario.draw_truth(&mut rng).into_iter().collect();
                let pose = &scenario.experiments[robot % 3].pose;
                let linear = chain.linearise(pose, Vector3::zeros(), &bushings).unwrap();
                let mut entries = Entries::default();
                let terms = Terms::new(&linear, &bushings, &Sensors::default()).unwrap();
                computed += line.receptance(&terms, Level::new(), &mut entries);
                let exact = Terms::<f64>::new(&linear, &bushings, &Sensors::default()).unwrap();
                for (place, _) in line.bins.iter().enumerate().filter(|&(_, &bin)| bin < bins) {
                    let s = Complex::new(alpha, f64::from(line.omega[place]));
                    let exact = receptance(&exact, s);
                    for row in ROWS {
                        let (mut miss, mut size) = (0.0, 0.0);
                        for entry in row {
                            let [re, im] =
                                [0, 1].map(|part| f64::from(entries[entry][part][place]));
                            miss += (re - exact[entry].re).powi(2) + (im - exact[entry].im).powi(2);
                            size += exact[entry].re.powi(2) + exact[entry].im.powi(2);
                        }
                        worst = worst.max((miss / size).sqrt());
                        squares += miss / size / (3 * ROBOTS * bins) as f64;
                    }
                }
            }
            let share = computed as f64 / (ROBOTS * bins) as f64;
            println!(
                "{share:.2} of the bins computed; missed by {:.1e}, at most by {worst:.1e}",
                squares.sqrt()
            );
            assert!(worst < most_missed, "{worst}");
            assert!(share < most_computed, "{share}");
        }
    }
}
