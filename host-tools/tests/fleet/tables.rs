//! Messages into the tables, and what the tables say.

use std::fs;
use std::process::Command;

use serde_json::{Value, json};

use super::database::Postgres;
use super::plant::{FLEXID, prepare, shipped};

/// A finding as a box sends it.
pub(crate) fn finding(sequence: u64, changes: Value) -> String {
    let joint = json!({
        "name": "joint_1",
        "stiffness": [6e7, 6e7, 6e7, 6e7, 6e7, 6e7], "stiffness_std": [6e5, null, 6e5, 6e5, 6e5, 6e5],
        "stiffness_verdict": ["identified", "not_observable", "identified", "identified", "identified", "identified"],
        "damping": [2e4, 2e4, 2e4, 2e4, 2e4, 2e4], "damping_std": [1e2, 1e2, 1e2, 1e2, 1e2, 1e2],
        "damping_verdict": ["weak", "weak", "weak", "weak", "weak", "weak"],
    });
    let mut own = json!({
        "site": "hall", "robot_id": "r1", "box": "b1", "boot_id": "boot-1", "sequence": sequence, "begun": null,
        "found_at": format!("2026-11-30T11:{sequence:02}:00.000Z"), "synchronised": true, "model_sha256": "m1", "config_sha256": "c1",
        "tool": "flexid 0.1.0", "schema": 2, "fit": { "acceptance": "consistent" }, "joints": [joint],
    });
    for (key, value) in changes.as_object().unwrap() {
        own[key] = value.clone();
    }
    own.to_string()
}

/// Messages into the view, as the collector and telegraf insert them. Each wrong one is a warning and a row; none is lost.
#[test]
fn what_is_wrong_is_kept_and_named() {
    let folder = tempfile::tempdir().unwrap();
    let postgres = Postgres::start_in(folder.path());
    let words = postgres.words("flexid-collect");
    let output = Command::new(FLEXID).args(["collect", "--migrate", &words]).output().unwrap();
    assert_eq!(output.status.code(), Some(1), "no such role yet");
    prepare(folder.path(), &postgres, 1);
    let send = |topic: &str, text: &str| {
        let insert = format!("insert into message (topic, value) values ('{topic}', $x${text}$x$)");
        let mut command = Command::new("psql");
        let output = command
            .args(["-qAtX", "-v", "ON_ERROR_STOP=1", "-c", &insert])
            .arg(&words)
            .output()
            .unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.success(), "{said}");
        said
    };
    let topic = "flexid/v1/hall/r1/finding";
    let long = format!("flexid/v1/hall/{}/finding", "r".repeat(300));
    let none = json!({});
    for (sequence, changes, says) in [
        (1, none.clone(), ""),
        (1, none.clone(), ""),
        (2, json!({ "joints": [] }), ""),
        (3, json!({ "schema": 3 }), "finding 3 has schema 3, this database knows 2"),
        (4, json!({ "model_sha256": "m2" }), "finding 4 is of another model than 3"),
        (
            5,
            json!({ "model_sha256": "m2", "synchronised": false }),
            "the clock of the box is not synchronised",
        ),
        (
            5,
            json!({ "model_sha256": "m2", "boot_id": "boot-2" }),
            "from the boots boot-1 and boot-2: two boxes have one outbox",
        ),
        (
            1,
            json!({ "model_sha256": "m2", "box": "b2", "boot_id": "boot-3" }),
            "box b2 follows box b1",
        ),
        (
            6,
            json!({ "model_sha256": "m2" }),
            "the boxes b2 (boot boot-3) and b1 (boot boot-1) both send",
        ),
        (9, json!({ "model_sha256": "m3" }), "finding 9 is of another model than 6"),
        // What was asked for comes late.
        (8, json!({ "model_sha256": "m2" }), ""),
        (10, json!({ "model_sha256": "m3" }), ""),
    ] {
        let said = send(topic, &finding(sequence, changes));
        assert!(
            said.contains(says) && said.is_empty() == says.is_empty(),
            "{sequence}: {said}, not {says}"
        );
    }
    let sequences = "b11 b12 b13 b14 b15 b15 b21 b16 b19 b18 b110";
    let kept = "select string_agg(box || sequence, ' ' order by received_at) from finding";
    assert_eq!(postgres.ask(kept), sequences);
    for (topic, text, says) in [
        (topic, "no JSON".into(), "invalid input syntax for type json"),
        (topic, "[".repeat(20_000), "stack depth limit exceeded"),
        (
            topic,
            finding(7, json!({ "robot_id": "r2" })),
            "is of hall/r2: correct the robot, or the acl_file",
        ),
        (topic, finding(7, json!({ "joints": 3 })), "cannot extract elements from a scalar"),
        (topic, finding(7, json!({ "sequence": "seven" })), "invalid input syntax for type bigint"),
        (topic, finding(7, json!({ "tool": "a\u{0}b" })), "unsupported Unicode escape sequence"),
        (topic, finding(7, json!({ "found_at": null })), "null value in column"),
        ("flexid/v1/hall/+/finding", "{}".into(), "is of no topic flexid/v1/SITE/ROBOT/finding"),
        (&long, "{}".into(), "is of no topic flexid/v1/SITE/ROBOT/finding"),
        (
            "flexid/v1/hall/r1/status",
            r#"{"sent":"all"}"#.into(),
            "invalid input syntax for type bigint",
        ),
        ("flexid/v1/hall/r1/status", "online".into(), "invalid input syntax for type json"),
    ] {
        for _ in 0..2 {
            let said = send(topic, &text);
            assert!(
                said.contains(says) && said.contains("kept in the table refused"),
                "{said}, not {says}"
            );
        }
    }
    assert_eq!(postgres.ask("select count(*) from refused"), "11");
    assert_eq!(postgres.ask(kept), sequences);
    // Its role does nothing else.
    for statement in [
        "select * from finding",
        "delete from finding",
        "update robot set type = 'x'",
        "drop view message",
    ] {
        assert!(postgres.try_ask("flexid-collect", statement).is_err(), "{statement}");
    }
}

