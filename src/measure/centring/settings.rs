//! Settings of the centring, each with the reason for its value.

use serde::Serialize;

use crate::cell::TriCal;
use crate::units::{MM, UM};

/// Settings of the centring, and the limits at which it fails.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CentringSettings {
    /// A ball is centred when every reading is smaller, m. 3 um: paper, section 3.
    pub tolerance: f64,
    /// Longest step commanded along one axis, m. 5 mm: the paper's safe range of the gauge (section 2.1); a longer distance
    /// takes two steps. Beyond the flat of a tip (5.75 mm) the ball is not where it was planned, and no step is taken.
    pub max_step: f64,
    /// Maximum number of steps. 30: a probing lasts about 30 s (paper, section 3) and a step about a second.
    pub max_steps: usize,
    /// Readings averaged before each step. 1: the indicators repeat to a few tenths of a micrometre.
    pub readings: usize,
    /// Repeated queries of an indicator after a lost or garbled answer. 2: a radio link loses single answers.
    pub retries: usize,
    /// Largest fraction of the distance that may remain after a step. 0.5: an uncalibrated robot leaves a few per cent, a tool
    /// frame wrong by 30 degrees leaves 0.5, one wrong by 60 degrees never arrives.
    pub shrink: f64,
    /// Distance below which steps are not judged by `shrink`, m. 0.1 mm: three times the repeatability of a small robot (0.03
    /// mm), below which the last few micrometres are found by trial.
    pub judged_above: f64,
    /// Successive steps, however small, without response after which an indicator counts as stuck. 4: by chance about once in
    /// 20,000 steps.
    pub stuck_after: usize,
    /// Successive overshoots that count as an oscillation. 2: a single one may be a robot that was pushed.
    pub overshoots: usize,
    /// A plunger is free within this distance of its free reading, and at its stop within this distance of its travel's end, m.
    /// 0.1 mm: far above the indicator's errors, far below the 1.15 mm between the safe range and the free reading.
    pub end_band: f64,
}

impl Default for CentringSettings {
    fn default() -> Self {
        CentringSettings {
            tolerance: 3.0 * UM,
            max_step: TriCal::PAPER.safe_range,
            max_steps: 30,
            readings: 1,
            retries: 2,
            shrink: 0.5,
            judged_above: 0.1 * MM,
            stuck_after: 4,
            overshoots: 2,
            end_band: 0.1 * MM,
        }
    }
}
