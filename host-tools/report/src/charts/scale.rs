//! The range of an axis, linear or logarithmic, and its ticks.

use std::ops::Range;

use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};

/// Room around values, decades.
const ROOM: f64 = 0.08;

/// An axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Scale {
    is_logarithmic: bool,
    /// Ends, in what is drawn: the values or their decimal logarithms.
    pub ends: [f64; 2],
    /// Places of the ticks, likewise.
    pub ticks: Vec<f64>,
}

impl Scale {
    /// A linear one with these ticks.
    pub(crate) fn linear(ends: [f64; 2], ticks: Vec<f64>) -> Self {
        Self { is_logarithmic: false, ends: proper(ends), ticks }
    }

    /// A linear one whose ticks are multiples of 1, 2 or 5 times a power of ten, up to eight.
    pub(crate) fn round(ends: [f64; 2]) -> Self {
        let [low, high] = proper(ends);
        let rough = (high - low) / 7.0;
        let power = 10_f64.powf(rough.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0].map(|times| times * power);
        let step = step.into_iter().find(|step| *step >= rough).unwrap_or(rough);
        let ticks = (0..=8).map(|index| ((low / step).ceil() + f64::from(index)) * step);
        let ticks = ticks.filter(|tick| *tick <= high * (1.0 + 1e-12)).collect();
        Self::linear([low, high], ticks)
    }

    /// A logarithmic one that holds all values above 0, with a little room.
    pub(crate) fn around(values: impl Iterator<Item = f64>) -> Self {
        let logarithms = values.filter(|value| *value > 0.0).map(f64::log10);
        let [low, high] = span(logarithms).unwrap_or([0.0, 1.0]);
        Self::logarithmic([low - ROOM, high + ROOM].map(|own| 10_f64.powf(own)))
    }

    /// A logarithmic one from end to end, both above 0. Ticks are the decades, and 2 and 5 times them where there are few.
    pub fn logarithmic([low, high]: [f64; 2]) -> Self {
        let low = if low > 0.0 && low.is_finite() { low } else { 1e-12 };
        let high = if high > low && high.is_finite() { high } else { 10.0 * low };
        let ends = proper([low.log10(), high.log10()]);
        let decades = ends[1] - ends[0];
        let parts: &[f64] = if decades <= 3.0 { &[1.0, 2.0, 5.0] } else { &[1.0] };
        let every = ((decades / 8.0).ceil() as i32).max(1);
        let powers = (ends[0].floor() as i32..=ends[1].ceil() as i32)
            .filter(|power| power.rem_euclid(every) == 0);
        let ticks = powers
            .flat_map(|power| parts.iter().map(move |part| f64::from(power) + part.log10()))
            .filter(|tick| *tick >= ends[0] - 1e-9 && *tick <= ends[1] + 1e-9)
            .collect();
        Self { is_logarithmic: true, ends, ticks }
    }

    /// A logarithmic one that holds all values above 0, in whole decades.
    pub(crate) fn decades(values: impl Iterator<Item = f64>) -> Self {
        let logarithms = values.filter(|value| *value > 0.0).map(f64::log10);
        let [low, high] = span(logarithms).unwrap_or([0.0, 1.0]);
        let [low, high] = [low.floor(), high.ceil()];
        let high = if high > low { high } else { low + 1.0 };
        Self::logarithmic([10_f64.powf(low), 10_f64.powf(high)])
    }

    /// The place at which a value is drawn. `None` of one that lies outside, or has no place, as 0 on a logarithmic axis.
    pub fn place(&self, value: f64) -> Option<f64> {
        let own = if self.is_logarithmic { value.log10() } else { value };
        let [low, high] = self.ends;
        let room = 1e-9 * (high - low);
        (low - room..=high + room).contains(&own).then(|| own.clamp(low, high))
    }

    /// The place at which the end of an area or a whisker is drawn: on the end of the axis if it lies outside. `None` of what is no number.
    pub(crate) fn end_place(&self, value: f64) -> Option<f64> {
        let own = if self.is_logarithmic { value.max(0.0).log10() } else { value };
        let [low, high] = self.ends;
        (!value.is_nan()).then(|| own.clamp(low, high))
    }

