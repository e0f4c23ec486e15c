//! Each finding arrives, in its order, whatever ends in between.

use std::fs;
use std::process::Command;
use std::time::{Duration, Instant};

use serde_json::Value;

use super::broker::{Broker, messages, sequences};
use super::edge::Edge;
use super::{until, until_logged};

/// Most memory of a publisher, MB.
const MOST_MB: u64 = 20;
/// Largest part of a core that a publisher takes.
const MOST_CORE: f64 = 0.005;

const FINDING: &str = "flexid/v1/hall/r1/finding";
const STATUS: &str = "flexid/v1/hall/r1/status";

#[test]
fn none_is_lost_with_broker_off_and_killed_and_publisher_killed() {
    let folder = tempfile::tempdir().unwrap();
    let mut broker = Broker::new(folder.path(), "allow_anonymous true");
    let edge = Edge::new(&folder.path().join("box"), "r1", broker.port, "");
    let (log, heard) = (edge.log(), folder.path().join("heard"));

    // The broker is off.
    let publisher = edge.publish();
    until_logged(&log, "nobody listens there: is mosquitto running");
    for number in 1..=3 {
        edge.find(number);
        until("kept", || (edge.kept() == number as usize).then_some(()));
    }
    broker.start();
    let _subscription = broker.subscribe(FINDING, &heard, &["-i", "reader"]);
    until("three findings", || sequences(&heard).contains(&3).then_some(()));
    until("online", || (broker.retained(STATUS)?["online"] == true).then_some(()));

    // The publisher is killed, the will told, and a daemon that has nothing new to say gives no finding.
    drop(publisher);
    until("offline", || (broker.retained(STATUS)?["online"] == false).then_some(()));
    let publisher = edge.publish();
    until("online", || (broker.retained(STATUS)?["online"] == true).then_some(()));
    edge.find(4);
    until("four findings", || sequences(&heard).contains(&4).then_some(()));

    // The broker is killed, and forgets what it retained.
    broker.kill();
    until_logged(&log, "findings wait in the outbox");
    for number in 5..=6 {
        edge.find(number);
        until("kept", || (edge.kept() == number as usize).then_some(()));
    }
    drop(publisher);
    broker.start();
    // It has forgotten who listens.
    until_logged(&folder.path().join("mosquitto.log"), "Received SUBSCRIBE from reader");
    let publisher = edge.publish();
    until("six findings", || sequences(&heard).contains(&6).then_some(()));

    let mut heard_first: Vec<u64> = Vec::new();
    for (_, own) in messages(&heard) {
        let sequence = own["sequence"].as_u64().unwrap();
        // The content is that of the daemon, and so are its instants.
        assert_eq!(own["joints"][0]["stiffness"][0].as_f64(), Some(sequence as f64), "{own}");
        assert_eq!(
            (&own["site"], &own["robot_id"], &own["schema"]),
            (&"hall".into(), &"r1".into(), &2.into())
        );
        assert_eq!(own["config_sha256"].as_str().unwrap(), sum(&edge, "edge.toml"));
        assert_eq!(own["model_sha256"].as_str().unwrap(), sum(&edge, "mill3-model.toml"));
        if !heard_first.contains(&sequence) {
            heard_first.push(sequence);
        }
    }
    assert_eq!(heard_first, [1, 2, 3, 4, 5, 6]);
    assert_eq!(broker.retained(FINDING).unwrap()["sequence"], 6);

    // What is asked for comes once more, and does not take the place of the newest.
    let before = sequences(&heard).len();
    broker.publish("flexid/v1/hall/r1/resend", "2-3");
    broker.publish("flexid/v1/hall/r1/resend", "everything");
    broker.publish("flexid/v1/hall/r1/resend", "7-99");
    until("two again", || (sequences(&heard).len() == before + 2).then_some(()));
    assert_eq!(sequences(&heard)[before..], [2, 3]);
    until_logged(
        &log,
        "\"everything\" is no request: send a sequence, 17, or the first and last, 17-20",
    );
    assert_eq!(broker.retained(FINDING).unwrap()["sequence"], 6);

    assert!(publisher.terminate());
    assert_eq!(broker.retained(STATUS).unwrap()["online"], false);
}

fn sum(edge: &Edge, file: &str) -> String {
    let output = Command::new("sha256sum").arg(edge.folder.join(file)).output().unwrap();
    String::from_utf8(output.stdout).unwrap()[..64].to_owned()
}

