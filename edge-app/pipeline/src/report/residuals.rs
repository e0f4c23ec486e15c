//! Judgement of the residuals.

use flexid_core::identify::{Acceptance, Estimate};
use flexid_core::refine::LeftOver;
use flexid_wire::residuals::{self, Meaning, Objection};

/// Largest χ² per degree of freedom that noise and slightly wrong sensors explain. Larger residuals have another cause. Noise
/// is not the cause of residuals three times as large as the noise, and their effect on the parameters is unknown.
pub const MAX_CONSISTENCY: f64 = 10.0;

/// Size and structure of the residuals.
#[derive(Clone, Copy, Debug)]
pub(super) struct Residuals {
    /// χ² per degree of freedom.
    consistency: f64,
    /// Significance of the structure of the residuals along the band.
    whiteness: f64,
    /// Size of that structure.
    structure: f64,
    /// True if the residuals are larger than noise explains.
    pub(super) size_objects: bool,
    /// True if there is any structure.
    whiteness_objects: bool,
    /// True if the residuals are smaller than those that the noise leaves.
    pub(super) noise_too_loud: bool,
    /// True if the residuals have structure that noise does not explain and that matters.
    pub(super) structure_objects: bool,
    /// True if the residuals of the static tests are larger than their noise explains.
    statics_object: bool,
    /// True if the minimum can be believed to be the right one.
    settled: bool,
    /// True if the estimate rests on records, not on static tests alone. Only records have structure along the band.
    of_records: bool,
    /// The part of what the fit leaves that is no response to the force, if no linear model leaves so much.
    distortion: Option<f64>,
}

impl Residuals {
    /// Returns residuals as noise alone leaves them.
    #[cfg(test)]
    pub(super) fn noise(consistency: f64) -> Self {
        Self {
            consistency,
            whiteness: 0.0,
            structure: 0.0,
            size_objects: false,
            whiteness_objects: false,
            noise_too_loud: false,
            structure_objects: false,
            statics_object: false,
            settled: true,
            of_records: true,
            distortion: None,
        }
    }

    /// Returns the residuals of an estimate, of which this part is no response to the force.
    pub(super) fn of(estimate: &Estimate, distortion: Option<f64>) -> Self {
        let &Estimate {
            consistency,
            structure,
            size_objects,
            noise_too_loud,
            structure_objects,
            statics_object,
            acceptance,
            experiments,
            ..
        } = estimate;
        let settled = acceptance != Acceptance::Unsettled;
        Self {
            consistency,
            whiteness: structure.significance,
            structure: structure.largest(),
            size_objects,
            whiteness_objects: structure.is_there(),
            noise_too_loud,
            structure_objects,
            statics_object,
            settled,
            of_records: experiments > 0,
            distortion,
        }
    }

    /// Returns whether noise or slightly wrong sensors can be the cause of the residuals.
    pub(super) fn are_sane(&self) -> bool {
        (0.0..=MAX_CONSISTENCY).contains(&self.consistency)
    }

    /// Returns whether intervals are valid that are made for noise of the size of the residuals.
    pub(super) fn allow_intervals(&self) -> bool {
        self.are_sane() && self.settled && !self.statics_object
    }

    /// Scales the standard deviation that the noise causes to that of noise as large as the residuals. It never becomes
    /// smaller. Returns `None` if the result is no finite number.
    pub(super) fn inflate(&self, deviation: f64) -> Option<f64> {
        let sane = self.consistency >= 0.0;
        let inflated = self.consistency.max(1.0).sqrt() * deviation;
        Some(inflated).filter(|inflated| sane && inflated.is_finite())
    }

    pub(super) fn message(&self) -> residuals::Residuals {
        residuals::Residuals {
            consistency: self.consistency,
            whiteness: self.whiteness,
            structure: self.structure,
            size_objects: self.size_objects,
            whiteness_objects: self.whiteness_objects,
            structure_objects: self.structure_objects,
            meaning: self.meaning(),
        }
    }

    /// Returns the meaning of the residuals. The model is blamed only if the search is sure of the minimum.
    fn meaning(&self) -> Meaning {
        if !self.of_records {
            return match (self.size_objects, self.statics_object) {
                (false, false) => Meaning::StaticNoise,
                _ => Meaning::StaticMisfit,
            };
        }
        match (self.size_objects, self.structure_objects) {
            _ if self.noise_too_loud => Meaning::LoudNoise,
            (_, false) if self.statics_object => Meaning::StaticTests,
            (false, false) => Meaning::Noise,
            (true, _) if self.distortion.is_some() => Meaning::WrongModel,
            _ if !self.settled => Meaning::WrongMinimum,
            (true, false) if self.are_sane() => Meaning::NoisierCut,
            (true, _) => Meaning::WrongModel,
            (false, true) => Meaning::SmallError,
        }
    }

