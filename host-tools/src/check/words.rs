//! Parts of findings: enumerations, numbers of records, and signals with their frames.

use std::fmt::Display;

use flexid_wire::implausible::{SignalFrames, Signals};

/// Most items that an enumeration names.
const NAMED: usize = 4;

/// Enumerates `items`: `a`, `a and b`, `a, b and c`. Of more than four it names three, and counts the others.
pub(super) fn enumerate<T: Display>(items: impl IntoIterator<Item = T>) -> String {
    let mut parts: Vec<String> = items.into_iter().map(|item| item.to_string()).collect();
    if parts.len() > NAMED {
        let others = parts.len() - (NAMED - 1);
        parts.truncate(NAMED - 1);
        parts.push(format!("{others} more"));
    }
    match parts.split_last() {
        None => String::new(),
        Some((only, [])) => only.clone(),
        Some((last, others)) => format!("{} and {last}", others.join(", ")),
    }
}

/// Names records by their numbers: `record 2`, `records 1, 2 and 3`.
pub(super) fn records(numbers: &[u64]) -> String {
    format!("record{} {}", if numbers.len() == 1 { "" } else { "s" }, enumerate(numbers))
}

/// Names signals with the number of their frames.
pub(super) fn frames(signals: &Signals) -> String {
    enumerate(signals.iter().map(|SignalFrames { signal, frames }| match frames {
        1 => format!("{signal} in 1 frame"),
        frames => format!("{signal} in {frames} frames"),
    }))
}

/// A frequency, Hz, without decimals where it has three digits before them, and with two digits where it has none.
pub(super) fn hz(frequency: f64) -> String {
    let places = match frequency {
        99.95.. => 0,
        low if low > 0.0 && low < 0.995 => (1.0 - low.log10().floor()) as usize,
        _ => 1,
    };
    let text = format!("{frequency:.places$}");
    text.strip_suffix(".0").unwrap_or(&text).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_items_are_counted() {
        let lists = [0, 1, 2, 4, 5].map(|length| enumerate(1..=length));
        assert_eq!(lists, ["", "1", "1 and 2", "1, 2, 3 and 4", "1, 2, 3 and 2 more"]);
        assert_eq!([records(&[2]), records(&[2, 4])], ["record 2", "records 2 and 4"]);
    }

    #[test]
    fn numbers_have_the_digits_that_count() {
        assert_eq!([2.0, 11.3, 128.4, 0.25, 0.031].map(hz), ["2", "11.3", "128", "0.25", "0.031"]);
    }
}
