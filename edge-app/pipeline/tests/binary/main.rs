//! Files that are no text, as other people's programs wrote them: `tests/fuzz/seeds/write.py` holds the cut that is in all of them.

macro_rules! seed {
    ($file:literal) => {
        ($file, include_bytes!(concat!("../../../../tests/fuzz/seeds/", $file)).as_slice())
    };
}

#[path = "../readings/cut.rs"]
mod cut;
mod hostile;
#[path = "../readings/mod.rs"]
mod readings;

use std::path::Path;

use flexid_pipeline::input::Binary;
use flexid_pipeline::source::{Layout, TableLog, Topics};
use proptest::prelude::*;

use cut::is_the_cut;
use readings::{all, forces, layout};

/// Bags without and with compression.
const BAGS: [(&str, &[u8]); 4] = [
    seed!("bag/rosbags.mcap"),
    seed!("bag/mcap-none.mcap"),
    seed!("bag/mcap-zstd.mcap"),
    seed!("bag/mcap-lz4.mcap"),
];

/// Names of the joints of a layout.
fn with_joints(layout: Layout, names: &[&str]) -> Layout {
    Layout { joints: names.iter().map(|name| (name.to_string(), false)).collect(), ..layout }
}

fn of_bag() -> Layout {
    let topics = Topics {
        wrench: "/ft/wrench".into(),
        acceleration: "/imu".into(),
        joints: Some("/joint_states".into()),
    };
    let own = Layout { topics: Some(topics), ..layout(None, &[]) };
    with_joints(own, &["joint_1", "joint_2"])
}

fn open_as<'a>(bytes: &'a [u8], layout: &Layout) -> Result<TableLog<'a>, String> {
    let format = Binary::of(bytes).ok_or("no magic")?;
    TableLog::open_binary(Path::new("cut"), format, bytes, layout, None)
        .map_err(|error| error.to_string())
}

/// The bytes without the last ones, and what comes of them.
fn spoilt(bytes: &[u8], layout: &Layout) -> Result<(usize, Option<String>), String> {
    let (arrivals, error) = all(open_as(bytes, layout)?);
    Ok((forces(&arrivals).len(), error))
}

#[test]
fn bags_of_other_programs_are_read() {
    for (name, bytes) in BAGS {
        is_the_cut(name, open_as(bytes, &of_bag()), true);
    }
}

/// Where the chunks of a bag stand.
fn chunks(bytes: &[u8]) -> Vec<std::ops::Range<usize>> {
    let (mut place, mut chunks) = (8, Vec::new());
    while place + 9 < bytes.len() {
        let length = u64::from_le_bytes(bytes[place + 1..place + 9].try_into().unwrap()) as usize;
        if bytes[place] == 6 {
            chunks.push(place + 9..place + 9 + length);
        }
        place += 9 + length;
    }
    chunks
}

#[test]
fn what_a_bag_that_is_cut_off_holds_is_used() {
    for (name, bytes) in BAGS {
        let (forces, error) = spoilt(&bytes[..bytes.len() / 2], &of_bag()).unwrap();
        assert!(forces >= 8, "{name}: {forces}");
        assert_eq!(
            error.as_deref(),
            Some("cut: is cut off, and what comes before is used: copy or record it again"),
            "{name}"
        );
    }
    let (name, bytes) = BAGS[2];
    let mut damaged = bytes.to_vec();
    let chunk = chunks(bytes).remove(3);
    damaged[(chunk.start + chunk.end) / 2] ^= 1;
    let (forces, error) = spoilt(&damaged, &of_bag()).unwrap();
    assert!((8..40).contains(&forces) && error.unwrap().contains("is damaged: a chunk "), "{name}");
    // Another length of its content, and no checksum.
    let (mut damaged, chunk) = (BAGS[1].1.to_vec(), chunks(BAGS[1].1).remove(3));
    damaged[chunk.start + 16] ^= 1;
    damaged[chunk.start + 24..chunk.start + 28].fill(0);
    let (_, error) = spoilt(&damaged, &of_bag()).unwrap();
    assert!(error.unwrap().contains("is damaged: a chunk states "));
}

