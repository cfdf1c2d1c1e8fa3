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

pub use asked::{ACTIONS, Unanswered, VIEWS};
pub use bench::Bench;
pub use case::Case;
pub use front::{MARKUP, MODULES, STYLE};
pub use in_browser::page_in_browser;
pub use opening::{LocatedError, copied_rows, locate_in_data, located_misfit, model_for};
pub use proposal_files::{WrittenProposal, write_proposal};
pub use saving::Place;
pub use step::{StepError, Wanted};

/// The examples of the package's page compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
