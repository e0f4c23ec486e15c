//! Texts of messages.

use serde_json::json;

use crate::envelope::Known;
use crate::moment::Moment;
use crate::outbox::Outbox;

/// Returns the text of a finding; `None` if it is not there any more.
///
/// # Errors
/// It cannot be read, or is none: an empty message would remove the one that the broker retains. The error is a line.
pub(super) fn finding(outbox: &Outbox, sequence: u64) -> Result<Option<String>, String> {
    let text = outbox.read(sequence).map_err(|error| format!("{error}: it is not sent"))?;
    let is_own = |text: &String| Known::of(text).is_some_and(|own| own.sequence == sequence);
    if text.as_ref().is_none_or(is_own) {
        return Ok(text);
    }
    let folder = outbox.folder().display();
    Err(format!("{folder}: finding {sequence} is damaged: it is not sent"))
}

/// Returns whether publisher and daemon are there, and up to which sequence the broker has the findings.
pub(super) fn status(
    online: bool,
    daemon: bool,
    tool: &str,
    outbox: &Outbox,
    boot: Option<&str>,
) -> String {
    let own = json!({
        "online": online, "daemon": daemon, "tool": tool,
        "box": outbox.name(), "sent": outbox.sent(), "boot_id": boot,
    });
    own.to_string()
}

/// Returns the number of findings that wait, and the entries of `body`, a JSON object that the daemon's follower has written.
pub(super) fn health(daemon: bool, waiting: usize, body: Option<&str>) -> String {
    let own = json!({ "time": Moment::now().to_string(), "daemon": daemon, "waiting": waiting });
    let own = own.to_string();
    match body.and_then(|body| body.strip_prefix('{')) {
        Some(body) => format!("{},{body}", own.trim_end_matches('}')),
        None => own,
    }
}
