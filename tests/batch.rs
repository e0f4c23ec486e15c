//! Many recordings, as the manual runs them: GNU parallel is killed in the midst and goes on, and what a task of a cluster runs.
//! The commands are those of the manual, the scripts those beside the scenario.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, SystemTime};

use flexid_hil::process::{Program, until};
use flexid_hil::programs;
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use tempfile::TempDir;

const MANUAL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../host-tools/docs/identify.md");
const SCENARIO: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../host-tools/scenario");
/// Recordings that can be identified. One more is empty.
const SOUND: usize = 8;
const PATIENCE: Duration = Duration::from_secs(120);

/// The code of the manual's section, block by block.
fn blocks() -> Vec<String> {
    let manual = fs::read_to_string(MANUAL).unwrap();
    let (_, section) = manual.split_once("## Thousands of recordings\n").unwrap();
    let (section, _) = section.split_once("\n## ").unwrap();
    let code = section.split("\n```").skip(1).step_by(2);
    code.map(|block| block.split_once('\n').unwrap().1.to_owned()).collect()
}

/// A shell in `folder` that finds the programs, two jobs of GNU parallel at once.
fn bash(folder: &Path, script: &str) -> Command {
    let path = [programs::folder().unwrap().into(), PathBuf::from("/usr/bin"), "/bin".into()];
    let mut command = Command::new("setsid");
    command.args(["bash", "-c", script]).current_dir(folder);
    command.env("PATH", std::env::join_paths(path).unwrap()).env("PARALLEL", "--jobs 2");
    command
}

/// Standard output of a script that ends with this exit status.
fn run(folder: &Path, script: &str, status: i32) -> String {
    let output = bash(folder, script).output().unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(status), "{script}\n{errors}");
    String::from_utf8(output.stdout).unwrap()
}

/// A folder with recordings of a robot, and a list of them.
fn folder(setup: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let scripts = ["one.sh", "part.sh"];
    for file in
        ["mill3.toml", "mill3.urdf", "mill3.dbc", "mill3-model.toml"].into_iter().chain(scripts)
    {
        fs::copy(Path::new(SCENARIO).join(file), folder.path().join(file)).unwrap();
    }
    let edge = Path::new(SCENARIO).join("mill3-edge.toml");
    fs::copy(edge, folder.path().join("edge.toml")).unwrap();
    fs::create_dir(folder.path().join("recordings")).unwrap();
    let simulate = "flexid simulate --config edge.toml --experiments 1 --seed $seed --candump recordings/$seed.log";
    run(folder.path(), &format!("set -e; for seed in {{1..{SOUND}}}; do {simulate}; done"), 0);
    fs::write(folder.path().join("recordings/empty.log"), "").unwrap();
    run(folder.path(), setup, 0);
    folder
}

/// The lines that have been written, with the time of each.
fn lines(folder: &Path) -> BTreeMap<PathBuf, SystemTime> {
    let files = fs::read_dir(folder.join("results")).unwrap().map(|entry| entry.unwrap().path());
    let files = files.filter(|file| file.extension().is_some_and(|end| end == "csv"));
    files.map(|file| (file.clone(), fs::metadata(file).unwrap().modified().unwrap())).collect()
}

/// Processes of a session that have not ended.
fn session(leader: u32) -> Vec<i32> {
    let processes = fs::read_dir("/proc").unwrap().filter_map(|entry| {
        let name = entry.unwrap().file_name();
        let stat = fs::read_to_string(Path::new("/proc").join(&name).join("stat")).ok()?;
        // The name of the program may hold anything.
        let (_, fields) = stat.rsplit_once(") ")?;
        let fields: Vec<&str> = fields.split(' ').collect();
        let is_of = fields[3].parse() == Ok(leader) && fields[0] != "Z";
        is_of.then(|| name.to_str()?.parse().ok())?
    });
    processes.collect()
}

