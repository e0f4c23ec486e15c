//! The log of a service: what lasts is said once.

use std::collections::BTreeSet;

/// Writes lines, and knows which faults it has said.
pub(crate) struct Faults<'a> {
    say: &'a dyn Fn(&str),
    /// Faults that have not ended.
    said: BTreeSet<String>,
}

impl<'a> Faults<'a> {
    /// Makes a log without lines; `say` writes one.
    pub(crate) fn new(say: &'a dyn Fn(&str)) -> Self {
        Self { say, said: BTreeSet::new() }
    }

    /// Says a line.
    pub(crate) fn say(&self, line: &str) {
        (self.say)(line);
    }

    /// Says a fault, unless it was said and has not [ended](Self::end). It begins with its place.
    pub(crate) fn begin(&mut self, line: String) {
        if !self.said.contains(&line) {
            self.say(&line);
            self.said.insert(line);
        }
    }

    /// Forgets the faults of a place.
    pub(crate) fn end(&mut self, place: &str) {
        self.said.retain(|line| !line.starts_with(place));
    }
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;

    use super::*;

    #[test]
    fn a_fault_is_said_once_until_it_ends() {
        let lines = RefCell::new(Vec::new());
        let say = |line: &str| lines.borrow_mut().push(line.to_owned());
        let mut faults = Faults::new(&say);
        for _ in 0..2 {
            faults.begin("disk: full".into());
            faults.begin("mqtt: off".into());
        }
        faults.end("disk");
        faults.begin("disk: full".into());
        faults.begin("mqtt: off".into());
        assert_eq!(*lines.borrow(), ["disk: full", "mqtt: off", "disk: full"]);
    }
}
