//! What a rehearsal promises, one promise a file.

mod gaps_are_those_of_the_motions;
