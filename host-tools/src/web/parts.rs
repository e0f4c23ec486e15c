//! The parts of the page that change, as HTML. Each has the element with its name in the page.

use std::sync::Arc;
use std::time::UNIX_EPOCH;

use flexid_pipeline::text::{count, printable};
use flexid_report::charts::spectra::panels;
use flexid_wire::messages::{Phase, Status};
use flexid_wire::spectra::Spectra;
use maud::{Markup, html};

use super::class::class;
use super::parameters::parameters;
use super::state::{Link, State};
use crate::show::confidence;
use crate::show::headline::Headline;
use crate::show::view::View;

/// Names of the parts.
pub(super) const NAMES: [&str; 9] = [
    "robot",
    "link",
    "verdict",
    "warnings",
    "progress",
    "parameters",
    "spectra",
    "confidence",
    "bus",
];

/// The parts, in the order of [`NAMES`].
pub(super) type Parts = [Arc<str>; NAMES.len()];

/// Phases of the identification, in their order.
const PHASES: [(Phase, &str); 4] = [
    (Phase::Waiting, "waiting"),
    (Phase::Searching, "searching"),
    (Phase::Refining, "refining"),
    (Phase::Settled, "settled"),
];

/// Renders all parts.
pub(super) fn render(state: &State) -> Parts {
    let view = &state.view;
    let finding = view.finding.as_ref();
    let parts: [Markup; NAMES.len()] = [
        robot(view.status.as_ref()),
        link(state),
        verdict(view),
        warnings(view),
        progress(view),
        finding.map(parameters).unwrap_or_default(),
        view.spectra.as_ref().map(spectra).unwrap_or_default(),
        confidence(view),
        html! { @if let Some(line) = view.bus_line() { p { (line) } } },
    ];
    // What a daemon on another machine sends must not end a line of the stream, or change the order of writing.
    parts.map(|part| printable(&part.into_string()).into())
}

fn robot(status: Option<&Status>) -> Markup {
    html! {
        @if let Some(Status { model, joints, interface, .. }) = status {
            b { (model) } " " (count((*joints).into(), "joint")) ", " (interface)
        } @else { b { "flexid" } }
    }
}

/// The connection to the daemon. The script shows times in the browser's time zone.
fn link(State { address, link, heard, .. }: &State) -> Markup {
    let since = heard.and_then(|heard| heard.duration_since(UNIX_EPOCH).ok());
    let seconds = since.map(|since| since.as_secs() % 86_400);
    let clock = |s: u64| format!("{:02}:{:02}:{:02} UTC", s / 3600, s / 60 % 60, s % 60);
    html! {
        @match (link, since.zip(seconds)) {
            (Link::Live, _) => p.live { "live: " (address) },
            (Link::Lost(reason), None) => p.lost role="alert" { b { "no connection to the daemon" } br; (reason) },
            (Link::Lost(reason), Some((since, seconds))) => p.lost role="alert" {
                b {
                    "connection lost, last data from "
                    time data-ms=(since.as_millis()) { (clock(seconds)) }
                }
                br;
                (reason)
            },
        }
    }
}

fn verdict(view: &View) -> Markup {
    let headline = Headline::of(view);
    let answer = view.finding.as_ref().and_then(|finding| finding.answer.as_ref());
    html! {
        div class=(class(headline.tone)) {
            h1 { (headline.words) }
            @if let Some(answer) = answer {
                dl {
                    @for (name, part) in answer.parts() {
                        dt { (name) }
                        dd { @for piece in part.to_string().split_inclusive(", ") { span { (piece) } } }
                    }
                }
            }
            @if let Some(verdicts) = headline.verdicts { p { (verdicts) } }
            @if let Some(answer) = answer { p { "95 % intervals, " (answer.place().to_string()) } }
        }
    }
}

/// Size of the residuals, and how far the numbers can be trusted.
fn confidence(view: &View) -> Markup {
    html! {
        @if let (Some(finding), Some(fit)) = (&view.finding, Headline::of(view).fit) {
            p { (fit) }
            pre { (confidence::lines(finding)) }
        }
    }
}

/// A dead bus, and the warnings about the fit, which the daemon sends with the gravest first.
fn warnings(view: &View) -> Markup {
    let dead = view.dead_bus();
    let warnings = view.finding.iter().flat_map(|finding| &finding.report.warnings);
    let warnings: Vec<_> = warnings.map(ToString::to_string).collect();
    html! {
        @if dead.is_some() || !warnings.is_empty() {
            h2 { (count(warnings.len() as u64 + u64::from(dead.is_some()), "warning")) }
            ol {
                @if let Some(dead) = dead { li.bad { (dead) } }
                @for warning in &warnings { li.caution { (warning) } }
            }
        }
    }
}

