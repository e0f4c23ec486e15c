//! Tables as programs write them, and tables with mistakes.

#[path = "../../../tests/readings/mod.rs"]
mod readings;

use std::sync::atomic::{AtomicUsize, Ordering};

use proptest::prelude::*;

use super::*;
use readings::{accelerations, all, angles, forces, layout};

const FILE: &str = "cut.csv";
const NAMES: &str = "time [s],Fx [N],Fy [N],Fz [N],ax [g],ay [g],az [g]\n";

/// Cuts at these poses.
fn cuts(poses: Vec<Vec<f64>>) -> Option<Vec<Cut>> {
    Some(poses.into_iter().map(|pose| Cut { pose, ..Cut::default() }).collect())
}

/// Opens a table of which the config says neither rate nor joints.
fn open(text: &[u8]) -> Result<TableLog<'_>, String> {
    TableLog::open(Path::new(FILE), text, &layout(None, &[]), None)
        .map_err(|error| error.to_string())
}

/// Rows `number,1,2,3,0,0,1` at 1 kHz.
fn rows(count: u32) -> String {
    (0..count).map(|row| format!("{:.3},{row},2,3,0,0,1\n", f64::from(row) * 1e-3)).collect()
}

/// The same two rows, at 1 kHz, of all who write tables.
#[test]
fn tables_of_other_programs_are_read() {
    let lvm = b"LabVIEW Measurement\t\r\nWriter_Version\t0.92\r\nSeparator\tTab\r\nX_Columns\tNo\r\n***End_of_Header***\t\r\n\t\r\n\
        Channels\t6\t\t\t\t\t\t\r\nSamples\t2\t2\t2\t2\t2\t2\t\r\nDate\t2017/10/04\t2017/10/04\t2017/10/04\t2017/10/04\t2017/10/04\t2017/10/04\t\r\n\
        Y_Unit_Label\tN\tN\tN\tg\tg\tg\t\r\nDelta_X\t1.0E-3\t1.0E-3\t1.0E-3\t1.0E-3\t1.0E-3\t1.0E-3\t\r\n***End_of_Header***\t\t\t\t\t\t\t\r\n\
        X_Value\tFx\tFy\tFz\tax\tay\taz\tComment\r\n\t1.5\t2\t3\t0\t0\t1\t\r\n\t-1.5\t2\t3\t0\t0\t1\r\n";
    for (writer, text) in [
        ("pandas", &b"time [s],Fx [N],Fy [N],Fz [N],ax [g],ay [g],az [g]\n0.0,1.5,2.0,3.0,0.0,0.0,1.0\n0.001,-1.5,2.0,3.0,0.0,0.0,1.0\n"[..]),
        // With its index, whose column has no name.
        ("pandas", b",time [s],Fx [N],Fy [N],Fz [N],ax [g],ay [g],az [g]\n0,0.0,1.5,2,3,0,0,1\n1,0.001,-1.5,2,3,0,0,1\n"),
        ("NumPy", b"# time [s];Fx [N];Fy [N];Fz [N];ax [g];ay [g];az [g]\n0.0e+00;1.5e+00;2.0e+00;3;0;0;1\n1.0e-03;-1.5e+00;2;3;0;0;1\n"),
        ("NumPy", b"# time Fx Fy Fz ax(g) ay(g) az(g)\n0.0 1.5 2.0 3.0 0.0 0.0 1.0\n1.0e-03 -1.5e+00 2 3 0 0 1\n"),
        ("MATLAB", b"   time     Fx  Fy Fz ax(g) ay(g) az(g)\n  0.000    1.5   2  3     0     0     1\n  0.001   -1.5   2  3     0     0     1\n"),
        ("a filter", b"T,time [s],Fx (filtered),Fx,Fy,Fz,ax [g],ay [g],az [g]\n20,0.0,9,1.5,2,3,0,0,1\n21,0.001,9,-1.5,2,3,0,0,1\n"),
        ("asammdf", b"\"timestamps\",\"Fx\",\"Fy\",\"Fz\",\"ax\",\"ay\",\"az\"\r\n\"s\",\"N\",\"N\",\"N\",\"g\",\"g\",\"g\"\r\n0,1.5,2,3,0,0,1\r\n0.001,-1.5,2,3,0,0,1\r\n"),
        ("DynoWare", b"File Type:\tExported ASCII Data\nSampling rate [Hz]:\t1000\nTotal number of channels:\t6\n\nTime\tFx\tFy\tFz\tax\tay\taz\ns\tN\tN\tN\tg\tg\tg\n0\t1.5\t2\t3\t0\t0\t1\n0.001\t-1.5\t2\t3\t0\t0\t1\n"),
        ("NI", b"Time (ms),Fx (N),Fy (kN),Fz (N),ax (mG),ay (G),az (G)\r\n0.000000,1.5,0.002,3,0,0,1\r\n1.000000,-1.5,0.002,3,0,0,1\r\n"),
        ("DEWESoft", b"Data file:;cut.dxd\nSample rate:;1000\nCreated:;27.11.2026 10:00:00\n\nTime (s);Fx (N);Fy (N);Fz (N);ax (g);ay (g);az (m/s\xB2)\n0,000;1,5;2,0;3,0;0,0;0,0;9,80665\n0,001;-1,5;2,0;3,0;0,0;0,0;9,80665\n"),
        ("Excel", b"\xEF\xBB\xBFsep=;\r\ntime [s];Fx [N];Fy [N];Fz [N];ax [g];ay [g];az [g]\r\n0;1,5;2;3;0;0;1\r\n0,001;-1,5;2;3;0;0;1\r\n;;;;;;\r\n"),
        ("a recorder in German", b"Zeit [s];Fx [N];Fy [N];Fz [N];ax [g];ay [g];az [g]\n0,000;1,5;2;3;0;0;1\n0,001;-1,5;2;3;0;0;1\n"),
        ("LabVIEW", lvm),
    ] {
        let table = open(text).unwrap_or_else(|error| panic!("{writer}: {error}"));
        let rate_hz = table.shown().rate_hz.unwrap();
        assert!((rate_hz - 1000.0).abs() < 1e-6, "{writer}: {rate_hz}");
        let (arrivals, error) = all(table);
        assert_eq!((forces(&arrivals), error), (vec![(0, [1.5, 2.0, 3.0]), (1, [-1.5, 2.0, 3.0])], None), "{writer}");
        assert_eq!(accelerations(&arrivals), [[0.0, 0.0, 9.80665]; 2], "{writer}");
    }
}

