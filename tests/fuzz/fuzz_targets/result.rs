//! Text that calls itself a result of `flexid identify --json`.
//!
//! A refusal is one line; the robot of a result that is read is predicted, or refuses its poses. The entries are those that `flexid report`
//! reads.
#![no_main]

use std::path::Path;

use flexid_report::document::Document;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    match Document::parse(Path::new("found.json"), text) {
        Ok(document) => {
            let found = &document.found;
            for pose in &found.robot.found().poses {
                let Ok(at) = found.robot.at(pose) else { continue };
                at.modes(400.0);
                at.receptance(20.0);
                if let Some(compliance) = at.compliance() {
                    at.deflection(&compliance, [100.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
                }
            }
        }
        Err(error) => assert!(!error.to_string().contains('\n'), "{error}"),
    }
});