/// The state of the daemon, the present record, and the work on the newest one.
fn progress(view: &View) -> Markup {
    let waits = view.status.as_ref().map(|status| status.state.to_string());
    let state = view.state();
    let recorded = view.status.as_ref().map_or(0.0, |status| status.record_fraction);
    html! {
        @if let Some(state) = &state { p.state { (state) } }
        @if let Some(waits) = waits.filter(|waits| Some(waits) != state.as_ref()) { p { (waits) } }
        @if recorded > 0.0 { (bar("record", recorded)) }
        @if let Some(progress) = view.progress {
            ol.phases {
                @for (phase, name) in PHASES {
                    li aria-current=[(phase == progress.phase).then_some("step")] { (name) }
                }
            }
            @if matches!(progress.phase, Phase::Searching | Phase::Refining) {
                (bar("work on the newest record", progress.fraction))
            }
        }
    }
}

/// The newest record beside the model.
fn spectra(spectra: &Spectra) -> Markup {
    let pose: Vec<_> = spectra.pose.iter().map(|angle| format!("{angle:.3}")).collect();
    html! {
        h2 { "Record " (spectra.record) ", measured against modelled" }
        p { "Acceleration along each axis of the accelerometer. Pose " (pose.join(" ")) " rad (m)." }
        (panels(spectra))
    }
}

fn bar(of: &str, fraction: f32) -> Markup {
    let percent = if fraction.is_finite() { 100.0 * fraction.clamp(0.0, 1.0) } else { 0.0 };
    html! {
        label {
            span { (of) " " (format!("{percent:.0} %")) }
            progress max="100" value=(format!("{percent:.0}")) {}
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, SystemTime};

    use flexid_wire::messages::BusState;
    use flexid_wire::text::clipped;
    use flexid_wire::trouble::{BusFault, BusFaultKind};
    use flexid_wire::warning::Warning;

    use super::*;
    use crate::show::page::tests::view;

    fn part(name: &str, state: &State) -> String {
        let index = NAMES.iter().position(|part| *part == name).unwrap();
        render(state)[index].to_string()
    }

    fn state(view: View) -> State {
        let heard = Some(SystemTime::UNIX_EPOCH + Duration::from_secs(86_400 + 3 * 3600 + 62));
        State { address: "unix:a.sock".into(), link: Link::Live, heard, view }
    }

    #[test]
    fn a_lost_connection_has_its_time_and_reason() {
        let mut state = state(view(3, &[]));
        assert!(part("link", &state).contains("live: unix:a.sock"));
        state.link = Link::Lost("the daemon hung up".into());
        let link = part("link", &state);
        assert!(link.contains("last data from <time data-ms=\"97262000\">03:01:02 UTC"), "{link}");
        assert!(link.contains("the daemon hung up"), "{link}");
        state.heard = None;
        assert!(!part("link", &state).contains("last data"));
    }

    #[test]
    fn a_dead_bus_is_the_first_warning() {
        let mut view = view(3, &[Warning::ImposedParameters]);
        let bus = view.bus.as_mut().unwrap();
        bus.state = BusState::Down;
        bus.fault = Some(BusFault { interface: clipped("vcan0"), kind: BusFaultKind::Down });
        let warnings = part("warnings", &state(view));
        assert!(
            warnings.starts_with("<h2>2 warnings</h2><ol><li class=\"bad\">vcan0 DOWN"),
            "{warnings}"
        );
    }

    /// The answer comes first, and what judges the fit is not in its card.
    #[test]
    fn the_first_card_has_the_answer() {
        let state = state(view(3, &[]));
        let verdict = part("verdict", &state);
        for said in [
            "<h1>consistent</h1><dl><dt>tool</dt><dd><span>softest 0.381 N/µm (±2.0 %) along",
            "<dt>lowest mode</dt><dd><span>6.33 Hz (±2.0 %), </span>",
            "<span>joint_3 not determined</span>",
            "<p>3 records: 18 of 36 parameters identified",
        ] {
            assert!(verdict.contains(said), "{said:?} is not in {verdict}");
        }
        for judged in ["χ²/dof", "SSP"] {
            assert!(!verdict.contains(judged), "{verdict}");
            assert!(part("confidence", &state).contains(judged), "{judged}");
        }
        let page = super::super::document::page(&render(&state), "v").into_string();
        let places = ["id=\"verdict\"", "id=\"progress\"", "id=\"spectra\"", "id=\"parameters\""];
        assert!(places.map(|place| page.find(place).unwrap()).is_sorted(), "{page}");
    }

    #[test]
    fn progress_has_the_record_the_phase_and_the_work() {
        let progress = part("progress", &state(view(3, &[])));
        for said in [
            "refining the fit to 3 records (attempt 1)",
            "<p>measuring</p>",
            "record 62 %",
            "<li aria-current=\"step\">refining</li>",
            "newest record 40 %",
        ] {
            assert!(progress.contains(said), "{said:?} is not in {progress}");
        }
    }

    /// A daemon on another machine may send anything.
    #[test]
    fn nothing_from_the_daemon_is_markup() {
        let evil = "<script>\"&\r\n\u{202e}";
        let mut view = view(3, &[]);
        let status = view.status.as_mut().unwrap();
        (status.model, status.interface) = (clipped(evil), clipped(evil));
        view.finding.as_mut().unwrap().report.joints[0].name = clipped(evil);
        for part in render(&state(view)) {
            assert!(!part.contains("<script") && !part.contains(['\r', '\u{202e}']), "{part}");
        }
    }
}
