//! The shipped systemd units. systemd's own measure rates how little they leave to an intruder.

use std::path::Path;
use std::process::Command;

const UNIT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../edge-app/dist/flexid-edge.service");
const PUBLISHER: &str =
    concat!(env!("CARGO_MANIFEST_DIR"), "/../host-tools/fleet/dist/flexid-publish.service");
const COLLECTOR: &str =
    concat!(env!("CARGO_MANIFEST_DIR"), "/../host-tools/fleet/dist/flexid-collect.service");
/// Largest exposure, from 0 to 10. systemd calls up to 4 OK.
const MOST: f64 = 1.6;

fn systemd_analyze(arguments: &[&str]) -> (bool, String) {
    let output = Command::new("systemd-analyze").args(arguments).env("LC_ALL", "C").output();
    let output = output.expect("systemd-analyze is missing: apt-get install systemd");
    let text = [output.stdout, output.stderr].concat();
    (output.status.success(), String::from_utf8_lossy(&text).into_owned())
}

#[test]
fn exposure_is_low() {
    for unit in [UNIT, PUBLISHER, COLLECTOR] {
        let (_, table) = systemd_analyze(&["security", "--offline=true", "--no-pager", unit]);
        let (_, level) = table.split_once("Overall exposure level for ").unwrap();
        let level: f64 = level.split(' ').nth(1).unwrap().parse().unwrap();
        assert!(level <= MOST, "{table}");
    }
}

/// systemd accepts every directive. The test needs neither the installed program nor the bus.
#[test]
fn directives_are_known() {
    for (unit, program) in [(UNIT, "flexid-edge"), (PUBLISHER, "flexid"), (COLLECTOR, "flexid")] {
        let (passes, complaints) = systemd_analyze(&["verify", unit]);
        let is_read = passes || complaints.contains(&format!("{program} is not executable"));
        assert!(is_read, "{complaints}");
        let of_the_file: Vec<_> = complaints
            .lines()
            .filter(|line| line.contains(".service") && !line.contains("is not executable"))
            .filter(|line| line.contains("flexid"))
            .collect();
        assert!(of_the_file.is_empty(), "{complaints}");
    }
}

/// The publisher reaches the daemon's socket and the loopback interface alone, and finds its configuration and its outbox.
#[test]
fn the_publisher_reaches_this_box_alone() {
    let unit = std::fs::read_to_string(PUBLISHER).unwrap();
    for line in [
        "RestrictAddressFamilies=AF_UNIX AF_INET AF_INET6",
        "IPAddressDeny=any",
        "IPAddressAllow=localhost",
        "SupplementaryGroups=flexid",
        "StateDirectory=flexid-publish",
        "ExecStart=flexid publish --config /etc/flexid/publish.toml",
    ] {
        assert!(unit.lines().any(|own| own == line), "{line}");
    }
}

/// The filter allows the system calls on which the daemon relies beside those of every service: each line of the unit adds to or
/// takes from those before it, and a deny list takes whole sets away.
#[test]
fn the_system_calls_of_the_daemon_are_allowed() {
    let unit = std::fs::read_to_string(UNIT).unwrap();
    let mut allowed = std::collections::BTreeSet::new();
    for line in unit.lines().filter_map(|line| line.strip_prefix("SystemCallFilter=")) {
        let (denies, words) = line.strip_prefix('~').map_or((false, line), |words| (true, words));
        for call in words.split_whitespace().flat_map(system_calls) {
            if denies {
                allowed.remove(&call)
            } else {
                allowed.insert(call)
            };
        }
    }
    let needed =
        ["sched_setscheduler", "sched_getscheduler", "fchmodat", "fchownat", "recvmmsg", "flock"];
    for call in [&needed[..], &["renameat"]].concat() {
        assert!(allowed.contains(call), "{call}");
    }
    for call in ["setpriority", "setrlimit", "mount", "reboot", "ptrace"] {
        assert!(!allowed.contains(call), "{call}");
    }
}

/// Returns the system calls of a set, or the one of this name.
fn system_calls(word: &str) -> Vec<String> {
    if !word.starts_with('@') {
        return vec![word.to_owned()];
    }
    let (_, text) = systemd_analyze(&["syscall-filter", "--no-pager", word]);
    let lines = text.lines().skip(1).map(str::trim);
    let words = lines.filter(|line| !line.is_empty() && !line.starts_with('#'));
    words.flat_map(system_calls).collect()
}

/// The unit allows what the daemon needs: the bus, its link's state, its readers, its folders, and a reload.
#[test]
fn the_daemon_can_still_work() {
    let unit = std::fs::read_to_string(UNIT).unwrap();
    let values = |key: &str| {
        let lines = unit.lines().filter_map(|line| line.strip_prefix(key)?.strip_prefix('='));
        lines.collect::<Vec<_>>().join(" ")
    };
    for family in ["AF_CAN", "AF_UNIX", "AF_INET", "AF_NETLINK"] {
        let families = values("RestrictAddressFamilies");
        assert!(families.split(' ').any(|own| own == family), "{families}");
    }
    assert_eq!(values("AmbientCapabilities"), "");
    assert_eq!(
        (values("RuntimeDirectory"), values("StateDirectory")),
        ("flexid".into(), "flexid".into())
    );
    assert_eq!(values("ExecReload"), "/bin/sh -c 'kill -HUP $MAINPID'");
    assert!(values("IPAddressAllow").contains("localhost"));
    assert!(Path::new(UNIT).with_file_name("flexid.sysusers").exists());
}
