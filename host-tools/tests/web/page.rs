//! The page as a person sees it in a browser.

use std::net::TcpListener;
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

use flexid_core::stream::Reading;
use serde_json::{Value, json};

use super::browser::Browser;
use super::daemon::Daemon;
use super::program::Web;

/// The parameters that the page shows.
const DOTS: &str = "document.querySelectorAll('#parameters .dot').length";

/// The panels that show spectra.
const PANELS: &str = "document.querySelectorAll('#spectra svg').length";

/// Places of the dots and points of the lines in them; lines of the grid have two points.
const CURVES: &str = "[...document.querySelectorAll('#spectra circle, #spectra polyline')]
    .map(own => own.getAttribute('points') ?? own.getAttribute('cx') + ',' + own.getAttribute('cy'))
    .filter(own => own.trim().split(' ').length != 2)";

/// Everything in one test, since a browser takes seconds to start.
#[test]
fn the_page_loads_updates_and_survives_the_end_of_daemon_and_server() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flexid.sock");
    let web = Web::start(&path, "127.0.0.1:0", &[]);
    let mut browser = Browser::open(&web.url());
    for text in ["no connection to the daemon", "nobody listens there", "No result yet"] {
        browser.until(text);
    }
    browser.evaluate("window.sameDocument = true");

    let daemon = Daemon::start(&path);
    browser.until("waiting for frames");
    browser.until("live: unix:");
    browser.until("mill3 3 joints, vcan0");
    daemon.send(Reading::Joint { index: 1, value: 0.5 });
    browser.until("waiting for force frames");
    assert_eq!(browser.evaluate(DOTS), 0);
    assert_eq!(browser.evaluate(PANELS), 0);
    daemon.cut(1);
    browser.until("of 36 parameters identified");
    browser.until_equal(DOTS, 36);
    browser.until("Record 1, measured against modelled");
    assert_eq!(browser.evaluate(PANELS), 3);
    let of_first = browser.evaluate(CURVES);
    daemon.cut(2);
    browser.until("Record 2, measured against modelled");
    let of_second = browser.evaluate(CURVES);
    // Dots, and the lines of modelled and noise.
    let curves = of_second.as_array().unwrap();
    assert_eq!(curves.len(), 3 * (17 + 2), "{of_second}");
    let is_apart = |(one, other): &(&Value, &Value)| one != other;
    let changed = curves.iter().zip(of_first.as_array().unwrap()).filter(is_apart).count();
    assert!(changed > curves.len() / 2, "{changed} of {} curves have changed", curves.len());
    browser.until_equal("document.title.includes(' - flexid')", true);
    // To be looked at.
    browser.picture(&Path::new(env!("CARGO_TARGET_TMPDIR")).join("web.png"), [1024, 768]);
    browser.evaluate("document.getElementById('spectra').scrollIntoView()");
    browser.picture(&Path::new(env!("CARGO_TARGET_TMPDIR")).join("spectra.png"), [1024, 768]);
    let wide = "document.documentElement.scrollWidth - document.documentElement.clientWidth";
    for width in [360, 768, 1024, 1920] {
        let metrics =
            json!({ "width": width, "height": 768, "deviceScaleFactor": 1, "mobile": false });
        browser.call("Emulation.setDeviceMetricsOverride", metrics);
        assert_eq!(browser.evaluate(wide), 0, "the page is wider than {width} pixels");
    }

    drop(daemon);
    let text = browser.until("connection lost, last data from ");
    let time = text.split("last data from ").nth(1).unwrap().get(..8).unwrap();
    assert!(time.bytes().filter(u8::is_ascii_digit).count() == 6, "{time} is no hh:mm:ss");
    assert_eq!(browser.evaluate(DOTS), 36, "the last estimate stays");
    assert_eq!(browser.evaluate(CURVES), of_second);
    let daemon = Daemon::start(&path);
    browser.until("live: unix:");
    browser.until_equal("document.body.innerText.includes('connection lost')", false);
    browser.until("waiting for frames");
    // A new daemon has no estimate yet.
    browser.until_equal(DOTS, 0);
    browser.until_equal(PANELS, 0);
    assert_eq!(browser.complaints, [""; 0]);

    let address = web.address.to_string();
    assert_eq!(web.end(), Some(0));
    browser.until("flexid web does not answer");
    let web = Web::start(&path, &address, &[]);
    let begun = Instant::now();
    while browser.evaluate("document.getElementById('silent').hidden") != true {
        assert!(begun.elapsed() < Duration::from_secs(30), "the page does not come back");
        thread::sleep(Duration::from_millis(100));
    }
    daemon.send(Reading::Joint { index: 1, value: 0.5 });
    browser.until("waiting for force frames");
    assert_eq!(browser.evaluate("window.sameDocument"), true, "the page was loaded again");
    drop(web);
}

#[test]
fn the_policy_forbids_outside_resources_and_other_scripts() {
    let folder = tempfile::tempdir().unwrap();
    let web = Web::start(&folder.path().join("flexid.sock"), "127.0.0.1:0", &[]);
    let outside = TcpListener::bind("127.0.0.1:0").unwrap();
    let mut browser = Browser::open(&web.url());
    browser.until("no connection to the daemon");
    let url = format!("http://{}/", outside.local_addr().unwrap());
    browser.evaluate(&format!(
        "new Promise(done => {{
            const image = new Image();
            image.onload = image.onerror = () => done(true);
            image.src = '{url}';
        }})"
    ));
    let fetched =
        browser.evaluate(&format!("fetch('{url}').then(() => 'got it', () => 'refused')"));
    assert_eq!(fetched, "refused");
    browser.evaluate(
        "document.body.append(Object.assign(document.createElement('script'), { text: 'window.injected = true' }))",
    );
    assert_eq!(browser.evaluate("window.injected === undefined"), true);
    outside.set_nonblocking(true).unwrap();
    assert!(outside.accept().is_err(), "the page connected to another server");
    let forbidden =
        browser.complaints.iter().filter(|text| text.contains("Content Security Policy"));
    assert!(forbidden.count() >= 3, "{:?}", browser.complaints);
}
