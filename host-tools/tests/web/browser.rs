//! A headless Chromium, driven by the DevTools protocol over pipes: JSON messages, each ended by a zero byte.

use std::io::{BufRead as _, BufReader, Write as _};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::{Duration, Instant};

use base64::prelude::{BASE64_STANDARD, Engine as _};
use serde_json::{Value, json};
use tempfile::TempDir;

/// Nothing here takes nearly as long; a test that waits for it has failed.
const PATIENCE: Duration = Duration::from_secs(60);

/// Chromium reads from descriptor 3 and writes to 4.
const COMMAND: &str = "exec chromium --headless --no-sandbox --disable-gpu --disable-quic --no-first-run \
    --disable-background-networking --disable-component-update --disable-sync --disable-dev-shm-usage \
    --remote-debugging-pipe --user-data-dir=\"$0\" 3<&0 4>&1 </dev/null >/dev/null 2>&1";

/// A browser with one page.
pub(crate) struct Browser {
    child: Child,
    input: ChildStdin,
    messages: Receiver<Value>,
    session: Option<String>,
    calls: u64,
    /// Errors and warnings of the page.
    pub(crate) complaints: Vec<String>,
    _profile: TempDir,
}

impl Browser {
    /// Opens `url`.
    pub(crate) fn open(url: &str) -> Self {
        let profile = tempfile::tempdir().unwrap();
        let mut child = Command::new("sh")
            .args(["-c", COMMAND])
            .arg(profile.path())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let (input, output) = (child.stdin.take().unwrap(), child.stdout.take().unwrap());
        let (sender, messages) = channel();
        thread::spawn(move || {
            for message in BufReader::new(output).split(0) {
                let message = serde_json::from_slice(&message.unwrap()).unwrap();
                if sender.send(message).is_err() {
                    break;
                }
            }
        });
        let (session, complaints) = (None, Vec::new());
        let mut browser =
            Self { child, input, messages, session, calls: 0, complaints, _profile: profile };
        let target = browser.call("Target.createTarget", json!({ "url": "about:blank" }));
        let target = json!({ "targetId": target["targetId"], "flatten": true });
        let session = browser.call("Target.attachToTarget", target);
        browser.session = Some(session["sessionId"].as_str().unwrap().to_owned());
        for domain in ["Log.enable", "Runtime.enable", "Page.enable"] {
            browser.call(domain, json!({}));
        }
        browser.call("Page.navigate", json!({ "url": url }));
        browser
    }

    /// The value of a JavaScript expression, or what its promise brings.
    pub(crate) fn evaluate(&mut self, expression: &str) -> Value {
        let answer = self.call(
            "Runtime.evaluate",
            json!({ "expression": expression, "returnByValue": true, "awaitPromise": true }),
        );
        assert_eq!(answer["exceptionDetails"], Value::Null, "{expression}");
        answer["result"]["value"].clone()
    }

    /// Waits until the text of the page contains `text`. Returns the text.
    pub(crate) fn until(&mut self, text: &str) -> String {
        self.retry(|browser| {
            let page = browser.evaluate("document.body ? document.body.innerText : ''");
            let page = page.as_str().unwrap_or_default();
            let says = page.contains(text);
            if says {
                Ok(page.to_owned())
            } else {
                Err(format!("no {text:?} on the page:\n{page}"))
            }
        })
    }

    /// Waits until a JavaScript expression has this value. The parts of the page arrive one by one, so another part may
    /// not have it yet when [`until`](Self::until) returns.
    pub(crate) fn until_equal(&mut self, expression: &str, expected: impl Into<Value>) {
        let expected = expected.into();
        self.retry(|browser| {
            let value = browser.evaluate(expression);
            let is_equal = value == expected;
            if is_equal { Ok(()) } else { Err(format!("{expression} is {value}, not {expected}")) }
        });
    }

    /// Reads until that succeeds.
    fn retry<T>(&mut self, read: impl Fn(&mut Self) -> Result<T, String>) -> T {
        let begun = Instant::now();
        loop {
            match read(self) {
                Ok(value) => return value,
                Err(missing) => assert!(begun.elapsed() < PATIENCE, "{missing}"),
            }
            thread::sleep(Duration::from_millis(50));
        }
    }

    /// Writes what is seen as PNG, in a window of this size.
    pub(crate) fn picture(&mut self, file: &Path, [width, height]: [u32; 2]) {
        let metrics =
            json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": false });
        self.call("Emulation.setDeviceMetricsOverride", metrics);
        let picture = self.call("Page.captureScreenshot", json!({ "format": "png" }));
        let bytes = BASE64_STANDARD.decode(picture["data"].as_str().unwrap()).unwrap();
        std::fs::write(file, bytes).unwrap();
    }

    /// The result of a method of the protocol.
    pub(crate) fn call(&mut self, method: &str, params: Value) -> Value {
        self.calls += 1;
        let mut message = json!({ "id": self.calls, "method": method, "params": params });
        if let Some(session) = &self.session {
            message["sessionId"] = json!(session);
        }
        self.input.write_all(format!("{message}\0").as_bytes()).expect("Chromium runs");
        loop {
            let message = self.messages.recv_timeout(PATIENCE).expect("Chromium answers");
            if message["id"] == self.calls {
                assert_eq!(message["error"], Value::Null, "{method}");
                return message["result"].clone();
            }
            self.hear(&message);
        }
    }

    fn hear(&mut self, event: &Value) {
        let params = &event["params"];
        match event["method"].as_str() {
            Some("Log.entryAdded") => self.complaints.push(params["entry"]["text"].to_string()),
            Some("Runtime.exceptionThrown") => self.complaints.push(params.to_string()),
            _ => {}
        }
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
