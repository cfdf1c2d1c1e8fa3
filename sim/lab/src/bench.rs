//! The benchmark of calibration methods: every method gets the same rows by files, and is judged on the same rows left out.

mod files;
mod leaderboard;
mod score;
mod spread;

pub use files::{DivisionFiles, Fault, PREDICTED, bench_files, read_predicted};
pub use leaderboard::{Entry, Standing, standings};
pub use score::{Judged, Prediction, judge};
