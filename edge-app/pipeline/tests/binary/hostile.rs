//! Files that are cut off, that state more than they hold, or that point to themselves: `tests/fuzz/seeds/hostile.py` makes them of the others.

use std::process::Command;

use super::{layout, of_bag, spoilt};

/// Most data of a process that reads them, bytes: a tenth of what the largest unpacks to, and that of its threads.
const MOST: u64 = 12 << 20;
const CUT_OFF: &str = "is cut off or damaged: copy, save or record it again";
const CIRCLE: &str =
    "is damaged: two of its blocks point to the same one, or in a circle: record it again";

macro_rules! hostile {
    ($file:literal, $forces:literal, $error:expr) => {{
        let (name, bytes) = seed!($file);
        (name, bytes, $forces, $error)
    }};
}

/// Seeds, the number of forces that are read, and how the error begins.
const FILES: [(&str, &[u8], usize, &str); 18] = [
    hostile!("bag/hostile-cut-off.mcap", 6, "is cut off, and what comes before is used"),
    hostile!("bag/hostile-record.mcap", 3, "is damaged: a record has more than 256 MiB"),
    hostile!("bag/hostile-states-much.mcap", 3, "has a chunk of more than 256 MiB"),
    hostile!("bag/hostile-bomb.mcap", 3, "is damaged: a chunk states 1000 bytes, and has more"),
    hostile!("mat/hostile-cut-off.mat", 0, CUT_OFF),
    hostile!(
        "mat/hostile-element.mat",
        0,
        "is damaged: Fx has 4294967288 bytes, which are not 40 times 1 values"
    ),
    hostile!("mat/hostile-states-much.mat", 0, CUT_OFF),
    hostile!("mat/hostile-packed.mat", 0, CUT_OFF),
    hostile!("mdf/hostile-cut-off.mf4", 0, CUT_OFF),
    hostile!("mdf/hostile-circle-channels.mf4", 0, CIRCLE),
    hostile!("mdf/hostile-circle-data.mf4", 0, CIRCLE),
    hostile!("mdf/hostile-shared-data.mf4", 0, CIRCLE),
    hostile!("mdf/hostile-states-much.mf4", 0, "has more than 4 GiB of records"),
    hostile!("tdms/hostile-cut-off.tdms", 0, CUT_OFF),
    hostile!("tdms/hostile-segment.tdms", 0, CUT_OFF),
    hostile!("tdms/hostile-description.tdms", 0, CUT_OFF),
    hostile!("tdms/hostile-objects.tdms", 0, CUT_OFF),
    hostile!("tdms/hostile-states-much.tdms", 0, CUT_OFF),
];

#[test]
fn hostile_files_are_refused() {
    for (name, bytes, forces, error) in FILES {
        let of_channels = layout(Some(1000.0), &[]);
        let layout = if name.starts_with("bag") { of_bag() } else { of_channels };
        let (read, fault) = match spoilt(bytes, &layout) {
            Ok((read, fault)) => (read, fault.unwrap_or_default()),
            Err(fault) => (0, fault),
        };
        assert!(fault.starts_with(&format!("cut: {error}")), "{name}: {fault}");
        assert_eq!(read, forces, "{name}");
    }
}

/// An allocation beyond the limit ends the process.
#[test]
fn hostile_files_take_little_memory() {
    let own = std::env::current_exe().unwrap();
    let mut limited = Command::new("prlimit");
    // A backtrace takes more.
    limited.env("RUST_BACKTRACE", "0").arg(format!("--data={MOST}")).arg(own);
    let ended = limited.args(["--exact", "hostile::hostile_files_are_refused"]).output().unwrap();
    let output = String::from_utf8_lossy(&ended.stdout);
    assert!(ended.status.success() && output.contains("1 passed"), "{ended:?}");
}
