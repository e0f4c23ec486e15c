//! Parts of lines: counts with their noun, and enumerations.

use core::fmt;

/// A count with its noun: `1 record`, `2 records`.
#[derive(Clone, Copy, Debug)]
pub struct Count<'a>(pub u64, pub &'a str);

impl fmt::Display for Count<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(number, noun) = self;
        write!(f, "{number} {noun}{}", if *number == 1 { "" } else { "s" })
    }
}

/// An enumeration, `a`, `a and b` or `a, b and c`. Items that are counted but not named make the last part: `a, b and 3 more`.
pub(crate) struct Enumeration<'a, T> {
    /// Items that are named.
    pub(crate) named: &'a [T],
    /// Number of the other items.
    pub(crate) more: u64,
}

impl<T: fmt::Display> fmt::Display for Enumeration<'_, T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { named, more } = self;
        let parts = named.len() + usize::from(*more > 0);
        for (index, item) in named.iter().enumerate() {
            separate(f, index, parts)?;
            item.fmt(f)?;
        }
        if *more > 0 {
            separate(f, named.len(), parts)?;
            write!(f, "{more} more")?;
        }
        Ok(())
    }
}

/// Writes the separator before the part `index` of `parts`.
fn separate(f: &mut fmt::Formatter<'_>, index: usize, parts: usize) -> fmt::Result {
    f.write_str(match index {
        0 => "",
        _ if index + 1 == parts => " and ",
        _ => ", ",
    })
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::string::ToString;

    use super::*;

    #[test]
    fn one_is_singular() {
        assert_eq!(
            [0, 1, 2].map(|number| Count(number, "record").to_string()),
            ["0 records", "1 record", "2 records"]
        );
    }

    #[test]
    fn the_last_part_follows_an_and() {
        let enumerate = |names, more| {
            let all = ["aaaa", "bbbb", "cccc"];
            Enumeration { named: &all[..names], more }.to_string()
        };
        assert_eq!(enumerate(0, 0), "");
        assert_eq!(enumerate(1, 0), "aaaa");
        assert_eq!(enumerate(2, 0), "aaaa and bbbb");
        assert_eq!(enumerate(3, 0), "aaaa, bbbb and cccc");
        assert_eq!(enumerate(2, 2), "aaaa, bbbb and 2 more");
        assert_eq!(enumerate(1, 3), "aaaa and 3 more");
    }
}
