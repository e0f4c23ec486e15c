//! Text that calls itself a file of static tests.
//!
//! A refusal is one line; what is read, core takes.
#![no_main]

use std::path::Path;
use std::sync::LazyLock;

use flexid_pipeline::model::Model;
use flexid_pipeline::statics::{self, StaticTests};
use libfuzzer_sys::fuzz_target;

static MODEL: LazyLock<Model> = LazyLock::new(|| {
    let text = include_str!("../../../host-tools/scenario/mill3-model.toml");
    Model::parse(Path::new("model.toml"), text).unwrap()
});

fuzz_target!(|text: &str| {
    match statics::parse(Path::new("static.csv"), text, &MODEL) {
        Ok(StaticTests { tests, lines }) => {
            assert!(!tests.is_empty() && tests.len() == lines.len());
            assert_eq!(flexid_core::statics::check(&tests, MODEL.driven().count()), Ok(()));
        }
        Err(error) => assert!(!error.to_string().contains('\n'), "{error}"),
    }
});
