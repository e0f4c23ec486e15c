//! The cost of reading a table: 10 kHz, nine columns, as text in memory.
//!
//! `cargo bench -p flexid-pipeline`; throughput is in bytes of the text.

use std::hint::black_box;
use std::path::Path;
use std::time::Duration;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use flexid_pipeline::source::{Flow, FrameSource as _, Layout, TableLog};

/// Seconds of the table.
const SECONDS: u32 = 6;
const RATE_HZ: u32 = 10_000;
const NAMES: &str = "Fx [N],Fy [N],Fz [N],ax [g],ay [g],az [g],q1 [deg],q2 [deg],q3 [deg]\n";

/// Rows of five decimals, as data acquisition units write them.
fn text() -> String {
    let row = |row: u32| {
        let time_s = f64::from(row) / f64::from(RATE_HZ);
        let [x, y, z] = [50.0, 90.0, 170.0].map(|hz: f64| (hz * time_s).sin());
        format!(
            "{:.5},{:.5},{:.5},{x:.5},{y:.5},{z:.5},0.0000000,-25.7831008,54.4309905\n",
            100.0 * x,
            -60.0 * y,
            30.0 * z
        )
    };
    let rows: String = (0..SECONDS * RATE_HZ).map(row).collect();
    format!("{NAMES}{rows}")
}

fn table(criterion: &mut Criterion) {
    let text = text();
    let layout = Layout {
        axes: ["Fx", "Fy", "Fz", "ax", "ay", "az"].map(str::to_owned),
        joints: ["q1", "q2", "q3"].map(|name| (name.to_owned(), false)).to_vec(),
        rate_hz: Some(f64::from(RATE_HZ)),
        base: None,
        topics: None,
    };
    let read = || {
        let (text, mut batch, mut readings) = (black_box(text.as_bytes()), Vec::new(), 0);
        let mut table = TableLog::open(Path::new("cut.csv"), text, &layout, None).unwrap();
        while table.read(&mut batch, Duration::ZERO).unwrap() == Flow::Open {
            readings += batch.len();
            batch.clear();
        }
        readings
    };
    let mut group = criterion.benchmark_group("table");
    group.throughput(Throughput::Bytes(text.len() as u64));
    group.bench_function("nine columns", |bencher| bencher.iter(read));
    group.finish();
}

criterion_group!(benches, table);
criterion_main!(benches);
