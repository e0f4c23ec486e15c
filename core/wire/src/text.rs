//! Text that always fits.

use core::fmt::{Display, Write};

use heapless::String;

/// `value` as text of at most `N` bytes of UTF-8; what does not fit is cut off, between characters.
///
/// Takes `format_args!` as well as `&str`.
pub fn clipped<const N: usize>(value: impl Display) -> String<N> {
    let mut clip = Clip(String::new());
    // The error means that the text is full; what was written before it stays.
    let _ = write!(clip, "{value}");
    clip.0
}

struct Clip<const N: usize>(String<N>);

impl<const N: usize> Write for Clip<N> {
    fn write_str(&mut self, text: &str) -> core::fmt::Result {
        text.chars().try_for_each(|character| self.0.push(character).map_err(|_| core::fmt::Error))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cuts_between_characters() {
        assert_eq!(clipped::<8>("joint_1").as_str(), "joint_1");
        assert_eq!(clipped::<8>("Gelenkachse").as_str(), "Gelenkac");
        assert_eq!(clipped::<6>("Größe").as_str(), "Größ");
        assert_eq!(clipped::<2>("€").as_str(), "");
    }

    #[test]
    fn nothing_follows_a_cut() {
        assert_eq!(clipped::<5>(format_args!("{}{}", "1234€", "x")).as_str(), "1234");
    }
}
