//! The output of a daemon's messages: a screen, lines, or JSON.

use std::io::{IsTerminal as _, stdout};
use std::time::Instant;

use ::console::Term;
use anyhow::Result;
use flexid_edge::console::{draw, print};

use super::headline::Headline;
use super::keys::{Key, Keys};
use super::news::News;
use super::pager::Pager;
use super::view::{REDRAW, View};
use super::{page, table};
use crate::json::ResultJson;

/// Terminal code that moves the cursor home and clears to the end.
const CLEAR: &str = "\x1b[H\x1b[J";

/// The output of messages: JSON lines, lines for people, or a screen that is drawn anew.
pub(crate) enum Screen {
    Json(Box<News>),
    Lines { last: String },
    Live { drawn: Option<Instant>, watched: Option<(Keys, Pager)> },
}

impl Screen {
    /// JSON lines if asked for, a live screen on a terminal, else lines.
    pub(crate) fn new(json: bool) -> Self {
        if json {
            Self::Json(Box::new(News::new()))
        } else if stdout().is_terminal() {
            Self::Live { drawn: None, watched: None }
        } else {
            Self::Lines { last: String::new() }
        }
    }

    /// A screen whose live form has pages and obeys keys, if the terminal has any.
    pub(crate) fn with_keys(json: bool) -> Self {
        match Self::new(json) {
            Self::Live { drawn, .. } => {
                Self::Live { drawn, watched: Keys::new().map(|keys| (keys, Pager::default())) }
            }
            other => other,
        }
    }

    /// Obeys the keys that were pressed. Returns whether one of them ends the command.
    pub(crate) fn obey(&mut self) -> bool {
        let Self::Live { drawn, watched: watched @ Some(_) } = self else { return false };
        let Some((keys, pager)) = watched else { return false };
        let Ok(pressed) = keys.pressed() else {
            *watched = None;
            return false;
        };
        let quits = pressed.contains(&Key::Quit);
        if !pressed.is_empty() {
            // The page is drawn at once.
            *drawn = drawn.and_then(|drawn| drawn.checked_sub(REDRAW));
        }
        pressed.into_iter().for_each(|key| pager.press(key));
        quits
    }

    /// Prints the output for a finding that has come.
    pub(crate) fn hear(&mut self, view: &View) -> Result<()> {
        let Some(finding) = &view.finding else { return Ok(()) };
        match self {
            Self::Json(news) => {
                news.end();
                let result = ResultJson::from(finding).with_spectra(view.spectra.as_ref());
                Ok(print(&(serde_json::to_string(&result)? + "\n"))?)
            }
            Self::Lines { .. } => {
                let headline = Headline::of(view);
                let warnings = finding.report.warnings.iter();
                let warnings = warnings.map(|warning| format!("warning: {warning}"));
                let lines = headline.answer.clone().into_iter().chain([headline.line()]);
                Ok(print(&(lines.chain(warnings).collect::<Vec<_>>().join("\n") + "\n"))?)
            }
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
            Self::Live { drawn, watched } => {
                if drawn.is_some_and(|drawn| drawn.elapsed() < REDRAW) {
                    return Ok(());
                }
                // The first drawing clears the whole screen, later ones line by line, which flickers less.
                let mut text = String::from(if drawn.is_none() { CLEAR } else { "\x1b[H" });
                *drawn = Some(Instant::now());
                // Lines that do not fit would scroll the screen. The output at the end has all lines.
                let (rows, columns) = Term::stdout().size();
                let (rows, columns) = (rows.into(), columns.into());
                let lines = match watched {
                    Some((_, pager)) => pager.lines(view, rows, columns),
                    // The cursor needs the last row.
                    None => page::overview(view, rows.saturating_sub(1), columns),
                };
                for line in lines {
                    text += &format!("{}\x1b[K\n", line.styled(columns));
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
                let lines = page::full(view, columns.into());
                let lines = lines.iter().map(|line| line.styled(usize::MAX) + "\n");
                Ok(draw(&(CLEAR.to_owned() + &lines.collect::<String>()))?)
            }
        }
    }

    /// Clears the screen for other output.
    pub(crate) fn clear(self) -> Result<()> {
        match self {
            Self::Live { drawn: Some(_), .. } => Ok(draw(CLEAR)?),
            _ => Ok(()),
        }
    }
}
