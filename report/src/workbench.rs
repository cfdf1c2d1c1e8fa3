//! The workbench: what its user does, and the answers. It is the same behind a server and in a browser: whoever shows the page
//! hands on what it asks.
//!
//! The user's actions are kept here, not on the page: a page that is loaded again shows the same state. Every number comes from
//! the library calls that the verbs make.

mod act;
mod asked;
mod bench;
mod beside;
mod case;
mod front;
mod history;
mod in_browser;
mod kept;
mod live;
mod opening;
mod own_effect;
mod proposal_files;
mod refusal;
mod saving;
mod state;
mod step;
mod switches;
mod work;

pub use self::asked::{ACTIONS, Unanswered, VIEWS};
pub use self::bench::Bench;
pub use self::case::Case;
pub use self::front::{MARKUP, MODULES, STYLE};
pub use self::in_browser::page_in_browser;
pub use self::opening::{LocatedError, copied_rows, locate_in_data, located_misfit, model_for};
pub use self::proposal_files::write_proposal;
pub use self::saving::Place;
pub use self::step::{StepError, Wanted};
