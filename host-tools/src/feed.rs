//! Follows a daemon for the publisher: its findings as they settle, and its health.

use std::convert::Infallible;
use std::fs;
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

use flexid_edge::client::{Client, ClientError};
use flexid_fleet::envelope::{Origin, sha256};
use flexid_fleet::publish::{Config, Found, Inlet, News};
use flexid_wire::finding::Finding;
use flexid_wire::messages::{BusHealth, FromEdge, Status};
use serde::Serialize;

use crate::json::{ResultJson, StatusJson};
use crate::show::view::View;

/// Name and version of this program.
pub(crate) const TOOL: &str = concat!("flexid ", env!("CARGO_PKG_VERSION"));
/// Interval between two attempts to connect.
const RETRY: Duration = Duration::from_secs(1);
/// Longest silence of a daemon. Chosen: ten times the interval at which a daemon tells its state.
const SILENCE: Duration = Duration::from_secs(5);
/// Interval between two states of health. The publisher sends one a minute.
const HEALTH: Duration = Duration::from_secs(10);

/// Follows the daemon until the publisher has ended.
pub(crate) fn follow(config: &Config, inlet: &Inlet) {
    loop {
        let Err(error) = listen(config, inlet);
        if !inlet.tell(News::Daemon(Err(error.to_string()))) {
            return;
        }
        thread::sleep(RETRY);
    }
}

/// Tells what the daemon says, until the connection ends.
fn listen(config: &Config, inlet: &Inlet) -> Result<Infallible, ClientError> {
    let mut client = Client::connect(&config.daemon, None)?;
    inlet.tell(News::Daemon(Ok(())));
    let mut view = View::default();
    let (mut heard, mut health) = (Instant::now(), None);
    let mut is_told = false;
    loop {
        let left = SILENCE.saturating_sub(heard.elapsed());
        let Some(message) = client.next(left)? else {
            return Err(ClientError::Silent(config.daemon.clone()));
        };
        heard = Instant::now();
        // Nothing here needs the spectra, which take most of the memory.
        if matches!(message, FromEdge::Spectra(_)) {
            continue;
        }
        is_told &= !view.take(message);
        if !is_told && view.settled().is_some() {
            for news in view.finding.iter().flat_map(|finding| found(config, finding, &view)) {
                inlet.tell(news);
            }
            is_told = true;
        }
        if health.is_none_or(|told: Instant| told.elapsed() >= HEALTH)
            && let (Some(status), Some(bus)) = (&view.status, &view.bus)
        {
            let own = Health { status: status.into(), bus };
            inlet.tell(News::Health(text(&own)));
            health = Some(Instant::now());
        }
    }
}

#[derive(Serialize)]
struct Health<'a> {
    status: StatusJson<'a>,
    bus: &'a BusHealth,
}

fn text(value: &impl Serialize) -> String {
    serde_json::to_string(value).expect("its keys are strings")
}

/// Returns the finding with its origin, and a line for what is wrong with that.
fn found(config: &Config, finding: &Finding, view: &View) -> Vec<News> {
    let mut news = Vec::new();
    let mut origin = Origin { tool: TOOL.to_owned(), ..Origin::default() };
    match origin_of(&config.edge, finding) {
        Ok((config_sha256, model_sha256)) => {
            (origin.config_sha256, origin.model_sha256) = (Some(config_sha256), Some(model_sha256));
        }
        Err(line) => {
            news.push(News::Line(format!(
                "{line}; the finding goes without the sums of its files"
            )));
        }
    }
    let age_s = |status: &Status| Some(status.uptime_s - status.newest_record_s?);
    let record_age_s = view.status.as_ref().and_then(age_s);
    let body = text(&ResultJson::from(finding));
    news.push(News::Found(Found { body, record_age_s, origin }));
    news
}

/// Returns the sums of the daemon's configuration and of its model, as they are on the disk.
fn origin_of(edge: &Path, finding: &Finding) -> Result<(String, String), String> {
    let sum = |file: &Path| {
        let bytes = fs::read(file);
        bytes.map(|bytes| sha256(&bytes)).map_err(|error| format!("{}: {error}", file.display()))
    };
    let config = flexid_pipeline::config::Config::load(edge).map_err(|error| error.to_string())?;
    let joints = finding.report.joints.iter().map(|joint| joint.name.as_str());
    if !joints.eq(config.model.joints.iter().map(|joint| joint.name.as_str())) {
        let joints: Vec<&str> =
            finding.report.joints.iter().map(|joint| joint.name.as_str()).collect();
        return Err(format!(
            "{}: its model {} has not the joints of the daemon's finding ({}): name the daemon's own configuration as edge",
            edge.display(),
            config.model.name,
            joints.join(", ")
        ));
    }
    let model = config.named_files.first().ok_or("it names no model")?;
    Ok((sum(edge)?, sum(model)?))
}
