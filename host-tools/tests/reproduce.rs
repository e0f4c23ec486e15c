//! `flexid reproduce` starts the program beside it, and says how to install it.

use std::fs;
use std::process::Command;

#[test]
fn the_program_beside_is_started_with_all_arguments() {
    let folder = tempfile::tempdir().unwrap();
    let flexid = folder.path().join("flexid");
    fs::copy(env!("CARGO_BIN_EXE_flexid"), &flexid).unwrap();
    let run = || {
        let mut command = Command::new(&flexid);
        command.args(["reproduce", "--quick", "--help"]).env("PATH", folder.path());
        let done = command.output().unwrap();
        let text = [done.stdout, done.stderr].map(|text| String::from_utf8(text).unwrap());
        (done.status.code(), text)
    };
    let (status, [_, error]) = run();
    assert_eq!(status, Some(2));
    assert_eq!(
        error,
        "flexid: flexid-reproduce is not installed: build it: cargo install --locked --path host-tools/reproduce\n"
    );

    fs::copy("/bin/echo", folder.path().join("flexid-reproduce")).unwrap();
    let (status, [printed, _]) = run();
    assert_eq!((status, printed.as_str()), (Some(0), "--quick --help\n"));
}
