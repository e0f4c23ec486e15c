//! The formats and their names.

use std::fmt;
use std::str::FromStr;

/// A format in which a robot can be exported. [`FromStr`] and [`Display`](fmt::Display) use the same names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// `mjcf`: the XML of MuJoCo, version 3 or later.
    Mjcf,
    /// `simscape`: a MATLAB script that builds a model of Simscape Multibody.
    Simscape,
    /// `drake`: a Python script that builds a `MultibodyPlant` of Drake.
    Drake,
    /// `csv`: a table with one row per parameter.
    Csv,
}

impl Format {
    /// All formats.
    pub const ALL: [Self; 4] = [Self::Mjcf, Self::Simscape, Self::Drake, Self::Csv];

    /// Returns the name of the format.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mjcf => "mjcf",
            Self::Simscape => "simscape",
            Self::Drake => "drake",
            Self::Csv => "csv",
        }
    }
}

/// No format has this name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown format {0:?}: one of mjcf, simscape, drake, csv")]
pub struct UnknownFormat(pub String);

impl FromStr for Format {
    type Err = UnknownFormat;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        let found = Self::ALL.into_iter().find(|format| format.name() == name);
        found.ok_or_else(|| UnknownFormat(name.to_string()))
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_again() {
        for format in Format::ALL {
            assert_eq!(format.to_string().parse(), Ok(format));
        }
        let error = "urdf".parse::<Format>().unwrap_err();
        assert_eq!(
            error.to_string(),
            r#"unknown format "urdf": one of mjcf, simscape, drake, csv"#
        );
    }
}
