//! Measured receptances: frequency responses of hammer and shaker tests, from universal files and tables.
//!
//! | module     | holds                                                              |
//! | ---------- | ------------------------------------------------------------------ |
//! | `uff`      | data sets 58, 58b and 164 of universal files                       |
//! | `table`    | tables (CSV) of real and imaginary parts, or magnitudes and phases |
//! | `function` | a function of frequency, wherever it comes from                    |
//! | `unit`     | units of a motion per force                                        |
//! | `settings` | how the tests were made                                            |
//! | `assembly` | functions to receptances, with a variance for each bin             |
//! | `measured` | a receptance, in the axes of the robot                             |
//!
//! A list names the files with their poses, in the columns of [`crate::poses`]:
//!
//! ```text
//! file,q1 [deg],q2 [deg],q3 [deg],px,py,pz
//! pose1.uff,0,-25.8,54.4,0,0,0.05
//! ```

mod assembly;
mod function;
mod measured;
mod settings;
mod table;
mod uff;
mod unit;

use std::path::Path;

use crate::input::{self, BadInput};
use crate::model::Model;
use crate::poses::{self, Cut};
use crate::record::{BINS, MAX_EXPERIMENTS};
pub use measured::Receptance;
pub use settings::Settings;
pub use uff::is_universal;
pub use unit::Unit;

/// Most receptances that a fit takes: the records of a fit are 16, and one must have room beside them.
pub const MAX_RECEPTANCES: usize = MAX_EXPERIMENTS - 1;

/// Fewest and most bins that a fit takes.
const BAND_BINS: [usize; 2] = [8, BINS];

/// Reads the receptances of the files that the list `list` names.
///
/// # Errors
/// The error is one line that names the file, the place and the correction.
pub fn load(
    list: &Path,
    model: &Model,
    settings: &Settings,
    band_hz: [f64; 2],
) -> Result<Vec<Receptance>, BadInput> {
    let lines = poses::load(list, model)?;
    let folder = list.parent().unwrap_or(Path::new(""));
    let mut all = Vec::new();
    for (name, cut) in lines.lines() {
        let file = folder.join(name);
        let bytes = input::read_regular_bytes(&file)?;
        let own = parse(&file, &bytes, cut, settings, band_hz)?;
        check_bins(&own, band_hz)?;
        all.extend(own);
        if all.len() > MAX_RECEPTANCES {
            return Err(BadInput::new(
                list,
                format!(
                    "names more than {MAX_RECEPTANCES} directions of force, each at a pose: leave some out"
                ),
            ));
        }
    }
    Ok(all)
}

/// Checks that a fit can take as many bins as the band holds.
fn check_bins(receptances: &[Receptance], band_hz: [f64; 2]) -> Result<(), BadInput> {
    for own in receptances {
        let [lowest, highest] = own.range_hz();
        let bins =
            ((highest.min(band_hz[1]) - lowest.max(band_hz[0])) / own.spacing_hz).floor() + 1.0;
        let [fewest, most] = BAND_BINS.map(|own| own as f64);
        let mend = match bins {
            few if few < fewest => "widen [measurement] band_hz, or test with finer frequencies",
            many if many > most => "narrow [measurement] band_hz, or export every second frequency",
            _ => continue,
        };
        let message = format!(
            "has {bins} frequencies in band_hz, and {fewest} to {most} can be fitted: {mend}"
        );
        return Err(BadInput::new(&own.file, message));
    }
    Ok(())
}

/// Parses `bytes`, the content of the file `file` of a modal test at a pose.
///
/// # Errors
/// The errors are those of [`load`].
pub fn parse(
    file: &Path,
    bytes: &[u8],
    cut: &Cut,
    settings: &Settings,
    band_hz: [f64; 2],
) -> Result<Vec<Receptance>, BadInput> {
    let functions = if is_universal(bytes) {
        uff::parse(file, bytes)?
    } else {
        let text = input::text(file, bytes.to_vec())?;
        table::parse(file, &text, cut.directions)?
    };
    assembly::assemble(file, functions, cut, settings, band_hz)
}
