//! Tables in text, as pandas and LabVIEW write them: `tests/fuzz/seeds/write.py` holds the cut that is in all of them.

#[path = "../readings/cut.rs"]
mod cut;
#[path = "../readings/mod.rs"]
mod readings;

use std::path::Path;

use flexid_pipeline::source::{Layout, TableLog};

use cut::is_the_cut;
use readings::{accelerations, all, forces, layout};

macro_rules! seed {
    ($file:literal) => {
        ($file, include_bytes!(concat!("../../../../tests/fuzz/seeds/table/", $file)).as_slice())
    };
}

const PANDAS: [(&str, &[u8]); 3] =
    [seed!("pandas.csv"), seed!("pandas-semicolons.csv"), seed!("pandas-quoted.csv")];

/// Files with one time for all channels, and with one for each.
const LABVIEW: [(&str, &[u8]); 2] = [seed!("gaps.lvm"), seed!("multi.lvm")];

/// Two cuts without a time.
const OF_TWO_CUTS: (&str, &[u8]) = seed!("none.lvm");

fn open<'a>(text: &'a [u8], layout: &Layout) -> Result<TableLog<'a>, String> {
    TableLog::open(Path::new("cut"), text, layout, None).map_err(|error| error.to_string())
}

#[test]
fn tables_of_pandas_are_read() {
    let mut layout = layout(None, &["q1", "q2"]);
    layout.joints[1].1 = true;
    for (name, text) in PANDAS {
        is_the_cut(name, open(text, &layout), true);
    }
}

/// `write.py` checks that lvm_read reads the same numbers.
#[test]
fn files_of_labview_are_read() {
    for (name, text) in LABVIEW {
        is_the_cut(name, open(text, &layout(None, &[])), false);
    }
    let (name, text) = OF_TWO_CUTS;
    let table = open(text, &layout(None, &[])).unwrap();
    assert!((table.shown().rate_hz.unwrap() - 1000.0).abs() < 1e-6, "{name}");
    let (arrivals, error) = all(table);
    let own: Vec<[f32; 3]> = forces(&arrivals).into_iter().map(|(_, force)| force).collect();
    let expected: Vec<_> = (0..40).map(|row| [row as f32, 2.0, -3.0]).collect();
    assert_eq!((own, error), (expected, None), "{name}");
    let expected: Vec<_> = (0..40).map(|row| [0.5, row as f32 / 8.0, -9.5]).collect();
    assert_eq!(accelerations(&arrivals), expected, "{name}");
    // The second cut begins anew.
    let starts: Vec<f64> = arrivals.iter().map(|arrival| arrival.time_s).collect();
    assert!(starts.windows(2).filter(|pair| pair[1] - pair[0] > 1.0).count() == 1, "{name}");
}