    /// Returns the objection of the residuals. An objection of the static tests has a warning of its own.
    pub(super) fn objection(&self) -> Option<Objection> {
        let Self { consistency, structure, .. } = *self;
        if !self.of_records {
            let misfit = self.size_objects && !self.statics_object;
            return misfit.then_some(Objection::StaticMisfit { consistency });
        }
        if let Some(part) = self.distortion.filter(|_| self.size_objects && !self.noise_too_loud) {
            return Some(Objection::Distortion { consistency, part });
        }
        match (self.size_objects, self.structure_objects) {
            _ if self.noise_too_loud => Some(Objection::LoudNoise { consistency }),
            (false, false) => None,
            (true, false) if self.statics_object => None,
            _ if !self.settled => {
                let structure = Some(structure).filter(|_| self.whiteness_objects);
                Some(Objection::WrongMinimum { consistency, structure })
            }
            (true, _) if !self.are_sane() => Some(Objection::WrongModel { consistency }),
            (true, true) => Some(Objection::SlightlyWrongModel { consistency }),
            (true, false) => Some(Objection::NoisierCut { consistency }),
            (false, true) => Some(Objection::Structure { structure }),
        }
    }
}

/// Returns the part of what a fit leaves that is no response to the force, if no linear model leaves so much.
pub(crate) fn distortion(left_over: &[LeftOver]) -> Option<f64> {
    left_over.iter().find_map(|one| match *one {
        LeftOver::Distortion { part } => Some(part),
        _ => None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(residuals: &Residuals) -> String {
        residuals.message().to_string()
    }

    fn advised(residuals: &Residuals) -> Option<String> {
        residuals.objection().map(|objection| objection.to_string())
    }

    fn residuals(
        [consistency, structure]: [f64; 2],
        [size_objects, structure_objects, statics_object]: [bool; 3],
    ) -> Residuals {
        let (settled, of_records) = (true, true);
        Residuals {
            consistency,
            whiteness: if structure_objects { 8.0 } else { 0.5 },
            structure,
            size_objects,
            whiteness_objects: structure_objects,
            noise_too_loud: false,
            structure_objects,
            statics_object,
            settled,
            of_records,
            distortion: None,
        }
    }

    /// Residuals that are no response to the force are no matter of the minimum.
    #[test]
    fn what_no_linear_model_explains_is_named() {
        for settled in [true, false] {
            let bent = Residuals {
                settled,
                distortion: Some(0.3),
                ..residuals([84.2, 1.2], [true, true, false])
            };
            assert!(said(&bent).ends_with(": the model is wrong"), "{}", said(&bent));
            let advice = advised(&bent).unwrap();
            assert!(advice.contains("no linear model") && advice.len() <= 160, "{advice}");
        }
        let explained = Residuals { distortion: Some(0.3), ..Residuals::noise(1.0) };
        assert_eq!(advised(&explained), None);
    }

    /// Without records the words do not mention cuts, sensors or structure along the band.
    #[test]
    fn static_tests_alone_have_words_of_their_own() {
        let alone =
            |objections| Residuals { of_records: false, ..residuals([3.2, 0.0], objections) };
        let cases = [
            ([false; 3], "noise explains those of the static tests (χ²/dof 3.20)", None),
            (
                [true, false, false],
                "χ²/dof 3.20 objects: the static tests do not fit",
                Some("[static]"),
            ),
            // A warning of its own gives the advice.
            ([true, false, true], "χ²/dof 3.20 objects: the static tests do not fit", None),
        ];
        for (objections, words, advice) in cases {
            let alone = alone(objections);
            assert_eq!(said(&alone), words);
            match (advised(&alone), advice) {
                (None, None) => {}
                (Some(given), Some(advice)) => {
                    assert!(given.contains(advice) && given.len() <= 160, "{given}");
                    assert!(!given.contains("cut") && !given.contains("sensors"), "{given}");
                }
                other => panic!("{objections:?}: {other:?}"),
            }
        }
    }

    #[test]
    fn each_objection_has_its_words_and_its_advice() {
        let nan = f64::NAN;
        let cases = [
            ([1.01, 0.02], [false; 3], "noise explains them (χ²/dof 1.01)", None),
            (
                [2.1, 0.02],
                [true, false, false],
                "χ²/dof 2.10 objects, structure does not",
                Some("noisier in the cut"),
            ),
            (
                [1.1, 0.14],
                [false, true, false],
                "structure 14 % objects, χ²/dof 1.10 does not",
                Some("small, but not"),
            ),
            (
                [2.1, 0.14],
                [true, true, false],
                "χ²/dof 2.10 and structure 14 % object: ",
                Some("state in [accuracy] what"),
            ),
            (
                [84.2, 1.2],
                [true, true, false],
                "χ²/dof 84.20 and structure 120 % object: ",
                Some("check masses, TCP, [mounting]"),
            ),
            (
                [nan, nan],
                [true, true, false],
                "χ²/dof NaN and structure NaN % object",
                Some("check masses, TCP"),
            ),
            (
                [f64::INFINITY, 0.0],
                [true, false, false],
                "χ²/dof inf objects, ",
                Some("check masses, TCP"),
            ),
            // The sensors in the cut do not cause residuals of static tests.
            ([1.14, 0.02], [false, false, true], "static tests object (χ²/dof 1.14)", None),
            ([2.1, 0.02], [true, false, true], "static tests object (χ²/dof 2.10)", None),
            ([84.2, 0.02], [true, false, true], "static tests object (χ²/dof 84.20)", None),
            (
                [2.1, 0.14],
                [true; 3],
                "χ²/dof 2.10 and structure 14 % object: ",
                Some("state in [accuracy] what"),
            ),
        ];
        for (numbers, objections, words, advice) in cases {
            let residuals = residuals(numbers, objections);
            let line = said(&residuals);
            assert!(line.starts_with(words), "{line}");
            match (advised(&residuals), advice) {
                (None, None) => {}
                (Some(given), Some(advice)) => {
                    assert!(given.contains(advice) && given.len() <= 160, "{given}");
                    assert!(!given.contains("regions far"), "{given}");
                }
                other => panic!("{numbers:?}: {other:?}"),
            }
        }
    }

    #[test]
    fn noise_that_is_too_loud_is_named() {
        let loud = Residuals { noise_too_loud: true, settled: false, ..Residuals::noise(0.02) };
        assert_eq!(said(&loud), "χ²/dof 0.02 objects: the noise is taken for louder than it is");
        let advice = advised(&loud).unwrap();
        assert!(advice.contains("(χ²/dof 0.02): no quiet stretch") && advice.len() <= 160);
        assert!(!loud.allow_intervals());
    }

    #[test]
    fn the_model_is_not_blamed_for_a_search_that_is_not_sure() {
        for numbers in [[84.2, 1.2], [2.1, 0.14], [f64::NAN, f64::NAN]] {
            for objections in [
                [true, true, false],
                [true, false, false],
                [false, true, false],
                [true, true, true],
            ] {
                let unsure = Residuals { settled: false, ..residuals(numbers, objections) };
                let words = said(&unsure);
                assert!(words.ends_with("the minimum may be a wrong one"), "{words}");
                let advice = advised(&unsure).unwrap();
                assert!(advice.starts_with("residuals of that minimum object"), "{advice}");
                assert!(!(words + &advice).contains("model"), "{advice}");
            }
        }
    }

    #[test]
    fn no_interval_where_noise_is_not_the_cause() {
        for (consistency, allowed) in
            [(0.9, true), (9.9, true), (10.1, false), (f64::NAN, false), (-1.0, false)]
        {
            let residuals = residuals([consistency, 0.0], [true, false, false]);
            assert_eq!(residuals.allow_intervals(), allowed, "{consistency}");
        }
        // There is no interval either where another minimum may be the right one, or where static tests contradict this one.
        assert!(!Residuals { settled: false, ..Residuals::noise(1.0) }.allow_intervals());
        assert!(!Residuals { statics_object: true, ..Residuals::noise(1.0) }.allow_intervals());
        let inflate =
            |consistency, deviation| residuals([consistency, 0.0], [false; 3]).inflate(deviation);
        assert_eq!([inflate(0.5, 0.1), inflate(4.0, 0.1)], [Some(0.1), Some(0.2)]);
        assert_eq!([inflate(f64::NAN, 0.1), inflate(1.0, f64::INFINITY)], [None; 2]);
    }
}
