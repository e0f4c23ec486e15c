//! Receptances from tables, and what is wrong with them.

use super::*;
use crate::poses::Direction;
use crate::receptance::table;

const BAND_HZ: [f64; 2] = [1.0, 4.0];

fn settings() -> Settings {
    Settings { averages: Some(5.0), axes: [(0, 1.0), (1, 1.0), (2, 1.0)], ..Settings::default() }
}

fn cut() -> Cut {
    Cut { pose: vec![0.1], point: [0.0, 0.0, 0.2], ..Cut::default() }
}

fn read(text: &str, settings: &Settings) -> Result<Vec<Receptance>, String> {
    let file = Path::new("a.csv");
    let functions = table::parse(file, text, cut().directions);
    let all = functions.and_then(|own| assemble(file, own, &cut(), settings, BAND_HZ));
    all.map_err(|error| error.to_string())
}

const TABLE: &str = "f,Hxz re [m/N],Hxz im [m/N],Hxz coherence,note\n\
                     1,2,0,0.9,a\n2,0,1,0.5,b\n3,1,1,0,c\n4,,,0.9,d\n";

/// `ε² = (1 − γ²)/(2 n γ²)`, and an accelerance is `−ω²` times a receptance.
#[test]
fn a_variance_is_that_of_the_coherence() {
    let all = read(TABLE, &settings()).unwrap();
    let [own] = &all[..] else { panic!("{all:?}") };
    assert_eq!((own.force_axis, own.first_hz, own.spacing_hz), (2, 1.0, 1.0));
    assert_eq!((own.point, own.range_hz()), ([0.0, 0.0, 0.2], [1.0, 4.0]));
    assert!(own.axes[1].is_empty() && own.axes[2].is_empty());
    let bins = &own.axes[0];
    let omega = |hz: f64| (TAU * hz).powi(2);
    let [re, im] = bins[0].accelerance;
    assert!((re + 2.0 * omega(1.0)).abs() < 1e-9 && im.abs() < 1e-9);
    let expected = 2.0 * (0.1 / (2.0 * 5.0 * 0.9)) * re * re;
    assert!((bins[0].variance / expected - 1.0).abs() < 1e-9, "{}", bins[0].variance);
    let expected = 2.0 * (0.5 / (2.0 * 5.0 * 0.5)) * omega(2.0).powi(2);
    assert!((bins[1].variance / expected - 1.0).abs() < 1e-9);
    assert!(bins[2..].iter().all(|bin| bin.variance == f64::INFINITY), "{bins:?}");
}

/// Floors add to it, a window moves the bins, axes and signs turn.
#[test]
fn settings_say_how_the_test_was_made() {
    let floors =
        Settings { averages: None, relative_floor: 0.1, absolute_floor: 2.0, ..settings() };
    let [own] = &read(TABLE, &floors).unwrap()[..] else { panic!("one") };
    let [re, im] = own.axes[0][0].accelerance;
    let expected = 2.0 * (0.01 * (re * re + im * im) + 4.0);
    assert!((own.axes[0][0].variance / expected - 1.0).abs() < 1e-9);
    let windowed = Settings { decay: 3.0, ..settings() };
    let [own] = &read(TABLE, &windowed).unwrap()[..] else { panic!("one") };
    let s = Complex::new(3.0, TAU);
    let [re, im] = own.axes[0][0].accelerance;
    assert!((Complex::new(re, im) - s * s * 2.0).norm() < 1e-9);
    let stated = Settings { unit: Unit::parse("m/N"), ..settings() };
    let [own] = &read(&TABLE.replace(" [m/N]", ""), &stated).unwrap()[..] else { panic!("one") };
    assert!((own.axes[0][0].accelerance[0] + 2.0 * TAU.powi(2)).abs() < 1e-9);
    let turned = Settings { axes: [(1, -1.0), (0, 1.0), (2, 1.0)], ..settings() };
    let [own] = &read(TABLE, &turned).unwrap()[..] else { panic!("one") };
    assert!(own.axes[0].is_empty() && own.axes[1][0].accelerance[0] > 0.0);
}

#[test]
fn each_direction_of_the_force_is_a_receptance() {
    let text = "f,Hxx re [g/N],Hxx im [g/N],H_y-x mag [g/N],H_y-x phase [deg],Hzy re [g/N],Hzy im [g/N]\n\
                1,1,0,1,90,3,0\n2,1,0,1,90,3,0\n";
    let floor = Settings { averages: None, relative_floor: 0.01, ..settings() };
    let all = read(text, &floor).unwrap();
    assert_eq!(all.iter().map(|own| own.force_axis).collect::<Vec<_>>(), [0, 1]);
    let [re, im] = all[0].axes[1][0].accelerance;
    assert!(re.abs() < 1e-9 && (im + 9.80665).abs() < 1e-9, "{re} {im}");
    assert_eq!(all[1].axes[2][0].accelerance, [3.0 * 9.80665, 0.0]);
}

/// A table of one response has its directions in the list.
#[test]
fn directions_may_stand_in_the_list() {
    let text = "f,re [m/s^2/N],im [m/s^2/N],coh\n1,1,2,0.9\n2,1,2,0.9\n";
    let x = Direction { axis: 0, sign: 1.0 };
    let directions = [Some(Direction { axis: 2, sign: -1.0 }), Some(x)];
    let file = Path::new("a.csv");
    let functions = table::parse(file, text, directions).unwrap();
    let all = assemble(file, functions, &cut(), &settings(), BAND_HZ).unwrap();
    assert_eq!(all[0].axes[0][0].accelerance, [-1.0, -2.0]);
    let error = read(text, &settings()).unwrap_err();
    assert!(error.starts_with("a.csv: the column \"re [m/s^2/N]\" does not say the direction of the response: write it into the list's column acceleration"), "{error}");
}

