//! Text that calls itself a result of `flexid identify --json`.
//!
//! A refusal is one line; the robot of a result that is read is predicted, or refuses its poses, and the result has its page.
#![no_main]

use std::path::Path;

use flexid_report::document::Document;
use flexid_report::render;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    match Document::parse(Path::new("found.json"), text) {
        Ok(document) => {
            render(&document, "found.json", None);
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
