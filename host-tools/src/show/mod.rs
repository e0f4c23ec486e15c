//! The output that people see in a terminal.
//!
//! | file         | what                                                      |
//! | ------------ | --------------------------------------------------------- |
//! | `table`      | all parameters, and beside them the truth if it is known  |
//! | `confidence` | what stands below the table                               |
//! | `statics`    | the static tests in the fit                               |
//! | `view`       | the latest messages of a daemon                           |
//! | `page`       | the live page of `watch`, `compact` its table             |
//! | `screen`     | the output as page, lines or JSON                         |
//! | `news`       | JSON lines before the first report                        |

mod compact;
mod confidence;
mod news;
pub(crate) mod page;
pub(crate) mod screen;
mod statics;
pub(crate) mod table;
mod verdict;
pub(crate) mod view;