/// Two columns with a unit of time leave the time open, unless one has its name.
#[test]
fn only_one_column_may_be_the_time_by_its_unit() {
    let rate_hz = |names: &str| {
        let row = |row: u32| format!("{:.3},{:.3},1,2,3,0,0,1\n", f64::from(row) * 1e-3, 0.5);
        let text = format!("{names},Fx,Fy,Fz,ax,ay,az\n") + &(0..9).map(row).collect::<String>();
        open(text.as_bytes()).unwrap().shown().rate_hz.map(f64::round)
    };
    assert_eq!(rate_hz("Zeit [s],Druck [bar]"), Some(1000.0));
    assert_eq!(rate_hz("Zeit [s],Verzug [s]"), None);
    assert_eq!(rate_hz("time [s],Verzug [s]"), Some(1000.0));
}

/// A channel that is not read may have another period than those that are.
#[test]
fn a_period_is_that_of_the_columns_that_are_read() {
    for (line, expected) in [
        ("Delta_X,1.0,0.001,0.001", Ok(Some(0.001))),
        ("Delta_X,0.001,,", Ok(Some(0.001))),
        ("Delta_X,1.0,0,0", Ok(None)),
        ("Samples,1.0,0.001,0.001", Ok(None)),
        ("Delta_X,1.0,0.001,0.002", Err(rates::two_rates(1000.0, 500.0))),
    ] {
        let cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        assert_eq!(layout::period_s(&cells, [2, 3].into_iter()), expected, "{line}");
    }
}

/// A text that counts what was read of it.
struct Counted<'a> {
    text: &'a [u8],
    taken: &'a AtomicUsize,
}

impl Read for Counted<'_> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let taken = self.text.read(into)?;
        self.taken.fetch_add(taken, Ordering::Relaxed);
        Ok(taken)
    }
}

