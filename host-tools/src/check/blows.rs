//! Judges the blows of a hammer: those that are cut off, those that come twice, and what friction makes of all of them.

use flexid_pipeline::check::{Blows, Examined, Survey};

use super::Severity::{Doubtful, Note};
use super::words::records;
use super::{Finding, sensors};

const ABOUT: &str = "blows";
/// Topic of the finding that friction may hold the joints.
pub(super) const FRICTION: &str = "friction";

/// Judges the blows of a survey.
pub(super) fn judge(survey: &Survey) -> Vec<Finding> {
    let all = || survey.usable().filter_map(|record| Some((record, record.blows.as_ref()?)));
    let numbers = |is: &dyn Fn(&Blows) -> bool| -> Vec<u64> {
        all().filter(|(_, blows)| is(blows)).map(|(Examined { number, .. }, _)| *number).collect()
    };
    let mut findings = Vec::new();
    let cut_off = numbers(&|blows| blows.cut_off_n.is_some());
    if let Some(end_n) = all().filter_map(|(_, blows)| blows.cut_off_n).reduce(f32::max) {
        let finding = format!(
            "overload: {} cut off at {end_n:.0} N",
            of_records(&cut_off, "a blow", "blows")
        );
        let mend = "raise the range of the hammer's channel or strike softer, and leave these out";
        findings.push(Finding::new(Doubtful, sensors::ABOUT, finding, mend));
    }
    let double = numbers(&|blows| blows.rebound_s().is_some());
    if let Some(shortest_s) = all().filter_map(|(_, blows)| blows.rebound_s()).reduce(f64::min) {
        let hits = of_records(&double, "a double hit", "double hits");
        let finding = format!("{hits}, {:.0} ms apart", 1e3 * shortest_s);
        let mend = "used as measured; a single blow shows more of the band";
        findings.push(Finding::new(Note, ABOUT, finding, mend));
    }
    let several = numbers(&|blows| blows.peaks_s.len() > 1 && blows.rebound_s().is_none());
    if !several.is_empty() {
        let finding = format!("{} with several blows", records(&several));
        let mend = "used as measured; a record's length between two blows makes a record of each";
        findings.push(Finding::new(Note, ABOUT, finding, mend));
    }
    if all().next().is_some() {
        let finding = "blows may not break the joints loose: where friction holds them, the robot is stiffer than in a cut";
        let mend = "compare with harder blows, or with a cut";
        findings.push(Finding::new(Note, FRICTION, finding, mend));
    }
    findings
}

/// `a double hit in record 2`, or `double hits in records 2 and 3`.
fn of_records(numbers: &[u64], one: &str, many: &str) -> String {
    let what = if numbers.len() == 1 { one } else { many };
    format!("{what} in {}", records(numbers))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::fixture::good;

    fn found(blows: [(&[f64], Option<f32>); 3]) -> Vec<String> {
        let mut survey = good();
        for (record, (peaks_s, cut_off_n)) in survey.records.iter_mut().zip(blows) {
            record.blows = Some(Blows { peaks_s: peaks_s.to_vec(), cut_off_n });
        }
        judge(&survey).into_iter().map(|own| own.finding).collect()
    }

    #[test]
    fn double_hits_overloads_and_several_blows_are_named() {
        assert_eq!(judge(&good()), []);
        let clean = found([(&[0.2], None); 3]);
        assert!(clean.len() == 1 && clean[0].starts_with("blows may not break"), "{clean:?}");
        let all = found([(&[0.2, 0.235], None), (&[0.2], Some(499.6)), (&[0.2, 2.2], None)]);
        assert_eq!(
            all[..3],
            [
                "overload: a blow in record 2 cut off at 500 N",
                "a double hit in record 1, 35 ms apart",
                "record 3 with several blows"
            ]
        );
    }
}
