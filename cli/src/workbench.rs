//! The workbench, served on the loopback address; what it answers is `calibench_workbench`'s.

mod connections;
mod gate;
mod server;

pub use self::connections::HEADER_PATIENCE;
pub use self::server::Server;
