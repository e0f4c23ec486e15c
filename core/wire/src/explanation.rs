//! Explanations of the misfit of a perfect plant, and the accuracies that the data contradict.

use core::fmt;

use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::accuracy::Accuracy;
use crate::nuisance::{MAX_NUISANCES, Nuisance, Unit};
use crate::text::Label;
use crate::words::{Enumeration, Measured};

/// Largest number of explanations of a report.
pub const MAX_EXPLANATIONS: usize = 6;
/// Largest number of rivals of an explanation.
pub const MAX_RIVALS: usize = 4;
/// Standard deviations beyond which an error is not zero: a normal distribution exceeds them once in twenty.
const SIGNIFICANT: f64 = 2.0;

/// An error of the robot: a true value less the stated one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Deviation {
    /// Its entry of `[accuracy]`.
    pub entry: Accuracy,
    /// Name of the error, for example `TCP z`.
    pub name: Label,
    /// Unit of the three numbers; empty for a part, of which 0.01 is 1 %.
    pub unit: Unit,
    /// Most likely value. Of a natural or corner frequency it is the frequency itself.
    pub value: f64,
    /// Standard deviation of the value; `None` if the fit gives no finite number.
    pub std: Option<f64>,
    /// The entry of `[accuracy]`, one standard deviation.
    pub accuracy: f64,
}

/// A kind of deviation that explains the records.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Explanation {
    /// The largest of its kind. Its value is that where this entry is wrong and the others are right.
    pub deviation: Deviation,
    /// By how many times its accuracy the kind is off, at least 1.
    pub times: f64,
    /// Share of the misfit of a perfect plant that the kind explains by itself, 0 to 1. Shares of several kinds may overlap.
    pub share: f64,
    /// By how much −2 ln of the evidence falls if this accuracy is wrong: above 2 the data speak against the accuracy, above 10 very
    /// strongly (Kass and Raftery, "Bayes factors", 1995). Zero if they do not.
    pub evidence: f64,
    /// True if the estimate rests on it.
    pub adopted: bool,
    /// The largest of each other kind that explains the records as well in the place of this one, the most likely first.
    pub rivals: Vec<Deviation, MAX_RIVALS>,
}

/// Other deviations that explain the records as well.
pub struct Rivals<'a>(&'a [Deviation]);

/// Others of the same kind that are off as well.
pub struct Alike(Vec<Deviation, MAX_NUISANCES>);

/// Mend for a contradicted accuracy.
pub struct Remedy(pub(crate) Accuracy);

impl Explanation {
    /// Returns whether the data speak against the stated accuracy.
    pub fn is_contradicted(&self) -> bool {
        self.evidence > 0.0
    }

    /// The rivals, if there are any.
    pub fn alternatives(&self) -> Option<Rivals<'_>> {
        (!self.rivals.is_empty()).then_some(Rivals(&self.rivals))
    }

    /// The other errors of this kind that the data show, if there are any: those among the `nuisances` of its report that are larger than their
    /// accuracy and than two of their standard deviations. An error in another unit cannot be compared with the accuracy, and is left out: the
    /// entry of a compliance also speaks of its damping.
    pub fn alike(&self, nuisances: &[Nuisance]) -> Option<Alike> {
        let Deviation { entry, accuracy, name, unit, .. } = &self.deviation;
        let is_of_kind = |own: &&Nuisance| own.entry == Some(*entry) && own.unit == *unit;
        let of_kind = nuisances.iter().filter(is_of_kind).filter(|own| own.name != *name);
        let deviations = of_kind.map(|own| Deviation {
            entry: *entry,
            name: own.name.clone(),
            unit: own.unit.clone(),
            value: if entry.is_factor() { own.value - 1.0 } else { own.value },
            std: own.std,
            accuracy: *accuracy,
        });
        let is_shown = |own: &Deviation| {
            let size = own.value.abs();
            size > *accuracy && own.std.is_some_and(|std| size > SIGNIFICANT * std)
        };
        let alike: Vec<Deviation, MAX_NUISANCES> = deviations.filter(is_shown).collect();
        (!alike.is_empty()).then_some(Alike(alike))
    }

    /// The mend, if the accuracy is contradicted.
    pub fn remedy(&self) -> Option<Remedy> {
        self.is_contradicted().then_some(Remedy(self.deviation.entry))
    }
}

/// For example `TCP z 3.12 ± 0.05 mm`.
impl fmt::Display for Deviation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, unit, value, std, .. } = self;
        write!(f, "{name} {}", Measured { value: *value, std: *std, unit })
    }
}

impl Deviation {
    /// Its accuracy, for example `its accuracy (tcp_m, 1.00 mm)`.
    pub(crate) fn stated(&self) -> Stated<'_> {
        Stated(self)
    }
}

/// The accuracy of a deviation.
pub(crate) struct Stated<'a>(&'a Deviation);

impl fmt::Display for Stated<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Deviation { entry, unit, accuracy, .. } = self.0;
        let accuracy = Measured { value: *accuracy, std: None, unit };
        write!(f, "its accuracy ({}, {accuracy})", entry.key())
    }
}

/// For example `TCP z 3.12 ± 0.05 mm explains 97 % of the misfit: 3.1 times its accuracy (tcp_m, 1.00 mm)`.
impl fmt::Display for Explanation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { deviation, times, share, adopted, .. } = self;
        write!(f, "{deviation} explains {:.0} % of the misfit: ", 100.0 * share)?;
        if *adopted {
            f.write_str("adopted, ")?;
        }
        if self.is_contradicted() {
            write!(f, "{times:.1} times")?;
        } else {
            f.write_str("allowed by")?;
        }
        write!(f, " {}", deviation.stated())
    }
}

