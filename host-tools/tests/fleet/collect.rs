//! From boxes over bridges with certificates into one table: none is lost, and none is there twice.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

use super::broker::{Broker, free_port};
use super::database::Postgres;
use super::edge::Edge;
use super::plant::{FLEXID, certificates, collect, plant, prepare, robot};
use super::{Running, until, until_logged};

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

/// The publisher of a box whose outbox is a small disk of its own; and the path to that.
fn publish_to_disk(edge: &Edge) -> (Running, PathBuf) {
    fs::create_dir(edge.folder.join("outbox")).unwrap();
    let run = "mount -t tmpfs -o size=400k none outbox && exec \"$0\" \"$@\"";
    let unshare = ["--user", "--map-root-user", "--mount", "sh", "-c", run, FLEXID];
    let publisher = edge.publish_by("unshare", &unshare);
    let outbox = format!("/proc/{}/root{}/outbox", publisher.0.id(), edge.folder.display());
    let outbox = PathBuf::from(outbox);
    until("the outbox", || outbox.join("box").exists().then_some(()));
    (publisher, outbox)
}

/// The newest sequence in an outbox.
fn newest(outbox: &Path) -> u64 {
    let names = fs::read_dir(outbox).into_iter().flatten().map(|own| own.unwrap().file_name());
    let sequence =
        |name: OsString| name.to_str()?.strip_suffix(".json")?.split('-').next()?.parse().ok();
    names.filter_map(sequence).max().unwrap_or(0)
}

/// Boxes that each find so much, to a plant that is off, without its collector, and killed; the disk of a box is full.
fn every_finding_arrives(boxes: usize, findings: u64) {
    let begun = Instant::now();
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path();
    let names: Vec<String> = (1..=boxes).map(|number| format!("r{number:03}")).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    certificates(place, &names);
    let postgres = Postgres::start_in(place);
    let outer = free_port();
    let mut plant = plant(place, outer);
    prepare(place, &postgres, plant.port);
    let start = |name: &&str| {
        let (edge, mut broker) = robot(place, name, outer);
        broker.start();
        (edge, broker)
    };
    let robots: Vec<(Edge, Broker)> = names.iter().map(start).collect();
    let (publisher, disk) = publish_to_disk(&robots[0].0);
    let fill = disk.join("fill");
    let mut outboxes = vec![disk];
    let mut publishers = vec![publisher];
    for (edge, _) in &robots[1..] {
        publishers.push(edge.publish());
        outboxes.push(edge.folder.join("outbox"));
    }

    let ask = |select: &str| postgres.ask(select).parse::<u64>().unwrap();
    // However long it takes, while there are more of them.
    let until_there = |which: &str, all: u64| {
        let mut there = ask(&format!("select count(*) from finding {which}"));
        while there < all {
            let more = || {
                Some(ask(&format!("select count(*) from finding {which}")))
                    .filter(|now| *now > there)
            };
            there = until("another finding", more);
        }
    };
    let mut collector = Some(collect(place));
    for number in 1..=findings {
        let at = |tenth: u64| number == findings * tenth / 10;
        if at(2) {
            plant.start();
        }
        if at(3) {
            collector = None;
        }
        if at(5) {
            collector = Some(collect(place));
            assert!(fs::write(&fill, vec![0; 1 << 20]).is_err(), "the disk is not full");
        }
        if at(7) {
            // What made room there cannot be sent again.
            until_there("where robot = 'r001'", number - 1);
            fs::remove_file(&fill).unwrap();
            plant.kill();
        }
        if at(9) {
            plant.start();
        }
        robots.iter().for_each(|(edge, _)| edge.find(number));
        for outbox in &outboxes {
            until("kept", || (newest(outbox) == number).then_some(()));
        }
    }
    until_there("", boxes as u64 * findings);

    let robots_with_all = format!(
        "select count(*) from (select from finding group by robot
         having count(*) = {findings} and min(sequence) = 1 and max(sequence) = {findings} and count(distinct sequence) = {findings}) as own"
    );
    assert_eq!(ask(&robots_with_all), boxes as u64);
    let wrong = "select count(*) from (select (body->'joints'->0->'stiffness'->>0)::float <> sequence as is_other,
        found_at < lag(found_at) over (partition by robot order by sequence) as is_earlier from finding) as own where is_other or is_earlier";
    assert_eq!(ask(wrong), 0);
    assert_eq!(ask("select count(*) from refused") + ask("select count(*) from gap"), 0);
    assert!(collector.unwrap().terminate());
    println!("{boxes} boxes with {findings} findings each: {:.0} s", begun.elapsed().as_secs_f64());
}

#[test]
fn every_finding_of_ten_boxes_arrives() {
    every_finding_arrives(10, 10);
}

/// `tests/run --full` has this one.
#[test]
#[ignore = "two minutes"]
fn every_finding_of_a_hundred_boxes_arrives() {
    every_finding_arrives(100, 50);
}
