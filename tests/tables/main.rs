//! One cut, one answer: the same cuts as a log of a bus and as the tables that data acquisition units export.
//!
//! The tables are written here from the frames, by the layout of `mill3.dbc`, with none of flexid's code.

mod binary;
mod clocks;

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::iter::zip;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use flexid_hil::bench::Bench;
use flexid_hil::report::Report;

/// Time after which a program that works on a recording is taken to hang.
const HANGS: Duration = Duration::from_secs(300);
/// Largest difference of two answers, standard deviations. The logs have stamps of 1 µs, and the tables instants.
const ALIKE: f64 = 0.1;
const LOGS: [&str; 3] = ["exp_00.log", "exp_01.log", "exp_02.log"];
const RATE_HZ: f64 = 2000.0;
const G: f64 = 9.80665;

/// An instant: force, N, acceleration, m/s², and angles, rad.
type Instant = ([f64; 3], [f64; 3], [f64; 3]);

/// An instant of which a frame has come.
type Part = (Option<[f64; 3]>, Option<[f64; 3]>, [f64; 3]);

/// The instants of a log, in the order of their counters.
fn instants(log: &str) -> Result<Vec<Instant>> {
    let mut angles = [f64::NAN; 3];
    let mut all: BTreeMap<i64, Part> = BTreeMap::new();
    let mut newest = 0;
    for line in log.lines() {
        let frame = line.split_whitespace().nth(2).context("a line without a frame")?;
        let (id, data) = frame.split_once('#').context("a frame without data")?;
        let byte = |place: usize| i64::from_str_radix(&data[2 * place..2 * place + 2], 16);
        let word = |place: usize| anyhow::Ok(byte(place)? | byte(place + 1)? << 8);
        let signed = |place: usize| Ok::<_, anyhow::Error>(word(place)? as u16 as i16);
        if let Some(joint) = ["111", "112", "113"].iter().position(|own| *own == id) {
            angles[joint] = f64::from((word(0)? | word(2)? << 16) as u32 as i32) * 1e-6;
            continue;
        }
        let scale = if id == "101" { 0.1 } else { 0.002 };
        let axes = [signed(0)?, signed(2)?, signed(4)?].map(|raw| f64::from(raw) * scale);
        // The counter wraps.
        newest += i64::from((word(6)? - newest) as u16 as i16);
        let instant = all.entry(newest).or_insert((None, None, angles));
        if id == "101" {
            instant.0 = Some(axes)
        } else {
            instant.1 = Some(axes)
        };
        instant.2 = angles;
    }
    // The first frames come before the first angles.
    let rows = all.into_values().map(|(force, acceleration, angles)| {
        Ok((force.context("no force")?, acceleration.context("no acceleration")?, angles))
    });
    let mut rows: Vec<Instant> = rows.collect::<Result<_>>()?;
    let first = rows.iter().find(|row| !row.2[2].is_nan()).context("no angles")?.2;
    rows.iter_mut().filter(|row| row.2[2].is_nan()).for_each(|row| row.2 = first);
    Ok(rows)
}

/// A table of commas with time and angles, as pandas writes it.
fn commas(cut: &[Instant]) -> Result<String> {
    let mut text = "time [s],Fx [N],Fy [N],Fz [N],ax [m/s^2],ay [m/s^2],az [m/s^2],q1 [deg],q2 [deg],q3 [deg]\n".to_owned();
    for (row, (force, acceleration, angles)) in cut.iter().enumerate() {
        write!(text, "{:?}", row as f64 / RATE_HZ)?;
        for value in force.iter().chain(acceleration).copied().chain(angles.map(f64::to_degrees)) {
            write!(text, ",{value:?}")?;
        }
        text.push('\n');
    }
    Ok(text)
}

