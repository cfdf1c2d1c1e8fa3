//! Promises of the search for laws.

mod a_hidden_law_is_found;
mod hidden_laws;
