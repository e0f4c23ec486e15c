//! Tables and lines in a window.

use std::path::Path;
use std::process::{Command, Stdio};

use console::{measure_text_width, strip_ansi_codes};

use crate::setup::{FLEXID, flexid, folder, found, identified};

/// Output of a command on stdout, in a window of so many columns.
fn in_window(folder: &Path, columns: usize, arguments: &str) -> String {
    let command = format!("stty rows 24 cols {columns}; {FLEXID} {arguments} 2>/dev/null");
    let output = Command::new("script")
        .args(["--quiet", "--return", "--command", &command, "/dev/null"])
        .current_dir(folder)
        .env("TERM", "dumb")
        .stdin(Stdio::null())
        .output()
        .expect("script, of Debian's bsdutils, runs");
    let text = String::from_utf8(output.stdout).unwrap();
    // A bar of progress begins its line anew.
    let lines =
        text.split('\n').map(|line| line.trim_end_matches('\r').rsplit('\r').next().unwrap_or(""));
    lines.map(|line| strip_ansi_codes(line).into_owned() + "\n").collect()
}

/// The text with one blank between words.
fn words(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn tables_fit_and_words_stay_whole() {
    let folder = folder();
    let folder = folder.path();
    identified(folder, "--truth-json t.json", || ());
    for (arguments, legend) in [
        ("predict o.json --force 0,200,0", "--highest HZ lists others, which no record shows"),
        (
            "compare o.json o.json",
            "each change in its standard deviation, what goes together counted once (Mahalanobis)",
        ),
        (
            "check --config edge.toml o.log",
            "share of the band's bins in which the force stands clear of its noise; below half",
        ),
        (
            "identify --config edge.toml o.log --truth t.json",
            "is 0 where model and measurement agree, and 2 where they are opposite",
        ),
        ("map o.json --points 5 --out m.svg", "have an interval of more than"),
        (
            "plan --config edge.toml --from o.json --poses 4 --experiments 1",
            "how many parameters `flexid identify` will call identified / weak / not observable",
        ),
        (
            "lobes o.json --teeth 2 --kt 700 --milling down --immersion 0.5 --feed 1,0,0 --rpm 1000,6000",
            "modes of spindle and tool lie above, and may limit the depth further",
        ),
    ] {
        for columns in [80, 100] {
            let text = in_window(folder, columns, arguments);
            assert!(words(&text).contains(legend), "{text}");
            let wide = text.lines().find(|line| measure_text_width(line) > columns);
            assert_eq!(wide, None, "{arguments}");
        }
    }
}

/// No line is folded where a program reads it, and `check` ends as it begins.
#[test]
fn a_pipe_gets_whole_lines() {
    let folder = found();
    let folder = folder.path();
    let output = flexid(folder, "check --config edge.toml o.log");
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("below half: the bands where it does not\n"), "{text}");
    assert!(text.lines().next().unwrap().starts_with("ready to identify: "), "{text}");
    assert_eq!(text.lines().next(), text.lines().last());
    let is_of_table = |line: &&str| !line.starts_with(" clear: ");
    let wide = text.lines().filter(is_of_table).find(|line| measure_text_width(line) > 80);
    assert_eq!(wide, None);
}