/// Beside the rows that are read ahead, a table holds no more than a buffer, however long it is.
#[test]
fn a_table_is_read_as_it_comes() {
    const BUFFER: usize = 1 << 17;
    let row = "0.5,2,3,0,0,1\n";
    let text = NAMES.replace("time [s],", "") + &row.repeat(8 * LOOK_AHEAD);
    let taken = AtomicUsize::new(0);
    let counted = Counted { text: text.as_bytes(), taken: &taken };
    let layout = layout(Some(1e3), &[]);
    let mut table = TableLog::open(Path::new(FILE), counted, &layout, None).unwrap();
    let (mut came, mut batch) = (0, Vec::new());
    loop {
        let flow = table.read(&mut batch, Duration::ZERO).unwrap();
        came += forces(&batch).len();
        batch.clear();
        let held = taken.load(Ordering::Relaxed).saturating_sub(came * row.len());
        assert!(held <= LOOK_AHEAD * row.len() + BUFFER, "{held} bytes after {came} rows");
        if flow == Flow::Ended {
            break;
        }
    }
    assert_eq!(came, 8 * LOOK_AHEAD);
}

#[test]
fn each_mistake_is_named_with_its_line_and_column() {
    let mend = ": correct it, or export the table again";
    let with = |row: &str| format!("{NAMES}{}{row}\n0.020,1,2,3,0,0,1\n", rows(15));
    for (text, expected) in [
        ("".to_owned(), "cut.csv: is no table: no line names the columns Fx, Fy, Fz, ax, ay, az of [signals]: ".to_owned()),
        ("Dear reader\n".to_owned(), "cut.csv: is no table: no line names the columns Fx, ".to_owned()),
        (
            NAMES.replace("Fz [N]", "F_z [N]") + &rows(9),
            "cut.csv:1: has no column \"Fz\": it has \"time [s]\", \"Fx [N]\", \"Fy [N]\", \"F_z [N]\", \"ax [g]\", \"ay [g]\", \"az [g]\" \
             (is it \"F_z [N]\" for \"Fz\"?): write the names of its columns in [signals], or name another table".to_owned(),
        ),
        (
            format!("Kistler\nTime,Dyno 1,Dyno 2,Dyno 3,ch4,ch5,ch6\n{}", rows(9)),
            "cut.csv:2: has no column \"Fx\", \"Fy\", \"Fz\", \"ax\", \"ay\", \"az\": it has \"Time\", \"Dyno 1\", ".to_owned(),
        ),
        (NAMES.replace("Fy", "Fx"), "cut.csv:1: column \"Fx\" is there twice: ".to_owned()),
        (NAMES.replace("time [s]", "Fx"), "cut.csv:1: column \"Fx\" is there twice: ".to_owned()),
        (
            NAMES.replace("[g]", "[V]") + &rows(9),
            "cut.csv:1: column \"ax [V]\" has unit \"V\": acceleration must be in one of m/s^2, m/s²,".to_owned(),
        ),
        (
            NAMES.replace("az [g]", "az") + &rows(9),
            "cut.csv:1: column \"az\" has no unit, and another axis has: give each of the three its unit".to_owned(),
        ),
        (
            format!("{NAMES}s,kN,N,N,g,g,g\n{}", rows(9)),
            "cut.csv:1: column \"Fx [N]\" has two units: leave one out".to_owned(),
        ),
        (format!("{}\n{NAMES}{}", with("0.015,1,two,3,0,0,1"), rows(9)), "cut.csv:17: column \"Fy\" holds \"two\", and no number".to_owned()),
        (NAMES.replace("[s]", "[min]") + &rows(9), "cut.csv:1: column \"time [min]\" has unit \"min\": time must be in one of s, ms".to_owned()),
        (NAMES.to_owned(), "cut.csv: has no row of numbers below the names of its columns".to_owned()),
        (with("0.015,1,two,3,0,0,1"), format!("cut.csv:17: column \"Fy\" holds \"two\", and no number{mend}")),
        (with("0.015,1,2,3,0,0"), "cut.csv:17: has 6 cells, and the line of names 7: is a cell missing, or are decimal commas".to_owned()),
        (with("0,015,1,2,3,0,0,1"), "cut.csv:17: has 8 cells, and the line of names 7: ".to_owned()),
        (with("x,1,2,3,0,0,1"), "cut.csv:17: column \"time\" holds \"x\", and no number".to_owned()),
        (with(",1,2,3,0,0,1"), "cut.csv:17: column \"time\" holds no time".to_owned()),
        (format!("{NAMES}{}0.015,1,2", rows(15)), format!("cut.csv:17: the last line is cut off{mend}")),
        (
            format!("{NAMES}{}", rows(20).replace(",2,3,", ",,3,")),
            "cut.csv: column \"Fy\" has no number in 20 of the first 20 rows: export force and acceleration at one rate".to_owned(),
        ),
        (format!("{NAMES}{}", "5,1,2,3,0,0,1\n".repeat(9)), "cut.csv: its time does not go on: ".to_owned()),
        (
            "Fx,Fy,Fz,ax,ay,az\n1,2,3,0,0,1\n\"1,234\",2,3,0,0,1\n".to_owned(),
            "cut.csv:3: column \"Fx\" holds \"1,234\", whose comma may be decimal or separate thousands: export with decimal points, or with semicolons between the cells".to_owned(),
        ),
        (with("\"0,015\",1,2,3,0,0,1"), "cut.csv:17: column \"time\" holds \"0,015\", and no number".to_owned()),
        (
            // Below the second cut the names come again.
            format!("Delta_X,0.001\n{own},1,2,3,0,0,1\n0.001,1,2,3,0,0,1\n0.002,1,2,3,0,0,1\n{own},1,2,3,0,0,1\n", own = "time,Fx,Fy,Fz,ax,ay,az\n"),
            "cut.csv:4: column \"time\" holds \"0.001\", and is empty in the first row: ".to_owned(),
        ),
        (
            format!("Delta_X,1e-3\n{own},1,2,3,0,0,1\nDelta_X,1e-3,1e-3,1e-3,2e-3,2e-3,2e-3\n{own},1,2,3,0,0,1\n", own = "time,Fx,Fy,Fz,ax,ay,az\n"),
            "cut.csv:4: comes at 500.0 Hz, and ".to_owned(),
        ),
        (
            "Delta_X,0.001\ntime,Fx,Fy,Fz,ax,ay,az\n,1,2,3,0,0,1\n0.001,1,2,3,0,0,1\n".to_owned(),
            "cut.csv:4: column \"time\" holds \"0.001\", and is empty in the first row: correct it, write seconds, or ".to_owned(),
        ),
    ] {
        let error = open(text.as_bytes()).err().unwrap_or_else(|| panic!("{text}"));
        assert!(error.starts_with(&expected), "{error}\n{expected}");
        assert!(!error.contains('\n'), "{error}");
    }
}

