//! Recordings with a fault, each made from a good one or in `tests/recordings`: what `check` says of it, and what comes of it.

use std::collections::HashMap;
use std::fs;
use std::path::Path;

use serde_json::Value;
use tempfile::TempDir;

use crate::check::{recorded, typical};
use crate::common::edit;
use crate::setup::{flexid, folder, refused};

/// Time of the first frame of a simulated log, s.
const BEGIN_S: f64 = 1_767_000_000.0;

/// A line of a simulated log.
#[derive(Clone, Debug)]
pub(crate) struct Line {
    /// Time after the first frame, µs.
    pub(crate) us: i64,
    bus: String,
    id: String,
    data: Vec<u8>,
}

impl Line {
    pub(crate) fn parse(line: &str) -> Self {
        let words: Vec<&str> = line.split(' ').collect();
        let (seconds, micros) = words[0][1..].trim_end_matches(')').split_once('.').unwrap();
        let us = (seconds.parse::<i64>().unwrap() - BEGIN_S as i64) * 1_000_000;
        let (id, data) = words[2].split_once('#').unwrap();
        let byte = |place: usize| u8::from_str_radix(&data[place..place + 2], 16).unwrap();
        Self {
            us: us + micros.parse::<i64>().unwrap(),
            bus: words[1].to_owned(),
            id: id.to_owned(),
            data: (0..data.len()).step_by(2).map(byte).collect(),
        }
    }

    pub(crate) fn text(&self) -> String {
        let us = BEGIN_S as i64 * 1_000_000 + self.us;
        self.with_stamp(&format!("{}.{:06}", us / 1_000_000, us % 1_000_000))
    }

    fn with_stamp(&self, stamp: &str) -> String {
        let Self { bus, id, data, .. } = self;
        let data: String = data.iter().map(|byte| format!("{byte:02X}")).collect();
        format!("({stamp}) {bus} {id}#{data}")
    }

    /// The number of the joint whose angle the frame has, from 1.
    pub(crate) fn joint(&self) -> Option<usize> {
        self.id.strip_prefix("11").and_then(|number| number.parse().ok())
    }

    pub(crate) fn angle(&self) -> i32 {
        i32::from_le_bytes([self.data[0], self.data[1], self.data[2], self.data[3]])
    }

    /// Sets the angle, µrad.
    pub(crate) fn set_angle(&mut self, angle: i32) {
        self.data[..4].copy_from_slice(&angle.to_le_bytes());
    }

    fn counter(&self) -> u16 {
        u16::from_le_bytes([self.data[6], self.data[7]])
    }
}

/// A folder with the scenario and the lines of a log of its three cuts.
pub(crate) fn good() -> (TempDir, Vec<Line>) {
    let folder = recorded();
    let text = fs::read_to_string(folder.path().join("cut.log")).unwrap();
    let lines = text.lines().map(Line::parse).collect();
    (folder, lines)
}

fn write(folder: &TempDir, lines: impl IntoIterator<Item = String>) {
    let text: String = lines.into_iter().map(|line| line + "\n").collect();
    fs::write(folder.path().join("fault.log"), text).unwrap();
}

/// The findings of `check` on a log.
pub(crate) struct Checked {
    pub(crate) json: Value,
    /// The findings that are wrong or doubtful, each with its remedy.
    bad: Vec<String>,
    /// All findings.
    all: Vec<String>,
}

impl Checked {
    fn of(folder: &Path, log: &str) -> Self {
        let output = flexid(folder, &format!("check --config edge.toml --json {log}"));
        let json: Value = serde_json::from_slice(&output.stdout).unwrap_or_else(|_| {
            panic!(
                "{}{}",
                String::from_utf8_lossy(&output.stdout),
                String::from_utf8_lossy(&output.stderr)
            )
        });
        let findings = || json["findings"].as_array().unwrap().iter();
        let line = |one: &Value| {
            format!("{}: {}", one["finding"].as_str().unwrap(), one["mend"].as_str().unwrap())
        };
        let is_bad = |one: &&Value| one["severity"] == "wrong" || one["severity"] == "doubtful";
        let (bad, all) =
            (findings().filter(is_bad).map(line).collect(), findings().map(line).collect());
        Self { bad, all, json }
    }

