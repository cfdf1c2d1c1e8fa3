//! What a rehearsal promises, one promise a file.
#![allow(clippy::unwrap_used)] // a test may panic: that is how it fails

mod gaps_are_those_of_the_motions;