#[test]
fn mistakes_are_named_with_their_place_and_mend() {
    let good = settings();
    let floor = Settings { averages: None, relative_floor: 0.01, ..settings() };
    let none = Settings { averages: None, ..settings() };
    let rows = "\n1,1,0,0.9\n2,1,0,0.9\n";
    let with = |header: &str| format!("{header}{rows}");
    let whole = with("f,Hxx re [m/N],Hxx im [m/N],Hxx coh");
    let column = "the column \"Hxx coh\"";
    for (text, settings, expected) in [
        (with("f,Hxx re,Hxx im,Hxx coh"), &good, "a.csv: the column \"Hxx re\" states no unit: state [receptance] unit, such as".to_owned()),
        (with("f,Hxx re [m/N],Hxx im [m/N],note"), &good, "a.csv: the column \"Hxx re [m/N]\" has no coherence (function type 6, or a column coherence): export it, or state".to_owned()),
        (whole.clone(), &none, format!("a.csv: {column} says how certain the column \"Hxx re [m/N]\" is if the number of averages is known: state")),
        (whole.replace("0.9", "0"), &good, format!("a.csv: {column} is 0 at all frequencies of band_hz: it was not computed; export it again, or")),
        (whole.replace("0.9", "1.5"), &good, format!("a.csv: {column} is 1.5 at 1 Hz: a coherence lies between 0 and 1")),
        (whole.replace("0.9", "1"), &good, "a.csv: the column \"Hxx re [m/N]\" has a coherence of 1 at 1 Hz, as if it had no error: state [receptance] relative_floor".to_owned()),
        (whole.replace("\n1,", "\n10,").replace("\n2,", "\n20,"), &floor, "a.csv: has frequencies from 10 to 20 Hz, and none in [measurement] band_hz, 1 to 4 Hz: correct one of them".to_owned()),
        (whole.replace("1,0,0.9", ",,0.9"), &floor, "a.csv: the column \"Hxx re [m/N]\" has no value in band_hz: export it again".to_owned()),
        (whole.replace("\n2,", "\nx,"), &floor, "a.csv:3: column of the frequency is \"x\": must be a number (in Hz)".to_owned()),
        ("f,Hxx re [m/N],Hxx im [m/N]\n".to_owned(), &floor, "a.csv: has no frequency: the first line names the columns".to_owned()),
    ] {
        let error = read(&text, settings).unwrap_err();
        assert!(error.starts_with(&expected), "{error}\n{expected}");
    }
    let refused = |change: &dyn Fn(&mut Settings)| {
        let mut settings = settings();
        change(&mut settings);
        settings.check().unwrap_err()
    };
    assert!(
        refused(&|own| own.averages = Some(1.0))
            .starts_with("[receptance] averages is 1: the coherence of fewer than 2 is 1")
    );
    assert!(
        refused(&|own| own.relative_floor = 2.0)
            .starts_with("[receptance] relative_floor is 2: parts are fractions")
    );
    assert!(
        refused(&|own| own.decay = -1.0)
            .starts_with("[receptance] decay_per_s is -1: must be 0 or larger")
    );
}

/// Nodes other than the accelerometer's, and several struck ones.
#[test]
fn nodes_are_named() {
    let direction = Some(Direction { axis: 0, sign: 1.0 });
    let function = |response: i64, force: i64| Function {
        place: format!("{response} per {force}"),
        kind: Kind::Response(Ok(Unit::parse("m/s^2/N").unwrap())),
        response: Dof { node: response, direction },
        reference: Dof { node: force, direction },
        grid: Grid { spacing_hz: 1.0, first_hz: 1.0 },
        values: vec![[1.0, 0.0]; 4],
    };
    let floor = Settings { averages: None, relative_floor: 0.01, ..settings() };
    let all = |functions: Vec<Function>, settings: &Settings| {
        let own = assemble(Path::new("a.uff"), functions, &cut(), settings, BAND_HZ);
        own.map_err(|error| error.to_string())
    };
    let both = || vec![function(1, 1), function(1, 5)];
    let error = all(both(), &floor).unwrap_err();
    assert!(error.starts_with("a.uff: has forces at the nodes 1, 5: state where each lies from the TCP, in m: [receptance.points_m] 1 ="), "{error}");
    let mut placed = floor.clone();
    placed.points = [(1, [0.0; 3]), (5, [0.1, 0.0, 0.0])].into();
    let points: Vec<[f64; 3]> = all(both(), &placed).unwrap().iter().map(|own| own.point).collect();
    assert_eq!(points, [[0.0; 3], [0.1, 0.0, 0.0]]);
    let roving = || vec![function(1, 1), function(2, 1)];
    let error = all(roving(), &floor).unwrap_err();
    assert!(
        error.starts_with(
            "a.uff: has responses of the nodes 1, 2: name the one where [mounting] has"
        ),
        "{error}"
    );
    let mut one = floor.clone();
    one.response_node = Some(2);
    assert_eq!(all(roving(), &one).unwrap().len(), 1);
    one.response_node = Some(3);
    assert!(
        all(roving(), &one)
            .unwrap_err()
            .contains("has no response of node 3, but of 1, 2: correct")
    );
    let error = all(vec![function(1, 1), function(1, 1)], &floor).unwrap_err();
    assert!(
        error.contains("1 per 1 is the second response along X for a force along X: keep one"),
        "{error}"
    );
    let mut other = function(1, 1);
    other.response.direction = Some(Direction { axis: 1, sign: 1.0 });
    other.grid.spacing_hz = 2.0;
    let error = all(vec![function(1, 1), other], &floor).unwrap_err();
    assert!(
        error.contains("1 per 1 has other frequencies than 1 per 1: export both over the same"),
        "{error}"
    );
}