    /// The number at a tick, as text.
    pub fn text(&self, tick: f64) -> String {
        if !self.is_logarithmic {
            // Ticks are multiples of a step, with rounding errors.
            let rounded = (tick * 1e6).round() / 1e6 + 0.0;
            return rounded.to_string().replace('-', "\u{2212}");
        }
        let value = 10_f64.powf(tick);
        if (0.009..20_000.0).contains(&value) {
            let digits = (-tick.floor()).max(0.0) as usize;
            return format!("{value:.digits$}");
        }
        let power = (tick + 1e-9).floor();
        let part = (10_f64.powf(tick - power)).round();
        let exponent = superscript(power as i32);
        if part <= 1.0 { format!("10{exponent}") } else { format!("{part}·10{exponent}") }
    }
}

/// The axis as the chart library asks for it, in what is drawn.
impl Ranged for Scale {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, place: &f64, (first, last): (i32, i32)) -> i32 {
        let [low, high] = self.ends;
        first + ((place - low) / (high - low) * f64::from(last - first)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        if hint.weight().allow_light_points() { Vec::new() } else { self.ticks.clone() }
    }

    fn range(&self) -> Range<f64> {
        self.ends[0]..self.ends[1]
    }
}

impl ValueFormatter<f64> for Scale {
    fn format_ext(&self, tick: &f64) -> String {
        self.text(*tick)
    }
}

/// A number as superscript digits.
pub(crate) fn superscript(number: i32) -> String {
    let digit = |digit: char| match digit {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        // The others follow each other.
        other => char::from_u32(0x2070 + other.to_digit(10).unwrap_or(0)).unwrap_or(other),
    };
    number.to_string().chars().map(digit).collect()
}

/// Least and largest finite value.
fn span(values: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    values.filter(|value| value.is_finite()).fold(None, |span, value| {
        let [low, high] = span.unwrap_or([value, value]);
        Some([low.min(value), high.max(value)])
    })
}

/// Ends that are finite and apart.
fn proper([low, high]: [f64; 2]) -> [f64; 2] {
    match (low.is_finite(), high.is_finite()) {
        (true, true) if high > low => [low, high],
        (true, _) => [low, low + 1.0],
        _ => [0.0, 1.0],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_few_and_inside() {
        let scales = [
            Scale::logarithmic([2.0, 200.0]),
            Scale::logarithmic([1e-9, 1e-4]),
            Scale::logarithmic([0.0, f64::NAN]),
            Scale::round([0.0, 1.0]),
            Scale::round([3.0, 3.0]),
            Scale::round([-17.0, 4211.0]),
            Scale::around([2e7, 2.2e7].into_iter()),
            Scale::around([].into_iter()),
            Scale::decades([3e-8, 0.0, f64::NAN, 7e-6].into_iter()),
        ];
        for scale in scales {
            let [low, high] = scale.ends;
            assert!(low < high, "{scale:?}");
            assert!((1..=12).contains(&scale.ticks.len()), "{scale:?}");
            let room = 1e-9 * (high - low);
            assert!(
                scale.ticks.iter().all(|tick| (low - room..=high + room).contains(tick)),
                "{scale:?}"
            );
        }
    }

    #[test]
    fn texts_are_short() {
        let scale = Scale::logarithmic([2.0, 200.0]);
        let texts: Vec<String> = scale.ticks.iter().map(|tick| scale.text(*tick)).collect();
        assert_eq!(texts, ["2", "5", "10", "20", "50", "100", "200"]);
        let scale = Scale::decades([2e-9, 3e-7].into_iter());
        assert_eq!(scale.text(scale.ticks[0]), "10⁻⁹");
        assert_eq!(scale.text(-7.0 + 2_f64.log10()), "2·10⁻⁷");
        assert_eq!(Scale::round([0.0, 1.0]).text(0.300_000_000_000_000_04), "0.3");
        assert_eq!(Scale::linear([-180.0, 180.0], vec![]).text(-180.0), "−180");
        assert_eq!(superscript(-120), "⁻¹²⁰");
    }

    #[test]
    fn what_has_no_place_is_not_drawn() {
        let scale = Scale::logarithmic([1.0, 100.0]);
        assert_eq!(scale.place(10.0), Some(1.0));
        for none in [0.0, -1.0, 0.9, 101.0, f64::NAN, f64::INFINITY] {
            assert_eq!(scale.place(none), None, "{none}");
        }
        assert_eq!(Scale::round([0.0, 1.0]).end_place(-3.0), Some(0.0));
        // The ends of an interval that nothing bounds are the ends of the axis.
        assert_eq!([0.0, f64::INFINITY].map(|own| scale.end_place(own)), [Some(0.0), Some(2.0)]);
        assert_eq!(scale.end_place(f64::NAN), None);
    }
}
