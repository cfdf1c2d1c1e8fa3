//! The decisive figure: the position error expected over the workspace, its map, and the extrapolation beyond the identified
//! ranges.

use std::fmt;

use super::effect_names::{all_called, capital};
use super::figures::expected;
use super::tables::{Table, plain_rows};
use calibench::identify::calibration::IdentifyError;
use calibench::prediction::{Banded, Extrapolation, PoseSource, WorkspaceError, WorkspaceMap};
use calibench::units::MM;

/// A predicted error over the workspace and the origin of its poses.
#[derive(Debug, Clone, PartialEq)]
pub struct Forecast {
    /// The prediction.
    pub error: WorkspaceError,
    /// Extent of the poses beyond those of the fit.
    pub extrapolation: Extrapolation,
}

/// Number of effects of a warning that are named.
const MOST_SHAPES: usize = 3;

fn banded(b: &Banded) -> String {
    format!("{:.3} mm ({:.3} to {:.3})", b.expected / MM, b.low / MM, b.high / MM)
}

impl Forecast {
    /// Describes the poses in words.
    pub fn poses(&self) -> String {
        let count = self.error.poses.len();
        match self.error.at {
            PoseSource::Validation => format!("the {count} validation poses"),
            PoseSource::Ranges => {
                format!("{count} poses sampled uniformly within the measured joint ranges, clear of the robot itself")
            }
            PoseSource::Limits => {
                format!(
                    "{count} poses sampled uniformly within the joint limits, clear of the robot itself (no validation rows name better ones)"
                )
            }
        }
    }

    /// The prediction in a sentence.
    pub fn sentence(&self) -> String {
        let least = if self.error.at_least {
            " These poses are farther from the data than any that were left out: the figures are least ones."
        } else {
            ""
        };
        format!(
            "{}: mean {}, largest {} (in brackets 10 to 90 % of what is to be expected; docs/comparing.md says how far to trust them); at {}.{least}",
            capital(expected(self.error.at).name),
            banded(&self.error.mean),
            banded(&self.error.max),
            self.poses()
        )
    }

    /// Expected error by distance from axis 1 (columns) and height over the base (rows, highest first), mm; blank cells hold no
    /// poses.
    pub fn map_table(&self) -> Table {
        map_table(&self.error.map())
    }
}

/// A map by distance from axis 1 (columns) and height over the base (rows, highest first), mm; blank cells hold no poses.
pub(crate) fn map_table(map: &WorkspaceMap) -> Table {
    let between = |edges: &[f64]| edges.windows(2).map(|e| format!("{:.0} .. {:.0}", e[0] / MM, e[1] / MM)).collect::<Vec<_>>();
    let header: Vec<String> = std::iter::once("height \\ radius, mm".to_owned()).chain(between(&map.radius)).collect();
    let rows: Vec<Vec<String>> = between(&map.height)
        .into_iter()
        .zip(&map.cells)
        .rev()
        .map(|(height, cells)| {
            let cells = cells.iter().map(|c| c.map_or_else(String::new, |c| format!("{:.3}", c.error / MM)));
            std::iter::once(height).chain(cells).collect()
        })
        .collect();
    plain_rows(header, rows)
}

/// The reason why no error over the workspace is predicted.
#[derive(Debug)]
#[non_exhaustive]
pub enum NoForecast {
    /// The data do not determine these parameters of the set-up.
    Undetermined(Vec<String>),
    /// No pose of the robot is clear of the robot itself.
    NoPose,
    /// The data are not those to which the calibration was fitted.
    OtherRows,
    /// The examination of the data failed.
    Failed(IdentifyError),
}

impl NoForecast {
    /// The reason for a model that leaves these parameters of its set-up undetermined.
    #[must_use]
    pub fn of(undetermined: &[String]) -> Self {
        if undetermined.is_empty() { NoForecast::NoPose } else { NoForecast::Undetermined(undetermined.to_vec()) }
    }
}

impl fmt::Display for NoForecast {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("The error to expect cannot be predicted")?;
        match self {
            NoForecast::Undetermined(names) => match names.as_slice() {
                [one] => write!(
                    f,
                    ": {one} is kept at its nominal value, and these data do not determine it. Measure at more places."
                ),
                several => write!(
                    f,
                    ": {} are kept at their nominal values, and these data do not determine them. Measure at more places.",
                    several.join(", ")
                ),
            },
            NoForecast::NoPose => f.write_str(": no pose of the robot is clear of itself."),
            NoForecast::OtherRows => f.write_str(
                " from these data: it needs the rows to which the calibration was fitted; name their dataset as well.",
            ),
            NoForecast::Failed(e) => write!(f, ": {e}."),
        }
    }
}

/// Warns of poses beyond the joint ranges of a calibration; `None` if every pose lies within them.
pub fn extrapolation_sentence(e: &Extrapolation) -> Option<String> {
    if e.outside == 0 {
        return None;
    }
    let joint = |j: &calibench::prediction::OutsideRange| {
        let unit = j.kind.unit();
        let [far, low, high] = [j.farthest, j.identified[0], j.identified[1]].map(|x| x / unit.si);
        format!("joint {} in {} (up to {far:.1} {} outside {low:.1} .. {high:.1})", j.joint, j.poses, unit.symbol)
    };
    let joints: Vec<String> = e.joints.iter().map(joint).collect();
    let plain = format!(
        "{} of {} poses lie outside the joint ranges in which the calibration was identified: {}.",
        e.outside,
        e.poses,
        joints.join(", ")
    );
    Some(if e.shapes.is_empty() {
        format!("warning: {plain}")
    } else {
        format!(
            "WARNING: {plain} The shapes of {} are known only where they were seen: THERE THEIR CORRECTION IS A GUESS. Measure there, or do not rely on it there.",
            match e.shapes.len() {
                few if few <= MOST_SHAPES => all_called(&e.registry, &e.shapes),
                many =>
                    format!("{} and {} more effects", all_called(&e.registry, &e.shapes[..MOST_SHAPES]), many - MOST_SHAPES),
            }
        )
    })
}
