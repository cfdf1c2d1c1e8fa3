//! The robot as a KUKA: a variable server, and the program that carries out what the variables ask for.

mod controller;
mod program;
mod robot;
mod variables;

pub use controller::Controller;
pub use program::run;
pub use robot::listen;
