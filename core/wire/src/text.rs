//! Text of bounded length.

use core::fmt::{Display, Result, Write};

use heapless::String;

/// A name: at most 32 bytes of UTF-8. [`clipped`] makes a name of any value.
pub type Name = String<32>;
/// Name of an unknown, for example `joint_1 tx stiffness` or `delay`: at most 48 bytes of UTF-8.
pub type Label = String<48>;
/// Name of a file without its folder: at most 64 bytes of UTF-8.
pub type FileName = String<64>;
/// Text of the operating system, the path of a file, or the reason of a refusal: at most 400 bytes of UTF-8. [`clipped`] makes
/// a text of any value.
pub type Text = String<400>;

/// Mark in place of text that was cut off.
const CUT: char = '…';

/// `value` as text of at most `N` bytes of UTF-8. Longer text is cut off between characters and ends with `…`, if `N` has
/// room for this mark.
///
/// The function takes `format_args!` as well as `&str`.
pub fn clipped<const N: usize>(value: impl Display) -> String<N> {
    let mut clip = Clip(String::new());
    // The error means that the text is full; the characters written before it stay.
    if write!(clip, "{value}").is_err() && N >= CUT.len_utf8() {
        while clip.0.len() + CUT.len_utf8() > N {
            let _ = clip.0.pop();
        }
        let _ = clip.0.push(CUT);
    }
    clip.0
}

struct Clip<const N: usize>(String<N>);

impl<const N: usize> Write for Clip<N> {
    fn write_str(&mut self, text: &str) -> Result {
        text.chars().try_for_each(|character| self.0.push(character).map_err(|_| core::fmt::Error))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cuts_between_characters_and_shows_the_cut() {
        assert_eq!(clipped::<8>("joint_1").as_str(), "joint_1");
        assert_eq!(clipped::<8>("12345678").as_str(), "12345678");
        assert_eq!(clipped::<8>("Gelenkachse").as_str(), "Gelen…");
        assert_eq!(clipped::<7>("Größe 5").as_str(), "Grö…");
        assert_eq!(clipped::<2>("€").as_str(), "");
    }

    #[test]
    fn nothing_follows_a_cut() {
        assert_eq!(clipped::<6>(format_args!("{}{}", "1234€", "x")).as_str(), "123…");
    }
}
