//! Articulated-body recursion on the dynamic stiffness, outward from base to tip: the receptance in O(J).
//!
//! `Z` is the dynamic stiffness of link j and all before it against the displacement η of link j. The recursion passes the
//! next bushing by eliminating x, the displacement by which the link before carries this bushing. Y, the inverse of
//! [`FromParent`](crate::chain::from_parent::FromParent), transforms x to the link before:
//!
//! ```text
//! Z̃ = Yᵀ Z Y       Δ = Z̃ + b − C − Cᵀ       Δ x = Bᵀ η       b = diag(z) + Γ       B = b − Cᵀ
//! Z ← b − B Δ⁻¹ Bᵀ + s² I                                       at the tip:   H = pᵀ Z⁻¹ p
//! ```
//!
//! z is the impedance of the bushing, `k + s d` if it does not depend on the frequency otherwise (`law`).
//!
//! In a record with a seam each bushing has a load γ, and each link a load f against η:
//!
//! ```text
//! f ← γ + B Δ⁻¹ (Yᵀ f − γ)
//! ```
//!
//! All matrices are complex symmetric: they are transposed, never conjugated. Γ and C are the terms of gravity
//! ([`crate::chain::linearise`]); without gravity B = b is diagonal. On ground that gives way, the base is a link before the first, whose Z is
//! the dynamic stiffness of the ground. A hose on the tool adds to the Z of the last link. Textbooks recurse from tip to base. In that
//! order the recursion would also pass the loads of three forces from joint to joint, which is half as much work again, and single
//! precision would lose half a digit more.

use seq_macro::seq;

use super::complex::{Column, Complex};
use super::elimination::{Elimination, first_link};
use super::lanes::Lanes;
use super::law::Rates;
use super::symmetric::{Factor, PACKED, at};
use super::terms::{JointTerms, Terms};
use crate::{DOF, MAX_JOINTS};

/// Receptance at one complex frequency per lane, TCP axes, m/N, packed as `xx yx yy zx zy zz`.
///
/// `s` is `iω`, or `α + iω`, rad/s.
#[inline(always)]
pub fn receptance<V: Lanes>(terms: &Terms<V::Scalar>, s: Complex<V>) -> [Complex<V>; 6] {
    let like = s.re;
    let tip = tip_stiffness(terms, s);
    // `loads` becomes L⁻¹ p, and `scaled` becomes D⁻¹ L⁻¹ p.
    let mut loads = [[Complex::zero(like); DOF]; 3];
    for axis in 0..3 {
        for i in 0..DOF {
            loads[axis][i].re = like.fill(terms.force_loads[axis][i]);
        }
    }
    tip.forward(&mut loads);
    let mut scaled = loads;
    tip.scale(&mut scaled);
    let mut receptance = [Complex::zero(like); 6];
    seq!(PACKED in 0..6 {
        let [a, b] = LOWER[PACKED];
        for i in 0..DOF {
            receptance[PACKED] = receptance[PACKED].add_mul(loads[a][i], scaled[b][i]);
        }
    });
    receptance
}

/// Row and column of each entry of a packed symmetric 3×3 matrix.
const LOWER: [[usize; 2]; 6] = [[0, 0], [1, 0], [1, 1], [2, 0], [2, 1], [2, 2]];

/// Dynamic stiffness of the last link, factorised, without a hose. All bushings are springs and dampers, as those of the search are.
#[inline(always)]
pub(super) fn tip_stiffness<V: Lanes>(terms: &Terms<V::Scalar>, s: Complex<V>) -> Factor<V> {
    // Each case has storage of its own. The compiler would copy a common one.
    if terms.gravity { tip_only::<V, true>(terms, s) } else { tip_only::<V, false>(terms, s) }
}

#[inline(always)]
fn tip_only<V: Lanes, const GRAVITY: bool>(terms: &Terms<V::Scalar>, s: Complex<V>) -> Factor<V> {
    let mut tip = Factor::zero(s.re);
    let mut elimination = Elimination::new(s.re);
    let eliminations = core::array::from_mut(&mut elimination);
    outward::<V, 1, GRAVITY>(terms, s, &Rates::plain(s), eliminations, &mut tip, None);
    tip
}

/// Loads of a seam, as the recursion passes them.
#[derive(Debug)]
pub(super) struct SeamLoads<'a, V> {
    /// γ: load on each bushing.
    pub(super) bushings: &'a [Column<V>; MAX_JOINTS],
    /// Load on the x of each bushing from the second on, after [`Elimination::half_solve`].
    pub(super) half: &'a mut [Column<V>; MAX_JOINTS],
    /// f: load on the link that the recursion has reached; zero at first.
    pub(super) link: &'a mut Column<V>,
}

/// Recursion from base to tip: factorises the dynamic stiffness of the last link. It keeps the elimination of bushing j in entry
/// j of `eliminations`; where there is a single entry, each elimination replaces the one before. A `seam` ends as a load on the
/// last link.
#[inline(always)]
pub(super) fn outward<V: Lanes, const KEPT: usize, const GRAVITY: bool>(
    terms: &Terms<V::Scalar>,
    s: Complex<V>,
    rates: &Rates<V>,
    eliminations: &mut [Elimination<V>; KEPT],
    tip: &mut Factor<V>,
    mut seam: Option<SeamLoads<'_, V>>,
) {
    let s2 = s * s;
    let stiffness = tip.matrix();
    if let Some(ground) = &terms.ground {
        *stiffness = [Complex::zero(s.re); PACKED];
        for i in 0..DOF {
            stiffness[at(i, i)] = ground.stiffness(s, i);
        }
    }
    for (index, joint) in terms.joints.iter().enumerate() {
        if index > 0 || terms.ground.is_some() {
            let elimination = &mut eliminations[if KEPT == 1 { 0 } else { index }];
            elimination.eliminate::<GRAVITY>(joint, rates, s2, stiffness);
            if let Some(seam) = &mut seam {
                seam.pass::<GRAVITY>(index, joint, elimination);
            }
        } else {
            first_link::<V, GRAVITY>(joint, rates, s2, stiffness);
            if let Some(seam) = &mut seam {
                *seam.link = seam.bushings[0];
            }
        }
    }
    // The search, which keeps no elimination, leaves hoses out.
    if KEPT > 1
        && let Some(hose) = &terms.hose
    {
        let impedance = hose.impedance(s);
        for (entry, spread) in tip.matrix().iter_mut().zip(&hose.spread) {
            *entry = entry.add_mul_real(impedance, s.re.fill(*spread));
        }
    }
    tip.factorise();
}

impl<V: Lanes> SeamLoads<'_, V> {
    /// `f ← γ + B Δ⁻¹ (Yᵀ f − γ)`.
    #[inline(always)]
    fn pass<const GRAVITY: bool>(
        &mut self,
        index: usize,
        joint: &JointTerms<V::Scalar>,
        elimination: &Elimination<V>,
    ) {
        let (bushing, half) = (&self.bushings[index], &mut self.half[index]);
        joint.to_parent.load_less(self.link, bushing, half);
        elimination.half_solve(half);
        *self.link = *bushing;
        elimination.transmit::<GRAVITY>(half, self.link);
    }
}
