//! Text that calls itself a table of Denavit-Hartenberg parameters, in CSV or TOML.
//!
//! A refusal has a message; a model that is imported is written and read again as itself.
#![no_main]

use std::path::Path;

use flexid::dh::{Convention, import};
use flexid::urdf::{Base, Masses};
use flexid_pipeline::model::Model;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    let total = Masses { total: Some((100.0, "--total-mass")), ..Masses::default() };
    for convention in [Convention::Standard, Convention::Modified] {
        for masses in [Masses::default(), total] {
            match import(text, "robot", convention, None, Base::Rigid, &masses) {
                Ok(imported) => {
                    let text = imported.to_toml().unwrap();
                    let file = Path::new("model.toml");
                    assert_eq!(Model::parse(file, &text).unwrap(), imported.model);
                }
                Err(error) => assert!(!error.message.is_empty()),
            }
        }
    }
});
