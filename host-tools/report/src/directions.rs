//! Combinations of unknowns that the data determine badly, each set of unknowns once.

use std::collections::BTreeSet;

/// Those of `all`, the worst first, whose unknowns no worse one has. `names` are the unknowns that a line names.
pub fn distinct<'a, T, I: Iterator<Item = &'a str>>(
    all: &'a [T],
    names: impl Fn(&'a T) -> I,
) -> Vec<&'a T> {
    let mut seen: BTreeSet<BTreeSet<&str>> = BTreeSet::new();
    all.iter().filter(|own| seen.insert(names(own).collect())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pair_stands_once_in_whatever_order() {
        let all = [vec!["a", "b"], vec!["c"], vec!["b", "a"], vec!["a", "b", "c"]];
        let distinct = distinct(&all, |own| own.iter().copied());
        assert_eq!(distinct, [&all[0], &all[1], &all[3]]);
    }
}