    /// Numbers of records and poses.
    fn records(&self) -> [usize; 2] {
        let records = self.json["records"].as_array().unwrap();
        let poses = records.iter().filter_map(|record| record["pose_number"].as_u64()).max();
        [records.len(), poses.unwrap_or_default() as usize]
    }

    pub(crate) fn is_ready(&self) -> bool {
        self.json["ready"] == true
    }

    #[track_caller]
    pub(crate) fn says(&self, words: &str) {
        assert!(
            self.all.iter().any(|line| line.contains(words)),
            "{words:?} is not in {:#?}",
            self.all
        );
    }

    /// Nothing bad is said of the log but this.
    #[track_caller]
    fn only_says(&self, words: &[&str]) {
        assert_eq!(self.bad.len(), words.len(), "{:#?}", self.bad);
        for words in words {
            assert!(
                self.bad.iter().any(|line| line.contains(words)),
                "{words:?} is not in {:#?}",
                self.bad
            );
        }
    }
}

/// Writes the lines and checks them.
pub(crate) fn check(folder: &TempDir, lines: impl IntoIterator<Item = String>) -> Checked {
    write(folder, lines);
    Checked::of(folder.path(), "fault.log")
}

pub(crate) fn texts(lines: &[Line]) -> Vec<String> {
    lines.iter().map(Line::text).collect()
}

/// The angle of a joint reads rubbish for single frames.
#[test]
fn an_angle_that_is_wrong_for_single_frames_is_left_out_and_named() {
    let (folder, lines) = good();
    for (wrong, said) in [
        (i32::MAX, "q3 reads 2147.4836 rad, the end of its signal, in 12 frames (left out)"),
        (i32::MIN, "q3 reads -2147.4836 rad, the end of its signal, in 12 frames (left out)"),
        (0, "q3 reads 0.0000 rad, away from its pose for a moment, in 12 frames (left out)"),
        (
            123_456_789,
            "q3 reads 123.4568 rad, away from its pose for a moment, in 12 frames (left out)",
        ),
    ] {
        let mut count = 0;
        let wrong_line = |line: &Line| {
            let mut line = line.clone();
            if line.joint() == Some(3) {
                count += 1;
                if count % 10 == 5 {
                    line.set_angle(wrong);
                }
            }
            line.text()
        };
        let checked = check(&folder, lines.iter().map(wrong_line).collect::<Vec<_>>());
        assert_eq!((checked.records(), checked.is_ready()), ([3, 3], true), "{wrong}");
        checked.only_says(&[]);
        checked.says(said);
        assert!(!checked.all.iter().any(|line| line.contains("all joint angles are within")));
    }
}

#[test]
fn an_angle_at_the_half_turn_may_have_either_sign() {
    let (folder, lines) = good();
    let (mut count, half) = (0, 3_141_592);
    let flips = |line: &Line| {
        let mut line = line.clone();
        if line.joint() == Some(1) && line.angle() == 0 {
            count += 1;
            line.set_angle(if count % 3 == 0 { -half } else { half });
        }
        line.text()
    };
    let checked = check(&folder, lines.iter().map(flips).collect::<Vec<_>>());
    assert_eq!((checked.records(), checked.is_ready()), ([3, 3], true));
    checked.only_says(&[]);
    let q1 = checked.json["records"][0]["pose"][0].as_f64().unwrap();
    assert!((q1.abs() - std::f64::consts::PI).abs() < 1e-5, "{q1}");
}

