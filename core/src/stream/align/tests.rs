use super::*;

struct Bench {
    aligner: Aligner,
    health: StreamHealth,
    instants: std::vec::Vec<Instant>,
    breaks: std::vec::Vec<Aligned>,
}

impl Bench {
    fn new() -> Self {
        Self::with_counter_bits(16)
    }

    fn with_counter_bits(bits: u32) -> Self {
        Self {
            aligner: Aligner::new(2000.0, bits),
            health: StreamHealth::default(),
            instants: std::vec::Vec::new(),
            breaks: std::vec::Vec::new(),
        }
    }

    fn push(&mut self, time_s: f64, counter: u32, channel: Channel) {
        let value = [counter as f32; 3];
        let (instants, breaks) = (&mut self.instants, &mut self.breaks);
        let mask = (1 << self.aligner.counter_bits) - 1;
        let frame = Frame { time_s, counter: counter & mask, channel, value };
        self.aligner.push(
            frame,
            &mut self.health,
            &mut |event, _: &mut StreamHealth| match event {
                Aligned::Instant(instant) => instants.push(instant),
                other => breaks.push(other),
            },
        );
    }

    /// Pushes both frames of the instants `counters`, the first at `start_s`.
    fn run(&mut self, start_s: f64, counters: core::ops::Range<u32>) {
        for (n, counter) in counters.enumerate() {
            let time_s = start_s + n as f64 * 5e-4;
            self.push(time_s, counter, Channel::Force);
            self.push(time_s + 1.3e-4, counter, Channel::Acceleration);
        }
    }

    fn end(&mut self) {
        let (instants, breaks) = (&mut self.instants, &mut self.breaks);
        self.aligner.flush(&mut self.health, &mut |event, _: &mut StreamHealth| match event {
            Aligned::Instant(instant) => instants.push(instant),
            other => breaks.push(other),
        });
    }
}

#[test]
fn pairs_by_counter_across_the_wrap() {
    let mut bench = Bench::new();
    bench.run(10.0, 65_000..66_000);
    bench.end();
    assert_eq!(bench.instants.len(), 1000);
    assert!(bench.instants.iter().all(|i| i.force.is_some() && i.force == i.acceleration));
    assert_eq!((bench.health.frames, bench.health.frames_lost), (2000, 0));
}

#[test]
fn counts_single_and_missing_frames_at_edges_too() {
    let mut bench = Bench::new();
    bench.push(0.0, 7, Channel::Acceleration);
    bench.push(5e-4, 8, Channel::Force);
    bench.push(2e-3, 11, Channel::Force);
    bench.push(2.1e-3, 11, Channel::Acceleration);
    bench.end();
    // Force 7, acceleration 8 and both frames of 9 and 10 are lost.
    assert_eq!(bench.health.frames_lost, 6);
    assert_eq!(bench.instants.len(), 5);
    assert!(bench.breaks.is_empty());
}

#[test]
fn a_long_gap_is_lost_and_breaks() {
    let mut bench = Bench::new();
    bench.run(0.0, 0..100);
    bench.run(0.065, 130..200);
    bench.end();
    assert_eq!(bench.health.frames_lost, 60);
    assert_eq!(bench.breaks, [Aligned::Gap(Some(30))]);
    assert_eq!(bench.health.restarts, 0);
}

#[test]
fn a_step_that_disagrees_with_time_is_a_restart() {
    // Ahead of time, behind time, back, and a silence with the counter going on.
    for (start_s, counter) in
        [(0.05, 600), (0.05, 20_000), (0.05, 40_000), (1.05, 100), (1.05, 300)]
    {
        let mut bench = Bench::new();
        bench.run(0.0, 0..100);
        bench.run(start_s, counter..counter + 50);
        bench.end();
        assert_eq!(bench.health.frames_lost, 0, "{start_s} {counter}");
        assert_eq!(bench.breaks, [Aligned::Restart], "{start_s} {counter}");
        assert_eq!(bench.instants.len(), 150);
    }
}

