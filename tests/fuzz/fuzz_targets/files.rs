//! Text that calls itself a model or a config file.
//!
//! A refusal is one line; a model that is read is written and read again as itself.
#![no_main]

use std::path::Path;

use flexid_pipeline::config::Config;
use flexid_pipeline::model::Model;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../host-tools/scenario");
    if let Err(error) = Config::parse(&scenario.join("edge.toml"), text) {
        assert!(!error.to_string().contains('\n'), "{error}");
    }
    let file = Path::new("model.toml");
    match Model::parse(file, text) {
        Ok(model) => {
            let again = Model::parse(file, &model.to_toml().unwrap()).unwrap();
            assert_eq!(again, model);
        }
        Err(error) => assert!(!error.to_string().contains('\n'), "{error}"),
    }
});
