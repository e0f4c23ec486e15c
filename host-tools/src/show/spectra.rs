//! The newest record beside the model, drawn with dots: one panel for each axis, the next below the one before. Measured are dots,
//! modelled is a line, and noise a dashed one, so that they differ without colours.

use console::Style;
use flexid_report::charts::scale::Scale;
use flexid_report::charts::spectra::{AXES, scales};
use flexid_wire::spectra::{Band, Spectra};

use super::braille::Dots;
use super::headline::Tone;
use super::line::Line;
use super::view::View;

/// Fewest rows of a panel of which three share a window. A smaller window shows one panel.
const SHARED: usize = 14;
/// Rows beside the dots: title, axis, frequencies.
const AROUND: usize = 3;
/// Fewest rows and columns of dots.
const LEAST: [usize; 2] = [4, 20];
/// Dots of a dash and of the gap behind it.
const DASH: usize = 3;

/// The curve of a dot. A cell that several share has the style of the last.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Curve {
    Noise,
    Modelled,
    Measured,
}

impl Curve {
    fn style(self) -> Style {
        match self {
            Self::Noise => Style::new().dim(),
            Self::Modelled => Style::new(),
            Self::Measured => Style::new().cyan(),
        }
    }
}

/// The panels of all axes. Each is as high as the window, or a third of it if that is enough.
pub(crate) fn lines(view: &View, rows: usize, columns: usize) -> Vec<Line> {
    let Some(spectra) = &view.spectra else { return vec!["no spectra of a record yet".into()] };
    let height = if rows / 3 >= SHARED { rows / 3 } else { rows };
    let [x, y] = scales(spectra);
    let labels = labels(&y, height.saturating_sub(AROUND));
    let left = labels.iter().map(|(_, label)| label.chars().count()).max().unwrap_or(0) + 1;
    let [least_rows, least_columns] = LEAST;
    if height < least_rows + AROUND || columns < left + least_columns {
        return vec!["make the window larger".into()];
    }
    let size = [height - AROUND, columns - left];
    let panel = |axis| {
        let mut lines = vec![title(spectra, axis)];
        for (row, cells) in dots(spectra, axis, [&x, &y], size).rows().enumerate() {
            let label = labels.iter().find(|(own, _)| *own == row).map(|(_, label)| label.as_str());
            let (label, tick) = label.map_or(("", '│'), |label| (label, '┤'));
            let mut line = Line::from(format!("{label:>width$}{tick}", width = left - 1));
            for piece in cells.chunk_by(|one, other| one.1 == other.1) {
                let style = piece[0].1.map_or(Tone::Neutral.into(), Curve::style);
                line.push(style, piece.iter().map(|(character, _)| *character).collect::<String>());
            }
            lines.push(line);
        }
        lines.extend(frequencies(&x, left, columns).map(Line::from));
        lines
    };
    (0..AXES.len()).flat_map(panel).collect()
}

fn title(spectra: &Spectra, axis: usize) -> Line {
    let Spectra { record, .. } = spectra;
    let mut title =
        Line::from(format!("acceleration {}, (m/s²)/√Hz, record {record}  ", AXES[axis]));
    title.push(Curve::Measured.style(), "⠂ ⠂ measured  ");
    title.push(Curve::Modelled.style(), "⠒⠒ modelled  ");
    title.push(Curve::Noise.style(), "⠒ ⠒ noise");
    title
}

/// Places between the ends of a scale, 0 to `last`.
fn place(scale: &Scale, value: f32, last: usize) -> Option<f64> {
    Some(part(scale, scale.place(f64::from(value))?) * last as f64)
}

/// The part of a scale that lies below a place on it.
fn part(scale: &Scale, place: f64) -> f64 {
    let [low, high] = scale.ends;
    (place - low) / (high - low)
}

fn dots(
    spectra: &Spectra,
    axis: usize,
    [x, y]: [&Scale; 2],
    [rows, columns]: [usize; 2],
) -> Dots<Curve> {
    let mut dots = Dots::new(rows, columns);
    let [width, height] = dots.size();
    let points = |value: fn(&Band) -> &[f32; 3]| -> Vec<[f64; 2]> {
        let bands = spectra.bands.iter();
        let point = |band: &Band| {
            let at = place(x, band.frequency_hz, width - 1)?;
            Some([at, place(y, value(band)[axis], height - 1)?])
        };
        bands.filter_map(point).collect()
    };
    dots.line(Curve::Noise, &points(|band| &band.noise), |x| (x / DASH).is_multiple_of(2));
    dots.line(Curve::Modelled, &points(|band| &band.modelled), |_| true);
    for [x, y] in points(|band| &band.measured) {
        dots.set(Curve::Measured, x.round() as usize, y.round() as usize);
    }
    dots
}

/// Rows of the ticks, and their labels.
fn labels(y: &Scale, rows: usize) -> Vec<(usize, String)> {
    let last = (4 * rows).saturating_sub(1) as f64;
    let row = |tick: f64| (last * (1.0 - part(y, tick))).round() as usize / 4;
    let mut labels: Vec<(usize, String)> = Vec::new();
    for tick in &y.ticks {
        let row = row(*tick);
        // Where two share a row, the decade is the first.
        if labels.iter().all(|(own, _)| *own != row) {
            labels.push((row, y.text(*tick)));
        }
    }
    labels
}

