//! Numbers as people read them.

use flexid_wire::words::{InUnit, Percent, ThreeDigits, Within};
use maud::{Markup, html};

/// A number of which three digits count.
pub(super) fn number(value: f64) -> String {
    match value {
        0.0 => "0".to_owned(),
        _ if value.is_finite() => minus(&ThreeDigits(value).to_string()),
        _ => "–".to_owned(),
    }
}

/// A number of which three digits count, with its unit.
pub(crate) fn in_unit(value: f64, unit: &str) -> String {
    if value.is_finite() { minus(&InUnit { value, unit }.to_string()) } else { "–".to_owned() }
}

/// A part as per cent.
pub(crate) fn percent(part: f64) -> String {
    if !part.is_finite() {
        return "–".to_owned();
    }
    minus(&Percent(part).to_string()).replace(" %", "\u{a0}%")
}

/// A 95 % interval in per cent of the value that it is about: `±0.22 %`, or `−11 to +12 %`.
pub(super) fn uncertainty(value: f64, interval: [f64; 2]) -> String {
    minus(&Within { value, interval }.to_string()).replace(" %", "\u{a0}%")
}

/// Agreement as per cent, with more digits near 1, and never rounded up to it.
pub(super) fn agreement(part: f64) -> String {
    if (0.99..1.0).contains(&part) {
        format!("{:.2}\u{a0}%", (1e4 * part).floor() / 100.0)
    } else {
        percent(part)
    }
}

/// Joint angles: `(0.10, −0.50, 0.40)`.
pub(super) fn pose(angles: &[f64]) -> String {
    let angles: Vec<String> = angles.iter().map(|angle| minus(&format!("{angle:.3}"))).collect();
    format!("({})", angles.join(", "))
}

/// A number of things: `1 record`, `2 records`.
pub(crate) fn count(number: usize, thing: &str) -> String {
    format!("{number} {thing}{}", if number == 1 { "" } else { "s" })
}

/// A line of the file whose `commands` stand between backticks, as code.
pub(super) fn marked(line: &str) -> Markup {
    html! {
        @for (index, part) in line.split('`').enumerate() {
            @if index % 2 == 1 { code { (part) } } @else { (part) }
        }
    }
}

pub(super) fn minus(text: &str) -> String {
    text.replace('-', "\u{2212}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits() {
        let cases = [
            (0.0, "0"),
            (9.996, "10.0"),
            (1234.6, "1235"),
            (-0.012_34, "−0.0123"),
            (f64::NAN, "–"),
        ];
        for (value, expected) in cases {
            assert_eq!(number(value), expected);
        }
        assert_eq!(in_unit(6.024e7, "N/m"), "60.2 MN/m");
        assert_eq!(in_unit(f64::NAN, "N/m"), "–");
        assert_eq!(percent(0.0012), "0.1\u{a0}%");
        assert_eq!(percent(-0.25), "−25\u{a0}%");
        assert_eq!(uncertainty(18.69, [18.6866, 18.6934]), "±0.02\u{a0}%");
        assert_eq!(uncertainty(18.69, [18.6851, 18.6932]), "−0.03 to +0.02\u{a0}%");
        assert_eq!(uncertainty(1.0, [0.5, 2.0]), "−50 to +100\u{a0}%");
        assert_eq!(
            (agreement(0.999_96), agreement(0.5)),
            ("99.99\u{a0}%".into(), "50\u{a0}%".into())
        );
        assert_eq!(pose(&[0.1, -0.5]), "(0.100, −0.500)");
        assert_eq!(marked("a `b` <c>").into_string(), "a <code>b</code> &lt;c&gt;");
        assert_eq!((count(1, "pose"), count(2, "pose")), ("1 pose".into(), "2 poses".into()));
    }
}