/// A file of LabVIEW with a segment a cut, in kN and g, as its "Write To Measurement File" writes it.
fn segments(cuts: &[Vec<Instant>]) -> Result<String> {
    let mut text = "LabVIEW Measurement\t\r\nWriter_Version\t2\r\nReader_Version\t2\r\nSeparator\tTab\r\nDecimal_Separator\t.\r\n\
        Multi_Headings\tYes\r\nX_Columns\tOne\r\nTime_Pref\tRelative\r\nOperator\tlab\r\nDate\t2026/11/27\r\nTime\t13:44:15.1234\r\n\
        ***End_of_Header***\t\r\n\t\r\n"
        .to_owned();
    for cut in cuts {
        let samples = cut.len();
        write!(
            text,
            "Channels\t6\t\t\t\t\t\t\r\nSamples{}\r\nDate{}\r\nTime{}\r\nY_Unit_Label\tkN\tkN\tkN\tg\tg\tg\t\r\n\
             X_Dimension{}\r\nX0{}\r\nDelta_X{}\r\n***End_of_Header***\t\t\t\t\t\t\t\r\nX_Value\tFx\tFy\tFz\tax\tay\taz\tComment\r\n",
            format!("\t{samples}").repeat(6),
            "\t2026/11/27".repeat(6),
            "\t13:44:15.1234".repeat(6),
            "\tTime".repeat(6),
            "\t0.0000000000000000E+0".repeat(6),
            "\t5.000000E-4".repeat(6),
        )?;
        for (row, (force, acceleration, _)) in cut.iter().enumerate() {
            write!(text, "{:.6}", row as f64 / RATE_HZ)?;
            for value in
                force.map(|own| own / 1e3).into_iter().chain(acceleration.map(|own| own / G))
            {
                write!(text, "\t{value:.9}")?;
            }
            text += if row == 0 { "\tfirst row\r\n" } else { "\r\n" };
        }
        text += "\r\n";
    }
    Ok(text)
}

/// A table of semicolons and decimal commas without time, with a line of units and other channels between, as German programs write it.
fn semicolons(cut: &[Instant]) -> Result<String> {
    let mut text = "\u{feff}Messung 1;;\r\nAbtastrate;2000 Hz;\r\n\r\nNr;az;ay;ax;Drehzahl;Fz;Fy;Fx\r\n;m/s²;m/s²;m/s²;1/min;N;N;N\r\n".to_owned();
    for (row, ([fx, fy, fz], [ax, ay, az], _)) in cut.iter().enumerate() {
        let line = format!("{row};{az:.4};{ay:.4};{ax:.4};1200.5;{fz:.2};{fy:.2};{fx:.2}\r\n");
        text += &line.replace('.', ",");
    }
    Ok(text)
}

/// The bench, its answer for the logs, and their cuts.
fn logs() -> Result<(Bench, Report, Vec<Vec<Instant>>)> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/recordings/nominal");
    let bench = Bench::recording(Path::new(folder))?;
    let of_logs = identified(&bench, &LOGS)?;
    let cuts = LOGS.map(|log| instants(&fs::read_to_string(bench.path(log))?));
    let cuts = cuts.into_iter().collect::<Result<_>>()?;
    // Neither bus nor counters.
    bench.configure("[bus]\ninterface = \"vcan0\"\ndbc = \"mill3.dbc\"\n", "")?;
    bench.configure("force_counter = \"ForceCounter\"\n", "")?;
    bench.configure("acceleration_counter = \"AccelerationCounter\"\n", "")?;
    bench.configure("rate_hz = 2000.0\n", "")?;
    Ok((bench, of_logs, cuts))
}

fn identified(bench: &Bench, names: &[&str]) -> Result<Report> {
    let mut command = vec!["identify", "--config", "edge.toml", "--json", "report.json"];
    command.extend(names);
    bench.flexid("identify", command)?.succeed(HANGS)?;
    Report::last_of(&fs::read_to_string(bench.path("report.json"))?)
}