#[test]
fn what_a_bag_lacks_is_named() {
    let listed = "/ft/wrench (geometry_msgs/msg/WrenchStamped), /imu (sensor_msgs/msg/Imu), /joint_states (sensor_msgs/msg/JointState)";
    let with = |change: &dyn Fn(&mut Topics)| {
        let mut own = of_bag();
        change(own.topics.as_mut().unwrap());
        own
    };
    for (layout, expected) in [
        (
            Layout { topics: None, ..of_bag() },
            format!("cut: is a bag of ROS 2, and the configuration does not name its topics: it has {listed}: add [topics] wrench"),
        ),
        (
            with(&|own| own.wrench = "/wrench".into()),
            format!("cut: has no topic /wrench: it has {listed}: correct [topics], or record it too"),
        ),
        (
            with(&|own| own.wrench = "/imu".into()),
            "cut: has messages of type sensor_msgs/msg/Imu on /imu: [topics] wrench must be geometry_msgs/WrenchStamped".into(),
        ),
        (
            with(&|own| own.joints = Some("/states".into())),
            format!("cut: has no topic /states: it has {listed}: "),
        ),
        (
            with_joints(of_bag(), &["joint_1", "joint_9"]),
            "cut: has no joint \"joint_9\" on /joint_states: it has gripper, joint_1, joint_2: name its joints in [signals] joints".into(),
        ),
    ] {
        let error = open_as(BAGS[0].1, &layout).err().unwrap();
        assert!(error.starts_with(&expected), "{error}\n{expected}");
    }
}

/// A bag in which the stamps of the accelerations are changed: of message, ns.
fn restamped(change: impl Fn(usize, u32) -> u32) -> Vec<u8> {
    let mut bytes = BAGS[1].1.to_vec();
    // Behind the frame `tool0` an orientation of 0, 0, 0, 1 shows an Imu.
    let is_imu =
        |own: &[u8]| own.starts_with(b"tool0\0") && own.get(36..44) == Some(&1_f64.to_le_bytes());
    let places: Vec<usize> = (0..bytes.len()).filter(|place| is_imu(&bytes[*place..])).collect();
    assert_eq!(places.len(), 40);
    for (message, place) in places.into_iter().enumerate() {
        let stamp = place - 8..place - 4;
        let own = u32::from_le_bytes(bytes[stamp.clone()].try_into().unwrap());
        bytes[stamp].copy_from_slice(&change(message, own).to_le_bytes());
    }
    // The sums of the chunks do not hold any more: 0 says that there is none.
    for chunk in chunks(&bytes) {
        bytes[chunk.start + 24..chunk.start + 28].fill(0);
    }
    bytes
}

#[test]
fn stamps_of_two_clocks_are_arrivals() {
    let shows = |change: &dyn Fn(usize, u32) -> u32| {
        let bytes = restamped(change);
        let table = open_as(&bytes, &of_bag())?;
        Ok::<_, String>((table.shown().own_clocks, table.shown().rate_hz))
    };
    // Less than the delay that is taken for typical.
    assert!(!shows(&|_, own| own + 19_000).unwrap().0);
    for (change, rate_hz) in [
        (
            &(|message: usize, own: u32| own + 50_000 * (message as u32 % 7))
                as &dyn Fn(usize, u32) -> u32,
            1000.0,
        ),
        (&|_, own| own + 450_000, 1000.0),
        (&|_, own| own + 21_000, 1000.0),
        (&|_, own| 2 * own, 500.0),
    ] {
        let (own_clocks, shown_hz) = shows(change).unwrap();
        assert!(own_clocks && (shown_hz.unwrap() / rate_hz - 1.0).abs() < 0.06, "{shown_hz:?}");
        // No reading is lost.
        assert_eq!(spoilt(&restamped(change), &of_bag()), Ok((40, None)));
    }
    for (change, expected) in [
        (
            &(|_: usize, own: u32| own + 500_000_000) as &dyn Fn(usize, u32) -> u32,
            "cut: has stamps on /ft/wrench and /imu of other times: ",
        ),
        (&|_, _| 5, "cut: has stamps on /ft/wrench or /imu that do not go on: "),
    ] {
        let error = shows(change).unwrap_err();
        assert!(error.starts_with(expected), "{error}\n{expected}");
    }
    let of = |change: &dyn Fn(usize, u32) -> u32| spoilt(&restamped(change), &of_bag());
    // A stamp that is far off is one that is lost.
    let (forces, error) =
        of(&|message, own| if message == 20 { own + 700_000 } else { own }).unwrap();
    assert_eq!((forces, error), (40, None));
}

/// MAT files with columns, and one with matrices.
const MAT: [(&str, &[u8]); 3] =
    [seed!("mat/columns.mat"), seed!("mat/packed.mat"), seed!("mat/matrices.mat")];

/// Layout of a file with units behind the names, since it has none.
fn of_matrices() -> Layout {
    let axes = ["F(:,1)", "F(:,2)", "F(:,3)", "A(1,:)", "A(2,:)", "A(3,:)"].map(str::to_owned);
    Layout { axes, ..layout(None, &["q(1)", "q(2)"]) }
}