#[test]
fn a_rate_that_contradicts_the_config_is_an_error() {
    let text = format!("{NAMES}{}", rows(20));
    let of = |rate_hz| {
        TableLog::open(Path::new(FILE), text.as_bytes(), &layout(Some(rate_hz), &[]), None)
    };
    let error = of(2000.0).err().unwrap().to_string();
    assert_eq!(
        error,
        "cut.csv: its rows come at 1000.0 Hz, and [measurement] rate_hz is 2000: correct the unit of the time or rate_hz"
    );
    assert!(of(1001.0).is_ok());
}

#[test]
fn a_mistake_behind_the_first_rows_ends_what_is_read() {
    let row = |row: usize| format!("{:.3},1,2,3,0,0,1\n", row as f64 * 1e-3);
    let lines = |count: usize| (0..count).map(row).collect::<String>();
    for (end, expected) in [
        ("x,1,2,3,0,0,1\n", "cut.csv:40002: column \"time\" holds \"x\", and no number"),
        (
            "5.0,1,2,3,0,0,1\n",
            "cut.csv:40002: the time goes back from 39.999 to 5 s, and not to its begin: ",
        ),
    ] {
        let text = format!("{NAMES}{}{end}", lines(40_000));
        let (arrivals, error) = all(open(text.as_bytes()).unwrap());
        assert_eq!(forces(&arrivals).len(), 40_000);
        assert!(error.as_ref().is_some_and(|own| own.starts_with(expected)), "{error:?}");
    }
    let slower: String =
        (0..200).map(|row| format!("{:.3},1,2,3,0,0,1\n", 40.0 + f64::from(row) * 2e-3)).collect();
    let text = format!("{NAMES}{}{slower}", lines(40_000));
    let error = all(open(text.as_bytes()).unwrap()).1.unwrap();
    assert!(error.contains("comes at 500.0 Hz, and what is before at 1000.0 Hz: "), "{error}");
}

