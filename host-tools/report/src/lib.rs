//! One page on a fit, for people: what is identified and whether to trust it, and the pictures that show why.
//!
//! | file or folder | what                                                                            |
//! | -------------- | ------------------------------------------------------------------------------- |
//! | `evidence`     | what the page shows beside the fit, as `flexid identify --json` writes it       |
//! | `document`     | a result file, read for the page                                                |
//! | `friction`     | the loads of a cut on the drives, in words                                      |
//! | `imperfection` | errors of sensors and robot in words, the same on terminal and page             |
//! | `directions`   | combinations of unknowns that the data determine badly, each set once           |
//! | `page`         | the page, one file for each section                                             |
//! | `history`      | a page on what changed over many fits                                            |
//! | `charts`       | the charts, as SVG that follows the page's light and dark colours               |
//!
//! The page is a pure function of the result file: the same file gives the same bytes.

pub mod charts;
pub mod directions;
pub mod document;
pub mod evidence;
pub mod friction;
pub mod history;
pub mod imperfection;
mod page;

pub use page::render;
