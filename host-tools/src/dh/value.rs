//! Values of cells: sums of numbers, parts of π and a joint's variable.

use std::f64::consts::PI;

/// Value of a cell: the sum of its terms, and the variable of the joint beside them.
#[derive(Clone, Copy, Default)]
pub(super) struct Value {
    /// In the unit of the column.
    pub(super) number: f64,
    /// Terms with π, rad.
    pub(super) of_pi: Option<f64>,
    pub(super) has_variable: bool,
}

/// Names of a joint's variable, which may be numbered.
const VARIABLES: [&str; 4] = ["theta", "θ", "q", "d"];

impl Value {
    /// The value of a sum of numbers, parts of π as `3*pi/4`, and at most one variable, as in `q2 - 90` and `q1+pi/2`.
    pub(super) fn new(text: &str) -> Option<Self> {
        let all = text.chars().filter(|own| !own.is_whitespace());
        let text = all.collect::<String>().replace('π', "pi").to_lowercase();
        let mut value = Self::default();
        let mut rest = text.as_str();
        while !rest.is_empty() {
            let (term, after) = rest.split_at(end_of_term(rest));
            rest = after;
            let (sign, own) = match term.strip_prefix('-') {
                Some(own) => (-1.0, own),
                None => (1.0, term.strip_prefix('+').unwrap_or(term)),
            };
            if let Some((before, after)) = own.split_once("pi") {
                let factor = match before.strip_suffix('*').unwrap_or(before) {
                    "" => 1.0,
                    own => own.parse().ok()?,
                };
                let divisor: f64 = match after.strip_prefix('/') {
                    Some(own) => own.parse().ok()?,
                    None if after.is_empty() => 1.0,
                    None => return None,
                };
                *value.of_pi.get_or_insert_default() += sign * factor * PI / divisor;
            } else if let Some(own) = VARIABLES.iter().find_map(|name| own.strip_prefix(name)) {
                let is_number = own.trim_start_matches('_').chars().all(|own| own.is_ascii_digit());
                if value.has_variable || sign < 0.0 || !is_number {
                    return None;
                }
                value.has_variable = true;
            } else {
                value.number += sign * own.parse::<f64>().ok()?;
            }
        }
        let is_finite = (value.number + value.of_pi.unwrap_or_default()).is_finite();
        (!text.is_empty() && is_finite).then_some(value)
    }
}

/// The end of the first term of a sum: the next sign that is not that of a power of ten.
fn end_of_term(text: &str) -> usize {
    let before = |at: usize| text.get(..at).unwrap_or_default();
    let is_power = |at: usize| {
        before(at)
            .strip_suffix('e')
            .is_some_and(|own| own.ends_with(|own: char| own.is_ascii_digit() || own == '.'))
    };
    let mut signs = text.char_indices().skip(1).filter(|(_, own)| ['+', '-'].contains(own));
    signs.find(|(at, _)| !is_power(*at)).map_or(text.len(), |(at, _)| at)
}
