//! Sensors without a common counter: the cuts of the logs, their acceleration sampled by another clock, give what counters give.

use std::f64::consts::PI;
use std::fmt::Write as _;

use super::*;

/// Delay of the acceleration, s, slowness of its clock, and latency of each sensor: mean of an exponential, part of stalls and the longest, s.
const LATE_S: f64 = 1e-3;
const PACE: f64 = 1.0 + 20e-6;
const CAN: (f64, f64, f64) = (50e-6, 0.01, 1e-3);
const USB: (f64, f64, f64) = (300e-6, 0.05, 5e-3);
/// Instants at rest that are put before a cut: its record begins with them.
const BEFORE: usize = 128;

/// Numbers between 0 and 1.
struct Random(u64);

impl Random {
    fn uniform(&mut self) -> f64 {
        // Knuth's MMIX generator.
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }

    fn latency(&mut self, (mean, stalls, longest): (f64, f64, f64)) -> f64 {
        let stall = if self.uniform() < stalls { longest * self.uniform() } else { 0.0 };
        stall - mean * self.uniform().ln()
    }
}

/// The value between samples, by two hundred of them in Hann's window.
fn between(values: &[f64], place: f64) -> f64 {
    const REACH: i64 = 100;
    let middle = place.floor() as i64;
    let near = middle - REACH + 1..=middle + REACH;
    let taps = near.map(|tap| {
        let x = place - tap as f64;
        let sinc = if x == 0.0 { 1.0 } else { (PI * x).sin() / (PI * x) };
        let value = values[tap.clamp(0, values.len() as i64 - 1) as usize];
        value * sinc * (0.5 + 0.5 * (PI * x / (REACH + 1) as f64).cos())
    });
    taps.sum()
}

/// A log of a cut from `start_s` on, without counters.
fn stamped(
    cut: &[Instant],
    start_s: f64,
    latency: (f64, f64, f64),
    random: &mut Random,
) -> Result<String> {
    let cut: Vec<Instant> = cut[..BEFORE].iter().chain(cut).copied().collect();
    let mut lines: Vec<(f64, String)> = Vec::new();
    let axes = [0, 1, 2].map(|axis| cut.iter().map(|own| own.1[axis]).collect::<Vec<f64>>());
    for (id, pace, late_s, scale) in [(0x101, 1.0, 0.0, 0.1), (0x102, PACE, LATE_S, 0.002)] {
        let mut newest_s = 0.0_f64;
        for number in 0..cut.len() {
            let stamp_s = number as f64 * pace / RATE_HZ;
            let place = (stamp_s - late_s) * RATE_HZ;
            let value = if id == 0x101 {
                cut[number].0
            } else {
                axes.each_ref().map(|own| between(own, place))
            };
            let raw = value.map(|own| ((own / scale).round() as i16 as u16).swap_bytes());
            newest_s = newest_s.max(start_s + stamp_s + random.latency(latency));
            let mut line = format!("({newest_s:.6}) can0 {id:X}#");
            raw.iter().try_for_each(|own| write!(line, "{own:04X}"))?;
            lines.push((newest_s, line + "0000"));
        }
    }
    for (number, (.., angles)) in cut.iter().enumerate().step_by(200) {
        let at_s = start_s + number as f64 / RATE_HZ;
        for (joint, angle) in angles.iter().enumerate() {
            let raw = ((angle * 1e6).round() as i32 as u32).swap_bytes();
            lines.push((at_s, format!("({at_s:.6}) can0 {}#{raw:08X}0000", 111 + joint)));
        }
    }
    lines.sort_by(|one, other| one.0.total_cmp(&other.0));
    Ok(lines.into_iter().map(|(_, line)| line + "\n").collect())
}

#[test]
fn sensors_without_a_counter_give_what_counters_give() -> Result<()> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/recordings/nominal");
    let bench = Bench::recording(Path::new(folder))?;
    bench.configure("assume = \"perfect\"", "assume = \"typical\"")?;
    let by_counters = identified(&bench, &LOGS)?;
    let cuts = LOGS.map(|log| instants(&fs::read_to_string(bench.path(log))?));
    let cuts: Vec<Vec<Instant>> = cuts.into_iter().collect::<Result<_>>()?;
    bench.configure("force_counter = \"ForceCounter\"\n", "")?;
    bench.configure("acceleration_counter = \"AccelerationCounter\"\n", "")?;
    for (name, latency) in [("can.log", CAN), ("usb.log", USB)] {
        let mut random = Random(7);
        let logs = cuts.iter().enumerate().map(|(number, cut)| {
            stamped(cut, 1.767e9 + 100.0 * number as f64, latency, &mut random)
        });
        fs::write(bench.path(name), logs.collect::<Result<String>>()?)?;
        let of_stamps = identified(&bench, &[name])?;
        compared(&by_counters, &of_stamps).context(name)?;
        let text = fs::read_to_string(bench.path("report.json"))?;
        let delay = text.split("\"delay_s\": ").nth(1).and_then(|rest| rest.split(',').next());
        let delay_s: f64 = delay.context("no delay")?.trim().parse()?;
        ensure!((delay_s - LATE_S).abs() < 50e-6, "{name}: {delay_s}");
    }
    Ok(())
}

/// Checks that as much is identified, and that it is the same within the deviations.
fn compared(one: &Report, other: &Report) -> Result<()> {
    ensure!(other.fit.records == 3 && other.fit.frames_lost == 0, "{:?}", other.fit);
    let (mut by_counters, mut by_stamps) = (0, 0);
    for (one, other) in zip(&one.joints, &other.joints) {
        let both = |joint: &flexid_hil::report::Joint| {
            let stiffness =
                zip(zip(joint.stiffness, joint.stiffness_std), joint.stiffness_verdict.clone());
            let damping = zip(zip(joint.damping, joint.damping_std), joint.damping_verdict.clone());
            stiffness.chain(damping).collect::<Vec<_>>()
        };
        for (((one, std), verdict), ((other, other_std), same)) in zip(both(one), both(other)) {
            by_counters += usize::from(verdict == "identified");
            by_stamps += usize::from(same == "identified");
            if verdict == "identified" && same == "identified" {
                let std = std.context("no deviation")?.hypot(other_std.context("no deviation")?);
                ensure!(
                    (one - other).abs() < 0.5 * std,
                    "{one:e} and {other:e}: {:.1} σ",
                    (one - other).abs() / std
                );
            }
        }
    }
    ensure!(by_stamps * 20 >= by_counters * 19, "{by_stamps} of {by_counters} are identified");
    Ok(())
}
