//! What reading by hand promises, one promise a file.
#![allow(clippy::unwrap_used)] // a test may panic: that is how it fails
