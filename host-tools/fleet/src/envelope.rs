//! What a finding carries beside the result: entries at the top of the same JSON object.

use serde::{Deserialize, Serialize};
use serde_json::Value;
use sha2::{Digest, Sha256};

use crate::moment::Moment;
use crate::place::Place;

/// Origin of a finding.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Origin {
    /// SHA-256 of the daemon's configuration. `None` if it cannot be read.
    pub config_sha256: Option<String>,
    /// SHA-256 of the model's file. `None` if it cannot be read, or is of another robot.
    pub model_sha256: Option<String>,
    /// Program that made the result, with its version.
    pub tool: String,
}

/// The entries of the envelope, beside those of the result.
#[derive(Debug, Serialize)]
pub(crate) struct Envelope<'a> {
    site: &'a str,
    /// Name of the robot. The result has `robot` for what predicts its motion.
    robot_id: &'a str,
    /// Name of the outbox, in which `sequence` counts.
    #[serde(rename = "box")]
    outbox: &'a str,
    boot_id: Option<&'a str>,
    sequence: u64,
    /// Instant at which the newest record came, UTC. `null` if it came to an earlier daemon.
    begun: Option<String>,
    /// Instant at which the finding settled, UTC.
    found_at: String,
    /// Whether the clock of these instants is synchronised. `null` if nobody knows.
    synchronised: Option<bool>,
    model_sha256: Option<&'a str>,
    config_sha256: Option<&'a str>,
    tool: &'a str,
}

/// Instants of a finding, and what is known of the clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Times {
    pub(crate) begun: Option<Moment>,
    pub(crate) found_at: Moment,
    pub(crate) synchronised: Option<bool>,
}

impl<'a> Envelope<'a> {
    pub(crate) fn new(place: &'a Place, origin: &'a Origin, times: Times) -> Self {
        Self {
            site: place.site(),
            robot_id: place.robot(),
            outbox: "",
            boot_id: None,
            sequence: 0,
            begun: times.begun.map(|begun| begun.to_string()),
            found_at: times.found_at.to_string(),
            synchronised: times.synchronised,
            model_sha256: origin.model_sha256.as_deref(),
            config_sha256: origin.config_sha256.as_deref(),
            tool: &origin.tool,
        }
    }

    /// Returns the envelope with the place of the finding in its outbox.
    pub(crate) fn numbered(self, outbox: &'a str, boot: Option<&'a str>, sequence: u64) -> Self {
        Self { outbox, boot_id: boot, sequence, ..self }
    }

    /// Puts the entries at the top of `body`, a JSON object with entries that begins with its brace. They stay as they are.
    pub(crate) fn around(&self, body: &str) -> String {
        let own = serde_json::to_string(self).expect("strings and numbers");
        let own = own.strip_suffix('}').unwrap_or_default();
        format!("{own},{}", body.strip_prefix('{').unwrap_or_default())
    }
}

/// Entries of a finding by which an outbox knows it.
#[derive(Debug, PartialEq, Deserialize)]
pub(crate) struct Known {
    #[serde(default)]
    pub(crate) sequence: u64,
    joints: Value,
}

impl Known {
    /// Reads the entries of a finding or of a result, which has no sequence; `None` if `text` is neither.
    pub(crate) fn of(text: &str) -> Option<Self> {
        serde_json::from_str(text).ok()
    }

    /// Returns whether `other` has the same parameters: it is the same estimate, which a daemon sends anew to each client.
    pub(crate) fn is_estimate_of(&self, other: &Self) -> bool {
        self.joints == other.joints
    }
}

/// Returns the SHA-256 of `bytes` in hexadecimal digits.
pub fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_result_stays_as_it_is() {
        let place = Place::new("hall", "r1").unwrap();
        let origin = Origin { tool: "flexid 0.1.0".into(), ..Origin::default() };
        let found_at = Moment::now();
        let times = Times { begun: None, found_at, synchronised: Some(false) };
        let body = r#"{"schema":2,"joints":[{"stiffness":[6.0e7,1e-300]}],"robot":{}}"#;
        let envelope = Envelope::new(&place, &origin, times).numbered("b0", Some("boot"), 17);
        let text = envelope.around(body);
        assert!(text.ends_with(&body[1..]), "{text}");
        let value: Value = serde_json::from_str(&text).unwrap();
        assert_eq!((&value["sequence"], &value["robot_id"]), (&17.into(), &"r1".into()));
        assert_eq!(value["found_at"], found_at.to_string());
        assert_eq!((&value["synchronised"], &value["begun"]), (&false.into(), &Value::Null));

        let known = Known::of(&text).unwrap();
        assert_eq!(known.sequence, 17);
        assert!(known.is_estimate_of(&Known::of(body).unwrap()));
        assert!(!known.is_estimate_of(&Known::of(&body.replace("6.0e7", "6.1e7")).unwrap()));
        assert!(Known::of("").is_none() && Known::of("{}").is_none());
    }

    #[test]
    fn the_sum_is_that_of_the_standard() {
        // FIPS 180-2, B.1.
        let sum = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(sha256(b"abc"), sum);
    }
}
