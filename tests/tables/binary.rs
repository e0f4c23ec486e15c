//! A cut as a bag of ROS 2, a MAT, an MF4 and a TDMS file, by the documents of the formats. What other programs write, the tests of the pipeline read.

use super::{Instant, RATE_HZ};

/// Names and units of the columns.
const COLUMNS: [(&str, &str); 9] = [
    ("Fx", "N"),
    ("Fy", "N"),
    ("Fz", "N"),
    ("ax", "m/s^2"),
    ("ay", "m/s^2"),
    ("az", "m/s^2"),
    ("q1", "rad"),
    ("q2", "rad"),
    ("q3", "rad"),
];

fn rows(cut: &[Instant]) -> Vec<[f64; 9]> {
    let row = |([fx, fy, fz], [ax, ay, az], [q1, q2, q3]): &Instant| {
        [*fx, *fy, *fz, *ax, *ay, *az, *q1, *q2, *q3]
    };
    cut.iter().map(row).collect()
}

/// A text behind its length.
fn text(own: &str) -> Vec<u8> {
    [&(own.len() as u32).to_le_bytes()[..], own.as_bytes()].concat()
}

fn doubles(own: &[f64]) -> Vec<u8> {
    own.iter().flat_map(|own| own.to_le_bytes()).collect()
}

/// A bag without chunks (mcap.dev/spec), with messages in little-endian CDR.
pub(crate) fn bag(cut: &[Instant]) -> Vec<u8> {
    let record =
        |kind: u8, body: &[u8]| [&[kind][..], &(body.len() as u64).to_le_bytes(), body].concat();
    let magic = b"\x89MCAP0\r\n";
    let mut bag = [&magic[..], &record(1, &[text("ros2"), text("test")].concat())].concat();
    let topics = [
        ("/ft/wrench", "geometry_msgs/msg/WrenchStamped"),
        ("/imu", "sensor_msgs/msg/Imu"),
        ("/joint_states", "sensor_msgs/msg/JointState"),
    ];
    for (id, (topic, name)) in (1_u16..).zip(topics) {
        let id = id.to_le_bytes();
        bag.extend(record(3, &[&id[..], &text(name), &text("ros2msg"), &text("")].concat()));
        bag.extend(record(
            4,
            &[&id[..], &id, &text(topic), &text("cdr"), &0_u32.to_le_bytes()].concat(),
        ));
    }
    for (row, (force, acceleration, angles)) in cut.iter().enumerate() {
        let ns = (row as f64 / RATE_HZ * 1e9) as u64;
        // The frame `tcp` ends at byte 16: doubles begin there.
        let header = [
            &[0, 1, 0, 0],
            &1_767_000_000_u32.to_le_bytes()[..],
            &(ns as u32).to_le_bytes(),
            &4_u32.to_le_bytes(),
            b"tcp\0",
        ]
        .concat();
        let mut put = |id: u16, body: &[u8]| {
            let log_ns = 1_767_000_000_000_000_000 + ns + 2_000_000;
            let stamps = [log_ns.to_le_bytes(), log_ns.to_le_bytes()].concat();
            bag.extend(record(
                5,
                &[&id.to_le_bytes()[..], &[0; 4], &stamps, &header, body].concat(),
            ));
        };
        put(1, &doubles(&[&force[..], &[0.0; 3]].concat()));
        put(2, &doubles(&[&[0.0; 25][..], acceleration, &[0.0; 9]].concat()));
        if row % 20 == 0 {
            let mut body = 3_u32.to_le_bytes().to_vec();
            for joint in 1..=3 {
                body.resize(body.len().next_multiple_of(4), 0);
                body.extend(text(&format!("joint_{joint}\0")));
            }
            body.resize(body.len().next_multiple_of(4), 0);
            body.extend(3_u32.to_le_bytes());
            body.resize(body.len().next_multiple_of(8), 0);
            body.extend(doubles(angles));
            // Neither velocities nor efforts.
            body.extend([0; 8]);
            put(3, &body);
        }
    }
    [&bag[..], &record(15, &[0; 4]), &record(2, &[0; 20]), magic].concat()
}

/// A MAT file of version 5, not compressed: `t`, `F`, `A` and `q`.
pub(crate) fn mat(cut: &[Instant]) -> Vec<u8> {
    let element = |kind: u32, data: &[u8]| {
        let mut own = [&kind.to_le_bytes()[..], &(data.len() as u32).to_le_bytes(), data].concat();
        own.resize(own.len().next_multiple_of(8), 0);
        own
    };
    let matrix = |name: &str, sizes: [usize; 2], values: &[f64]| {
        let sizes = sizes.map(|own| (own as u32).to_le_bytes()).concat();
        let class = [6, 0, 0, 0, 0, 0, 0, 0];
        let parts = [
            element(6, &class),
            element(5, &sizes),
            element(1, name.as_bytes()),
            element(9, &doubles(values)),
        ];
        element(14, &parts.concat())
    };
    let mut mat = b"MATLAB 5.0 MAT-file, a test".to_vec();
    mat.resize(124, b' ');
    mat.extend([0, 1, b'I', b'M']);
    let rows = rows(cut);
    let columns = |columns: std::ops::Range<usize>| -> Vec<f64> {
        columns.flat_map(|column| rows.iter().map(move |row| row[column])).collect()
    };
    let time: Vec<f64> = (0..cut.len()).map(|row| row as f64 / RATE_HZ).collect();
    mat.extend(matrix("t", [cut.len(), 1], &time));
    mat.extend(matrix("F", [cut.len(), 3], &columns(0..3)));
    mat.extend(matrix("A", [cut.len(), 3], &columns(3..6)));
    mat.extend(matrix("q", [1, 3], &cut[0].2));
    mat
}

