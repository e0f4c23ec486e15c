//! What a broker refuses stays in the outbox, what a database refuses at the broker, and one line names the mend.

use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::json;

use super::broker::{Broker, sequences};
use super::database::Postgres;
use super::edge::Edge;
use super::plant::{collect, migrate};
use super::tables::finding;
use super::{until, until_logged};

/// Two users with their passwords.
fn passwords(folder: &Path) {
    let file = folder.join("passwords");
    fs::write(&file, "").unwrap();
    for (user, password) in [("r1", "secret"), ("plant", "other")] {
        let mut command = Command::new("mosquitto_passwd");
        let status = command.arg("-b").arg(&file).args([user, password]).status();
        assert!(status.unwrap().success());
    }
}

#[test]
fn wrong_passwords_and_topics_that_are_not_allowed_lose_nothing() {
    let folder = tempfile::tempdir().unwrap();
    passwords(folder.path());
    let acl = folder.path().join("acl");
    let allowed = "user plant\ntopic read flexid/#\n\npattern write flexid/v1/+/%u/#\npattern read flexid/v1/+/%u/resend\n";
    fs::write(&acl, allowed.replace("/%u/#", "/%u/status")).unwrap();
    let mut broker = Broker::new(folder.path(), "password_file passwords\nacl_file acl");
    broker.start();
    let heard = folder.path().join("heard");
    let _subscription =
        broker.subscribe("flexid/v1/hall/r1/finding", &heard, &["-u", "plant", "-P", "other"]);
    let edge = Edge::new(
        &folder.path().join("box"),
        "r1",
        broker.port,
        "user = \"r1\"\npassword_file = \"password\"\n",
    );
    fs::write(edge.folder.join("password"), "wrong\n").unwrap();
    let publisher = edge.publish();
    until_logged(
        &edge.log(),
        "the broker refuses user and password: correct [broker] user and password_file",
    );
    edge.find(1);
    until("kept", || (edge.kept() == 1).then_some(()));
    assert!(publisher.terminate());

    fs::write(edge.folder.join("password"), "secret\n").unwrap();
    let _publisher = edge.publish();
    until_logged(
        &edge.log(),
        "hall/r1/finding: the broker does not let this user write it: correct its acl_file",
    );
    fs::write(&acl, allowed).unwrap();
    let reload = format!("kill -HUP {}", broker.id());
    assert!(Command::new("sh").args(["-c", &reload]).status().unwrap().success());
    until("the finding", || sequences(&heard).contains(&1).then_some(()));
}

#[test]
fn a_database_that_refuses_loses_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path();
    let postgres = Postgres::start_in(place);
    postgres.ask("create role \"flexid-collect\" login");
    let mut broker = Broker::new(&place.join("broker"), "allow_anonymous true");
    broker.start();
    let config = format!(
        "database = \"{}\"\n[broker]\naddress = \"127.0.0.1:{}\"\n",
        postgres.words("flexid-collect"),
        broker.port
    );
    fs::write(place.join("collect.toml"), config).unwrap();
    let log = place.join("collect.log");
    let collector = collect(place);
    until_logged(
        &log,
        "the tables are of number 0, this flexid needs 1: run `flexid collect --migrate`",
    );
    until_logged(&log, "connected");
    let topic = "flexid/v1/hall/r1/finding";
    broker.publish(topic, &finding(1, json!({})));
    migrate(&postgres);
    let there = |number: &str| {
        let count = || (postgres.ask("select count(*) from finding") == number).then_some(());
        until("findings", count);
    };
    there("1");
    postgres.ask("revoke insert on message from \"flexid-collect\"");
    broker.publish(topic, &finding(2, json!({})));
    until_logged(
        &log,
        "permission denied for view message: run `flexid collect --migrate` as the tables' owner; messages wait at the broker",
    );
    // They outlive the collector.
    drop(collector);
    postgres.ask("grant insert on message to \"flexid-collect\"");
    let _collector = collect(place);
    there("2");
}

#[test]
fn wrong_configurations_are_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let edge = Edge::new(folder.path(), "r1", 1883, "");
    let file = folder.path().join("publish.toml");
    let right = fs::read_to_string(&file).unwrap();
    for (from, to, says) in [
        ("\"r1\"", "\"+\"", "robot \"+\" has '+'"),
        ("127.0.0.1:1883", "192.168.1.10:1883", "is open to the network"),
        ("\"outbox\"", "\"edge.toml\"", "edge.toml: is a file: name a folder"),
    ] {
        fs::write(&file, right.replacen(from, to, 1)).unwrap();
        let output = Command::new(env!("CARGO_BIN_EXE_flexid"))
            .args(["publish", "--config"])
            .arg(&file)
            .output()
            .unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!((output.status.code(), said.lines().count()), (Some(2), 1), "{said}");
        assert!(said.contains(says), "{said}");
    }
    fs::write(&file, right).unwrap();
    let _publisher = edge.publish();
    until("the lock", || folder.path().join("outbox/box").exists().then_some(()));
    let output = Command::new(env!("CARGO_BIN_EXE_flexid"))
        .args(["publish", "--config"])
        .arg(&file)
        .output()
        .unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(said.contains("outbox: another `flexid publish` uses it"), "{said}");
    assert_eq!(output.status.code(), Some(1));

    // The daemon's configuration is that of another robot.
    let model = folder.path().join("mill3-model.toml");
    let text = fs::read_to_string(&model).unwrap();
    fs::write(&model, text.replace("joint_2", "axis_2")).unwrap();
    edge.find(1);
    until_logged(
        &edge.log(),
        "has not the joints of the daemon's finding (joint_1, joint_2, joint_3): name the daemon's own",
    );
    until("kept", || (edge.kept() == 1).then_some(()));
}
