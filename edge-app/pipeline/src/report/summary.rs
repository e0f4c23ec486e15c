//! Summary of a report in a few lines.

use std::fmt;

use flexid_wire::report::{Acceptance, Report, Verdict};

use crate::text::count;

/// Prints the result of the fit on one line, the number of parameters with each verdict on a second, then each warning.
#[derive(Clone, Copy, Debug)]
pub struct Summary<'a>(pub &'a Report);

impl Summary<'_> {
    /// Returns the result of the fit and the numbers of the verdicts on one line.
    pub fn line(&self) -> String {
        self.to_string().lines().take(2).collect::<Vec<_>>().join("; ")
    }
}

impl fmt::Display for Summary<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Report { joints, fit, warnings } = self.0;
        let accepted = match fit.acceptance {
            Acceptance::Consistent => "consistent",
            Acceptance::ModelSuspect => "MODEL SUSPECT",
            Acceptance::Unsettled => "not settled",
        };
        write!(f, "{accepted}: χ²/dof {:.3}", fit.consistency)?;
        if fit.records == 0 && fit.frames == 0 {
            writeln!(f, "; static tests alone; {:.1} s", fit.seconds)?;
        } else {
            if fit.records > 0 {
                write!(f, ", SSP {:.1e} (worst {:.1e})", fit.ssp, fit.ssp_max)?;
            }
            writeln!(
                f,
                "; {}, {}, {} lost; {:.1} s",
                count(fit.records, "record"),
                count(fit.frames, "frame"),
                fit.frames_lost,
                fit.seconds
            )?;
        }
        // Static tests determine no damping.
        let (all, dampings) = match fit.records {
            0 => ("stiffnesses", 0),
            _ => ("parameters", 6),
        };
        let verdicts = || {
            joints.iter().flat_map(|joint| {
                joint.stiffness_verdict.iter().chain(&joint.damping_verdict[..dampings])
            })
        };
        let of = |wanted| verdicts().filter(|verdict| **verdict == wanted).count();
        write!(
            f,
            "{} of {} {all} identified, {} weak, {} not observable",
            of(Verdict::Identified),
            verdicts().count(),
            of(Verdict::Weak),
            of(Verdict::NotObservable)
        )?;
        match of(Verdict::Fixed) {
            0 => writeln!(f)?,
            fixed => writeln!(f, ", {fixed} fixed")?,
        }
        warnings.iter().try_for_each(|warning| writeln!(f, "warning: {warning}"))
    }
}

#[cfg(test)]
mod tests {
    use flexid_wire::report::{Fit, FoundBy, JointReport};
    use flexid_wire::text::clipped;
    use flexid_wire::warning::Warning;

    use super::*;

    fn report() -> Report {
        let joint = JointReport {
            name: clipped("joint_1"),
            stiffness: [1e7; 6],
            stiffness_std: [Some(1e4); 6],
            stiffness_verdict: [Verdict::Identified; 6],
            damping: [1e3; 6],
            damping_std: [Some(1e2), Some(1e2), None, None, None, None],
            damping_verdict: std::array::from_fn(|dof| {
                if dof < 2 { Verdict::Weak } else { Verdict::NotObservable }
            }),
        };
        let fit = Fit {
            records: 3,
            frames: 6000,
            frames_lost: 2,
            ssp: 0.001,
            ssp_max: 0.02,
            consistency: 1.0,
            search_evaluations: 2000,
            refine_iterations: 1,
            starts: 1,
            bridged: 2,
            seconds: 1.25,
            acceptance: Acceptance::Consistent,
            found_by: FoundBy::Descent,
            random_searches: 0,
            branches: 1,
        };
        let warnings = [Warning::BusErrors { errors: 2 }].into_iter().collect();
        Report { joints: [joint].into_iter().collect(), fit, warnings }
    }

    #[test]
    fn tells_the_fit_the_verdicts_and_the_warnings() {
        let mut report = report();
        assert_eq!(
            Summary(&report).to_string(),
            "consistent: χ²/dof 1.000, SSP 1.0e-3 (worst 2.0e-2); 3 records, 6000 frames, 2 lost; 1.2 s\n\
             6 of 12 parameters identified, 2 weak, 4 not observable\nwarning: the bus reported 2 errors\n"
        );
        let line = Summary(&report).line();
        assert!(line.starts_with("consistent: χ²/dof 1.000"), "{line}");
        assert!(line.ends_with("1.2 s; 6 of 12 parameters identified, 2 weak, 4 not observable"));
        (report.fit.records, report.fit.frames) = (0, 0);
        let text = Summary(&report).to_string();
        let first = "consistent: χ²/dof 1.000; static tests alone; 1.2 s\n";
        assert!(text.starts_with(first), "{text}");
        assert!(
            text.contains("\n6 of 6 stiffnesses identified, 0 weak, 0 not observable\n"),
            "{text}"
        );
        report.fit.records = 3;
        report.joints[0].damping_verdict[0] = Verdict::Fixed;
        let text = Summary(&report).to_string();
        assert!(text.contains("identified, 1 weak, 4 not observable, 1 fixed\n"), "{text}");
    }
}
