//! All parameters: value, 95 % interval, verdict, and a picture of the interval on an axis that all joints share.

use flexid_core::imperfection::REFERENCE_HZ;
use flexid_wire::confidence::Interval;
use flexid_wire::finding::Finding;
use flexid_wire::report::Verdict;
use flexid_wire::words::Within;
use maud::{Markup, html};

use super::class::class;
use crate::show::headline::tone;
use crate::show::table::DOF_NAMES;
use crate::show::verdict;

/// Largest number of decades between two marks of an axis.
const MARKS: i32 = 6;

/// One kind of parameter of one joint: values, intervals and verdicts of its six directions.
struct Kind<'a> {
    name: &'static str,
    /// Units along the axes, and about them.
    units: [&'static str; 2],
    values: &'a [f64; 6],
    intervals: &'a [Option<Interval>; 6],
    verdicts: &'a [Verdict; 6],
}

/// A logarithmic axis over whole decades.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Axis {
    /// Powers of ten of both ends.
    ends: [i32; 2],
}

/// A section for each joint, base first. Without records there are no dampings.
pub(super) fn parameters(finding: &Finding) -> Markup {
    let Finding { report, confidence, .. } = finding;
    let has_dampings = report.fit.records > 0;
    let joints: Vec<(&str, Vec<Kind>)> = report
        .joints
        .iter()
        .zip(&confidence.joints)
        .map(|(joint, intervals)| {
            let stiffness = Kind {
                name: "stiffness",
                units: ["N/m", "Nm/rad"],
                values: &joint.stiffness,
                intervals: &intervals.stiffness_interval,
                verdicts: &joint.stiffness_verdict,
            };
            let damping = Kind {
                name: "damping",
                units: ["Ns/m", "Nms/rad"],
                values: &joint.damping,
                intervals: &intervals.damping_interval,
                verdicts: &joint.damping_verdict,
            };
            let kinds = [stiffness, damping].into_iter().take(1 + usize::from(has_dampings));
            (joint.name.as_str(), kinds.collect())
        })
        .collect();
    // The axes of stiffness and damping, along and about.
    let axes = [0, 1].map(|kind| {
        [0..3, 3..6].map(|dofs| {
            let kinds = joints.iter().filter_map(|(_, kinds)| kinds.get(kind));
            Axis::over(kinds.flat_map(|kind| dofs.clone().flat_map(|dof| kind.extent(dof))))
        })
    });
    html! {
        @if has_dampings {
            p { (format!("With hysteresis these are the values at {REFERENCE_HZ} Hz.")) }
        }
        @for (name, kinds) in &joints {
            section.joint {
                h3 { (name) }
                div.kinds { @for (kind, axes) in kinds.iter().zip(&axes) { (kind.table(axes)) } }
            }
        }
    }
}

impl Kind<'_> {
    /// Value and ends of the interval of one direction.
    fn extent(&self, dof: usize) -> impl Iterator<Item = f64> {
        self.intervals[dof].into_iter().flatten().chain([self.values[dof]])
    }

    fn table(&self, axes: &[Axis; 2]) -> Markup {
        html! {
            table {
                @for (part, axis) in axes.iter().enumerate() {
                    tr {
                        th {}
                        th { (if part == 0 { self.name } else { "" }) }
                        th.axis { span { (axis.label(0)) } span { (self.units[part]) } span { (axis.label(1)) } }
                        th { (if part == 0 { "95 %" } else { "" }) }
                    }
                    @for dof in 3 * part..3 * part + 3 { (self.row(dof, axis)) }
                }
            }
        }
    }

    fn row(&self, dof: usize, axis: &Axis) -> Markup {
        let (value, interval, own) = (self.values[dof], self.intervals[dof], self.verdicts[dof]);
        html! {
            tr class=(class(tone(own))) {
                th { (DOF_NAMES[dof]) }
                td.value { (format!("{value:.3e}")) }
                td { (axis.picture(value, interval)) }
                td.interval {
                    @if let Some(interval) = interval { (Within { value, interval }) " " }
                    @if own != Verdict::Identified { em { (verdict::verdict(own)) } }
                }
            }
        }
    }
}