/// Checks that two answers are one.
fn alike(one: &Report, other: &Report) -> Result<()> {
    ensure!(one.fit.records == other.fit.records, "{:?} {:?}", one.fit, other.fit);
    ensure!(other.fit.frames_lost == 0, "{:?}", other.fit);
    let mut compared = 0;
    for (one, other) in zip(&one.joints, &other.joints) {
        let numbers = zip(zip(one.stiffness, other.stiffness), one.stiffness_std)
            .chain(zip(zip(one.damping, other.damping), one.damping_std));
        let verdicts = zip(&one.stiffness_verdict, &other.stiffness_verdict)
            .chain(zip(&one.damping_verdict, &other.damping_verdict));
        for (((one, other), deviation), (verdict, same)) in zip(numbers, verdicts) {
            ensure!(verdict == same, "{verdict} {same}");
            if let Some(deviation) = deviation.filter(|_| verdict == "identified") {
                let apart = (one - other).abs() / deviation;
                ensure!(apart < ALIKE, "{one:e} and {other:e} are {apart:.2} σ apart");
                compared += 1;
            }
        }
    }
    ensure!(compared >= 30, "{compared} parameters are identified");
    Ok(())
}

#[test]
fn a_cut_has_one_answer_as_a_log_and_as_a_table() -> Result<()> {
    let (bench, of_logs, cuts) = logs()?;
    for (cut, name) in zip(&cuts, ["0.csv", "1.csv", "2.csv"]) {
        fs::write(bench.path(name), commas(cut)?)?;
    }
    alike(&of_logs, &identified(&bench, &["0.csv", "1.csv", "2.csv"])?).context("commas")?;

    // No angles in the table.
    bench.configure("joints = [\"q1\", \"q2\", \"q3\"]", "[recording]\nposes = \"poses.csv\"")?;
    let mut poses = "file,q1,q2 [deg],q3\n".to_owned();
    for (number, [q1, q2, q3]) in (0..).zip(cuts.iter().map(|cut| cut[0].2)) {
        for name in ["cuts.lvm".to_owned(), format!("{number}.txt")] {
            writeln!(poses, "{name},{q1},{},{q3}", q2.to_degrees())?;
        }
    }
    fs::write(bench.path("poses.csv"), poses)?;
    fs::write(bench.path("cuts.lvm"), segments(&cuts)?)?;
    alike(&of_logs, &identified(&bench, &["cuts.lvm"])?).context("segments")?;

    bench.configure("band_hz", "rate_hz = 2000.0\nband_hz")?;
    for (number, cut) in cuts.iter().enumerate() {
        fs::write(bench.path(format!("{number}.txt")), semicolons(cut)?)?;
    }
    let packed = Command::new("gzip").arg(bench.path("1.txt")).status()?;
    ensure!(packed.success(), "gzip fails");
    alike(&of_logs, &identified(&bench, &["0.txt", "1.txt.gz", "2.txt"])?).context("semicolons")
}

#[test]
fn a_cut_has_one_answer_as_a_file_of_channels_and_as_a_bag() -> Result<()> {
    let (bench, of_logs, cuts) = logs()?;
    let answer = |ending: &str, write: &dyn Fn(&[Instant]) -> Vec<u8>| -> Result<()> {
        let names = ["0", "1", "2"].map(|name| format!("{name}.{ending}"));
        for (cut, name) in zip(&cuts, &names) {
            fs::write(bench.path(name), write(cut))?;
        }
        let found = identified(&bench, &names.each_ref().map(String::as_str))?;
        alike(&of_logs, &found).with_context(|| ending.to_owned())
    };
    answer("mf4", &binary::mdf)?;
    answer("tdms", &binary::tdms)?;
    let names = [("F", "F"), ("a", "A")];
    for (axis, matrix) in names {
        for (place, name) in ["x", "y", "z"].iter().enumerate() {
            bench.configure(
                &format!("\"{axis}{name}\""),
                &format!("\"{matrix}(:,{})\"", place + 1),
            )?;
        }
    }
    bench.configure("\"q1\", \"q2\", \"q3\"", "\"q(1)\", \"q(2)\", \"q(3)\"")?;
    answer("mat", &binary::mat)?;
    bench.configure(
        "[measurement]",
        "[topics]\nwrench = \"/ft/wrench\"\nacceleration = \"/imu\"\njoints = \"/joint_states\"\n[measurement]",
    )?;
    bench.configure("\"q(1)\", \"q(2)\", \"q(3)\"", "\"joint_1\", \"joint_2\", \"joint_3\"")?;
    answer("mcap", &binary::bag)
}