#[test]
fn a_batch_that_is_killed_in_the_midst_goes_on_to_the_same_table() {
    let blocks = blocks();
    let [setup, parallel, sbatch, join] = &blocks[..] else { panic!("{blocks:#?}") };
    let whole = folder(setup);
    // Its exit status is the number of jobs that failed.
    run(whole.path(), parallel, 1);
    let missing = run(whole.path(), join, 0);
    let table = || fs::read_to_string(whole.path().join("table.csv")).unwrap();
    let uninterrupted = table();
    assert_eq!((missing.as_str(), uninterrupted.lines().count()), ("", 2 + SOUND), "{missing}");
    let header: Vec<&str> = uninterrupted.lines().next().unwrap().split(',').collect();
    assert_eq!((header[0], header[6], header.len()), ("recording", "identified", 9 + 2 * 36));
    for line in uninterrupted.lines().skip(1) {
        match line.strip_prefix("recordings/empty.log,2,") {
            Some(reason) => assert!(reason.contains("recordings/empty.log: is empty"), "{line}"),
            None => assert!(line.contains(".log,0,,consistent,"), "{line}"),
        }
    }

    let killed = folder(setup);
    let mut command = bash(killed.path(), parallel);
    let program = Program::start("parallel", &mut command, killed.path()).unwrap();
    let some = || Ok(lines(killed.path()).len() >= 3);
    until("three lines", PATIENCE, some).unwrap();
    let leader = program.id();
    until("the end of all jobs", PATIENCE, || {
        let left = session(leader);
        for id in &left {
            // One may have ended since.
            let _ = kill(Pid::from_raw(*id), Signal::SIGKILL);
        }
        Ok(left.is_empty())
    })
    .unwrap();
    program.wait(PATIENCE).unwrap();
    let before = lines(killed.path());
    assert!(before.len() < SOUND, "killed too late: {before:?}");
    let is_whole = |file: &PathBuf| fs::read_to_string(file).unwrap().lines().count() == 2;
    assert!(before.keys().all(is_whole), "{before:?}");
    assert!(run(killed.path(), join, 0).lines().count() > 1, "nothing is missing");
    run(killed.path(), parallel, 1);
    let after = lines(killed.path());
    let kept = before.iter().filter(|(file, time)| after.get(*file) == Some(time)).count();
    // Two jobs were running, and one is repeated since it failed.
    assert!(kept + 3 >= before.len() && kept > 0, "{before:?} {after:?}");
    assert_eq!(run(killed.path(), join, 0), "");
    assert_eq!(fs::read_to_string(killed.path().join("table.csv")).unwrap(), uninterrupted);

    // What a cluster runs, some of the lines being lost.
    let (_, wrapped) = sbatch.split_once("--wrap '").unwrap();
    let slurm = wrapped.split_once('\'').unwrap().0;
    let job = fs::read_to_string(Path::new(SCENARIO).join("job.yaml")).unwrap();
    let (_, command) = job.split_once("command: [sh, -c, \"").unwrap();
    let kubernetes = command.split_once('"').unwrap().0;
    for (variable, task, number) in [
        ("SLURM_ARRAY_TASK_ID", slurm, "1"),
        ("SLURM_ARRAY_TASK_ID", slurm, "9"),
        ("JOB_COMPLETION_INDEX", kubernetes, "2"),
        ("JOB_COMPLETION_INDEX", kubernetes, "0"),
    ] {
        let log = run(whole.path(), &format!("sed -n {number}~500p list.txt"), 0);
        let lost = Path::new(log.trim()).file_stem().map(|stem| {
            let name = stem.to_str().unwrap();
            whole.path().join(format!("results/{name}.csv"))
        });
        lost.iter().for_each(|file| fs::remove_file(file).unwrap());
        run(whole.path(), &format!("export {variable}={number}; {task}"), 0);
        assert!(lost.is_none_or(|file| file.exists()), "{variable}={number}: {task}");
    }
    run(whole.path(), join, 0);
    assert_eq!(table(), uninterrupted);
}