#[test]
fn a_value_that_is_missing_is_a_sample_that_is_lost() {
    let text = format!("{NAMES}{}", rows(30))
        .replace(",7,2,3,", ",NaN,2,3,")
        .replace("0.009,9,2,3,0,0,1", "0.009,9,2,3,0,,1");
    let (arrivals, error) = all(open(text.as_bytes()).unwrap());
    let counters: Vec<u32> = forces(&arrivals).into_iter().map(|(counter, _)| counter).collect();
    let without: Vec<u32> = (0..30).filter(|row| *row != 7).collect();
    assert_eq!((counters, error), (without, None));
    assert_eq!(accelerations(&arrivals).len(), 29);
}

#[test]
fn a_file_may_hold_several_cuts() {
    let (names, rows) = (NAMES, rows(20));
    let pose = |angle: f64| vec![angle, 0.5, 0.6];
    let between = "\nTest 2\nDate,27.11.2026\n\n";
    for text in [
        // The time begins anew; tables are joined; something stands between.
        format!("{names}{rows}{rows}"),
        format!("{names}{rows}{names}{rows}"),
        format!("{names}{rows}{between}{names}{rows}"),
    ] {
        let open = |poses: Vec<Vec<f64>>| {
            TableLog::open(Path::new(FILE), text.as_bytes(), &layout(None, &[]), cuts(poses))
                .unwrap()
        };
        let (arrivals, error) = all(open(vec![pose(0.1), pose(0.2)]));
        assert_eq!((forces(&arrivals).len(), error), (40, None));
        assert!(arrivals.windows(2).all(|pair| pair[0].time_s <= pair[1].time_s));
        // At the begin and at the end of each cut.
        let expected = [(0.0, 0.1), (0.019, 0.1), (11.019, 0.2), (11.038, 0.2)];
        for (own, expected) in angles(&arrivals, 0).into_iter().zip(expected) {
            assert!((own.0 - expected.0).abs() < 1e-9 && own.1 == expected.1, "{own:?}");
        }
        assert_eq!(angles(&all(open(vec![pose(0.3)])).0, 0).len(), 4);
    }
    let text = format!("{names}{rows}{rows}{rows}");
    let table = TableLog::open(
        Path::new(FILE),
        text.as_bytes(),
        &layout(None, &[]),
        cuts(vec![pose(0.1), pose(0.2)]),
    );
    let error = all(table.unwrap()).1.unwrap();
    assert!(
        error.starts_with(
            "cut.csv:42: begins cut 3 of this table, and [recording] poses has 2 lines of it"
        ),
        "{error}"
    );
}

/// A cut whose pose may be that of another is refused.
#[test]
fn each_cut_has_a_pose_of_its_own() {
    let later = |row: u32| format!("{:.3},{row},2,3,0,0,1\n", 60.0 + f64::from(row) * 1e-3);
    let paused = format!("{NAMES}{}{}", rows(20), (0..20).map(later).collect::<String>());
    let pose = |angle: f64| vec![angle, 0.5, 0.6];
    let open = |poses: Vec<Vec<f64>>| {
        let (text, layout) = (paused.as_bytes(), layout(None, &[]));
        all(TableLog::open(Path::new(FILE), text, &layout, cuts(poses)).unwrap())
    };
    let (arrivals, error) = open(vec![pose(0.1), pose(0.2)]);
    let found: Vec<f64> = angles(&arrivals, 0).iter().map(|(_, angle)| *angle).collect();
    assert_eq!((found, error), (vec![0.1, 0.1, 0.2, 0.2], None));
    let error = open([0.1, 0.2, 0.3].map(pose).to_vec()).1.unwrap();
    let expected = "cut.csv: number of its cuts is 2, and [recording] poses has 3 lines of it";
    assert!(error.starts_with(expected), "{error}");
}

