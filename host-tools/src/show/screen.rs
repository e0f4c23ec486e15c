//! The output of a daemon's messages: a screen, lines, or JSON.

use std::io::{IsTerminal as _, stdout};
use std::time::Instant;

use ::console::{Term, truncate_str};
use anyhow::Result;
use flexid_edge::console::{draw, print};
use flexid_pipeline::report::Summary;
use flexid_pipeline::text::printable;
use flexid_wire::finding::Finding;

use super::news::News;
use super::view::{REDRAW, View};
use super::{page, table};
use crate::json::ResultJson;

/// Terminal code that moves the cursor home and clears to the end.
const CLEAR: &str = "\x1b[H\x1b[J";

/// The output of messages: JSON lines, lines for people, or a screen that is drawn anew.
pub(crate) enum Screen {
    Json(Box<News>),
    Lines { last: String },
    Live { drawn: Option<Instant> },
}

impl Screen {
    /// JSON lines if asked for, a live screen on a terminal, else lines.
    pub(crate) fn new(json: bool) -> Self {
        if json {
            Self::Json(Box::new(News::new()))
        } else if stdout().is_terminal() {
            Self::Live { drawn: None }
        } else {
            Self::Lines { last: String::new() }
        }
    }

    /// Prints the output for one finding.
    pub(crate) fn hear(&mut self, finding: &Finding) -> Result<()> {
        match self {
            Self::Json(news) => {
                news.end();
                Ok(print(&(serde_json::to_string(&ResultJson::from(finding))? + "\n"))?)
            }
            Self::Lines { .. } => Ok(print(&Summary(&finding.report).to_string())?),
            Self::Live { .. } => Ok(()),
        }
    }

    /// Shows what has changed.
    pub(crate) fn draw(&mut self, view: &View) -> Result<()> {
        match self {
            Self::Json(news) => Ok(print(&news.lines(view)?)?),
            Self::Lines { last } => {
                let news: Vec<_> = view.dead_bus().into_iter().chain(view.state()).collect();
                let news = news.join("; ");
                if news == *last {
                    return Ok(());
                }
                last.clone_from(&news);
                Ok(print(&(news + "\n"))?)
            }
            Self::Live { drawn } => {
                if drawn.is_some_and(|drawn| drawn.elapsed() < REDRAW) {
                    return Ok(());
                }
                // The first drawing clears the whole screen, later ones line by line, which flickers less.
                let mut text = String::from(if drawn.is_none() { CLEAR } else { "\x1b[H" });
                *drawn = Some(Instant::now());
                // Lines that do not fit would scroll the screen. The output at the end has all lines.
                let (rows, columns) = Term::stdout().size();
                for line in page::lines(view, rows.into(), columns.into()) {
                    let line = printable(&line);
                    let line = truncate_str(&line, columns.into(), "…");
                    text += &format!("{line}\x1b[K\n");
                }
                Ok(draw(&(text + "\x1b[J"))?)
            }
        }
    }

    /// Prints the output that stays when the command ends.
    pub(crate) fn end(&mut self, view: &View) -> Result<()> {
        match self {
            Self::Json(_) => Ok(()),
            Self::Lines { .. } => {
                let table =
                    view.finding.as_ref().map(|finding| table::finding(finding, None, None));
                let bus = view.bus_line().map(|line| line + "\n");
                Ok(print(&(table.unwrap_or_default() + &bus.unwrap_or_default()))?)
            }
            Self::Live { .. } => {
                let (_, columns) = Term::stdout().size();
                let page = page::full(view, columns.into()).join("\n");
                Ok(draw(&(CLEAR.to_owned() + &printable(&page) + "\n"))?)
            }
        }
    }

    /// Clears the screen for other output.
    pub(crate) fn clear(self) -> Result<()> {
        match self {
            Self::Live { drawn: Some(_) } => Ok(draw(CLEAR)?),
            _ => Ok(()),
        }
    }
}