/// Joint 2 rests between two steps of 0.1°, and reads one or the other.
#[test]
fn an_angle_of_coarse_steps_gives_records_and_its_step_is_named() {
    let (folder, lines) = good();
    let step = 1745;
    let dithers = |is_high: fn(u32) -> bool| {
        let mut count = 0;
        let lines = lines.iter().map(move |line| {
            let mut line = line.clone();
            if line.joint() == Some(2) {
                count += 1;
                if is_high(count) {
                    line.set_angle(line.angle() + step);
                }
            }
            line.text()
        });
        lines.collect::<Vec<_>>()
    };
    let said = "q2 steps by 0.0017 rad, which is taken for its resolution";
    // Every third frame, and about every second one without any order.
    let thirds = check(&folder, dithers(|count| count % 3 == 0));
    assert_eq!((thirds.records(), thirds.is_ready()), ([3, 3], true));
    thirds.only_says(&[said]);
    let halves = check(&folder, dithers(|count| count.wrapping_mul(2_654_435_769) >> 31 == 1));
    assert_eq!((halves.records()[1], halves.is_ready()), (3, true), "{:?}", halves.all);
    halves.says(said);

    // The DBC file states the step: `1` of the log is 0.1° then.
    let dbc = folder.path().join("mill3.dbc");
    let text = fs::read_to_string(&dbc).unwrap();
    let coarse = |line: &str| match line.contains("SG_ q2 ") {
        true => line.replace("(1e-06,0)", "(0.001745,0)"),
        false => line.to_owned(),
    };
    fs::write(&dbc, text.lines().map(coarse).collect::<Vec<_>>().join("\n") + "\n").unwrap();
    let mut count = 0_u32;
    let stated = lines.iter().map(|line| {
        let mut line = line.clone();
        if line.joint() == Some(2) {
            count += 1;
            let high = count.wrapping_mul(2_654_435_769) >> 31 == 1;
            line.set_angle(line.angle() / step + i32::from(high));
        }
        line.text()
    });
    let stated = check(&folder, stated.collect::<Vec<_>>());
    assert_eq!((stated.records(), stated.is_ready()), ([3, 3], true));
    stated.only_says(&[said]);
}

/// A joint that moves now and then faster than a robot feeds.
#[test]
fn a_joint_that_ends_each_record_is_named() {
    let (folder, lines) = good();
    let mut count = 0;
    let moves = |line: &Line| {
        let mut line = line.clone();
        if line.joint() == Some(2) {
            count += 1;
            line.set_angle(line.angle() + 40_000 * (count / 2));
        }
        line.text()
    };
    let checked = check(&folder, lines.iter().map(moves).collect::<Vec<_>>());
    assert_eq!((checked.records(), checked.is_ready()), ([0, 0], false));
    checked.says("q2 moved by 0.0400 rad or more ");
    checked.says(" times, faster than a feed, while something was cut");
}

/// The counters of the sensors run on from cut to cut.
fn run_on(lines: &[Line]) -> Vec<Line> {
    let mut last: HashMap<String, (u16, u16, i64)> = HashMap::new();
    let renumbered = lines.iter().map(|line| {
        let mut line = line.clone();
        if line.joint().is_none() {
            let count = line.counter();
            let (before, mut shift, us) =
                last.get(&line.id).copied().unwrap_or((count.wrapping_sub(1), 0, line.us));
            if count.wrapping_sub(before) != 1 {
                let pause = ((line.us - us) as f64 / 500.0).round() as u16;
                shift = before.wrapping_add(shift).wrapping_add(pause).wrapping_sub(count);
            }
            last.insert(line.id.clone(), (count, shift, line.us));
            line.data[6..].copy_from_slice(&count.wrapping_add(shift).to_le_bytes());
        }
        line
    });
    renumbered.collect()
}

/// The controller falls off the bus after the first cut, and the sensors go on.
#[test]
fn joints_that_fall_silent_are_named_and_give_no_later_cut_a_pose() {
    let (folder, lines) = good();
    let whole = check(&folder, texts(&run_on(&lines)));
    assert_eq!(whole.records(), [3, 3]);
    // What came between the cuts is not in the log.
    whole.only_says(&[]);
    whole.says("7996 frames of force and acceleration not recorded");
    for lines in [lines.clone(), run_on(&lines)] {
        let stops = lines.iter().filter(|line| line.joint().is_none() || line.us < 4_500_000);
        let checked = check(&folder, stops.map(Line::text).collect::<Vec<_>>());
        assert_eq!(checked.records(), [1, 1]);
        let said = [
            "q1, q2 and q3 came at 10 Hz and have not come since 4.0 s",
            "2 cuts without joint angles: no records of them",
        ];
        checked.only_says(&said);
        checked.says("1 record in 1 pose");
    }
}

