//! The demo.

use std::io::{BufRead as _, BufReader};
use std::process::{Command, Stdio};

use crate::setup::{DEMO, stderr};

#[test]
fn the_demo_reports_wrong_usage_in_one_line() {
    let output = Command::new(DEMO).args(["--truth", "me"]).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    let errors = stderr(&output);
    assert!(errors.starts_with("flexid-demo: ") && errors.contains("drawn:SEED"), "{errors}");
    assert_eq!(errors.lines().count(), 1, "{errors}");
}

#[test]
fn the_demo_says_which_bus_it_took_and_then_only_news() {
    let mut demo = Command::new(DEMO).stdout(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(demo.stdout.take().unwrap()).lines();
    let [bus, news] = [(); 2].map(|()| lines.next().unwrap().unwrap());
    demo.kill().unwrap();
    demo.wait().unwrap();
    let pair = "bus: a socket pair that carries the same CAN frames (";
    let vcan = "bus: vcan0, a virtual CAN bus in a network namespace of its own";
    let reason = bus.strip_prefix(pair).and_then(|rest| rest.strip_suffix(')'));
    assert!(bus == vcan || reason.is_some(), "{bus}");
    assert!(!bus.contains("Error") && !bus.contains("RTNETLINK"), "{bus}");
    assert!(news.starts_with("waiting for "), "{news}");
}
