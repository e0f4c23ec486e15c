//! From boxes over bridges with certificates into one table: none is lost, and none is there twice.

use std::fs::{self, File};
use std::path::Path;
use std::process::{Command, Stdio};

use serde_json::{Value, json};

use super::broker::{Broker, free_port};
use super::database::Postgres;
use super::edge::Edge;
use super::{Running, until, until_logged};

const DIST: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/fleet/dist");
const FLEXID: &str = env!("CARGO_BIN_EXE_flexid");

/// A file as it is shipped, with these replacements.
fn shipped(name: &str, replacements: &[(&str, &str)]) -> String {
    let mut text = fs::read_to_string(format!("{DIST}/{name}")).unwrap();
    for (from, to) in replacements {
        assert!(text.contains(from), "{name} has no {from}");
        text = text.replace(from, to);
    }
    text
}

/// An authority, and certificates of the plant and of robots.
fn certificates(folder: &Path, robots: &[&str]) {
    let openssl = |arguments: &str| {
        let mut command = Command::new("openssl");
        command.args(arguments.split(' ')).current_dir(folder).stderr(Stdio::null());
        assert!(command.status().expect("apt-get install openssl").success(), "{arguments}");
    };
    let key = "-newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 2";
    openssl(&format!("req -x509 {key} -keyout plant-ca.key -out plant-ca.crt -subj /CN=authority"));
    for name in robots.iter().chain(&["plant"]) {
        openssl(&format!(
            "req -x509 {key} -CA plant-ca.crt -CAkey plant-ca.key -keyout {name}.key -out {name}.crt -subj /CN={name} -addext subjectAltName=DNS:localhost -addext basicConstraints=critical,CA:FALSE"
        ));
    }
}

/// The broker of the plant as it is shipped; its port is that for the collector.
fn plant(folder: &Path, outer: u16) -> Broker {
    let passwords = folder.join("passwords");
    fs::write(&passwords, "").unwrap();
    let mut command = Command::new("mosquitto_passwd");
    assert!(
        command.arg("-b").arg(&passwords).args(["collect", "secret"]).status().unwrap().success()
    );
    fs::copy(format!("{DIST}/flexid.acl"), folder.join("flexid.acl")).unwrap();
    let (inner, place) = (free_port(), folder.display().to_string());
    let text = shipped(
        "mosquitto-plant.conf",
        &[
            ("listener 8883", &format!("listener {outer}")),
            ("listener 1883", &format!("listener {inner}")),
            ("/etc/mosquitto/certs", &place),
            ("/etc/mosquitto", &place),
            ("autosave_interval 60", "autosave_interval 1"),
        ],
    );
    Broker::of(
        &folder.join("plant"),
        inner,
        &format!("persistence_location {place}/plant/\n{text}"),
    )
}

/// A box and its broker as it is shipped.
fn robot(folder: &Path, robot: &str, outer: u16) -> (Edge, Broker) {
    let (port, place) = (free_port(), folder.display().to_string());
    let text = shipped(
        "mosquitto-box.conf",
        &[
            ("listener 1883", &format!("listener {port}")),
            ("broker.plant.example:8883", &format!("localhost:{outer}")),
            ("/etc/mosquitto/certs", &place),
            ("hall-3/kr210-4711", &format!("hall/{robot}")),
            ("kr210-4711", robot),
            ("restart_timeout 5 60", "restart_timeout 1"),
        ],
    );
    let broker = Broker::of(&folder.join(format!("{robot}-broker")), port, &text);
    (Edge::new(&folder.join(robot), robot, port, ""), broker)
}

