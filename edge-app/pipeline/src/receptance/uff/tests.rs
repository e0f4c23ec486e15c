//! Data sets as they are written, and what is wrong in them.

use super::*;

/// A data set of three complex values from 2 Hz on, with these records 6, 9 and 10.
fn set(record6: &str, numerator: &str, denominator: &str) -> String {
    let id = "NONE\n".repeat(5);
    format!(
        "    -1\n    58\n{id}{record6}\n         5         3         1  2.00000E+00  5.00000E-01  0.00000E+00\n\
         {:>10}    0    0    0 NONE                 Hz                  \n{numerator}\n{denominator}\n         0    0    0    0 NONE                 NONE\n \
         1.00000E+00-2.00000E+00 3.00000E+00 4.00000E+00 5.00000E+00 6.00000E+00\n    -1\n",
        18
    )
}

fn record6(kind: i64, response: i64, force: i64) -> String {
    format!(
        "{kind:5}{:10}{:5}{:10} {:10}{:10}{response:4} {:10}{:10}{force:4}",
        0, 0, 0, "A point", 7, "NONE", 8
    )
}

fn axis(kind: i64, unit: &str) -> String {
    format!("{kind:10}    0    0    0 {:20} {unit:20}", "label")
}

fn read(text: &str) -> Result<Vec<Function>, String> {
    parse(Path::new("a.uff"), text.as_bytes()).map_err(|error| error.to_string())
}

fn only(text: &str) -> Function {
    read(text).unwrap().remove(0)
}

#[test]
fn a_response_has_its_directions_its_unit_and_its_frequencies() {
    let own = only(&set(&record6(4, -3, 1), &axis(12, "g"), &axis(13, "lbf")));
    let along = |dof: Dof| (dof.node, dof.direction.map(|own| (own.axis, own.sign)));
    assert_eq!(along(own.response), (7, Some((2, -1.0))));
    assert_eq!(along(own.reference), (8, Some((0, 1.0))));
    assert_eq!(own.grid, Grid { spacing_hz: 0.5, first_hz: 2.0 });
    assert_eq!(own.values, [[1.0, -2.0], [3.0, 4.0], [5.0, 6.0]]);
    let Kind::Response(Ok(unit)) = own.kind else { panic!("{own:?}") };
    assert_eq!(unit.motion, Motion::Acceleration);
    assert!((unit.size - 9.80665 / 4.448_221_615_260_5).abs() < 1e-9);
}

/// A label comes before the factors of data set 164; without both the units are those of SI.
#[test]
fn units_are_those_of_the_label_of_data_set_164_or_si() {
    let system = "    -1\n   164\n         5mm (milli newton)           2\n  1.0D+03  1.0D+03  1.0D+00\n  0.0D+00\n    -1\n";
    let size = |text: &str| match only(text).kind {
        Kind::Response(Ok(unit)) => unit.size,
        other => panic!("{other:?}"),
    };
    let plain = set(&record6(4, 1, 1), &axis(8, "NONE"), &axis(13, "NONE"));
    assert_eq!(size(&plain), 1.0);
    assert_eq!(size(&format!("{system}{plain}")), 1.0);
    let labelled = set(&record6(4, 1, 1), &axis(8, "mm"), &axis(13, "N"));
    assert!((size(&format!("{system}{labelled}")) - 1e-3).abs() < 1e-15);
    let of_whole = set(&record6(4, 1, 1), &axis(0, "(m/s^2)/N"), &axis(0, "NONE"));
    assert_eq!(size(&of_whole), 1.0);
    assert_eq!(
        only(&(set(&record6(6, 1, 1), &axis(0, ""), &axis(0, "")) + &plain)).kind,
        Kind::Coherence
    );
}

/// Whatever the head says of the number of bytes, and whether or not a line ends before the mark.
#[test]
fn binary_sets_are_those_in_ascii() {
    let text = set(&record6(4, 1, 2), &axis(12, "m/s2"), &axis(13, "N"));
    let expected = only(&text).values;
    let head = text.split_inclusive('\n').take(13).collect::<String>();
    for (is_big, order) in [(false, 1), (true, 2)] {
        for end in ["    -1\n", "\r\n    -1\r\n"] {
            let head = head.replace("    58\n", &format!("    58b{order:6}     2          11          24     0     0           0           0\n"));
            let mut bytes = head.into_bytes();
            for value in expected.as_flattened() {
                let own = *value as f32;
                bytes.extend(if is_big { own.to_be_bytes() } else { own.to_le_bytes() });
            }
            bytes.extend(end.as_bytes());
            bytes.extend(text.as_bytes());
            let both = parse(Path::new("a.uff"), &bytes).unwrap();
            assert_eq!(both.len(), 2);
            assert_eq!(both[0].values, expected, "{order} {end:?}");
            assert_eq!(both[0].values, both[1].values);
        }
    }
}

