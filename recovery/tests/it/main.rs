//! What a recovery promises, one promise a file.
#![allow(clippy::unwrap_used)] // a test may panic: that is how it fails

mod a_crash_is_recovered;