/// Makes the tables, and writes a configuration.
fn prepare(folder: &Path, postgres: &Postgres, port: u16) {
    let words = postgres.words("postgres");
    for says in ["tables: from number 0 to 1\n", "tables: from number 1 to 1\n"] {
        let output = Command::new(FLEXID).args(["collect", "--migrate", &words]).output().unwrap();
        assert_eq!(
            String::from_utf8(output.stdout).unwrap(),
            says,
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
    }
    fs::write(folder.join("collect.password"), "secret\n").unwrap();
    let text = shipped(
        "collect.toml",
        &[
            ("127.0.0.1:1883", &format!("127.0.0.1:{port}")),
            (
                "host=/run/postgresql user=flexid-collect dbname=flexid",
                &postgres.words("flexid-collect"),
            ),
        ],
    );
    fs::write(folder.join("collect.toml"), text).unwrap();
}

fn collect(folder: &Path) -> Running {
    let log = File::options().append(true).create(true).open(folder.join("collect.log")).unwrap();
    let mut command = Command::new(FLEXID);
    command.args(["collect", "--config", "collect.toml"]).current_dir(folder);
    Running(command.stdin(Stdio::null()).stderr(log).spawn().unwrap())
}

#[test]
fn none_is_lost_and_none_is_there_twice() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path();
    let names = ["r1", "r2"];
    certificates(place, &names);
    let mut postgres = Postgres::start_in(place);
    let outer = free_port();
    let mut plant = plant(place, outer);
    prepare(place, &postgres, plant.port);
    let mut robots = names.map(|name| robot(place, name, outer));
    robots.iter_mut().for_each(|(_, broker)| broker.start());
    let mut publishers: Vec<Running> = robots.iter().map(|(edge, _)| edge.publish()).collect();
    let find = |robots: &[(Edge, Broker)], number: u64| {
        for (edge, _) in robots {
            edge.find(number);
            until("kept", || (edge.kept() == number as usize).then_some(()));
        }
    };
    let log = place.join("collect.log");

    // The plant is off.
    let collector = collect(place);
    until_logged(&log, "nobody listens there: is mosquitto running");
    find(&robots, 1);
    plant.start();
    until_logged(&log, "connected");
    find(&robots, 2);
    // Its broker is killed.
    plant.kill();
    find(&robots, 3);
    plant.start();
    // The collector is killed.
    drop(collector);
    find(&robots, 4);
    let mut collector = collect(place);
    // The database is off.
    postgres.kill();
    find(&robots, 5);
    until_logged(&log, "is PostgreSQL running, and database right?; messages wait at the broker");
    drop(std::mem::replace(&mut collector, collect(place)));
    postgres.start();
    // A broker of a box is killed, with what it had acknowledged; and a publisher.
    robots[0].1.kill();
    find(&robots, 6);
    robots[0].1.start();
    drop(publishers.pop());
    publishers.push(robots[1].0.publish());
    find(&robots, 7);
    // What a broker loses is missed, too, where nothing newer follows.
    plant.kill();
    find(&robots, 8);
    until("acknowledged", || (robots[0].0.sent() == 8).then_some(()));
    robots[0].1.kill();
    robots[0].1.start();
    plant.start();

    let sequences = "select robot, string_agg(sequence::text, ',' order by sequence) from finding group by robot order by robot";
    let expected = "r1|1,2,3,4,5,6,7,8\nr2|1,2,3,4,5,6,7,8";
    until("eight findings of each", || (postgres.ask(sequences) == expected).then_some(()));
    // Content, and the parameters of three joints.
    assert_eq!(postgres.ask("select count(*) from finding where (body->'joints'->0->'stiffness'->>0)::float <> sequence"), "0");
    assert_eq!(postgres.ask("select count(*) from parameter"), (2 * 8 * 36).to_string());
    assert_eq!(postgres.ask("select count(*) from refused"), "0");
    let online = "select count(*) from robot where online";
    until("both are online", || (postgres.ask(online) == "2").then_some(()));
    assert!(collector.terminate());
    // What the brokers delivered more than once has left no trace.
    assert_eq!(postgres.ask(sequences), expected);
    drop(publishers);
    let _collector = collect(place);
    until("both are offline", || (postgres.ask(online) == "0").then_some(()));
}

/// A finding as a box sends it.
fn finding(sequence: u64, changes: Value) -> String {
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
    ] {
        let said = send(topic, &finding(sequence, changes));
        assert!(
            said.contains(says) && said.is_empty() == says.is_empty(),
            "{sequence}: {said}, not {says}"
        );
    }
    let kept = "select string_agg(box || sequence, ' ' order by received_at) from finding";
    assert_eq!(postgres.ask(kept), "b11 b12 b13 b14 b15 b15 b21 b16");
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
    assert_eq!(postgres.ask("select count(*) from refused"), "9");
    assert_eq!(postgres.ask(kept), "b11 b12 b13 b14 b15 b15 b21 b16");
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
    for (sequence, factor) in [(1, 1.0), (2, 0.88)] {
        let mut own: Value = serde_json::from_str(&finding(sequence, json!({}))).unwrap();
        own["joints"][0]["stiffness"][4] = json!(factor * 6e7);
        let insert = format!(
            "insert into message (topic, value) values ('flexid/v1/hall/r1/finding', $x${own}$x$)"
        );
        postgres.try_ask("flexid-collect", &insert).unwrap();
    }
    let change = "select robot, joint, axis, round(percent::numeric, 2), round(std::numeric, 2) from change where abs(percent) > 1";
    // 100 % × √2 × 1 % of the first, of 1/0.88 % of the second.
    assert_eq!(postgres.ask(change), "r1|joint_1|ry|-12.00|1.51");
    let dashboard: Value = serde_json::from_str(&shipped("grafana.json", &[])).unwrap();
    let mut asked = 0;
    for panel in dashboard["panels"].as_array().unwrap() {
        for target in panel["targets"].as_array().unwrap() {
            let query = target["rawSql"].as_str().unwrap();
            let query = query
                .replace("$__timeFilter(time)", "time > 'epoch'")
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