/// For example `as likely: force sensor gain z 2.1 ± 0.2 %`.
impl fmt::Display for Rivals<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("as likely: ")?;
        Enumeration { named: self.0, more: 0 }.fmt(f)
    }
}

/// For example `off as well: force sensor gain y 5.1 ± 0.2 % and force sensor gain z 4.9 ± 0.2 %`.
impl fmt::Display for Alike {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("off as well: ")?;
        Enumeration { named: &self.0, more: 0 }.fmt(f)
    }
}

/// For example `measure the TCP and correct it in the model, or state tcp_m as it is`.
impl fmt::Display for Remedy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, or state {} as it is", self.0.advice(), self.0.key())
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::string::ToString;

    use super::*;
    use crate::report::Verdict;
    use crate::text::clipped;

    fn tcp() -> Deviation {
        Deviation {
            entry: Accuracy::TcpM,
            name: clipped("TCP z"),
            unit: clipped("m"),
            value: 3.124e-3,
            std: Some(5.2e-5),
            accuracy: 1e-3,
        }
    }

    #[test]
    fn an_explanation_says_what_how_much_and_what_to_do() {
        let gain = Deviation {
            entry: Accuracy::ForceGain,
            name: clipped("force sensor gain z"),
            unit: clipped(""),
            value: 0.0213,
            std: Some(1.6e-4),
            accuracy: 5e-3,
        };
        let within = Explanation {
            deviation: tcp(),
            times: 1.0,
            share: 0.974,
            evidence: 0.0,
            adopted: false,
            rivals: Vec::new(),
        };
        assert_eq!(
            within.to_string(),
            "TCP z 3.12 ± 0.05 mm explains 97 % of the misfit: allowed by its accuracy (tcp_m, 1.00 mm)"
        );
        assert!(within.alternatives().is_none() && within.remedy().is_none());
        let rivals = [gain.clone(), tcp()].into_iter().collect();
        let contradicted = Explanation { times: 3.12, evidence: 20.0, rivals, ..within };
        assert_eq!(
            contradicted.to_string(),
            "TCP z 3.12 ± 0.05 mm explains 97 % of the misfit: 3.1 times its accuracy (tcp_m, 1.00 mm)"
        );
        assert_eq!(
            contradicted.alternatives().unwrap().to_string(),
            "as likely: force sensor gain z 2.13 ± 0.02 % and TCP z 3.12 ± 0.05 mm"
        );
        assert_eq!(
            contradicted.remedy().unwrap().to_string(),
            "measure the TCP and correct it in the model, or state tcp_m as it is"
        );
        let nuisance = |name, entry, value, std| Nuisance {
            name: clipped(name),
            entry: Some(entry),
            accuracy: None,
            unit: clipped(""),
            value,
            std: Some(std),
            interval: None,
            verdict: Verdict::Identified,
        };
        let nuisances = [
            nuisance("force sensor gain x", Accuracy::ForceGain, 1.051, 2e-3),
            nuisance("force sensor gain y", Accuracy::ForceGain, 0.953, 2e-3),
            nuisance("force sensor gain z", Accuracy::ForceGain, 1.0213, 1.6e-4),
            nuisance("accelerometer gain x", Accuracy::AccelerationGain, 1.05, 2e-3),
        ];
        let of_gains = Explanation { deviation: gain.clone(), ..contradicted.clone() };
        let alike = of_gains.alike(&nuisances).unwrap().to_string();
        assert_eq!(
            alike,
            "off as well: force sensor gain x 5.1 ± 0.2 % and force sensor gain y -4.7 ± 0.2 %"
        );
        let [within, unsure] = [(1.004, 1e-4), (1.05, 0.03)];
        for (value, std) in [within, unsure] {
            let one = nuisance("force sensor gain x", Accuracy::ForceGain, value, std);
            assert!(of_gains.alike(&[one]).is_none());
        }
        let adopted = Explanation { adopted: true, ..contradicted };
        assert!(adopted.to_string().contains("misfit: adopted, 3.1 times its accuracy (tcp_m"));
    }

    /// A compliance and its damping have one entry, and two units.
    #[test]
    fn errors_of_another_unit_are_not_alike() {
        let entry = Accuracy::GroundMPerN;
        let ground = Explanation {
            deviation: Deviation {
                entry,
                name: clipped("ground tx"),
                unit: clipped("m/N"),
                value: 5e-9,
                std: Some(1e-10),
                accuracy: 5e-10,
            },
            times: 10.0,
            share: 0.9,
            evidence: 20.0,
            adopted: false,
            rivals: Vec::new(),
        };
        let nuisance = |name, unit, value, std| Nuisance {
            name: clipped(name),
            entry: Some(entry),
            accuracy: None,
            unit: clipped(unit),
            value,
            std: Some(std),
            interval: None,
            verdict: Verdict::Identified,
        };
        let damping = nuisance("damping of ground tx", "m s/N", 1e-7, 1e-9);
        assert!(ground.alike(core::slice::from_ref(&damping)).is_none());
        let other = nuisance("ground ty", "m/N", 4e-9, 1e-10);
        let alike = ground.alike(&[damping, other]).unwrap().to_string();
        assert!(alike.starts_with("off as well: ground ty ") && !alike.contains("damping"));
    }
}
