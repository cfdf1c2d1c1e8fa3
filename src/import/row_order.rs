//! Information in the order of the rows if it is that of measurement: the side from which each joint came, and the time.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::ImportReport;
use crate::measure::dataset::Sample;

/// A joint that moves less than this, rad or m, has not moved: below the resolution of any controller.
const UNMOVED: f64 = 1e-6;

/// The table `[rows]` of a map: rows stand in the order of measurement.
#[derive(Deserialize, Debug, Clone, Copy, PartialEq)]
#[serde(deny_unknown_fields)]
pub(super) struct RowOrder {
    /// True if every joint came from where the row before had it.
    #[serde(default)]
    pub approach: bool,
    /// Time from one row to the next, s.
    pub interval_s: Option<f64>,
}

impl RowOrder {
    /// Fills in what the order says of samples, and reports it.
    pub fn apply(self, samples: &mut [Sample], report: &mut ImportReport) {
        let mut sessions: BTreeMap<Option<String>, Vec<usize>> = BTreeMap::new();
        for (i, sample) in samples.iter().enumerate() {
            sessions.entry(sample.session.clone()).or_default().push(i);
        }
        for places in sessions.values() {
            self.apply_to_session(samples, places);
        }
        if self.approach {
            report.notes.push(
                "the side from which each joint came is that of its last move from row to row; 0 before its first move".into(),
            );
        }
        if let Some(interval) = self.interval_s {
            report.notes.push(format!("times are those of rows every {interval} s, from the first row of each session on"));
        }
    }

    fn apply_to_session(self, samples: &mut [Sample], places: &[usize]) {
        let Some(&first) = places.first() else { return };
        let mut before = samples[first].q.clone();
        let mut sides = vec![0; before.len()];
        let (mut row, mut line) = (0, row_of(&samples[first]).to_owned());
        for &i in places {
            let sample = &mut samples[i];
            for ((side, now), before) in sides.iter_mut().zip(&sample.q).zip(&mut before) {
                let moved = now - *before;
                if moved.abs() > UNMOVED {
                    *side = if moved > 0.0 { 1 } else { -1 };
                }
                *before = *now;
            }
            // Several points of one row were measured at once.
            if row_of(sample) != line {
                (row, line) = (row + 1, row_of(sample).to_owned());
            }
            if self.approach {
                sample.approach = Some(sides.clone());
            }
            if let Some(interval) = self.interval_s {
                sample.time_s = Some(interval * f64::from(row));
            }
        }
    }
}

/// The name of the row of a sample: that of a further point of the tool is `ROW/POINT`.
fn row_of(sample: &Sample) -> &str {
    match sample.tool_target {
        Some(_) => sample.id.rsplit_once('/').map_or(&sample.id, |(row, _)| row),
        None => &sample.id,
    }
}