/// The units of a cut hold for it alone.
#[test]
fn a_cut_of_other_units_is_an_error() {
    let names = "time,Fx,Fy,Fz,ax,ay,az\n";
    let block = |units: &str| format!("{names}{units}{}", rows(9));
    let of = |second: &str| {
        let text = block("s,N,N,N,g,g,g\n") + &block(second);
        let table = open(text.as_bytes());
        table.map(|table| forces(&all(table).0).len())
    };
    assert_eq!(of("s,N,N,N,g,g,g\n"), Ok(18));
    assert_eq!(of(""), Ok(18));
    let error = of("s,kN,kN,kN,g,g,g\n").unwrap_err();
    assert!(error.starts_with("cut.csv:13: column \"time\" holds \"s\", and no number"), "{error}");
    let segment = |unit: &str| {
        format!(
            "Y_Unit_Label\t{unit}\nDelta_X\t0.001\n***End_of_Header***\nX_Value\tFx\tFy\tFz\tax\tay\taz\n\t1\t2\t3\t0\t0\t1\n"
        )
    };
    let (si, kilo) = ("N\tN\tN\tg\tg\tg", "kN\tkN\tkN\tg\tg\tg");
    let joined =
        |second: &str| open((segment(si) + "\n" + &segment(second)).as_bytes()).map(|_| ());
    assert_eq!(joined(si), Ok(()));
    assert!(joined(kilo).unwrap_err().contains("has other units than the cut before"));
    let two =
        segment(si).replace("Delta_X\t0.001", "Delta_X\t0.001\t0.001\t0.001\t0.002\t0.002\t0.002");
    assert!(
        open(two.as_bytes())
            .err()
            .unwrap()
            .contains("comes at 500.0 Hz, and what is before at 1000.0 Hz")
    );
}

/// A name that the config states with its unit has it.
#[test]
fn a_unit_in_the_name_of_the_config_counts() {
    let own = Layout {
        axes: ["Fx", "Fy", "Fz", "ax [g]", "ay [g]", "az [g]"].map(str::to_owned),
        ..layout(None, &[])
    };
    let text = format!("{NAMES}{}", rows(9));
    let table = TableLog::open(Path::new(FILE), text.as_bytes(), &own, None).unwrap();
    assert_eq!(accelerations(&all(table).0)[0], [0.0, 0.0, 9.80665]);
}

#[test]
fn angles_come_in_a_cycle_and_when_they_change() {
    let row = |row: u32| {
        let q1 = if row < 250 { 90.0 } else { 91.0 };
        format!(
            "{:.3},1,2,3,0,0,1,{q1},{}\n",
            f64::from(row) * 1e-3,
            if row == 3 { "" } else { "0.5" }
        )
    };
    let text =
        format!("{},q1 [deg],q2\n{}", NAMES.trim_end(), (0..500).map(row).collect::<String>());
    let table =
        TableLog::open(Path::new(FILE), text.as_bytes(), &layout(None, &["q1", "q2"]), None);
    let (arrivals, _) = all(table.unwrap());
    let q1: Vec<_> = angles(&arrivals, 0)
        .iter()
        .map(|(time_s, angle)| ((time_s * 1e2).floor(), angle.to_degrees().round()))
        .collect();
    assert_eq!(
        q1,
        [
            (0.0, 90.0),
            (10.0, 90.0),
            (20.0, 90.0),
            (25.0, 91.0),
            (35.0, 91.0),
            (45.0, 91.0),
            (49.0, 91.0)
        ]
    );
    assert_eq!(angles(&arrivals, 1).len(), 6);
}

