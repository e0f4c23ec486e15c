//! What several findings say: of the parameters of each, and of the errors that they share.
//!
//! | file      | what                                           |
//! | --------- | ---------------------------------------------- |
//! | `epoch`   | what one finding says, the shared errors apart |
//! | `reading` | the same from result files                     |

mod epoch;
mod reading;

pub(crate) use epoch::Pool;
pub use epoch::{Epoch, Posterior};
pub(crate) use reading::epochs;
