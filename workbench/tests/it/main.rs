//! The guarantees of this package, one file each.
#![allow(clippy::unwrap_used)] // a test may panic: that is how it fails

mod an_added_family_is_named_like_any_other;
#[allow(dead_code)] // its own `main`
#[path = "../../../examples/own_effect.rs"]
mod own_effect;