impl Axis {
    /// The shortest axis that holds all positive `numbers`.
    fn over(numbers: impl Iterator<Item = f64>) -> Self {
        let powers = numbers.filter(|number| *number > 0.0 && number.is_finite()).map(f64::log10);
        let [low, high] = powers.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], power| {
            [low.min(power), high.max(power)]
        });
        if low > high {
            return Self { ends: [0, 1] };
        }
        let low = low.floor() as i32;
        Self { ends: [low, (high.ceil() as i32).max(low + 1)] }
    }

    /// Place of a number, 0 to 100 between the ends.
    fn place(&self, number: f64) -> Option<f64> {
        let [low, high] = self.ends.map(f64::from);
        let place = 100.0 * (number.log10() - low) / (high - low);
        (0.0..=100.0).contains(&place).then_some(place)
    }

    fn label(&self, end: usize) -> Markup {
        html! { "10" sup { (self.ends[end]) } }
    }

    /// A mark at each decade, a line over the interval, and a dot at the value.
    fn picture(&self, value: f64, interval: Option<Interval>) -> Markup {
        let [low, high] = self.ends;
        let step = 1 + (high - low - 1) / MARKS;
        let marks =
            (low..=high).step_by(step as usize).filter_map(|power| self.place(10_f64.powi(power)));
        let marks: String = marks.map(|place| format!("M{place:.1} 0V20")).collect();
        let whisker =
            interval.and_then(|[lower, upper]| Some((self.place(lower)?, self.place(upper)?)));
        html! {
            svg viewBox="0 0 100 20" preserveAspectRatio="none" aria-hidden="true" {
                path.mark d=(marks) {}
                @if let Some((lower, upper)) = whisker {
                    path.whisker d=(format!("M{lower:.2} 10H{upper:.2}M{lower:.2} 5V15M{upper:.2} 5V15")) {}
                }
                @if let Some(place) = self.place(value) { path.dot d=(format!("M{place:.2} 10h0.01")) {} }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::show::page::tests::finding;

    #[test]
    fn an_axis_has_whole_decades() {
        let ends = |numbers: &[f64]| Axis::over(numbers.iter().copied()).ends;
        assert_eq!(ends(&[2e7, 3e8]), [7, 9]);
        assert_eq!(ends(&[1e7]), [7, 8]);
        assert_eq!(ends(&[0.02, f64::NAN, -1.0, f64::INFINITY, 0.0]), [-2, -1]);
        assert_eq!(ends(&[]), [0, 1]);
        let axis = Axis { ends: [7, 9] };
        assert_eq!(axis.place(1e8), Some(50.0));
        for outside in [1e6, 1e10, 0.0, -1.0, f64::NAN] {
            assert_eq!(axis.place(outside), None, "{outside}");
        }
    }

    #[test]
    fn a_picture_has_marks_whisker_and_dot() {
        let picture = Axis { ends: [7, 9] }.picture(1e8, Some([1e7, 1e9])).into_string();
        assert!(picture.contains("M0.0 0V20M50.0 0V20M100.0 0V20"), "{picture}");
        assert!(picture.contains("M0.00 10H100.00") && picture.contains("M50.00 10h"), "{picture}");
        let wide = Axis { ends: [-300, 300] }.picture(1.0, None).into_string();
        assert!(wide.matches('V').count() <= 8 && !wide.contains("whisker"), "{wide}");
    }

    #[test]
    fn every_parameter_has_a_row() {
        let mut finding = finding(3);
        finding.report.joints[1].damping_verdict[5] = Verdict::NotObservable;
        finding.confidence.joints[1].damping_interval[5] = None;
        let text = parameters(&finding).into_string();
        assert_eq!(text.matches("class=\"dot\"").count(), 36);
        assert_eq!(text.matches("class=\"whisker\"").count(), 35);
        assert_eq!(text.matches("±1.7 % </td>").count(), 18, "{text}");
        assert_eq!(text.matches("<em>not observable</em>").count(), 1);
        assert_eq!(text.matches("<tr class=\"faint\">").count(), 1, "{text}");
        assert!(!text.contains("class=\"bad\""), "{text}");
        assert!(text.contains("With hysteresis these are the values at 20 Hz."), "{text}");
        finding.report.fit.records = 0;
        assert!(!parameters(&finding).into_string().contains("damping"));
    }
}
