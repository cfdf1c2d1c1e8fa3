//! The languages of robot programs: what is a position in each, in which frames, and what is told.

pub(super) mod fanuc;
pub(super) mod krl;
pub(super) mod rapid;
pub(super) mod urscript;
pub(super) mod val3;
pub(super) mod yaskawa;