#[test]
fn frequencies_that_are_listed_must_be_even() {
    let listed = |frequencies: [f64; 3]| {
        let text = set(&record6(4, 1, 1), &axis(12, "m/s^2"), &axis(13, "N"));
        let [first, second, third] = frequencies;
        let values = format!(
            "{first:13.5e}{:13.5e}{:13.5e}{second:13.5e}{:13.5e}{:13.5e}\n{third:13.5e}{:13.5e}{:13.5e}",
            1.0, -2.0, 3.0, 4.0, 5.0, 6.0
        );
        let (head, _) = text.split_once(" 1.00000E+00-2").unwrap();
        read(&format!(
            "{}{values}\n    -1\n",
            head.replace(
                "         1  2.00000E+00  5.00000E-01",
                "         0  0.00000E+00  0.00000E+00"
            )
        ))
    };
    let own = listed([2.0, 2.5, 3.0]).unwrap().remove(0);
    assert_eq!((own.grid, own.values[0]), (Grid { spacing_hz: 0.5, first_hz: 2.0 }, [1.0, -2.0]));
    let error = listed([2.0, 2.7, 3.0]).unwrap_err();
    assert!(
        error.contains("its frequencies are uneven (number 2 is 2.7 Hz): export them at even"),
        "{error}"
    );
}

/// `[receptance] unit` then says it.
#[test]
fn a_unit_that_the_file_does_not_state_has_a_reason() {
    for (numerator, denominator, expected) in [
        (axis(0, "NONE"), axis(13, "N"), "states no unit"),
        (axis(12, "furlong"), axis(13, "N"), "has the unit \"furlong\", which is none of a motion"),
        (axis(12, "mm"), axis(13, "N"), "has the unit \"mm\", and is said to be another motion"),
        (axis(12, "m/s^2"), axis(13, "stone"), "has the force in \"stone\""),
    ] {
        let own = only(&set(&record6(4, 1, 1), &numerator, &denominator));
        assert_eq!(own.kind, Kind::Response(Err(expected.to_owned())));
    }
}

#[test]
fn mistakes_are_named_with_their_place_and_mend() {
    let good = [record6(4, 1, 1), axis(12, "m/s^2"), axis(13, "N")];
    let with = |index: usize, other: String| {
        let mut records = good.clone();
        records[index] = other;
        let [record6, numerator, denominator] = records;
        set(&record6, &numerator, &denominator)
    };
    let whole = with(0, good[0].clone());
    for (text, expected) in [
        (
            with(0, record6(1, 1, 1)),
            "a.uff: has no frequency response (data set 58, function type 4): it has time response; export the responses",
        ),
        (
            with(1, axis(13, "N")),
            "a.uff:2: the data set at line 2 (NONE) has a force over a motion: export the motion over the force",
        ),
        (
            with(2, axis(12, "N")),
            "a.uff:2: the data set at line 2 (NONE) has no force in its denominator: ",
        ),
        (
            with(0, "4".to_owned()),
            "a.uff:2: the data set does not say function type, nodes and directions (record 6)",
        ),
        (
            whole.replace(" 6.00000E+00\n", "\n"),
            "a.uff:2: the data set has 2 of 3 values: it is cut off",
        ),
        (
            whole.replace(" 6.00000E+00\n", " 6.0x\n"),
            "a.uff:2: the data set has a value that is no number",
        ),
        (
            whole.replace("         5         3", "         5         x"),
            "a.uff:2: the data set does not say what its values are (record 7)",
        ),
        (
            whole.replace("Hz ", "rpm"),
            "a.uff:2: the data set at line 2 (NONE) has no frequencies in Hz",
        ),
        (
            whole.replace("    58\n", "    58b     1     3          11          24\n"),
            "a.uff:2: the binary data set has byte order 1 and floating point format 3",
        ),
        (
            "    -1\n    15\n    -1\n".to_owned(),
            "a.uff: has no frequency response (data set 58, function type 4): it has no data set 58",
        ),
        ("    -1\n    58\nNONE\n".to_owned(), "a.uff:2: the data set is cut off: export it again"),
    ] {
        let error = read(&text).unwrap_err();
        assert!(error.starts_with(expected), "{error}\n{expected}");
    }
}

/// A response that turns, or to a torque, is left out.
#[test]
fn turns_are_left_out() {
    let turns = set(&record6(4, 4, 1), &axis(12, "rad/s^2"), &axis(13, "N"));
    let shifts = set(&record6(4, 1, 1), &axis(12, "m/s^2"), &axis(13, "N"));
    assert_eq!(read(&(turns + &shifts)).unwrap().len(), 1);
}

/// Files of other programs.
#[test]
fn files_of_others_are_read() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/receptances");
    for (name, other) in
        [("testlab.uff", "it has no data set 58"), ("binary8byte.uff", "it has time response")]
    {
        let bytes = std::fs::read(folder.join(name)).unwrap();
        assert!(is_universal(&bytes), "{name}");
        let error = parse(Path::new(name), &bytes).unwrap_err().to_string();
        assert!(error.contains(other), "{error}");
    }
    assert!(!is_universal(b"file,q1\n-1\n") && !is_universal(b""));
}
