//! Fourier transform of a real record whose length is a power of two.

use microfft::Complex32;
use microfft::real::{
    rfft_256, rfft_512, rfft_1024, rfft_2048, rfft_4096, rfft_8192, rfft_16384, rfft_32768,
};

/// Shortest record that has a spectrum, samples.
pub const MIN_SAMPLES: usize = 256;
/// Longest record that has a spectrum, samples.
pub const MAX_SAMPLES: usize = 32_768;

/// `Σ x_n e^(−2πi k n / N)` for `k = 1..N/2`, in place: the result holds bin k at index k. Index 0 holds
/// the sum as its real part and the bin at half the rate as its imaginary part.
///
/// `None` if the length is not a power of two from [`MIN_SAMPLES`] to [`MAX_SAMPLES`].
pub fn real_transform(samples: &mut [f32]) -> Option<&mut [Complex32]> {
    macro_rules! by_length {
        ($($length:literal => $transform:ident),*) => {
            match samples.len() {
                $($length => {
                    let array: &mut [f32; $length] = samples.try_into().ok()?;
                    Some($transform(array))
                })*
                _ => None,
            }
        };
    }
    by_length!(
        256 => rfft_256, 512 => rfft_512, 1024 => rfft_1024, 2048 => rfft_2048, 4096 => rfft_4096,
        8192 => rfft_8192, 16384 => rfft_16384, 32768 => rfft_32768
    )
}
