//! Numbers as people read them.

use flexid_wire::words::{Percent, Within};
use maud::{Markup, html};

use crate::charts::scale::superscript;

/// A number to three digits: plain from 0.01 to 999, with a power of ten beyond.
pub(super) fn number(value: f64) -> String {
    digits(value, 3)
}

/// A number to so many digits.
pub(super) fn digits(value: f64, digits: usize) -> String {
    if !value.is_finite() {
        return "–".to_owned();
    }
    if value == 0.0 {
        return "0".to_owned();
    }
    // As it is rounded: 9.996 has the exponent of 10.0.
    let text = format!("{value:.*e}", digits.max(1) - 1);
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    let plain = if (-2..3).contains(&exponent) {
        let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
        format!("{value:.decimals$}")
    } else {
        format!("{mantissa}·10{}", superscript(exponent))
    };
    minus(&plain)
}

/// A part as per cent.
pub(super) fn percent(part: f64) -> String {
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
pub(super) fn count(number: usize, thing: &str) -> String {
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
            (1234.6, "1.23·10³"),
            (0.012_34, "0.0123"),
            (6.024e7, "6.02·10⁷"),
            (-2.5e-9, "−2.50·10⁻⁹"),
            (f64::NAN, "–"),
        ];
        for (value, expected) in cases {
            assert_eq!(number(value), expected);
        }
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
