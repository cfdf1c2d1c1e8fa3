//! The workbench: the report's page, live on the loopback address.
//!
//! The user's actions are kept here, not in the browser: a reloaded page shows the same state. Every number comes from the
//! library calls that the verbs make.

mod act;
mod bench;
mod connections;
mod gate;
mod history;
mod kept;
mod live;
mod own_effect;
mod refusal;
mod saving;
mod server;
mod state;
mod switches;
mod work;

pub use self::bench::Bench;
pub use self::connections::HEADER_PATIENCE;
pub use self::own_effect::Draft;
pub use self::refusal::Refusal;
pub use self::saving::{Place, Saved};
pub use self::server::Server;
