//! Epochs: where the records of a solver lie in time, its finding as a file, and the solver of the next epoch.

use std::io;
use std::path::Path;

use flexid_wire::finding::Finding;

use super::Solver;
use crate::config::Config;
use crate::date::{date, is_date};
use crate::document::{FindingJson, Origin, OriginFile};
use crate::intake::Counts;

impl Solver {
    /// Returns when the oldest and the newest record that is kept began, on the clock of the readings, s. Those that have a date count, or all
    /// if none has. Returns `None` without records.
    pub fn span_s(&self) -> Option<[f64; 2]> {
        let all: Vec<f64> = self.sources.iter().flatten().map(|record| record.start_s).collect();
        let dated: Vec<f64> = all.iter().copied().filter(|start_s| is_date(*start_s)).collect();
        let counting = if dated.is_empty() { all } else { dated };
        Some([*counting.first()?, *counting.last()?])
    }

    /// Returns the number of records that came, those included that were left out.
    pub fn came(&self) -> u64 {
        self.came.saturating_sub(self.config.receptances.len() as u64)
    }

    /// Makes a solver of the same config that knows nothing of these records. `counts` is what has come in by now.
    ///
    /// # Errors
    /// A checked config gives no error.
    pub fn anew(&self, counts: &Counts) -> io::Result<Self> {
        let mut solver = Self::new(&self.config)?;
        solver.state.earlier = solver.state.earlier.without(counts);
        Ok(solver)
    }

    /// Returns the `finding` of the present estimate as the text of a file that `flexid history` reads. Returns `None` without an estimate.
    ///
    /// # Errors
    /// The text cannot be made. No finding is known of which it cannot.
    pub fn document(&self, finding: &Finding) -> io::Result<Option<String>> {
        let Some(robot) = self.robot() else { return Ok(None) };
        let shared = self.shared();
        let origin = origin(&self.config, self.span_s().and_then(|[oldest_s, _]| date(oldest_s)));
        let json = FindingJson::from(finding).of_robot(Some(&robot), shared.as_ref());
        let text = serde_json::to_string(&json.from_origin(&origin))?;
        Ok(Some(text + "\n"))
    }
}

/// The origin of a daemon's finding.
fn origin(config: &Config, date: Option<String>) -> Origin {
    let file = |path: &Path| {
        let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
        OriginFile { name, sha256: None }
    };
    Origin {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        command: format!("flexid-edge --config {}", config.file_name()),
        date,
        configuration: config.files().map(file).collect(),
        logs: Vec::new(),
    }
}