#[test]
fn a_burst_after_a_hold_up_is_no_restart() {
    let mut bench = Bench::new();
    bench.run(0.0, 0..100);
    for counter in 100..250 {
        bench.push(0.125, counter, Channel::Force);
        bench.push(0.125, counter, Channel::Acceleration);
    }
    bench.run(0.125, 250..300);
    bench.end();
    assert_eq!((bench.health.frames_lost, bench.health.restarts), (0, 0));
    assert_eq!(bench.instants.len(), 300);
}

#[test]
fn one_odd_counter_is_refused() {
    let mut bench = Bench::new();
    bench.run(0.0, 0..100);
    bench.push(0.05, 30_000, Channel::Force);
    bench.push(0.05013, 100, Channel::Acceleration);
    bench.run(0.0505, 101..200);
    bench.end();
    assert_eq!((bench.health.refused, bench.health.restarts), (1, 0));
    assert_eq!(bench.health.frames_lost, 1, "the force that came with the odd counter");
    assert_eq!(bench.instants.len(), 200);
}

/// Neither of the two frames that show the restart is refused, and the samples after it are there.
#[test]
fn a_counter_that_goes_on_elsewhere_is_a_restart() {
    // A little back, where up to five counters may be taken for repeated ones, and far away.
    for (counters, pairs) in [(94..200, 201..=206), (20_000..20_050, 150..=150)] {
        let mut bench = Bench::new();
        bench.run(0.0, 0..100);
        bench.run(0.05, counters);
        bench.end();
        assert_eq!((bench.health.restarts, bench.health.refused), (1, 0));
        assert_eq!(bench.health.frames_lost, 0);
        assert_eq!(bench.breaks, [Aligned::Restart]);
        assert!(pairs.contains(&bench.instants.len()), "{}", bench.instants.len());
    }
}

#[test]
fn frames_out_of_order_and_doubled() {
    let mut bench = Bench::new();
    bench.run(0.0, 0..10);
    bench.push(5e-3, 10, Channel::Force);
    bench.push(5.5e-3, 11, Channel::Force);
    bench.push(5.6e-3, 10, Channel::Acceleration);
    bench.push(5.7e-3, 11, Channel::Acceleration);
    bench.push(5.8e-3, 11, Channel::Acceleration);
    bench.push(5.9e-3, 3, Channel::Force);
    bench.end();
    assert_eq!(bench.health.frames_lost, 0);
    assert_eq!(bench.health.repeated, 2);
    assert_eq!(bench.instants.len(), 12);
}

/// At 2 kHz a counter of 8 bits turns in 128 ms.
#[test]
fn lost_turns_of_the_counter_are_gaps() {
    for lost in [200, 253, 256, 257, 512, 767] {
        let mut bench = Bench::with_counter_bits(8);
        bench.run(0.0, 0..1000);
        bench.run(f64::from(1000 + lost) * 5e-4, 1000 + lost..3000);
        bench.end();
        assert_eq!(bench.breaks, [Aligned::Gap(None)], "{lost}");
        assert_eq!((bench.health.restarts, bench.health.refused), (0, 0), "{lost}");
        assert_eq!(bench.health.frames_lost, 2 * u64::from(lost));
        assert_eq!(bench.instants.len() as u32, 3000 - lost);
        assert!(bench.instants.iter().all(|i| i.force.is_some() && i.force == i.acceleration));
    }
}

/// The counters are the same, but no frame is lost: the frames come at once when the sender goes on.
#[test]
fn a_hold_up_of_whole_turns_is_a_gap_without_loss() {
    for held_s in [0.13, 0.3, 0.45] {
        let mut bench = Bench::with_counter_bits(8);
        bench.run(0.0, 0..1000);
        for counter in 1000..3000 {
            let time_s = f64::from(counter).mul_add(5e-4, 1.3e-4);
            let time_s = time_s.max(0.5 + held_s + f64::from(counter - 1000) * 1e-4);
            bench.push(time_s, counter, Channel::Force);
            bench.push(time_s, counter, Channel::Acceleration);
        }
        bench.end();
        assert!(!bench.breaks.is_empty(), "{held_s}");
        assert!(bench.breaks.iter().all(|each| *each == Aligned::Gap(None)), "{held_s}");
        assert_eq!(bench.health.frames_lost, 0, "{held_s}");
        assert_eq!((bench.health.restarts, bench.instants.len()), (0, 3000), "{held_s}");
    }
}

