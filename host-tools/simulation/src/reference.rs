//! The reference robot and its scenario, for the tests of this crate and of `flexid-reproduce`.

use std::path::Path;

use flexid_core::chain::Chain;
use flexid_pipeline::model::Model;
use flexid_simulation::scenario::Scenario;

fn file(name: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenario").join(name)
}

/// The reference robot.
pub(crate) fn model() -> Model {
    Model::load(&file("mill3-model.toml")).unwrap()
}

/// The reference scenario and its robot.
pub(crate) fn mill3() -> (Scenario, Chain) {
    let model = model();
    let scenario = Scenario::load(&file("mill3.toml"), &model).unwrap();
    (scenario, model.chain().unwrap())
}
