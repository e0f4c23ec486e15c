//! The findings as JSON for scripts.

use anyhow::Result;
use flexid_pipeline::check::{Examined, Identifier, Station, Travel};
use flexid_pipeline::clocks::FoundClocks;
use serde::Serialize;

use super::{Check, Finding};
use crate::json::SCHEMA;

#[derive(Serialize)]
struct CheckJson<'a> {
    schema: u32,
    ready: bool,
    verdict: String,
    findings: &'a [Finding],
    /// Clocks of the sensors. Left out if one counter counts the instants of both, or if they cannot be told.
    #[serde(skip_serializing_if = "Option::is_none")]
    clocks: Option<&'a FoundClocks>,
    identifiers: Vec<IdentifierJson<'a>>,
    records: Vec<RecordJson<'a>>,
}

/// An identifier of the DBC file, or another one that came.
#[derive(Serialize)]
struct IdentifierJson<'a> {
    /// `null` of columns of a table.
    id: Option<String>,
    is_expected: bool,
    signals: &'a [String],
    frames: u64,
    /// Silences left out. `null` for fewer than two frames between silences.
    rate_hz: Option<f64>,
}

#[derive(Serialize)]
struct RecordJson<'a> {
    number: u64,
    start_s: f64,
    seconds: f64,
    rate_hz: f64,
    pose: &'a [f64],
    /// `null` along a path.
    pose_number: Option<u64>,
    /// Motion along a path. `null` where the robot stands.
    travel: Option<TravelJson<'a>>,
    repeats: Option<u64>,
    rest_s: f64,
    /// Fault for which the record is refused.
    fault: Option<String>,
    rms_force_n: Option<f64>,
    /// Share of the band's bins in which the force stands clear of its noise, 0 to 1.
    clear: Option<f64>,
    octaves: Vec<OctaveJson>,
}

/// Motion in a record along a path.
#[derive(Serialize)]
struct TravelJson<'a> {
    /// Number of the path, from 1.
    path: u64,
    length_m: f64,
    /// Time in which the robot moves evenly, s.
    even_s: f64,
    /// Largest rate of a joint in an even part, rad/s (m/s).
    rate: f64,
    /// Length of a part, s.
    part_s: f64,
    parts: Vec<StationJson<'a>>,
}

/// Where the robot is in a part.
#[derive(Serialize)]
struct StationJson<'a> {
    /// Mean joint angles, rad (m).
    pose: &'a [f64],
    /// Place of the TCP, along the axes of the base, m.
    tool_m: [f64; 3],
    /// True if a fit takes the part.
    is_even: bool,
}

#[derive(Serialize)]
struct OctaveJson {
    band_hz: [f64; 2],
    clear: f64,
}

/// The check as JSON.
///
/// # Errors
/// No check gives an error.
pub(crate) fn text(check: &Check) -> Result<String> {
    let survey = check.survey;
    let expected = survey.map_or(&[][..], |survey| &survey.expected).iter();
    let unexpected = survey.map_or(&[][..], |survey| &survey.unexpected).iter();
    let identifiers = expected.map(|one| identifier(one, true));
    let json = CheckJson {
        schema: SCHEMA,
        ready: check.is_ready(),
        verdict: check.verdict(),
        findings: &check.findings,
        clocks: survey.and_then(|survey| survey.clocks.as_ref()?.as_ref().ok()),
        identifiers: identifiers.chain(unexpected.map(|one| identifier(one, false))).collect(),
        records: survey.map_or(&[][..], |survey| &survey.records).iter().map(record).collect(),
    };
    Ok(serde_json::to_string_pretty(&json)? + "\n")
}

fn identifier(identifier: &Identifier, is_expected: bool) -> IdentifierJson<'_> {
    IdentifierJson {
        id: identifier.id.map(|id| id.to_string()),
        is_expected,
        signals: &identifier.signals,
        frames: identifier.traffic.frames,
        rate_hz: identifier.traffic.rate_hz(),
    }
}

fn travel(travel: &Travel) -> TravelJson<'_> {
    TravelJson {
        path: travel.path,
        length_m: travel.length_m(),
        even_s: travel.even_s(),
        rate: travel.rate(),
        part_s: travel.part_s,
        parts: travel.parts.iter().map(station).collect(),
    }
}

fn station(Station { pose, tool_m, is_even, .. }: &Station) -> StationJson<'_> {
    StationJson { pose, tool_m: (*tool_m).into(), is_even: *is_even }
}

fn record(record: &Examined) -> RecordJson<'_> {
    let excitation = record.excitation.as_ref().ok();
    let octaves = excitation.map_or(&[][..], |excitation| &excitation.octaves).iter();
    RecordJson {
        number: record.number,
        start_s: record.start_s,
        seconds: record.seconds,
        rate_hz: record.rate_hz,
        pose: &record.pose,
        pose_number: record.pose_number,
        travel: record.travel.as_ref().map(travel),
        repeats: record.repeats,
        rest_s: record.quiet_s,
        fault: record.excitation.as_ref().err().map(ToString::to_string),
        rms_force_n: excitation.map(|excitation| excitation.rms_force_n),
        clear: excitation.map(|excitation| excitation.share()),
        octaves: octaves
            .map(|octave| OctaveJson { band_hz: octave.band_hz, clear: octave.share() })
            .collect(),
    }
}

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::*;
    use crate::check::fixture::{config, good};

    #[test]
    fn json_has_what_the_tables_have() {
        let (config, survey) = (config(), good());
        let check = Check::new(&config, Some(&survey));
        let json: Value = serde_json::from_str(&text(&check).unwrap()).unwrap();
        assert_eq!(json["ready"], true);
        assert_eq!(json["verdict"], check.verdict());
        assert_eq!(json["findings"].as_array().unwrap().len(), check.findings.len());
        assert_eq!(json["identifiers"][0]["id"], "0x101");
        assert_eq!(json["records"][2]["pose_number"], 3);
        assert_eq!(json["records"][2]["octaves"][0]["clear"], 1.0);
        let empty = Check::new(&config, None);
        let json: Value = serde_json::from_str(&text(&empty).unwrap()).unwrap();
        assert_eq!(json["records"].as_array().unwrap().len(), 0);
    }
}