#[test]
fn variables_of_matlab_are_read() {
    for (name, bytes) in &MAT[..2] {
        is_the_cut(name, open_as(bytes, &layout(None, &["q(1)", "q(2)"])), true);
    }
    let (name, bytes) = MAT[2];
    is_the_cut(name, open_as(bytes, &of_matrices()), true);
    // The config states units where the file has none.
    let axes = of_matrices()
        .axes
        .map(|axis| if axis.starts_with('F') { format!("{axis} [mN]") } else { axis });
    let (arrivals, _) = all(open_as(bytes, &Layout { axes, ..of_matrices() }).unwrap());
    assert_eq!(forces(&arrivals)[39].1[0], 0.039);
    let error = open_as(bytes, &layout(None, &[])).err().unwrap();
    assert!(
        error.starts_with(
            "cut: has no column \"Fx\", \"Fy\", \"Fz\", \"ax\", \"ay\", \"az\": it has \"F(:,1)\", "
        ),
        "{error}"
    );
    let error = open_as(&MAT[0].1[..2000], &layout(None, &[])).err().unwrap();
    assert_eq!(error, "cut: is cut off or damaged: copy, save or record it again");
}

const MDF: [(&str, &[u8]); 5] = [
    seed!("mdf/plain.mf4"),
    seed!("mdf/deflate.mf4"),
    seed!("mdf/transposed.mf4"),
    seed!("mdf/groups.mf4"),
    seed!("mdf/motorola.mf4"),
];

const TDMS: [(&str, &[u8]); 4] = [
    seed!("tdms/whole.tdms"),
    seed!("tdms/segments.tdms"),
    seed!("tdms/daqmx.tdms"),
    seed!("tdms/big-endian.tdms"),
];

#[test]
fn channels_of_data_acquisition_units_are_read() {
    for (name, bytes) in MDF.into_iter().chain(TDMS) {
        is_the_cut(name, open_as(bytes, &layout(None, &[])), false);
        // Cut off at any place it is an error in one line.
        for length in (32..bytes.len()).step_by(7) {
            if let Ok((_, Some(error))) | Err(error) = spoilt(&bytes[..length], &layout(None, &[]))
            {
                assert!(
                    error.starts_with("cut: ") && !error.contains('\n'),
                    "{name} {length}: {error}"
                );
            }
        }
    }
    let axes = ["F_x", "Fy", "Fz", "ax", "ay", "az"].map(str::to_owned);
    for ((name, bytes), group) in [(MDF[1], "0"), (TDMS[0], "cut")] {
        let error =
            open_as(bytes, &Layout { axes: axes.clone(), ..layout(None, &[]) }).err().unwrap();
        let near = "(is it \"Fx\" for \"F_x\"?): write the names of its columns in [signals], or name another table";
        assert!(
            error.starts_with("cut: has no column \"F_x\": it has ") && error.ends_with(near),
            "{name}: {error}"
        );
        // With the group.
        let axes = axes.clone().map(|name| format!("{group}/{}", name.replace('_', "")));
        is_the_cut(name, open_as(bytes, &Layout { axes, ..layout(None, &[]) }), false);
    }
    let unfinished = [b"UnFinMF ", &MDF[0].1[8..]].concat();
    let error = open_as(&unfinished, &layout(None, &[])).err().unwrap();
    assert!(
        error.starts_with(
            "cut: was not finished by its writer: finish it with `pip install asammdf"
        ),
        "{error}"
    );
    let older = [&MDF[0].1[..28], &[0x4A, 1], &MDF[0].1[30..]].concat();
    let error = open_as(&older, &layout(None, &[])).err().unwrap();
    assert!(
        error.starts_with("cut: is MDF of version 3.30, and 4 is read: convert it with "),
        "{error}"
    );
}

fn seeds() -> Vec<(&'static str, &'static [u8])> {
    BAGS.into_iter().chain(MAT).chain(MDF).chain(TDMS).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(2000) })]

    /// A spoilt file is refused in one line, or gives finite values at times that do not go back.
    #[test]
    fn no_spoilt_file_stops_the_reader(
        seed in 0..seeds().len(),
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0..3_u8), 0..6),
    ) {
        let (name, bytes) = seeds()[seed];
        let mut bytes = bytes.to_vec();
        for (place, byte, edit) in edits {
            let place = 8 + place.index(bytes.len() - 8);
            match edit {
                0 => bytes[place] = byte,
                1 => bytes[place] ^= 1 << (byte % 8),
                _ => bytes.truncate(place.max(bytes.len() / 2)),
            }
        }
        let layout = if name.starts_with("bag") { of_bag() } else { layout(Some(1000.0), &[]) };
        match open_as(&bytes, &layout) {
            Err(error) => prop_assert!(!error.contains('\n')),
            Ok(table) => {
                let (arrivals, error) = all(table);
                prop_assert!(error.is_none_or(|error| !error.contains('\n')));
                prop_assert!(arrivals.windows(2).all(|pair| pair[0].time_s <= pair[1].time_s));
                for arrival in forces(&arrivals) {
                    prop_assert!(arrival.1.iter().all(|axis| axis.is_finite()));
                }
            }
        }
    }
}
