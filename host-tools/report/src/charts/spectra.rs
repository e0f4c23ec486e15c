//! A record beside the model: amplitude spectral densities of the acceleration, a panel for each axis.

use flexid_wire::spectra::{Band, Spectra};
use maud::{Markup, html};

use super::panel::{Curve, Labels, Panel};
use super::scale::Scale;
use super::{Colour, Mark, legend, svg_of};

/// Names of the axes.
pub const AXES: [&str; 3] = ["x", "y", "z"];
/// Size of a panel, pixels. Chosen: three beside each other are legible on a tablet, one on a telephone.
const SIZE: (u32, u32) = (760, 560);
/// Radius of many dots and of few, and the width that they share, pixels. Chosen: many do not hide the line on which they lie.
const DOTS: [u32; 2] = [4, 8];
const ROOM: u32 = 600;
/// Decades below the largest value that are shown, at most. Chosen: noise is there.
const DECADES: f64 = 6.0;

/// Unit of the acceleration of a record.
pub const OF_RECORD: &str = "(m/s²)/√Hz";
/// Unit of that of a modal test.
pub const OF_TEST: &str = "(m/s²)/N";

/// Amplitude spectral densities along a band, for each axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Densities {
    /// Unit of the acceleration: (m/s²)/√Hz of a record, (m/s²)/N of a modal test.
    pub unit: &'static str,
    /// Lower and upper edge of the band, Hz.
    pub band_hz: [f64; 2],
    /// Frequencies, Hz.
    pub frequency_hz: Vec<f64>,
    /// Measured acceleration, (m/s²)/√Hz.
    pub measured: [Vec<f64>; 3],
    /// Modelled acceleration, (m/s²)/√Hz.
    pub modelled: [Vec<f64>; 3],
    /// Noise, (m/s²)/√Hz.
    pub noise: [Vec<f64>; 3],
}

impl From<&Spectra> for Densities {
    fn from(spectra: &Spectra) -> Self {
        let along = |of: fn(&Band) -> &[f32; 3]| {
            let values =
                |axis: usize| spectra.bands.iter().map(|own| of(own)[axis].into()).collect();
            std::array::from_fn(values)
        };
        Self {
            unit: OF_RECORD,
            band_hz: spectra.band_hz.map(f64::from),
            frequency_hz: spectra.bands.iter().map(|own| own.frequency_hz.into()).collect(),
            measured: along(|own| &own.measured),
            modelled: along(|own| &own.modelled),
            noise: along(|own| &own.noise),
        }
    }
}

/// Scales of the frequency, Hz, and of the densities along all axes, (m/s²)/√Hz.
pub fn scales(densities: impl Into<Densities>) -> [Scale; 2] {
    scales_of(&densities.into())
}

fn scales_of(own: &Densities) -> [Scale; 2] {
    let all = own.measured.iter().chain(&own.modelled).chain(&own.noise).flatten();
    [Scale::logarithmic(own.band_hz), density_scale(all.copied())]
}

/// Scale of these densities: whole decades, at most [`DECADES`] of them.
pub(crate) fn density_scale(densities: impl Iterator<Item = f64> + Clone) -> Scale {
    let finite = densities.filter(|own| own.is_finite());
    let least = finite.clone().fold(0.0, f64::max) * 10_f64.powf(-DECADES);
    Scale::decades(finite.filter(|own| *own > 0.0).map(|own| own.max(least)))
}

/// A legend, and a panel for each axis.
pub fn panels(densities: impl Into<Densities>) -> Markup {
    let own = densities.into();
    html! {
        (legend(&[
            ("measured", Colour::Blue, Mark::Dot),
            ("modelled", Colour::Orange, Mark::Line),
            ("noise", Colour::Grey, Mark::Dashed),
        ]))
        (axis_panels("Measured and modelled", own.unit, &scales_of(&own), |axis| curves(&own, axis)))
    }
}