/// Each panel of the dashboard asks what the reader's role may, and a change is found.
#[test]
fn the_dashboard_shows_a_change() {
    let folder = tempfile::tempdir().unwrap();
    let postgres = Postgres::start_in(folder.path());
    prepare(folder.path(), &postgres, 1);
    let file = folder.path().join("messages");
    let message = |(sequence, factor): (u64, f64)| {
        let mut own: Value = serde_json::from_str(&finding(sequence, json!({}))).unwrap();
        own["joints"][0]["stiffness"][4] = json!(factor * 6e7);
        format!("2026-11-30T12:00:00Z\tflexid/v1/hall/r1/finding\t{own}\n")
    };
    fs::write(&file, [(1, 1.0), (2, 0.88)].map(message).concat()).unwrap();
    // As telegraf writes them.
    let copy = format!("\\copy message (time, topic, value) from '{}'", file.display());
    postgres.try_ask("flexid-collect", &copy).unwrap();
    let change = "select robot, joint, axis, round(percent::numeric, 2), round(std::numeric, 2) from change('epoch') where abs(percent) > 1";
    // 100 % × √2 × 1 % of the first, of 1/0.88 % of the second.
    assert_eq!(postgres.ask(change), "r1|joint_1|ry|-12.00|1.51");
    let dashboard: Value = serde_json::from_str(&shipped("grafana.json", &[])).unwrap();
    let mut asked = 0;
    for panel in dashboard["panels"].as_array().unwrap() {
        for target in panel["targets"].as_array().unwrap() {
            let query = target["rawSql"].as_str().unwrap();
            let query = query
                .replace("$__timeFilter(time)", "time > 'epoch'")
                .replace("$__timeFrom()", "'epoch'")
                .replace("'${robot}'", "'hall/r1'");
            assert!(!query.contains('$'), "{query}");
            let rows = postgres.try_ask("flexid-read", &query).unwrap();
            let is_weak = query.contains("'damping'");
            let may_be_empty = query.contains(" event ") || query.contains(" refused ");
            assert!(!rows.is_empty() || may_be_empty || is_weak, "{query}");
            asked += 1;
        }
    }
    assert!(asked >= 4, "{asked}");
}
