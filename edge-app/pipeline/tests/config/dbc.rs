//! The DBC file that `EDGE.toml` names.

use std::fs;

use super::{Config, DBC, EDGE, MODEL, check, load};

#[test]
fn mistakes_in_the_dbc_file_name_the_signal() {
    let table = [
        (
            "[-3276.8|3276.7] \"N\" EDGE\n SG_ Fy",
            "[-3276.8|3276.7] \"lb\" EDGE\n SG_ Fy",
            "mill3.dbc: signal Fx has unit \"lb\": force must be in one of N, kN, mN, lbf, daN, kgf, kp, Newtons, or state force_unit in [signals]",
        ),
        (
            "\"m/s^2\"",
            "\"\"",
            "mill3.dbc: signal ax has unit \"\": acceleration must be in one of m/s^2,",
        ),
        (
            "\"rad\"",
            "\"mm\"",
            "mill3.dbc: signal q1 has unit \"mm\": angle must be in one of rad, mrad, deg, °",
        ),
        (
            "AccelerationCounter : 48|16@",
            "AccelerationCounter : 48|12@",
            "mill3.dbc: ForceCounter has 16 bits and AccelerationCounter has 12: force and acceleration are \
             joined by their counters, which must be equally wide",
        ),
        (
            "ForceCounter : 48|16@1+ (1,0)",
            "ForceCounter : 48|16@1+ (2,0)",
            "mill3.dbc: counter ForceCounter has factor 2 and offset 0: must be (1,0)",
        ),
        (
            "ForceCounter : 48|16@1+",
            "ForceCounter : 48|4@1+",
            "mill3.dbc: counter ForceCounter has 4 bits: must have 8 to 32",
        ),
        (
            "FORCE: 8",
            "FORCE: 7",
            "mill3.dbc: signal ForceCounter: reaches to byte 8 of a payload of 7: mend start bit or length",
        ),
        (
            "FORCE: 8",
            "FORCE: 65",
            "mill3.dbc: message FORCE has 65 bytes: a CAN FD frame has at most 64",
        ),
        (
            "BO_ 257 FORCE",
            "BO_ 4000 FORCE",
            "mill3.dbc: message FORCE has identifier 4000: above 2047",
        ),
        (
            "SG_ Fx :",
            "SG_ Fx m0 :",
            "mill3.dbc: signal Fx is multiplexed: flexid reads plain signals only; set the sensor to",
        ),
        (
            "SG_ Joint1Counter :",
            "SG_ Fx :",
            "edge.toml: [signals] force: \"Fx\" is in messages FORCE and JOINT_1 of mill3.dbc: write \"FORCE.Fx\"",
        ),
        (
            "BO_ 258 ACCELERATION",
            "BO_ 257 ACCELERATION",
            "mill3.dbc: messages FORCE and ACCELERATION share the identifier 257: each frame has one layout",
        ),
        (
            "SG_ Fy : 16|16@",
            "SG_ Fy : 8|16@",
            "mill3.dbc: signals Fx and Fy of message FORCE overlap: mend start bit or length",
        ),
        (
            "ForceCounter : 48|16@1+",
            "ForceCounter : 40|16@1+",
            "mill3.dbc: signals Fz and ForceCounter of message FORCE overlap: mend start bit or length",
        ),
        ("VERSION \"\"", "VERSION \"", "mill3.dbc: is not a DBC file: line "),
    ];
    check("mill3.dbc", &table);
}

#[test]
fn known_units_are_converted() {
    for (from, to, unit) in [("\"N\"", "\"kN\"", 1e3), ("\"N\"", "\"mN\"", 1e-3)] {
        let table = load("mill3.dbc", from, to).unwrap().signals;
        assert_eq!(table.force_resolution, (0.1 * unit) as f32);
    }
    for (unit, size) in [("\"mG\"", 9.80665e-3), ("\"µg\"", 9.80665e-6), ("\"μg\"", 9.80665e-6)] {
        let table = load("mill3.dbc", "\"m/s^2\"", unit).unwrap().signals;
        assert_eq!(table.acceleration_resolution, (0.002 * size) as f32, "{unit}");
    }
    let table = load("mill3.dbc", "\"m/s^2\"", "\"g\"").unwrap().signals;
    assert_eq!(table.acceleration_resolution, (0.002 * 9.80665) as f32);
    assert!(load("mill3.dbc", "\"rad\"", "\"deg\"").is_ok());
}

#[test]
fn dbc_files_in_the_old_encoding_are_read() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("edge.toml"), EDGE).unwrap();
    fs::write(folder.path().join("mill3-model.toml"), MODEL).unwrap();
    let mut dbc = DBC.replace("m/s^2", "m/s?").into_bytes();
    for byte in dbc.iter_mut().filter(|byte| **byte == b'?') {
        *byte = 0xB2;
    }
    fs::write(folder.path().join("mill3.dbc"), dbc).unwrap();
    Config::load(&folder.path().join("edge.toml")).unwrap();
}