/// Densities of the acceleration in this unit, a panel for each axis.
pub(crate) fn axis_panels(
    what: &str,
    unit: &str,
    [x, y]: &[Scale; 2],
    curves: impl Fn(usize) -> Vec<Curve>,
) -> Markup {
    let panel = |axis: usize| {
        let panel = Panel {
            x: x.clone(),
            y: y.clone(),
            title: AXES[axis].to_owned(),
            labels: Labels { x: Some("frequency / Hz".into()), y: Some(unit.into()) },
            bands: Vec::new(),
            curves: curves(axis),
        };
        let label = format!("{what} acceleration along {}", AXES[axis]);
        svg_of(SIZE, &label, |canvas| panel.draw(canvas))
    };
    html! {
        div.panels { @for axis in 0..3 { figure { (panel(axis)) } } }
    }
}

fn curves(own: &Densities, axis: usize) -> Vec<Curve> {
    let points =
        |values: &[f64]| own.frequency_hz.iter().copied().zip(values.to_vec()).collect::<Vec<_>>();
    let line = |colour, width, values: &[f64]| Curve {
        colour,
        width,
        points: points(values).into_iter().map(|(hz, own)| (hz, Some(own))).collect(),
    };
    let [many, few] = DOTS;
    let radius = (ROOM / own.frequency_hz.len().max(1) as u32).clamp(many, few);
    vec![
        line(Colour::Grey, 4, &own.noise[axis]),
        line(Colour::Orange, 5, &own.modelled[axis]),
        Curve::dots(Colour::Blue, radius, points(&own.measured[axis]).into_iter()),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spectra(measured: f32) -> Spectra {
        let band = |frequency_hz| Band {
            frequency_hz,
            measured: [measured, 1.0, 1.0],
            modelled: [1.0; 3],
            noise: [0.01; 3],
        };
        Spectra {
            record: 1,
            pose: Default::default(),
            band_hz: [2.0, 200.0],
            bands: [2.0, 20.0, 200.0].map(band).into_iter().collect(),
        }
    }

    /// Heights, pixels, of the three curves of the first panel at the frequency in the middle: dots of measured, lines of others.
    fn heights(spectra: &Spectra) -> [f64; 3] {
        let svg = panels(spectra).into_string();
        let attribute = |element: &str, name: &str| {
            let rest = element.split_once(&format!(" {name}=\"")).unwrap().1;
            rest.split_once('"').unwrap().0.to_owned()
        };
        let dots: Vec<&str> = svg.split("<circle").skip(1).collect();
        assert_eq!(dots.len(), 9, "{svg}");
        let line = |colour: &str| {
            let line = svg.split("<polyline").find(|line| {
                line.contains(&format!("stroke=\"{colour}\"")) && line.matches(',').count() == 3
            });
            let points = attribute(line.unwrap(), "points");
            let middle = points.split(' ').nth(1).unwrap().split_once(',').unwrap().1.to_owned();
            middle.parse().unwrap()
        };
        [attribute(dots[1], "cy").parse().unwrap(), line("#D57C00"), line("#7F7F7F")]
    }

    /// Dots of equal spectra lie on the line; a factor of ten is as high as a decade of the axis.
    #[test]
    fn the_heights_are_logarithms() {
        let [measured, modelled, noise] = heights(&spectra(1.0));
        assert_eq!(measured, modelled);
        let decade = (noise - modelled) / 2.0;
        assert!(decade > 50.0, "{decade}");
        let [measured, modelled, _] = heights(&spectra(0.1));
        assert!((measured - modelled - decade).abs() <= 1.0, "{measured} {modelled} {decade}");
    }

    #[test]
    fn what_is_no_number_is_not_drawn() {
        let none = Spectra { bands: Default::default(), band_hz: [0.0; 2], ..spectra(1.0) };
        for spectra in [none, spectra(f32::NAN), spectra(f32::INFINITY), spectra(0.0)] {
            let page = panels(&spectra).into_string();
            assert_eq!(page.matches("<svg").count(), 3);
            assert!(!page.contains("NaN") && !page.contains("inf"), "{page}");
        }
    }
}