/// A joint that turns evenly, and whose angles come a hundred times a second, in rows at 2 kHz that lie a little off the milliseconds.
#[test]
fn an_angle_that_joints_have_left_is_not_repeated() {
    let angle = |row: u32| 0.02 * f64::from(row) * 5e-4;
    for holds in [false, true] {
        let row = |row: u32| {
            let newest = row - row % 20;
            let cell = if holds || row == newest {
                format!("{:.9}", angle(newest))
            } else {
                String::new()
            };
            format!("{:.6},1,2,3,0,0,1,{cell}\n", f64::from(row) * 4.999e-4)
        };
        let text = format!("{},q1\n{}", NAMES.trim_end(), (0..3981).map(row).collect::<String>());
        let table = TableLog::open(Path::new(FILE), text.as_bytes(), &layout(None, &["q1"]), None);
        let (arrivals, _) = all(table.unwrap());
        let told = angles(&arrivals, 0);
        assert!((200..=201).contains(&told.len()), "{} readings", told.len());
        for (time_s, told) in told {
            let off = told - angle((time_s / 4.999e-4).round() as u32);
            assert!(off.abs() < 1e-8, "{told} rad at {time_s} s is {off} rad off");
        }
    }
}

#[test]
fn steps_and_rates_of_tables_are_joined() {
    let shown = |steps: [f32; 2], rate_hz| Shown {
        rate_hz,
        steps: [steps[0], 0.5, 0.5, steps[1], 1.0, 1.0],
        own_clocks: false,
    };
    let (one, other) = (shown([0.1, 0.0], Some(1000.0)), shown([0.2, 0.3], None));
    assert_eq!(one.and(other), Ok(shown([0.1, 0.3], Some(1000.0))));
    assert_eq!(one.and(shown([0.1, 0.1], Some(2000.0))), Err([1000.0, 2000.0]));
    let text = format!("{NAMES}{}", rows(20).replace(",2,3,", ",2,3.5,"));
    assert_eq!(open(text.as_bytes()).unwrap().shown().steps, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
}

#[test]
fn a_table_shows_by_its_names_or_its_separators() {
    let layout = layout(None, &[]);
    assert!(has_names(b"preamble\r\nt;Fx;Fy;Fz;ax;ay;az\r\n", &layout));
    assert!(!has_names(b"t;Fx;Fy;Fz;ax;ay\r\n1;2;3;4;5;6\r\n", &layout));
    assert!(is_like(b"t;Fx;Fy\r\n1;2;3\r\n") && is_like(b"a\n1,2,3\n4,5,6\n"));
    assert!(!is_like(b"Dear reader,\n\nyours,\n") && !is_like(b"\xFF,1,2\n1,2,3\n"));
}

/// The reference robot, turned about its first joint by a quarter: the y of the base is what x of the base was.
#[test]
fn a_force_along_the_axes_of_the_base_is_turned() {
    let model = include_str!("../../../../../host-tools/scenario/mill3-model.toml");
    let chain =
        crate::model::Model::parse(Path::new("model.toml"), model).unwrap().chain().unwrap();
    let layout = Layout { base: Some(chain), ..layout(None, &[]) };
    let of = |q1: f64, force: &str| {
        let text = format!("{NAMES}0,{force},0,0,1\n0.001,{force},0,0,1\n");
        let poses = cuts(vec![vec![q1, -0.5, 0.9]]);
        let table = TableLog::open(Path::new(FILE), text.as_bytes(), &layout, poses).unwrap();
        forces(&all(table).0)[1].1
    };
    let quarter = 1_f64.to_radians() * 90.0;
    let (turned, plain) = (of(quarter, "0,10,3"), of(0.0, "10,0,3"));
    for (one, other) in turned.iter().zip(plain) {
        assert!((one - other).abs() < 1e-5, "{turned:?} {plain:?}");
    }
    let length = plain.iter().map(|axis| axis * axis).sum::<f32>().sqrt();
    assert!((length - 109_f32.sqrt()).abs() < 1e-5 && (plain[0] - 10.0).abs() > 0.1, "{plain:?}");
}

/// The seeds of the fuzz target.
const SEEDS: [&[u8]; 7] = [
    include_bytes!("../../../../../tests/fuzz/seeds/table/commas.csv"),
    include_bytes!("../../../../../tests/fuzz/seeds/table/names.csv"),
    include_bytes!("../../../../../tests/fuzz/seeds/table/pandas-quoted.csv"),
    include_bytes!("../../../../../tests/fuzz/seeds/table/segments.lvm"),
    include_bytes!("../../../../../tests/fuzz/seeds/table/semicolons.txt"),
    include_bytes!("../../../../../tests/fuzz/seeds/table/short.csv"),
    include_bytes!("../../../../../tests/fuzz/seeds/table/spaces.txt"),
];

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(2000) })]

    /// A spoilt table is refused in one line, or gives finite values at times that do not go back.
    #[test]
    fn no_spoilt_table_stops_the_reader(
        seed in 0..SEEDS.len(),
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0..4_u8), 0..6),
    ) {
        let mut text = SEEDS[seed].to_vec();
        for (place, byte, edit) in edits {
            let place = place.index(text.len());
            match edit {
                0 => text[place] = byte,
                1 => text.insert(place, b"\n;,\t.e-9#\""[usize::from(byte) % 10]),
                2 => drop(text.drain(place..text.len().min(place + usize::from(byte) % 16).max(place + 1))),
                _ => text.extend_from_within(..place),
            }
            if text.is_empty() {
                break;
            }
        }
        let layout = layout(None, &["q1", "q2"]);
        match TableLog::open(Path::new(FILE), &text[..], &layout, None) {
            Err(error) => prop_assert!(!error.to_string().contains('\n')),
            Ok(table) => {
                prop_assert!(has_names(&text, &layout));
                let (arrivals, error) = all(table);
                prop_assert!(error.is_none_or(|error| !error.contains('\n')));
                prop_assert!(arrivals.windows(2).all(|pair| pair[0].time_s <= pair[1].time_s));
                for arrival in arrivals {
                    let is_finite = match arrival.content {
                        Content::Reading(Reading::Joint { value, .. }) => value.is_finite(),
                        Content::Reading(Reading::Setup(_)) => true,
                        Content::Reading(Reading::Force { value, .. } | Reading::Acceleration { value, .. }) => {
                            value.iter().all(|axis| axis.is_finite())
                        }
                        Content::Frame(_) => false,
                    };
                    prop_assert!(is_finite);
                }
            }
        }
    }
}

