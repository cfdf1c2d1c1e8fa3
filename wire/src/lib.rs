//! What robot controllers say and hear on the wire. No package knows the arm behind it, or the procedure that moves it.

pub mod kuka;
pub mod ur;

/// The number of the order after this one: it fits a signed integer of four bytes and is never 0, the value of a register before
/// its first order.
pub fn next_order(last: i64) -> i64 {
    if (0..i64::from(i32::MAX)).contains(&last) { last + 1 } else { 1 }
}

/// The examples of the package's page compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
