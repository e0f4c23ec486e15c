//! The output that people see in a terminal.
//!
//! | file         | what                                                      |
//! | ------------ | --------------------------------------------------------- |
//! | `table`      | all parameters, and beside them the truth if it is known  |
//! | `answer`     | the robot as a whole, read first                          |
//! | `confidence` | what stands below the table                               |
//! | `statics`    | the static tests in the fit                               |
//! | `view`       | the latest messages of a daemon                           |
//! | `page`       | the live pages of `watch`, `compact` the short table      |
//! | `spectra`    | the newest record beside the model, drawn with `braille`  |
//! | `pager`      | one page at a time, with the `keys` below                 |
//! | `line`       | lines in colours                                          |
//! | `screen`     | the output as page, lines or JSON                         |
//! | `headline`   | the verdict on the fit, read first                        |
//! | `news`       | JSON lines before the first report                        |

mod answer;
mod braille;
mod compact;
pub(crate) mod confidence;
pub(crate) mod headline;
mod keys;
mod line;
mod news;
pub(crate) mod page;
mod pager;
pub(crate) mod screen;
mod spectra;
mod statics;
pub(crate) mod table;
pub(crate) mod verdict;
pub(crate) mod view;
