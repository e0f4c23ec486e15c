//! The answer of a finding in lines: stiffness of the tool, lowest mode, drives, and where they hold.

use flexid_wire::answer::Answer;

use super::confidence::INDENT;

/// The lines, each with its name before it.
pub(crate) fn lines(answer: &Answer) -> Vec<String> {
    let parts = answer.parts().map(|(name, part)| format!("{name:INDENT$}{part}"));
    let place = format!("{:INDENT$}95 % intervals, {}", "", answer.place());
    parts.into_iter().chain([place]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::show::page::tests::answer;

    #[test]
    fn each_part_has_its_line() {
        assert_eq!(
            lines(&answer(2)),
            [
                "tool         softest 0.381 N/µm (±2.0 %) along 0.71 0.02 -0.70, stiffest 0.870 N/µm (±2.0 %) along 0.00 1.00 0.03; static",
                "lowest mode  6.33 Hz (±2.0 %), damping 1.10 % (1.08 to 1.12 %)",
                "drives       joint_1 2.31 MNm/rad (±2.0 %), joint_2 not determined",
                "             95 % intervals, at the pose of record 3, the newest: 0.10 -0.45 0.95; directions in the axes of the TCP",
            ]
        );
    }
}