/// An MF4 file of one group, in 16-bit integers with a scale for force and acceleration.
pub(crate) fn mdf(cut: &[Instant]) -> Vec<u8> {
    /// Appends a block and returns its place.
    fn block(file: &mut Vec<u8>, id: &[u8], links: &[u64], data: &[u8]) -> u64 {
        file.resize(file.len().next_multiple_of(8), 0);
        let place = file.len() as u64;
        file.extend([id, &[0; 4]].concat());
        file.extend((24 + 8 * links.len() as u64 + data.len() as u64).to_le_bytes());
        file.extend((links.len() as u64).to_le_bytes());
        file.extend(links.iter().flat_map(|own| own.to_le_bytes()));
        file.extend(data);
        place
    }
    let mut file = b"MDF     4.10    a test\0\0".to_vec();
    file.resize(64, 0);
    file[28..30].copy_from_slice(&410_u16.to_le_bytes());
    block(&mut file, b"##HD", &[0; 6], &[0; 32]);
    // Time and angles are doubles.
    let scales = [
        None,
        Some(0.1),
        Some(0.1),
        Some(0.1),
        Some(0.002),
        Some(0.002),
        Some(0.002),
        None,
        None,
        None,
    ];
    let columns = std::iter::once(("time", "s")).chain(COLUMNS);
    let mut all = Vec::new();
    let mut length = 0_u32;
    for ((name, unit), scale) in columns.zip(scales) {
        let size: u32 = if scale.is_some() { 2 } else { 8 };
        all.push((name, unit, scale, length, size));
        length += size;
    }
    let mut next = 0;
    for (name, unit, scale, place, size) in all.iter().rev() {
        let [name_place, unit_place] =
            [name, unit].map(|own| block(&mut file, b"##TX", &[], format!("{own}\0").as_bytes()));
        let conversion = scale.map_or(0, |scale: f64| {
            let data = [&[1, 0, 0, 0, 0, 0, 2, 0][..], &[0; 16], &doubles(&[0.0, scale])].concat();
            block(&mut file, b"##CC", &[0; 4], &data)
        });
        let [kind, sync] = if *name == "time" { [2, 1] } else { [0, 0] };
        let number = if scale.is_some() { 2 } else { 4 };
        let data = [
            &[kind, sync, number, 0][..],
            &place.to_le_bytes(),
            &(8 * size).to_le_bytes(),
            &[0; 60],
        ]
        .concat();
        next = block(
            &mut file,
            b"##CN",
            &[next, 0, name_place, 0, conversion, 0, unit_place, 0],
            &data,
        );
    }
    let data =
        [&[0; 8][..], &(cut.len() as u64).to_le_bytes(), &[0; 8], &length.to_le_bytes(), &[0; 4]]
            .concat();
    let group = block(&mut file, b"##CG", &[0, next, 0, 0, 0, 0], &data);
    let mut records = Vec::new();
    for (number, row) in rows(cut).iter().enumerate() {
        let values = std::iter::once(number as f64 / RATE_HZ).chain(row.iter().copied());
        for (value, scale) in values.zip(scales) {
            match scale {
                Some(scale) => records.extend(((value / scale).round() as i16).to_le_bytes()),
                None => records.extend(value.to_le_bytes()),
            }
        }
    }
    let records = block(&mut file, b"##DT", &[], &records);
    let group = block(&mut file, b"##DG", &[0, group, records, 0], &[0; 8]);
    file[64 + 24..64 + 32].copy_from_slice(&group.to_le_bytes());
    file
}

/// A TDMS file of one segment, row by row.
pub(crate) fn tdms(cut: &[Instant]) -> Vec<u8> {
    let mut described = (COLUMNS.len() as u32).to_le_bytes().to_vec();
    for (name, unit) in COLUMNS {
        described.extend(text(&format!("/'cut'/'{name}'")));
        described.extend([20_u32, 10, 1].map(u32::to_le_bytes).concat());
        described.extend((cut.len() as u64).to_le_bytes());
        described.extend(2_u32.to_le_bytes());
        described.extend(
            [&text("wf_increment")[..], &10_u32.to_le_bytes(), &(1.0 / RATE_HZ).to_le_bytes()]
                .concat(),
        );
        described
            .extend([text("unit_string"), 0x20_u32.to_le_bytes().to_vec(), text(unit)].concat());
    }
    let rows = doubles(&rows(cut).concat());
    let lengths = [(described.len() + rows.len()) as u64, described.len() as u64];
    // Description, a new list, values, one row after the other.
    let contents = 1_u32 << 1 | 1 << 2 | 1 << 3 | 1 << 5;
    let lead = [
        b"TDSm",
        &contents.to_le_bytes()[..],
        &4713_u32.to_le_bytes(),
        &lengths.map(u64::to_le_bytes).concat(),
    ]
    .concat();
    [lead, described, rows].concat()
}
