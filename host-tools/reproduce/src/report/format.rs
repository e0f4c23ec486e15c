//! Numbers as text, with a sensible number of digits. A number that is not finite becomes a dash.

use maud::{Markup, html};

use super::Measure;

/// Text where there is no number.
pub(super) const NOTHING: &str = "–";

/// Space between a number and its unit.
const SPACE: char = '\u{a0}';
const MINUS: &str = "\u{2212}";

/// A number with a typographic minus, and without a sign where all digits are zero.
pub(super) fn number(x: f64, decimals: usize) -> String {
    with_sign(x, format!("{:.decimals$}", x.abs()), false)
}

/// A share as percent.
pub(super) fn percent(x: f64) -> String {
    unless_finite(x, || format!("{}{SPACE}%", number(100.0 * x, decimals(100.0 * x, 2))))
}

/// A change as percent, always with its sign.
pub(super) fn change(x: f64) -> String {
    let percent = 100.0 * x;
    unless_finite(x, || {
        let digits = format!("{:.*}", decimals(percent, 2), percent.abs());
        format!("{}{SPACE}%", with_sign(percent, digits, true))
    })
}

/// The interval of a change, from its lower to its upper end.
pub(super) fn change_interval(ends: [f64; 2]) -> String {
    interval(ends, change)
}

/// A mean of the measure, in the paper's form.
pub(super) fn value(measure: Measure, x: f64) -> String {
    match measure {
        Measure::ParameterDeviation => percent(x),
        Measure::DisplacementError => unless_finite(x, || number(x, decimals(x, 4))),
    }
}

/// The interval of a mean, from its lower to its upper end.
pub(super) fn value_interval(measure: Measure, ends: [f64; 2]) -> String {
    interval(ends, |x| value(measure, x))
}

/// The p of a test, for a column.
pub(super) fn p(p: f64) -> String {
    unless_finite(p, || if p < 0.001 { format!("<{SPACE}0.001") } else { number(p, 3) })
}

/// The p of a test, for a sentence.
pub(super) fn p_in_words(value: f64) -> String {
    let text = p(value);
    if text.starts_with('<') {
        format!("p{SPACE}{text}")
    } else {
        format!("p{SPACE}={SPACE}{text}")
    }
}

/// A probability. It is written 1.00 only if it is 1.
pub(super) fn probability(x: f64) -> String {
    unless_finite(
        x,
        || {
            if (0.995..1.0).contains(&x) { format!(">{SPACE}0.99") } else { number(x, 2) }
        },
    )
}

/// A count, in groups of three digits from five digits on.
pub(super) fn count(n: u64) -> String {
    let digits = n.to_string();
    if digits.len() < 5 {
        return digits;
    }
    let mut grouped = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            grouped.push('\u{202f}');
        }
        grouped.push(digit);
    }
    grouped
}

/// A ratio, in two to three digits.
pub(super) fn times(ratio: f64) -> String {
    unless_finite(ratio, || match ratio {
        r if r >= 1e4 => count((r / 1000.0).round() as u64 * 1000),
        r if r >= 100.0 => count((r / 10.0).round() as u64 * 10),
        r if r >= 10.0 => number(r, 0),
        r => number(r, 1),
    })
}

/// A wall time, marked as a number that may differ between two runs.
pub(super) fn seconds(s: f64) -> Markup {
    let text = unless_finite(s, || match s.abs() {
        x if x < 1e-3 => format!("{}{SPACE}µs", number(1e6 * s, 0)),
        x if x < 1.0 => format!("{}{SPACE}ms", number(1e3 * s, decimals_of_three(1e3 * x))),
        x if x < 120.0 => format!("{}{SPACE}s", number(s, decimals_of_three(x))),
        _ => format!("{}{SPACE}min", number(s / 60.0, 1)),
    });
    html! { span.seconds { (text) } }
}

fn interval(ends: [f64; 2], text: impl Fn(f64) -> String) -> String {
    if ends.iter().all(|x| x.is_finite()) {
        let [low, high] = ends.map(text);
        let unit = format!("{SPACE}%");
        format!("{} to {high}", low.strip_suffix(&unit).unwrap_or(&low))
    } else {
        NOTHING.to_owned()
    }
}

fn unless_finite(x: f64, text: impl FnOnce() -> String) -> String {
    if x.is_finite() { text() } else { NOTHING.to_owned() }
}

/// Number of decimals: `least`, or as many as show two digits of a small number.
fn decimals(x: f64, least: usize) -> usize {
    let magnitude = x.abs();
    if magnitude == 0.0 || !magnitude.is_finite() {
        return least;
    }
    let leading = magnitude.log10().floor();
    least.max((1.0 - leading).clamp(0.0, 8.0) as usize)
}

/// Number of decimals that gives three digits altogether.
fn decimals_of_three(x: f64) -> usize {
    match x {
        x if x < 10.0 => 2,
        x if x < 100.0 => 1,
        _ => 0,
    }
}

fn with_sign(x: f64, digits: String, plus: bool) -> String {
    let zero = digits.chars().all(|c| c == '0' || c == '.');
    match (zero, x < 0.0, plus) {
        (false, true, _) => format!("{MINUS}{digits}"),
        (false, false, true) => format!("+{digits}"),
        _ => digits,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_are_those_of_the_paper_or_two() {
        assert_eq!(percent(0.2657), "26.57\u{a0}%");
        assert_eq!(percent(0.000_312), "0.031\u{a0}%");
        assert_eq!(change(-0.0137), "−1.37\u{a0}%");
        assert_eq!(change(0.0109), "+1.09\u{a0}%");
        assert_eq!(change(-0.0), "0.00\u{a0}%");
        assert_eq!(value(Measure::DisplacementError, 0.0367), "0.0367");
        assert_eq!(value(Measure::DisplacementError, 0.000_61), "0.00061");
        assert_eq!(change_interval([-0.021, 0.003]), "−2.10 to +0.30\u{a0}%");
    }

    #[test]
    fn tests_are_quoted_as_usual() {
        assert_eq!(p_in_words(0.0131), "p\u{a0}=\u{a0}0.013");
        assert_eq!(p_in_words(1e-9), "p\u{a0}<\u{a0}0.001");
        assert_eq!(probability(0.999), ">\u{a0}0.99");
        assert_eq!(count(110_592), "110\u{202f}592");
        assert_eq!(count(9999), "9999");
    }

    #[test]
    fn what_is_not_finite_is_a_dash() {
        for x in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let texts = [percent(x), change(x), p(x), probability(x), times(x)];
            assert!(texts.iter().all(|text| text == NOTHING), "{texts:?}");
            assert_eq!(change_interval([0.0, x]), NOTHING);
            assert_eq!(
                seconds(x).into_string(),
                format!("<span class=\"seconds\">{NOTHING}</span>")
            );
        }
    }
}
