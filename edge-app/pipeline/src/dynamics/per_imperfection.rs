//! Derivatives of the dynamic stiffness and of the loads by the imperfections: central differences, one-sided where it cannot be less.
//!
//! ```text
//! vᵀ ∂Z u = Σ_{i≤j} ∂Z_ij w_ij        w_ij = v_i u_j + v_j u_i   (i < j),   v_i u_i   (i = j)
//! ```
//!
//! ∂Z is symmetric. Its entries by all imperfections are the rows of one matrix, so that one product with the w of all pairs of columns gives
//! all derivatives. That of the bushings depends on the frequency in another way, and is evaluated on both sides.

use flexid_core::chain::linearise::LinearisationError;
use flexid_core::refine::Mechanics;
use nalgebra::{Complex, DMatrix, Matrix6, Vector6};

use super::assembly::Matrices;
use super::bushings::{self, Bushings};
use super::place::Place;
use super::robot::Robot;

/// Shift of an imperfection for a difference, in its standard deviations. Chosen: the error of a central difference grows with its square.
const SHIFT: f64 = 0.1;
/// Loads of unit forces and torques.
const LOADS: usize = 6;

/// Derivatives by all imperfections.
#[derive(Clone, Debug)]
pub(crate) struct PerImperfection {
    /// Number of imperfections.
    all: usize,
    /// Places of those with uncertainty. The rows below are in this order.
    uncertain: Vec<usize>,
    /// Derivatives of the mass matrix, a row each, by the columns of its upper triangle; `None` if it stays.
    mass: Option<DMatrix<f64>>,
    /// Those of the stiffness beside that of the bushings.
    stiffness: Option<DMatrix<f64>>,
    /// Those of the damping beside that of the bushings.
    damping: Option<DMatrix<f64>>,
    /// Those of the loads of unit forces and torques at the tool, [`LOADS`] rows each.
    tip: DMatrix<f64>,
    /// Those of the bushings, where they change.
    bushings: Vec<Change>,
}

/// Bushings on both sides of an imperfection.
#[derive(Clone, Debug)]
struct Change {
    /// Its place among those with uncertainty.
    row: usize,
    /// Joints whose bushings differ.
    joints: Vec<usize>,
    sides: Box<[Mechanics; 2]>,
    /// Distance of the sides.
    by: f64,
}

impl PerImperfection {
    /// At a pose. The bushings of both sides are compared at `place`.
    pub(crate) fn new(
        robot: &Robot,
        pose: &[f64],
        size: usize,
        place: Place,
    ) -> Result<Self, LinearisationError> {
        let stds: Vec<f64> = robot.imperfection_stds().collect();
        let uncertain: Vec<usize> = (0..stds.len()).filter(|index| stds[*index] > 0.0).collect();
        let (rows, entries) = (uncertain.len(), size * (size + 1) / 2);
        let [mut mass, mut stiffness, mut damping] =
            [0, 1, 2].map(|_| DMatrix::zeros(rows, entries));
        let mut tip = DMatrix::zeros(LOADS * rows, size);
        let mut bushings = Vec::new();
        for (row, &index) in uncertain.iter().enumerate() {
            let up = SHIFT * stds[index];
            let down = up.min(robot.room_below(index));
            let side = |shift: f64| robot.mechanics(pose, Some((index, shift)));
            let sides = [side(up)?, side(-down)?];
            let by = up + down;
            let [above, below] = sides.each_ref().map(Matrices::new);
            let change = above.difference(&below, by);
            for (all, own) in [
                (&mut mass, &change.mass),
                (&mut stiffness, &change.stiffness),
                (&mut damping, &change.damping),
            ] {
                for (entry, (i, j)) in upper(size).enumerate() {
                    all[(row, entry)] = own[(i, j)];
                }
            }
            tip.rows_mut(LOADS * row, LOADS).tr_copy_from(&change.tip);
            let joints = differing(&sides, place);
            if !joints.is_empty() {
                bushings.push(Change { row, joints, sides: Box::new(sides), by });
            }
        }
        let changed = |all: DMatrix<f64>| all.iter().any(|entry| *entry != 0.0).then_some(all);
        let [mass, stiffness, damping] = [mass, stiffness, damping].map(changed);
        Ok(Self { all: stds.len(), uncertain, mass, stiffness, damping, tip, bushings })
    }

    /// `vᵀ ∂Z v` by each imperfection.
    pub(crate) fn of_stiffness(
        &self,
        place: Place,
        v: &DMatrix<Complex<f64>>,
    ) -> Vec<DMatrix<Complex<f64>>> {
        let columns = v.ncols();
        let products = products(v);
        let mut all = DMatrix::<Complex<f64>>::zeros(self.uncertain.len(), products.ncols() / 2);
        // ∂K + s² ∂M + s ∂D: its real part, then its imaginary part.
        let [of_mass, of_damping, of_stiffness] = match place {
            Place::At(s) => [s * s, s, Complex::from(1.0)],
            Place::Static(_) => [0.0, 0.0, 1.0].map(Complex::from),
        };
        let sum = |part: fn(Complex<f64>) -> f64| {
            let terms = [
                (&self.stiffness, part(of_stiffness)),
                (&self.mass, part(of_mass)),
                (&self.damping, part(of_damping)),
            ];
            let mut terms = terms.into_iter().filter(|(_, factor)| *factor != 0.0);
            let first = terms.find_map(|(own, factor)| own.as_ref().map(|own| own * factor))?;
            let rest = terms.filter_map(|(own, factor)| Some((own.as_ref()?, factor)));
            Some(rest.fold(first, |sum, (own, factor)| sum + own * factor))
        };
        let parts: [(_, Complex<f64>); 2] =
            [(sum(|own| own.re), 1.0.into()), (sum(|own| own.im), Complex::i())];
        for (part, factor) in parts {
            let Some(part) = part else { continue };
            let own = part * &products;
            for pair in 0..all.ncols() {
                for row in 0..all.nrows() {
                    let own = Complex::new(own[(row, 2 * pair)], own[(row, 2 * pair + 1)]);
                    all[(row, pair)] += factor * own;
                }
            }
        }
        let mut matrices = vec![DMatrix::zeros(columns, columns); self.all];
        for (row, index) in self.uncertain.iter().enumerate() {
            for (pair, (a, b)) in upper(columns).enumerate() {
                matrices[*index][(a, b)] = all[(row, pair)];
                matrices[*index][(b, a)] = all[(row, pair)];
            }
        }
        for change in &self.bushings {
            change.add(place, v, &mut matrices[self.uncertain[change.row]]);
        }
        matrices
    }

