//! Numbers of a model file.

/// Places of `[ixx, iyy, izz, ixy, ixz, iyz]` in the matrix.
pub(super) const INERTIA_ORDER: [(usize, usize); 6] =
    [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];

/// The numbers rounded to 12 digits of the largest one, for a file that people read.
pub(super) fn tidy<const N: usize>(numbers: [f64; N]) -> [f64; N] {
    let largest = numbers.iter().fold(f64::MIN_POSITIVE, |most, number| most.max(number.abs()));
    let decimals = (11.0 - largest.log10().floor()).clamp(0.0, 300.0) as usize;
    numbers.map(|number| format!("{number:.decimals$}").parse().unwrap_or(number) + 0.0)
}
