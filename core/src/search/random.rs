//! Random numbers for the search, from any generator.

use rand_core::Rng;

/// A random number, uniform in [0, 1).
pub(super) fn uniform(generator: &mut impl Rng) -> f32 {
    (generator.next_u32() >> 8) as f32 / (1_u32 << 24) as f32
}

/// A random index in `0..count`.
pub(super) fn choice(generator: &mut impl Rng, count: usize) -> usize {
    ((u64::from(generator.next_u32()) * count as u64) >> 32) as usize
}

/// Fills `point` with a random point, uniform in the ball of radius 1 about the origin. Its length is the number of
/// dimensions.
pub(super) fn in_unit_ball(generator: &mut impl Rng, point: &mut [f32]) {
    for coordinate in point.iter_mut() {
        *coordinate = normal(generator);
    }
    let length = libm::sqrtf(point.iter().map(|x| x * x).sum());
    let depth = libm::powf(uniform(generator), 1.0 / point.len() as f32);
    let scale = if length > 0.0 { depth / length } else { 0.0 };
    for coordinate in point {
        *coordinate *= scale;
    }
}

/// A standard normal random number (Box and Muller).
fn normal(generator: &mut impl Rng) -> f32 {
    let radius = libm::sqrtf(-2.0 * libm::logf(1.0 - uniform(generator)));
    radius * libm::cosf(core::f32::consts::TAU * uniform(generator))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_core::SeedableRng;
    use rand_xoshiro::Xoshiro256PlusPlus;

    /// In n dimensions the radius of a uniform point in the unit ball has the mean n/(n+1), and each coordinate has the
    /// variance 1/(n+2). The statistical error of ten thousand points is well within the limits.
    #[test]
    fn fills_the_ball_evenly() {
        let mut generator = Xoshiro256PlusPlus::seed_from_u64(1);
        const N: usize = 5;
        let (mut radius, mut square, mut mean) = (0.0, 0.0, 0.0);
        for _ in 0..10_000 {
            let mut point = [0.0; N];
            in_unit_ball(&mut generator, &mut point);
            let length = libm::sqrtf(point.iter().map(|x| x * x).sum());
            assert!(length <= 1.0 + 1e-6);
            radius += length / 1e4;
            square += point[2] * point[2] / 1e4;
            mean += point[4] / 1e4;
        }
        assert!((radius - 5.0 / 6.0).abs() < 0.006, "{radius}");
        assert!((square - 1.0 / 7.0).abs() < 0.01, "{square}");
        assert!(mean.abs() < 0.02, "{mean}");
    }
}
