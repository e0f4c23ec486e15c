//! Text that calls itself a robot.
//!
//! A refusal is one line; a model that is imported, on a pedestal or not, is written and read again as itself.
#![no_main]

use std::path::Path;

use flexid::urdf::{Base, import};
use flexid_pipeline::input::BadInput;
use flexid_pipeline::model::Model;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    let file = Path::new("robot.urdf");
    for base in [Base::Rigid, Base::Pedestal] {
        match import(text, "tcp", base) {
            Ok(imported) => {
                assert!(!imported.warnings.iter().any(|warning| warning.contains('\n')));
                let text = imported.model.to_toml().unwrap();
                assert_eq!(Model::parse(Path::new("model.toml"), &text).unwrap(), imported.model);
            }
            Err(error) => {
                // As `flexid model import` says it.
                let error = BadInput::new(file, error).to_string();
                assert!(!error.contains('\n'), "{error}");
            }
        }
    }
});
