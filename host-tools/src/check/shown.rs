//! Judges what the records show of the parameters: how many of these a fit can identify from them, if it finds the right minimum.
//!
//! One measure stands for the variety of poses and paths, the excitation, and the noise: the information of the records about a robot in the middle of
//! its bounds, as `flexid plan` predicts it of cuts to come. Nothing counts poses.

use flexid_pipeline::check::Survey;
use flexid_pipeline::config::Config;

use super::Finding;
use super::Severity::{Doubtful, Note};
use crate::plan::greedy::Criterion;
use crate::plan::parameters;
use crate::plan::prediction::Prediction;

const ABOUT: &str = "variety";

/// Judges the information of a survey. Doubtful where at most half of the parameters show. Chosen: their median is then not identified.
pub(super) fn judge(config: &Config, survey: &Survey) -> Option<Finding> {
    survey.usable().next()?;
    // A survey does not count modal tests.
    if !config.receptances.is_empty() {
        return None;
    }
    let information = survey.shown.as_ref()?;
    let count = parameters(&config.sought);
    let uncertainty = Criterion::D.uncertainty(information, count);
    let Prediction { identified, .. } =
        Prediction::new(&config.model, &config.sought, information, uncertainty);
    let finding = format!(
        "the records show {identified} of {count} parameters to 5 % or better (of a robot in the middle of its bounds)"
    );
    if identified == count {
        return Some(Finding::right(ABOUT, finding));
    }
    let severity = if 2 * identified <= count { Doubtful } else { Note };
    let mend = "mill in regions far from these, along paths (`flexid plan --cuts` judges them) or in poses that `flexid plan` proposes, and sweep the spindle's speed";
    Some(Finding::new(severity, ABOUT, finding, mend))
}

#[cfg(test)]
mod tests {
    use flexid_core::refine::Information;

    use super::*;
    use crate::check::Severity::Right;
    use crate::check::fixture::{config, empty, good};

    #[test]
    fn records_are_judged_by_the_parameters_that_they_show() {
        let (config, mut survey) = (config(), good());
        assert_eq!(judge(&config, &survey), None, "nobody asked");
        for (known, severity) in [(36, Right), (19, Note), (18, Doubtful)] {
            let mut shown = Information::none(config.sought.unknowns());
            (0..36).for_each(|unknown| {
                shown.add_known(unknown, if unknown < known { 0.01 } else { 0.2 });
            });
            survey.shown = Some(shown);
            let finding = judge(&config, &survey).unwrap();
            assert_eq!(finding.severity, severity, "{}", finding.finding);
            assert!(finding.finding.starts_with(&format!("the records show {known} of 36 ")));
        }
        assert_eq!(judge(&config, &empty()), None);
    }
}
