//! The scenarios that flexid ships, in the program itself.

use std::path::{Path, PathBuf};
use std::{fs, io};

/// Files of a scenario with their texts. `edge.toml` is the daemon's configuration.
#[derive(Clone, Copy, Debug)]
pub struct Shipped([(&'static str, &'static str); 4]);

/// The reference scenario: three joints, no gravity.
pub const MILL3: Shipped = Shipped([
    ("edge.toml", include_str!("../../scenario/mill3-edge.toml")),
    ("mill3-model.toml", include_str!("../../scenario/mill3-model.toml")),
    ("mill3.toml", include_str!("../../scenario/mill3.toml")),
    ("mill3.dbc", include_str!("../../scenario/mill3.dbc")),
]);

/// The robot of [`MILL3`], which feeds along paths.
pub const MILL3_FEED: Shipped = Shipped([
    ("edge.toml", include_str!("../../scenario/mill3-edge.toml")),
    ("mill3-model.toml", include_str!("../../scenario/mill3-model.toml")),
    ("mill3.toml", include_str!("../../scenario/mill3-feed.toml")),
    ("mill3.dbc", include_str!("../../scenario/mill3.dbc")),
]);

/// Six joints in gravity, without bounds.
pub const MILL6: Shipped = Shipped([
    ("edge.toml", include_str!("../../scenario/mill6-edge.toml")),
    ("mill6-model.toml", include_str!("../../scenario/mill6-model.toml")),
    ("mill6.toml", include_str!("../../scenario/mill6.toml")),
    ("mill6.dbc", include_str!("../../scenario/mill6.dbc")),
]);

impl Shipped {
    /// Writes the files into `folder`. Returns the path of the configuration.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn write(self, folder: &Path) -> io::Result<PathBuf> {
        for (name, text) in self.0 {
            fs::write(folder.join(name), text)?;
        }
        Ok(folder.join("edge.toml"))
    }
}