/// A script writes numbers as it likes, and `candump -N` writes nanoseconds.
#[test]
fn stamps_of_any_number_of_decimals_are_read() {
    let (folder, lines) = good();
    let forms: [fn(String) -> String; 3] = [
        |stamp| stamp.trim_end_matches('0').to_owned(),
        |stamp| stamp + "000",
        |stamp| stamp + "123",
    ];
    for form in forms {
        let stamped = lines.iter().map(|line| {
            let text = line.text();
            line.with_stamp(&form(text[1..].split_once(')').unwrap().0.to_owned()))
        });
        let checked = check(&folder, stamped.collect::<Vec<_>>());
        assert_eq!((checked.records(), checked.is_ready()), ([3, 3], true));
        checked.only_says(&[]);
        checked.says("no frame of 49152 lost");
    }
}

#[test]
fn raw_lengths_above_eight_are_read() {
    let (folder, lines) = good();
    let raw = lines
        .iter()
        .map(|line| if line.joint().is_none() { line.text() + "_F" } else { line.text() });
    let checked = check(&folder, raw.collect::<Vec<_>>());
    assert_eq!((checked.records(), checked.is_ready()), ([3, 3], true));
    checked.only_says(&[]);
}

#[test]
fn frames_that_the_kernel_dropped_are_counted() {
    let (folder, lines) = good();
    let dropped = lines.iter().enumerate().flat_map(|(number, line)| {
        let told = format!(
            "DROPCOUNT: dropped 3 CAN frames on 'vcan0' socket (total drops {})",
            3 * (number / 9000 + 1)
        );
        let told = (number % 9000 == 4500).then_some(told);
        told.into_iter().chain([line.text()])
    });
    let checked = check(&folder, dropped.collect::<Vec<_>>());
    assert_eq!((checked.records(), checked.is_ready()), ([3, 3], true));
    checked.only_says(&[
        "fault.log: the kernel dropped 18 frames while this was recorded: record with `candump -r",
    ]);
}

/// One line in twenty is of another tool.
#[test]
fn a_log_of_which_many_lines_cannot_be_read_is_wrong() {
    let (folder, lines) = good();
    let torn = |every: usize| {
        let lines = lines.iter().enumerate();
        let lines = lines.map(|(number, line)| {
            let text = line.text();
            if number % every == 1 { text[..20].to_owned() } else { text }
        });
        check(&folder, lines.collect::<Vec<_>>())
    };
    let (many, few) = (torn(20), torn(2000));
    assert!(!many.is_ready() && few.is_ready());
    let said = "fault.log:2: 2476 lines of 49521 not of candump -L, from this one on";
    assert!(many.json["verdict"].as_str().unwrap().starts_with(&format!("not ready: {said}")));
    few.says("fault.log:2: 25 lines of 49521 not of candump -L");
}

/// Stamps that are no times at all: neither a rate nor a restart is read from them.
#[test]
fn stamps_that_are_no_times_are_named() {
    let (folder, lines) = good();
    let mut before_us = 0;
    let differences = lines.iter().map(|line| {
        let passed_us = line.us - before_us;
        before_us = line.us;
        line.with_stamp(&format!("{}.{:06}", passed_us / 1_000_000, passed_us % 1_000_000))
    });
    let cases = [
        (
            lines.iter().map(|line| line.with_stamp("0000000000.000000")).collect::<Vec<_>>(),
            "fault.log: all stamps are equal: record without -H",
        ),
        (
            lines.iter().map(|line| line.with_stamp(&(line.us / 1_000_000).to_string())).collect(),
            "fault.log: all stamps are whole seconds: record with `candump -L`",
        ),
        (differences.collect(), ": record without -t d: differences are no times"),
    ];
    for (lines, said) in cases {
        let checked = check(&folder, lines);
        assert!(!checked.is_ready());
        checked.says(said);
        let verdict = checked.json["verdict"].as_str().unwrap();
        assert!(verdict.starts_with("not ready: fault.log: "), "{verdict}");
        for wrong in ["rate_hz", "restart"] {
            assert!(!checked.bad.iter().any(|line| line.contains(wrong)), "{:#?}", checked.bad);
        }
        let message = refused(folder.path(), "identify --config edge.toml fault.log");
        assert!(message.contains(said.trim_start_matches("fault.log: ")), "{message}");
    }
}