/// The sender is held up between the two frames of one instant. They stay apart, and each lacks the other.
#[test]
fn a_hold_up_within_an_instant_loses_that_instant_alone() {
    for held_s in [0.13, 0.2, 0.3, 0.45] {
        let mut bench = Bench::with_counter_bits(8);
        bench.run(0.0, 0..1000);
        bench.push(0.5, 1000, Channel::Force);
        for counter in 1000..3000 {
            let time_s = f64::from(counter).mul_add(5e-4, 1.3e-4);
            let time_s = time_s.max(0.5 + held_s + f64::from(counter - 1000) * 1e-4);
            if counter > 1000 {
                bench.push(time_s, counter, Channel::Force);
            }
            bench.push(time_s, counter, Channel::Acceleration);
        }
        bench.end();
        assert!(bench.breaks.iter().all(|each| *each == Aligned::Gap(None)), "{held_s}");
        assert_eq!(bench.health.frames_lost, 2, "{held_s}");
        assert_eq!((bench.health.restarts, bench.instants.len()), (0, 3001), "{held_s}");
    }
}

/// The counters are the same, but the turns are lost.
#[test]
fn lost_turns_after_half_an_instant_stay_counted() {
    for turns in [1, 2, 3] {
        let mut bench = Bench::with_counter_bits(8);
        bench.run(0.0, 0..1000);
        bench.push(0.5, 1000, Channel::Force);
        let back = 1000 + 256 * turns;
        let back_s = f64::from(back) * 5e-4;
        bench.push(back_s + 1.3e-4, back, Channel::Acceleration);
        bench.run(back_s + 5e-4, back + 1..back + 2000);
        bench.end();
        assert_eq!(bench.health.frames_lost, 2 * 256 * u64::from(turns), "{turns}");
        assert_eq!((bench.health.restarts, bench.breaks.len()), (0, 1), "{turns}");
    }
}

#[test]
fn a_hold_up_within_a_turn_joins() {
    let mut bench = Bench::with_counter_bits(8);
    bench.run(0.0, 0..100);
    for counter in 100..300 {
        bench.push(0.15, counter, Channel::Force);
        bench.push(0.15, counter, Channel::Acceleration);
    }
    bench.run(0.15, 300..400);
    bench.end();
    assert_eq!((bench.health.frames_lost, bench.breaks.len()), (0, 0));
    assert_eq!(bench.instants.len(), 400);
}

#[test]
fn a_clock_that_is_set_back_is_no_break() {
    for (back_s, first) in [(3600.0, 100), (0.02, 100), (10.0, 102)] {
        let mut bench = Bench::new();
        bench.run(5000.0, 0..100);
        bench.run(5000.05 - back_s, first..200);
        bench.end();
        assert_eq!(bench.breaks, [], "{back_s}");
        assert_eq!(bench.health.frames_lost, 2 * u64::from(first - 100), "{back_s}");
        assert_eq!((bench.instants.len(), bench.health.refused), (200, 0), "{back_s}");
    }
}

/// The time proves nothing then: any other counter may be that of another recording.
#[test]
fn a_clock_that_is_set_back_and_a_counter_that_jumps_are_a_restart() {
    for bits in [8, 16] {
        for first in [104, 120, 220, 97, 92] {
            let mut bench = Bench::with_counter_bits(bits);
            bench.run(5000.0, 0..101);
            bench.run(4000.0, first..first + 100);
            bench.end();
            assert_eq!(bench.breaks, [Aligned::Restart], "{bits} {first}");
            let health = bench.health;
            assert_eq!((health.restarts, health.frames_lost), (1, 0), "{bits} {first}");
            assert_eq!((health.repeated, health.refused), (0, 0), "{bits} {first}");
            assert_eq!(bench.instants.len(), 201, "{bits} {first}");
        }
    }
}