/// The axis of frequencies, and the numbers at its ticks.
fn frequencies(x: &Scale, left: usize, columns: usize) -> [String; 2] {
    const UNIT: &str = " Hz";
    let last = (2 * (columns - left)).saturating_sub(1) as f64;
    let mut axis: Vec<char> = vec!['─'; columns - left];
    let mut numbers = vec![' '; columns];
    let mut free = 0;
    for tick in &x.ticks {
        let column = (last * part(x, *tick)).round() as usize / 2;
        axis[column] = '┬';
        let text: Vec<char> = x.text(*tick).chars().collect();
        let room = columns - UNIT.len();
        let start = (left + column).saturating_sub(text.len() / 2).min(room - text.len());
        if start >= free {
            numbers[start..start + text.len()].copy_from_slice(&text);
            free = start + text.len() + 1;
        }
    }
    let end = free.saturating_sub(1);
    let numbers: String = numbers[..end].iter().collect();
    [format!("{:>left$}{}", "└", axis.iter().collect::<String>()), numbers + UNIT]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::show::page::tests::view;

    /// The panel of an axis in a window of 80 × 24, as text.
    fn panel(axis: usize) -> Vec<String> {
        let lines = lines(&view(3, &[]), 22, 80);
        assert_eq!(lines.len(), 66);
        lines[22 * axis..22 * (axis + 1)].iter().map(Line::text).collect()
    }

    #[test]
    fn a_window_has_a_panel_with_both_axes() {
        for (axis, name) in AXES.iter().enumerate() {
            let panel = panel(axis);
            let head = format!("acceleration {name}, (m/s²)/√Hz, record 3  ");
            assert!(panel[0].starts_with(&head), "{panel:#?}");
            for line in &panel {
                assert!(line.chars().count() <= 80, "{line:?}");
            }
            let labels: Vec<_> =
                panel[1..20].iter().filter_map(|line| line.split_once('┤')).collect();
            let labels: Vec<_> = labels.iter().map(|(label, _)| label.trim()).collect();
            let decades = ["1", "0.1", "0.01", "10⁻³"];
            assert!(decades.iter().all(|decade| labels.contains(decade)), "{labels:?}");
            assert_eq!(labels.len(), 10, "{labels:?}");
            assert_eq!(panel[20].matches('┬').count(), 7, "{}", panel[20]);
            let words: Vec<_> = panel[21].split_whitespace().collect();
            assert_eq!(words, ["2", "5", "10", "20", "50", "100", "200", "Hz"]);
        }
    }

    /// Measured is ten times modelled along x, and modelled ten times the noise: the dots lie a decade above the line.
    #[test]
    fn curves_lie_where_their_numbers_are() {
        let panel = panel(0);
        let row = |label: &str| panel.iter().position(|line| line.trim_start().starts_with(label));
        let [tenth, hundredth] = [row("0.1┤").unwrap(), row("0.01┤").unwrap()];
        let cells = |row: usize| panel[row].split_once('┤').unwrap().1.to_owned();
        assert!(!cells(hundredth).contains(' '), "the line has a gap: {panel:#?}");
        let dotted = cells(tenth);
        let measured = dotted.chars().filter(|cell| *cell != ' ').count();
        assert!((50..=60).contains(&measured) && dotted.contains(' '), "{panel:#?}");
        for row in 1..20 {
            let cells = panel[row].split(['┤', '│']).nth(1).unwrap();
            let is_empty = cells.trim().is_empty();
            let expected = row != tenth && row != hundredth && row != 19;
            assert_eq!(is_empty, expected, "row {row} of {panel:#?}");
        }
    }

    #[test]
    fn a_resonance_stands_at_its_frequency() {
        let panel = panel(2);
        let peak = panel.iter().skip(1).find(|line| {
            line.split(['┤', '│']).nth(1).is_some_and(|cells| !cells.trim().is_empty())
        });
        let peak =
            peak.unwrap().chars().position(|own| ('\u{2801}'..='\u{28ff}').contains(&own)).unwrap();
        let tick = panel[21].split("20").next().unwrap().chars().count();
        assert!(peak.abs_diff(tick) <= 2, "{peak} is not at {tick}: {panel:#?}");
    }

    #[test]
    fn any_window_and_any_numbers_are_drawn() {
        let mut view = view(3, &[]);
        for (rows, columns) in [(0, 0), (3, 80), (8, 30), (22, 80), (60, 200), (22, 26)] {
            for line in lines(&view, rows, columns) {
                assert!(line.width() <= columns.max(80), "{line:?}");
            }
        }
        assert_eq!(lines(&view, 60, 100).len(), 60, "three panels share a high window");
        let spectra = view.spectra.as_mut().unwrap();
        for (index, band) in spectra.bands.iter_mut().enumerate() {
            band.measured = [f32::NAN, f32::INFINITY, -1.0];
            band.modelled = [0.0, f32::MIN_POSITIVE, f32::MAX];
            band.frequency_hz *= if index % 2 == 0 { 0.0 } else { 1.0 };
        }
        assert_eq!(lines(&view, 22, 80).len(), 66);
        view.spectra.as_mut().unwrap().bands.clear();
        assert_eq!(lines(&view, 22, 80).len(), 66);
        view.spectra = None;
        assert_eq!(lines(&view, 22, 80), ["no spectra of a record yet".into()]);
    }
}