    /// `∂Pᵀ e`, for as many loads as `e` has columns, by each imperfection with uncertainty, beside its place.
    pub(crate) fn of_loads(
        &self,
        e: &DMatrix<Complex<f64>>,
    ) -> impl Iterator<Item = (usize, DMatrix<Complex<f64>>)> {
        let loads = e.ncols();
        let parts = DMatrix::from_fn(e.nrows(), 2 * loads, |i, j| {
            if j < loads { e[(i, j)].re } else { e[(i, j - loads)].im }
        });
        let all = &self.tip * parts;
        self.uncertain.iter().enumerate().map(move |(row, index)| {
            let own = |load: usize, column: usize| {
                let row = LOADS * row + load;
                Complex::new(all[(row, column)], all[(row, loads + column)])
            };
            (*index, DMatrix::from_fn(loads, loads, own))
        })
    }
}

impl Change {
    /// Adds `vᵀ ∂B v`.
    fn add(&self, place: Place, v: &DMatrix<Complex<f64>>, to: &mut DMatrix<Complex<f64>>) {
        for &joint in &self.joints {
            let [up, down] = self.sides.each_ref().map(|side| block(side, joint, place));
            let change = match (up, down) {
                (Block::Diagonal(up), Block::Diagonal(down)) => {
                    Block::Diagonal((up - down).unscale(self.by))
                }
                (up, down) => Block::Whole((up.whole() - down.whole()).unscale(self.by)),
            };
            let first = 6 * joint;
            for b in 0..v.ncols() {
                let loads = change.times(&v.fixed_view::<6, 1>(first, b).into_owned());
                for a in 0..=b {
                    let own: Complex<f64> = (0..6).map(|i| v[(first + i, a)] * loads[i]).sum();
                    to[(a, b)] += own;
                    if a != b {
                        to[(b, a)] += own;
                    }
                }
            }
        }
    }
}

/// B of a joint.
#[expect(clippy::large_enum_variant, reason = "it lives on the stack, one at a time")]
enum Block {
    Diagonal(Vector6<Complex<f64>>),
    /// The first joint, on ground that gives way.
    Whole(Matrix6<Complex<f64>>),
}

fn block(mechanics: &Mechanics, joint: usize, place: Place) -> Block {
    let [springs, dampers] = bushings::impedances(mechanics, joint, place);
    let z = springs + dampers;
    let part = if joint == 0 { bushings::part(mechanics, place, &z) } else { None };
    match part {
        Some(part) => Block::Whole(Matrix6::from_fn(|i, j| z[i] * part[(i, j)])),
        None => Block::Diagonal(z),
    }
}

impl Block {
    fn whole(&self) -> Matrix6<Complex<f64>> {
        match self {
            Self::Diagonal(z) => Matrix6::from_diagonal(z),
            Self::Whole(block) => *block,
        }
    }

    fn times(&self, y: &Vector6<Complex<f64>>) -> Vector6<Complex<f64>> {
        match self {
            Self::Diagonal(z) => z.component_mul(y),
            Self::Whole(block) => {
                Vector6::from_fn(|i, _| (0..6).map(|j| block[(i, j)] * y[j]).sum())
            }
        }
    }
}

/// Joints whose bushings differ.
fn differing(sides: &[Mechanics; 2], place: Place) -> Vec<usize> {
    let [up, down] = sides.each_ref().map(|side| Bushings::new(side, place));
    (0..sides[0].joints()).filter(|joint| up.differs(&down, *joint)).collect()
}

/// Places of the upper triangle of a matrix, column by column.
fn upper(size: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..size).flat_map(|j| (0..=j).map(move |i| (i, j)))
}

/// w of all pairs of columns, the upper triangle of these: its real part in a column, its imaginary part in the next.
fn products(v: &DMatrix<Complex<f64>>) -> DMatrix<f64> {
    let (n, columns) = v.shape();
    let mut all = DMatrix::zeros(n * (n + 1) / 2, columns * (columns + 1));
    for (pair, (a, b)) in upper(columns).enumerate() {
        let (x, y) = (v.column(a), v.column(b));
        for (entry, (i, j)) in upper(n).enumerate() {
            let own = if i == j { x[i] * y[i] } else { x[i] * y[j] + x[j] * y[i] };
            all[(entry, 2 * pair)] = own.re;
            all[(entry, 2 * pair + 1)] = own.im;
        }
    }
    all
}
