//! URScript, the language in which Universal Robots' controllers are programmed, read and carried out.
//!
//! [`parse`] reads the text of a program and [`run`] carries it out. The language itself (variables, functions, loops,
//! threads, arithmetic) is here; whatever reaches for the robot is asked of a [`Host`].
//!
//! A program comes over a network from anybody: its length, its nesting, the depth of its calls, the number of its threads
//! and the size of its values are limited, and what exceeds them is an error that names the line.

mod arguments;
mod builtins;
mod cursor;
mod expressions;
mod formula;
mod interpreter;
mod lexer;
mod machine;
mod operators;
mod parser;
mod scope;
mod statements;
mod tree;
mod trouble;
mod value;

pub use arguments::Arguments;
pub use interpreter::run;
pub use lexer::MAX_TEXT;
pub use machine::Host;
pub use parser::parse;
pub use trouble::Trouble;
pub use value::Value;
