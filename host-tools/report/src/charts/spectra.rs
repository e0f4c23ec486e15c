//! The newest record of a daemon beside the model: amplitude spectral densities of the acceleration, a panel for each axis.

use flexid_wire::spectra::{Band, Spectra};
use maud::{Markup, html};

use super::panel::{Curve, Labels, Panel};
use super::scale::Scale;
use super::{Colour, Mark, legend, svg_of};

/// Names of the axes.
pub const AXES: [&str; 3] = ["x", "y", "z"];
/// Size of a panel, pixels. Chosen: three beside each other are legible on a tablet, one on a telephone.
const SIZE: (u32, u32) = (760, 560);
/// Decades below the largest value that are shown, at most. Chosen: noise is there.
const DECADES: f64 = 6.0;

/// Scales of the frequency, Hz, and of the densities along all axes, (m/s²)/√Hz.
pub fn scales(spectra: &Spectra) -> [Scale; 2] {
    let frequency = Scale::logarithmic(spectra.band_hz.map(f64::from));
    let densities = || {
        let bands = spectra.bands.iter();
        bands
            .flat_map(|band| [band.measured, band.modelled, band.noise].concat())
            .map(f64::from)
            .filter(|own| own.is_finite())
    };
    let least = densities().fold(0.0, f64::max) * 10_f64.powf(-DECADES);
    let density = Scale::decades(densities().filter(|own| *own > 0.0).map(|own| own.max(least)));
    [frequency, density]
}

/// A legend, and a panel for each axis.
pub fn panels(spectra: &Spectra) -> Markup {
    let scales = scales(spectra);
    html! {
        (legend(&[
            ("measured", Colour::Blue, Mark::Dot),
            ("modelled", Colour::Orange, Mark::Line),
            ("noise", Colour::Grey, Mark::Dashed),
        ]))
        div.panels {
            @for axis in 0..3 { figure { (panel(spectra, axis, &scales)) } }
        }
    }
}

fn panel(spectra: &Spectra, axis: usize, [x, y]: &[Scale; 2]) -> Markup {
    let points = |value: fn(&Band) -> &[f32; 3]| {
        let bands = spectra.bands.iter();
        bands.map(move |band| (f64::from(band.frequency_hz), f64::from(value(band)[axis])))
    };
    let line = |colour, width, value| Curve {
        colour,
        width,
        points: points(value).map(|(hz, own)| (hz, Some(own))).collect(),
    };
    let panel = Panel {
        x: x.clone(),
        y: y.clone(),
        title: AXES[axis].to_owned(),
        labels: Labels { x: Some("frequency / Hz".into()), y: Some("(m/s²)/√Hz".into()) },
        bands: Vec::new(),
        curves: vec![
            line(Colour::Grey, 4, |band| &band.noise),
            line(Colour::Orange, 5, |band| &band.modelled),
            Curve::dots(Colour::Blue, 8, points(|band| &band.measured)),
        ],
    };
    let label = format!("Measured and modelled acceleration along {}", AXES[axis]);
    svg_of(SIZE, &label, |canvas| panel.draw(canvas))
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
        let svg = panel(spectra, 0, &scales(spectra)).into_string();
        let attribute = |element: &str, name: &str| {
            let rest = element.split_once(&format!(" {name}=\"")).unwrap().1;
            rest.split_once('"').unwrap().0.to_owned()
        };
        let dots: Vec<&str> = svg.split("<circle").skip(1).collect();
        assert_eq!(dots.len(), 3, "{svg}");
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

    /// Where measured and modelled are equal, the dots lie on the line; a factor of ten is as high as a decade of the axis.
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