/// No counter restarts, and no frame is lost.
#[test]
fn stamps_that_jump_for_single_frames_cost_nothing() {
    let (folder, lines) = good();
    let jumps = lines.iter().enumerate().map(|(number, line)| {
        let mut line = line.clone();
        if number % 2000 == 1000 {
            line.us += 700_000;
        }
        if number % 3001 == 500 {
            line.us -= 300_000;
        }
        line.text()
    });
    let checked = check(&folder, jumps.collect::<Vec<_>>());
    assert_eq!((checked.records(), checked.is_ready()), ([3, 3], true));
    checked.only_says(&[]);
    checked.says("jump away and back, and were replaced: record without -H");
    checked.says("2 restarts of the counters: right between recordings");
    checked.says("force and acceleration come at 2000.0 Hz");
}

/// The clock of the recording is set forward in the middle of the second cut.
#[test]
fn a_clock_that_is_set_is_no_restart_of_counters() {
    let (folder, lines) = good();
    let set = lines.iter().map(|line| {
        let mut line = line.clone();
        line.us += if line.us > 7_000_000 { 2_000_000 } else { 0 };
        line.text()
    });
    let checked = check(&folder, set.collect::<Vec<_>>());
    checked.says("1 pause of more than 0.5 s, over which the counters go on without a gap");
    checked.says("2 restarts of the counters: right between recordings");
    assert!(checked.is_ready());
}

/// A loop-back puts each frame into the log twice.
#[test]
fn frames_that_came_twice_are_named_as_that_alone() {
    let (folder, lines) = good();
    let twice = lines.iter().flat_map(|line| [line.text(), line.text()]);
    let checked = check(&folder, twice.collect::<Vec<_>>());
    assert_eq!((checked.records(), checked.is_ready()), ([3, 3], true));
    checked.only_says(&["49152 frames of force and acceleration came again"]);
    checked.says("force and acceleration come at 2000.0 Hz");
}

#[test]
fn sensors_on_two_buses_are_named_with_their_buses() {
    let (folder, lines) = good();
    edit(&folder.path().join("edge.toml"), "\"vcan0\"", "\"can0\"");
    let apart = lines.iter().map(|line| {
        let bus = if line.id == "102" { "can1" } else { "can0" };
        Line { bus: bus.to_owned(), ..line.clone() }.text()
    });
    let checked = check(&folder, apart.collect::<Vec<_>>());
    let verdict = checked.json["verdict"].as_str().unwrap();
    assert!(verdict.contains("0x102 (ax, ay, az) is on can1 in this log"), "{verdict}");
    checked.says("all sensors and joints must share a bus");
    for wrong in ["switch the sender on", "lost"] {
        assert!(!checked.bad.iter().any(|line| line.contains(wrong)), "{:#?}", checked.bad);
    }
}

/// The first lines of logs, as the tools write them.
#[test]
fn files_of_other_tools_are_read_or_named_with_their_remedy() {
    let folder = folder();
    typical(folder.path());
    let recordings = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/recordings");
    for (file, said) in [
        (
            "wireshark-socketcan.pcap",
            "is a capture of Wireshark or tcpdump (pcap): convert it with `pip install scapy; ",
        ),
        ("python-can-sqlite.db", "can_logconvert IN.db OUT.log`"),
        (
            "powershell-utf-16.log",
            "is UTF-16, as PowerShell writes: convert it with `iconv -f UTF-16 -t UTF-8 ",
        ),
        (
            "candump-tz-without-L.log",
            "is what candump prints without -L: record with `candump -L`, or convert it with `sed ",
        ),
    ] {
        let message = refused(
            folder.path(),
            &format!("check --config edge.toml {}", recordings.join(file).display()),
        );
        assert!(message.contains(said), "{message}");
    }
    for file in ["candump-N-nanoseconds.log", "raw-dlc-suffix.log"] {
        let log = recordings.join(file);
        let checked = Checked::of(folder.path(), &log.display().to_string());
        checked.says("all 5 expected identifiers are in the log");
        assert!(
            !checked.all.iter().any(|line| line.contains("not of candump -L")),
            "{:?}",
            checked.all
        );
    }
}
