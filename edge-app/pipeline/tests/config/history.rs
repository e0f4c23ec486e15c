//! Epochs of the daemon.

use std::time::Duration;

use flexid_pipeline::config::Epoch;

use super::load;

#[test]
fn a_history_has_one_end_of_its_epochs() {
    let history = |lines: &str| {
        let section = format!("[history]\n{lines}\n\n[server]");
        load("edge.toml", "[server]", &section).map(|config| config.history.unwrap())
    };
    let days = history("epoch = \"1d\"").unwrap();
    assert_eq!((days.epoch, days.folder), (Epoch::Time(Duration::from_secs(86_400)), None));
    let fifty = history("records = 50\nfolder = \"found\"").unwrap();
    assert_eq!(fifty.epoch, Epoch::Records(50));
    assert!(fifty.folder.unwrap().ends_with("found"));
    assert_eq!(load("edge.toml", "", "").unwrap().history, None);
    for (lines, error) in [
        ("", "edge.toml: [history] says no end of an epoch: add epoch = \"1d\", or records = 50"),
        (
            "epoch = \"1d\"\nrecords = 50",
            "edge.toml: [history] has epoch and records: leave one out",
        ),
        ("records = 0", "edge.toml: [history] records is 0: must be at least 1"),
        ("epoch = \"0s\"", "edge.toml: [history] epoch is \"0s\": must be positive"),
        (
            "epoch = \"one day\"",
            "edge.toml: [history] epoch is \"one day\": expected number at 0: write a duration, as \"8h\", \"1d\" or \"1week\"",
        ),
        (
            "epoch = 1",
            "edge.toml:34: [history] epoch: invalid type: integer `1`, expected a string",
        ),
        (
            "each = \"1d\"",
            "edge.toml:34: [history] each: unknown key `each`: did you mean `epoch`?",
        ),
    ] {
        assert_eq!(history(lines).unwrap_err(), error);
    }
}
