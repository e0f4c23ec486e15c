//! Manners in a shell: completions, manual pages, pipes that close, and terminals that are not driven by what is printed.

use std::fs;
use std::io::{BufRead as _, BufReader, Write as _};
use std::process::{Command, Stdio};

use crate::setup::{FLEXID, besides, flexid, folder, found, stderr, unheard};

#[test]
fn completions_are_scripts_of_their_shell() {
    let folder = folder();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let output = flexid(folder.path(), &format!("completions {shell}"));
        let script = String::from_utf8(output.stdout.clone()).unwrap();
        assert!(output.status.success() && script.contains("identify"), "{}", stderr(&output));
    }
    let script = flexid(folder.path(), "completions bash").stdout;
    let mut bash = Command::new("bash").arg("-n").stdin(Stdio::piped()).spawn().unwrap();
    bash.stdin.take().unwrap().write_all(&script).unwrap();
    assert!(bash.wait().unwrap().success());
    assert_eq!(unheard(folder.path(), FLEXID, "completions bash").status.code(), Some(0));
    assert_eq!(flexid(folder.path(), "completions cmd").status.code(), Some(2));
}

#[test]
fn every_command_has_its_manual_page() {
    let folder = folder();
    let output = flexid(folder.path(), "man pages/of/flexid");
    assert!(output.status.success(), "{}", stderr(&output));
    for (page, text) in [
        ("flexid.1", "flexid\\-identify(1)"),
        ("flexid-identify.1", "candump"),
        ("flexid-model-import.1", "URDF"),
    ] {
        let page = fs::read_to_string(folder.path().join("pages/of/flexid").join(page)).unwrap();
        assert!(page.contains(text), "{page}");
    }
    let output = flexid(folder.path(), "man mill3.urdf");
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("mill3.urdf: cannot be made: a file is in its place"));
}

#[test]
fn what_was_probably_meant_is_named() {
    let folder = folder();
    for (arguments, meant) in [
        ("identify --confg edge.toml", "'--confg' found: did you mean '--config'? (see --help)"),
        ("identfy --config edge.toml", "'identfy': did you mean 'identify'? (see --help)"),
        ("completions bsh", "did you mean 'bash'? (see --help)"),
    ] {
        let output = flexid(folder.path(), arguments);
        let errors = stderr(&output);
        assert_eq!((output.status.code(), errors.lines().count()), (Some(2), 1), "{errors}");
        assert!(errors.contains(meant), "{errors}");
    }
}

/// The help on stderr, and the status of a wrong use, as other programs of clap have it.
#[test]
fn without_a_command_there_is_the_help() {
    let folder = folder();
    for (arguments, lines) in [
        ("", ["Usage: flexid <COMMAND>", "  identify "]),
        ("model", ["Usage: flexid model <COMMAND>", "  import "]),
    ] {
        let output = flexid(folder.path(), arguments);
        let help = stderr(&output);
        assert_eq!((output.status.code(), output.stdout.len()), (Some(2), 0), "{help}");
        for line in lines {
            assert!(help.lines().any(|own| own.starts_with(line)), "{help}");
        }
    }
}

/// A file's name, an argument and a robot's name that would colour the terminal or rename its window.
#[test]
fn escape_sequences_do_not_reach_the_terminal() {
    let folder = folder();
    let evil = "a\x1b[31m\u{9b}b.log";
    for arguments in [["identify", "--config", "edge.toml", evil], ["watch", evil, "--until", evil]]
    {
        let output =
            Command::new(FLEXID).args(arguments).current_dir(folder.path()).output().unwrap();
        let errors = stderr(&output);
        assert!(!errors.contains(['\x1b', '\u{9b}']), "{errors:?}");
        // clap takes the escape sequences out of what it repeats.
        assert!(errors.contains("\\u009bb.log"), "{errors:?}");
    }
    let urdf = folder.path().join("mill3.urdf");
    let text = fs::read_to_string(&urdf).unwrap();
    fs::write(&urdf, text.replace("name=\"mill3\"", "name=\"mill\u{9b}3\"")).unwrap();
    let output = flexid(folder.path(), "model import mill3.urdf --tcp tcp -o m.toml");
    let said = String::from_utf8(output.stdout.clone()).unwrap() + &stderr(&output);
    assert!(said.contains("mill\\u009b3") && !said.contains('\u{9b}'), "{said:?}");
}

/// On a terminal work shows at once how far it is; into pipes it prints nothing about that unless it is long.
#[test]
fn work_shows_its_progress_on_a_terminal() {
    let folder = found();
    for (arguments, work) in [
        ("plan --config edge.toml --poses 32", &["weighing", "choosing"][..]),
        ("map o.json --points 30", &["mapping"]),
        (
            "lobes o.json --teeth 2 --kt 700 --angles 0,90 --feed 1,0,0 --rpm 60,1200",
            &["sampling the receptance", "seeking the lobes"],
        ),
        ("predict o.json --receptance h.csv", &["predicting"]),
        (
            "simulate --config edge.toml --candump s.log",
            &["simulating experiment 1", " of 12.3 s, "],
        ),
        ("identify --config edge.toml s.log", &["reading", "searching"]),
    ] {
        let command = format!("{FLEXID} {arguments}");
        let terminal = Command::new("script")
            .args(["-qec", &command, "/dev/null"])
            .env("TERM", "xterm")
            .current_dir(folder.path())
            .stdin(Stdio::null())
            .output()
            .expect("script, of Debian's bsdutils, runs");
        let shown = String::from_utf8_lossy(&terminal.stdout).into_owned();
        for part in work {
            assert!(shown.contains(part) && shown.contains(" %"), "{arguments}: {shown:?}");
        }
        let piped = flexid(folder.path(), arguments);
        assert_eq!((piped.status.success(), besides(&piped).as_str()), (true, ""), "{arguments}");
    }
}

/// A log that comes slowly, through a pipe that stays open: a line in ten seconds, and then the one of the error.
#[test]
fn long_work_says_where_there_is_no_terminal_how_far_it_is() {
    let folder = folder();
    for command in ["check", "identify"] {
        let mut work = Command::new(FLEXID)
            .args([command, "--config", "edge.toml", "-"])
            .current_dir(folder.path())
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(work.stderr.take().unwrap()).lines().map(Result::unwrap);
        let mut next = || lines.find(|line| !line.starts_with("warning: ")).unwrap();
        let progress = next();
        assert!(progress.starts_with("progress: reading, 1"), "{command}: {progress}");
        drop(work.stdin.take());
        let error = next();
        assert!(error.starts_with("flexid: ") && error.contains("is empty"), "{command}: {error}");
        assert_eq!((work.wait().unwrap().code(), lines.count()), (Some(2), 0), "{command}");
    }
}