/// A hammer of one channel, and an accelerometer of one axis: what is not measured is 0.
#[test]
fn axes_that_are_not_measured_have_no_column() {
    let axes = ["Hammer", "Hammer", "Hammer", "", "", "az"].map(str::to_owned);
    let layout = Layout { axes, ..layout(None, &[]) };
    assert_eq!(layout.needed().collect::<Vec<_>>(), ["Hammer", "az"]);
    let blow = "0.000,0.5,1\n0.001,500,-2\n";
    let text = format!("time [s],Hammer [N],az [g]\n{blow}{blow}");
    let cut = |axis, sign, point| Cut {
        pose: vec![0.1],
        directions: [Some(Direction { axis, sign }), None],
        point,
    };
    let stated = vec![cut(0, 1.0, [0.0; 3]), cut(2, -1.0, [0.1, 0.0, -0.2])];
    let table = TableLog::open(Path::new(FILE), text.as_bytes(), &layout, Some(stated)).unwrap();
    assert_eq!(table.shown().steps[..3], [499.5; 3]);
    let (arrivals, error) = all(table);
    let forces: Vec<[f32; 3]> = forces(&arrivals).into_iter().map(|(_, force)| force).collect();
    let expected = [[0.5, 0.0, 0.0], [500.0, 0.0, 0.0], [0.0, 0.0, -0.5], [0.0, 0.0, -500.0]];
    assert_eq!((forces, error), (expected.to_vec(), None));
    let z = accelerations(&arrivals);
    assert_eq!(z[..2], [[0.0, 0.0, 9.80665], [0.0, 0.0, -19.6133]]);
    let setup = |arrival: &Arrival| match arrival.content {
        Content::Reading(Reading::Setup(setup)) => Some(setup),
        _ => None,
    };
    let setups: Vec<Setup> = arrivals.iter().filter_map(setup).collect();
    let of = |force, point| Setup { point, force, acceleration: [false, false, true] };
    let expected = [of([true, false, false], [0.0; 3]), of([false, false, true], [0.1, 0.0, -0.2])];
    assert_eq!(setups, expected);
    let lacks = TableLog::open(Path::new(FILE), &b"time [s],Hammer [N]\n0,1\n"[..], &layout, None);
    let lacks = lacks.err().unwrap().to_string();
    assert!(lacks.starts_with("cut.csv:1: has no column \"az\": "), "{lacks}");
}
