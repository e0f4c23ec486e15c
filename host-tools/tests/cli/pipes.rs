//! Whatever happens to the output, what was made stays.

use std::fs;

use crate::setup::{DEMO, FLEXID, besides, flexid, folder, json, stderr, unheard};

#[test]
fn nobody_who_listens_is_no_reason_to_panic() {
    let folder = folder();
    let cases = [
        (FLEXID, "model import mill3.urdf --tcp tcp -o m.toml", Some("m.toml")),
        (FLEXID, "simulate --config edge.toml --experiments 1 --candump o.log", Some("o.log")),
        (FLEXID, "--help", None),
        (DEMO, "", None),
    ];
    for (program, arguments, made) in cases {
        let output = unheard(folder.path(), program, arguments);
        assert_eq!(output.status.code(), Some(0), "{arguments}");
        assert_eq!(stderr(&output), "", "{arguments}");
        if let Some(made) = made {
            assert!(folder.path().join(made).exists(), "{arguments}: no {made}");
        }
    }
}

#[test]
fn what_was_identified_stays_whatever_happens_afterwards() {
    let folder = folder();
    let simulated = flexid(folder.path(), "simulate --config edge.toml --candump a.log");
    assert!(simulated.status.success(), "{}", stderr(&simulated));
    let log = folder.path().join("a.log");
    fs::write(&log, "hello\n".to_owned() + &fs::read_to_string(&log).unwrap()).unwrap();
    let found = || {
        assert_eq!(json(folder.path(), "o.json")["joints"].as_array().unwrap().len(), 3);
        fs::remove_file(folder.path().join("o.json")).unwrap();
    };

    // The second recording cannot be read, whoever asks.
    let command = "identify --config edge.toml a.log /proc/self/mem --json o.json";
    let output = flexid(folder.path(), command);
    let (table, errors) = (String::from_utf8(output.stdout.clone()).unwrap(), besides(&output));
    assert_eq!(output.status.code(), Some(1), "{errors}");
    assert!(table.contains("joint_3") && table.contains("3 records"), "{table}");
    assert!(errors.contains("the recording breaks off") && errors.lines().count() == 1, "{errors}");
    found();

    let output = flexid(folder.path(), "identify --config edge.toml a.log --json o.json");
    let table = String::from_utf8(output.stdout.clone()).unwrap();
    assert!(output.status.success() && besides(&output).is_empty(), "{}", stderr(&output));
    assert_eq!(table.matches("a.log:1: no line of candump -L").count(), 1, "{table}");
    found();

    let command = "identify --config edge.toml a.log --json o.json";
    let output = unheard(folder.path(), FLEXID, command);
    assert_eq!((output.status.code(), besides(&output).as_str()), (Some(0), ""));
    found();
}
