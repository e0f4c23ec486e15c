//! What the residuals say of the model, and what to do about it.

use flexid_core::identify::Estimate;
use flexid_wire::confidence;
use flexid_wire::text::clipped;

/// χ² per degree of freedom up to which sensors may be at fault that are a little off; what makes more is something else.
/// Residuals three times the noise have no noise for their cause, and nobody knows how far they move the parameters.
const HUGE: f64 = 10.0;

/// Size and structure of what is left between model and measurement.
#[derive(Clone, Copy, Debug)]
pub(super) struct Residuals {
    /// χ² per degree of freedom.
    consistency: f64,
    /// About N(0, 1) if the model is right.
    whiteness: f64,
    /// They are larger than noise explains.
    pub(super) size_objects: bool,
    /// They have more structure than noise explains.
    whiteness_objects: bool,
}

impl Residuals {
    pub(super) fn of(estimate: &Estimate) -> Self {
        let &Estimate { consistency, whiteness, size_objects, whiteness_objects, .. } = estimate;
        Self { consistency, whiteness, size_objects, whiteness_objects }
    }

    /// Whether intervals made of noise of their size say anything of the parameters.
    pub(super) fn allow_intervals(&self) -> bool {
        (0.0..=HUGE).contains(&self.consistency)
    }

    /// By this much standard deviations are larger than the noise makes them.
    pub(super) fn inflation(&self) -> f64 {
        self.consistency.max(1.0).sqrt()
    }

    pub(super) fn message(&self) -> confidence::Residuals {
        confidence::Residuals {
            whiteness: self.whiteness,
            size_objects: self.size_objects,
            whiteness_objects: self.whiteness_objects,
            text: clipped(self.words()),
        }
    }

    /// Which of the two objects, and what that means.
    fn words(&self) -> String {
        let size = format!("χ²/dof {:.2}", self.consistency);
        let whiteness = format!("whiteness {:.1}", self.whiteness);
        match (self.size_objects, self.whiteness_objects) {
            (false, false) => format!("noise explains them ({size}, {whiteness})"),
            (true, true) => format!("{size} and {whiteness} object: the model is wrong"),
            (true, false) if self.allow_intervals() => {
                format!("{size} objects, {whiteness} does not: more noise than at rest")
            }
            (true, false) => format!("{size} objects, {whiteness} does not: the model is wrong"),
            (false, true) => format!(
                "{whiteness} objects, {size} does not: a small error of the model, or coloured noise"
            ),
        }
    }

    /// What to look at, if they object.
    pub(super) fn advice(&self) -> Option<String> {
        let Self { consistency, whiteness, .. } = self;
        match (self.size_objects, self.whiteness_objects) {
            (false, false) => None,
            (true, _) if !self.allow_intervals() => Some(format!(
                "the model is wrong (chi^2/dof {consistency:.0}): check masses, TCP, joint angles, axes and units of \
                 the signals, then gravity, delay, gains"
            )),
            (true, true) => Some(format!(
                "the model is wrong by a little (chi^2/dof {consistency:.1}): let [calibration] find delay, \
                 gains, mounting and masses; if that does not help, check gravity, TCP"
            )),
            (true, false) => Some(format!(
                "residuals are larger than the noise, but random (chi^2/dof {consistency:.1}): the sensors are \
                 noisier in the cut than at rest"
            )),
            (false, true) => Some(format!(
                "residuals are small, but not random (whiteness {whiteness:.0}): let [calibration] find delay, gains \
                 and mounting; if that does not help, check gravity, filters"
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn residuals(consistency: f64, size_objects: bool) -> Residuals {
        Residuals { consistency, whiteness: 0.0, size_objects, whiteness_objects: false }
    }

    #[test]
    fn each_objection_has_its_words_and_its_advice() {
        let nan = f64::NAN;
        let cases = [
            ([1.01, 0.4], [false; 2], "noise explains them (χ²/dof 1.01, whiteness 0.4)", None),
            (
                [2.1, 0.4],
                [true, false],
                "χ²/dof 2.10 objects, whiteness 0.4 does not",
                Some("noisier in the cut"),
            ),
            (
                [1.1, 9.0],
                [false, true],
                "whiteness 9.0 objects, χ²/dof 1.10 does not",
                Some("small, but not"),
            ),
            (
                [2.1, 9.0],
                [true; 2],
                "χ²/dof 2.10 and whiteness 9.0 object: ",
                Some("let [calibration] find delay"),
            ),
            (
                [84.2, 99.0],
                [true; 2],
                "χ²/dof 84.20 and whiteness 99.0 object: ",
                Some("check masses, TCP"),
            ),
            (
                [nan, nan],
                [true; 2],
                "χ²/dof NaN and whiteness NaN object",
                Some("check masses, TCP"),
            ),
            (
                [f64::INFINITY, 0.0],
                [true, false],
                "χ²/dof inf objects, ",
                Some("check masses, TCP"),
            ),
        ];
        for ([consistency, whiteness], [size_objects, whiteness_objects], words, advice) in cases {
            let residuals = Residuals { consistency, whiteness, size_objects, whiteness_objects };
            assert!(residuals.words().starts_with(words), "{}", residuals.words());
            match (residuals.advice(), advice) {
                (None, None) => {}
                (Some(given), Some(advice)) => {
                    assert!(given.contains(advice) && given.len() <= 160, "{given}");
                    assert!(!given.contains("more poses"), "{given}");
                }
                other => panic!("{consistency}, {whiteness}: {other:?}"),
            }
        }
    }

    #[test]
    fn no_interval_where_noise_is_not_the_cause() {
        for (consistency, allowed) in
            [(0.9, true), (9.9, true), (10.1, false), (f64::NAN, false), (-1.0, false)]
        {
            assert_eq!(residuals(consistency, true).allow_intervals(), allowed, "{consistency}");
        }
        assert_eq!(residuals(0.5, false).inflation(), 1.0);
        assert_eq!(residuals(4.0, true).inflation(), 2.0);
    }
}