#[test]
fn a_finding_is_the_result_that_watch_prints_and_its_envelope() {
    let folder = tempfile::tempdir().unwrap();
    let edge = Edge::new(folder.path(), "r1", 1, "");
    let publisher = edge.publish();
    edge.find(1);
    until("kept", || (edge.kept() == 1).then_some(()));
    assert!(publisher.terminate());
    // The same estimate, which the daemon sends anew to each client, is the same finding.
    let publisher = edge.publish();
    let answers = || fs::read_to_string(edge.log()).unwrap().matches("the daemon answers").count();
    until("the second publisher hears the daemon", || (answers() == 2).then_some(()));
    edge.find(2);
    until("kept", || (edge.kept() == 2).then_some(()));
    assert!(publisher.terminate());

    let mut files: Vec<_> =
        fs::read_dir(edge.folder.join("outbox")).unwrap().map(|own| own.unwrap().path()).collect();
    files.retain(|file| file.extension().is_some_and(|own| own == "json"));
    files.sort();
    let mut own: Value = serde_json::from_str(&fs::read_to_string(&files[1]).unwrap()).unwrap();
    let mut watch = Command::new(env!("CARGO_BIN_EXE_flexid"));
    watch.args(["watch", "unix:flexid.sock", "--json", "--until", "identified", "--timeout", "30"]);
    let printed = watch.current_dir(&edge.folder).output().unwrap().stdout;
    let printed: Value = serde_json::from_slice(
        printed.trim_ascii().split(|byte| *byte == b'\n').next_back().unwrap(),
    )
    .unwrap();
    let entries = own.as_object_mut().unwrap();
    let mut envelope = entries.clone();
    entries.retain(|entry, _| printed.get(entry).is_some());
    envelope.retain(|entry, _| printed.get(entry).is_none());
    assert_eq!(own, printed);
    let names: Vec<&str> = envelope.keys().map(String::as_str).collect();
    let expected = "begun boot_id box config_sha256 found_at model_sha256 robot_id sequence site synchronised tool";
    assert_eq!(names.join(" "), expected);
    let boot = fs::read_to_string("/proc/sys/kernel/random/boot_id").unwrap();
    assert_eq!((&envelope["sequence"], &envelope["boot_id"]), (&2.into(), &boot.trim().into()));
}

/// Without room on the disk findings wait in memory, and nothing of a finding is heard before it is on the disk.
#[test]
fn a_full_disk_delays_findings_only() {
    let folder = tempfile::tempdir().unwrap();
    let mut broker = Broker::new(folder.path(), "allow_anonymous true");
    broker.start();
    let edge = Edge::new(&folder.path().join("box"), "r1", broker.port, "");
    let heard = folder.path().join("heard");
    let _subscription = broker.subscribe(FINDING, &heard, &[]);
    fs::create_dir(edge.folder.join("outbox")).unwrap();
    // A disk of its own, which only the publisher sees.
    let run = "mount -t tmpfs -o size=64k none outbox && exec \"$0\" \"$@\"";
    let program = env!("CARGO_BIN_EXE_flexid");
    let publisher = edge
        .publish_by("unshare", &["--user", "--map-root-user", "--mount", "sh", "-c", run, program]);
    let outbox = format!("/proc/{}/root{}/outbox", publisher.0.id(), edge.folder.display());
    until_logged(&edge.log(), "connected");
    let fill = format!("{outbox}/fill");
    let filled = fs::write(&fill, vec![0; 1 << 20]);
    assert!(filled.is_err(), "the disk is not full");
    edge.find(1);
    until_logged(
        &edge.log(),
        "cannot be written: No space left on device (os error 28): make room",
    );
    edge.find(2);
    assert_eq!(sequences(&heard), [0; 0]);
    fs::remove_file(&fill).unwrap();
    until("two findings", || sequences(&heard).contains(&2).then_some(()));
    assert_eq!(sequences(&heard), [1, 2]);
    let stiffness = |own: &Value| own["joints"][0]["stiffness"][0].as_f64().unwrap();
    assert_eq!(
        messages(&heard).iter().map(|(_, own)| stiffness(own)).collect::<Vec<_>>(),
        [1.0, 2.0]
    );
}

#[test]
fn a_publisher_takes_little() {
    let folder = tempfile::tempdir().unwrap();
    let mut broker = Broker::new(folder.path(), "allow_anonymous true");
    broker.start();
    let edge = Edge::new(&folder.path().join("box"), "r1", broker.port, "");
    let heard = folder.path().join("heard");
    let _subscription = broker.subscribe(FINDING, &heard, &[]);
    let publisher = edge.publish();
    for number in 1..=5 {
        edge.find(number);
        until("heard", || sequences(&heard).contains(&number).then_some(()));
    }
    // A daemon that mills tells its state and its bus twice a second.
    let process = format!("/proc/{}", publisher.0.id());
    let (begun, before) = (Instant::now(), taken(&process));
    while begun.elapsed() < Duration::from_secs(4) {
        edge.live();
        std::thread::sleep(Duration::from_millis(250));
    }
    let part = (taken(&process) - before) / begun.elapsed().as_secs_f64();
    let status = fs::read_to_string(format!("{process}/status")).unwrap();
    let most = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap();
    let megabytes = most.trim().trim_end_matches(" kB").parse::<u64>().unwrap() as f64 / 1000.0;
    println!("a publisher takes {megabytes:.1} MB and {:.2} % of a core", 100.0 * part);
    assert!(megabytes <= MOST_MB as f64, "{megabytes} MB");
    assert!(part <= MOST_CORE, "{part} of a core");
}

/// The time that the threads of a process have run, s.
fn taken(process: &str) -> f64 {
    let tasks = fs::read_dir(format!("{process}/task")).unwrap().map(|task| task.unwrap().path());
    let ran = tasks.filter_map(|task| fs::read_to_string(task.join("schedstat")).ok());
    ran.map(|text| text.split(' ').next().unwrap().parse::<f64>().unwrap() * 1e-9).sum()
}
