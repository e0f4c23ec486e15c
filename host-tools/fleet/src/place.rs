//! Names of a robot: its site, and its own. They are levels of topics.

use std::fmt;

/// Most letters of a name. Chosen: a serial number has fewer, and the topic stays short.
const LONGEST: usize = 64;

/// A robot of a site.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    site: String,
    robot: String,
}

/// Why a name cannot be a level of a topic.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NameError {
    /// The name is empty.
    #[error("{0} is empty: name it by letters, digits, - _ and .")]
    Empty(&'static str),
    /// The name has a letter that separates levels, matches any level, or is not ASCII.
    #[error("{0} {1:?} has {2:?}: write letters of ASCII, digits, - _ and . only")]
    Letter(&'static str, String, char),
    /// The name is too long.
    #[error("{0} has {1} letters: {LONGEST} at most")]
    Long(&'static str, usize),
}

impl Place {
    /// Makes a place of checked names.
    ///
    /// # Errors
    /// A name cannot be a level of a topic. The error names the key, `site` or `robot`, and the correction.
    pub fn new(site: &str, robot: &str) -> Result<Self, NameError> {
        check("site", site)?;
        check("robot", robot)?;
        Ok(Self { site: site.to_owned(), robot: robot.to_owned() })
    }

    /// Returns the name of the site.
    pub fn site(&self) -> &str {
        &self.site
    }

    /// Returns the name of the robot.
    pub fn robot(&self) -> &str {
        &self.robot
    }

    /// Returns the topic of `what`, for example `flexid/v1/hall-3/kr210-4711/finding`.
    pub fn topic(&self, what: &str) -> String {
        format!("flexid/v1/{self}/{what}")
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.site, self.robot)
    }
}

fn check(key: &'static str, name: &str) -> Result<(), NameError> {
    let letters = name.chars().count();
    if letters > LONGEST {
        return Err(NameError::Long(key, letters));
    }
    let is_allowed = |letter: &char| letter.is_ascii_alphanumeric() || "-_.".contains(*letter);
    match name.chars().find(|letter| !is_allowed(letter)) {
        Some(letter) => Err(NameError::Letter(key, name.to_owned(), letter)),
        None if name.is_empty() => Err(NameError::Empty(key)),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_levels_of_a_topic() {
        let place = Place::new("hall-3", "KR210_4711.b").unwrap();
        assert_eq!(place.topic("finding"), "flexid/v1/hall-3/KR210_4711.b/finding");
        for (name, letter) in
            [("a/b", '/'), ("+", '+'), ("a#", '#'), ("$SYS", '$'), ("halle 3", ' '), ("a\nb", '\n')]
        {
            let error = Place::new("hall", name).unwrap_err();
            assert_eq!(error, NameError::Letter("robot", name.to_owned(), letter));
            assert!(!error.to_string().contains('\n'), "{error}");
        }
        assert_eq!(Place::new("", "r"), Err(NameError::Empty("site")));
        assert_eq!(Place::new(&"ä".repeat(300), "r"), Err(NameError::Long("site", 300)));
    }
}
