//! Single wrong samples.

use flexid_core::stream::{Reading, StreamHealth};

use super::{Bench, PERIOD};

/// A record of which every so many accelerations along y are 5 m/s² too high.
fn spiked(every: usize) -> (Vec<super::Record<{ super::CAPACITY }>>, StreamHealth) {
    let mut bench = Bench::new();
    for n in 0..2048 {
        let size = if n >= 300 { 300.0 } else { 0.0 };
        let counter = bench.counter & 0xffff;
        let phase = f64::from(bench.sent);
        let mut noise = |size: f64| size * bench.random.normal();
        let force = [0.31, 0.47, 0.13].map(|w: f64| (size * (w * phase).sin() + noise(0.2)) as f32);
        let mut motion = [0.05, 0.11, 0.02]
            .map(|w: f64| ((w * phase).sin() * size / 100.0 + noise(0.02)) as f32);
        if n % every == every / 2 {
            motion[1] += 5.0;
        }
        bench.push(bench.now, Reading::Force { counter, value: force });
        bench.push(bench.now + 1.3e-4, Reading::Acceleration { counter, value: motion });
        if n % 200 == 0 {
            bench.angles();
        }
        bench.counter = bench.counter.wrapping_add(1);
        bench.sent += 1;
        bench.now += PERIOD;
    }
    bench.finish()
}

#[test]
fn spikes_are_bridged_and_counted_by_axis() {
    let (whole, none) = spiked(10_000);
    let (records, health) = spiked(300);
    assert_eq!((none.spikes, health.spikes), ([0; 6], [0, 0, 0, 0, 7, 0]));
    assert_eq!((records.len(), health.bridged, health.spiked), (1, 0, 0));
    for (axis, (own, other)) in
        records[0].acceleration.iter().zip(&whole[0].acceleration).enumerate()
    {
        let worst = own.iter().zip(other).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(worst < 0.2, "axis {axis}: {worst}");
    }
    let [own, other] = [&records, &whole].map(|records| records[0].acceleration_noise[1]);
    assert!(own > other && own < 1.1 * other, "{own}, {other}");
}

#[test]
fn a_record_of_many_spikes_is_refused() {
    let (records, health) = spiked(100);
    assert_eq!((records.len(), health.records, health.spiked), (0, 0, 1));
    assert!(health.spikes[4] > 15 && health.samples_discarded == 2048, "{health:?}");
}
