//! Residuals of the default model on every row of a division, for comparison with other regressors on the same division.

use calibench::identify::calibration::{Calibration, IdentifyError};
use calibench::identify::problem::Use;
use calibench::measure::dataset::{Dataset, Measured, NamedDataset, Sample};
use calibench::measure::poses::Postures;
use calibench::units::{DEG, MM};
use nalgebra::Vector3;

use super::Case;

/// Role of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// Used to identify the default model.
    Fitted,
    /// Held out.
    Judged,
    /// Measured on the set-up of a held-out campaign, to find its base and tool and nothing else.
    SetUp,
}

/// One sample of a division.
#[derive(Debug, Clone)]
pub struct Row {
    /// Its role.
    pub part: Part,
    /// Number of its posture, from 1 through both parts.
    pub posture: usize,
    /// Joint angles as the controller reports them, rad (N).
    pub q: Vec<f64>,
    /// Name of the measured point of the tool and of its set-up: rows of one name share base and tool.
    pub tool: String,
    /// Name of the ball if its position is not known in advance. A ball without fitted rows is placed by the judged rows.
    pub free_ball: Option<String>,
    /// Measured minus predicted by the default model, in the axes of the robot's base, m; for a distance, along the line of
    /// sight.
    pub error: Vector3<f64>,
    /// Position of the measured point by the default model, in the frame of the robot's base, m.
    pub predicted: Vector3<f64>,
}

impl Row {
    /// True if the default model was identified on it.
    pub fn is_fitted(&self) -> bool {
        self.part == Part::Fitted
    }
}

impl Case<'_> {
    /// All fitted rows, then all judged rows, under `default`, the default model identified on the fitted ones. They are judged
    /// as in the proof. Rows of a held-out campaign that only determine its set-up are excluded.
    ///
    /// # Errors
    /// If the calibration is of other data.
    pub fn rows(&self, default: &Calibration) -> Result<Vec<Row>, IdentifyError> {
        let mut rows = part_rows(default, &self.fitted(), Part::Fitted, 0)?;
        let postures = rows.iter().map(|r| r.posture).max().unwrap_or(0);
        rows.extend(part_rows(&self.as_judged(default), &self.judged(), Part::Judged, postures)?);
        Ok(rows)
    }

    /// The rows of a held-out campaign that determine its base and tool, under `calibration`; none of other divisions.
    ///
    /// # Errors
    /// If the calibration is of other data.
    pub fn set_up_rows(&self, calibration: &Calibration) -> Result<Vec<Row>, IdentifyError> {
        if !self.anew {
            return Ok(Vec::new());
        }
        part_rows(&self.as_judged(calibration), &self.judged(), Part::SetUp, 0)
    }

    /// File name for the rows, without folder: non-alphanumeric characters become dashes.
    pub fn file_name(&self) -> String {
        let plain = |c: char| if c.is_alphanumeric() { c } else { '-' };
        let name: String = format!("{} {}", self.robot, self.fold).chars().map(plain).collect();
        let words: Vec<&str> = name.split('-').filter(|w| !w.is_empty()).collect();
        format!("{}.csv", words.join("-"))
    }
}

fn part_rows(
    calibration: &Calibration,
    datasets: &[NamedDataset<'_>],
    part: Part,
    before: usize,
) -> Result<Vec<Row>, IdentifyError> {
    let which = if part == Part::Judged { Use::Validation } else { Use::Fit };
    let applied = calibration.apply(datasets, which)?;
    let mut seen = Vec::with_capacity(applied.problem.sample_count());
    applied.problem.for_each_sample(&applied.values, &mut |posed| {
        let base = posed.posture.frame(0);
        seen.push((base.components(&posed.residual), base.components(&(posed.posture.tcp() - base.o))));
    });
    let postures = Postures::of(datasets, |s| which.takes(s));
    let samples = datasets
        .iter()
        .flat_map(|d| d.dataset.samples.iter().filter(|s| which.takes(s)).map(move |s| ((d.name, d.dataset), s)));
    let free_ball = |dataset: &Dataset, measured: &Measured| match measured {
        Measured::Ball { ball, .. } => dataset.balls.get(*ball).filter(|b| b.free).map(|b| b.id.clone()),
        Measured::Point(_) | Measured::Distance { .. } => None,
    };
    Ok(samples
        .zip(postures.of_samples())
        .zip(seen)
        .map(|((((name, dataset), sample), posture), (error, predicted))| Row {
            part,
            posture: before + posture + 1,
            q: sample.q.clone(),
            tool: tool(name, dataset, sample),
            free_ball: free_ball(dataset, &sample.measured),
            error,
            predicted,
        })
        .collect())
}

/// The campaign, the session if it has one, and the point of the tool, parted by slashes.
fn tool(campaign: &str, dataset: &Dataset, sample: &Sample) -> String {
    let target = sample.tool_target.and_then(|k| dataset.tool_targets.get(k)).map_or("tcp", |target| target.id.as_str());
    match &sample.session {
        Some(session) => format!("{campaign}/{session}/{target}"),
        None => format!("{campaign}/{target}"),
    }
}

/// The rows as a CSV file: `part`, `posture`, `q1_deg` and so on, `free_ball`, `error_x_mm`, `error_y_mm`, `error_z_mm`.
pub fn csv(rows: &[Row]) -> String {
    let joints = (1..=rows.first().map_or(0, |r| r.q.len())).map(|j| format!("q{j}_deg"));
    let before = ["part", "posture"].map(String::from);
    let after = ["free_ball", "error_x_mm", "error_y_mm", "error_z_mm"].map(String::from);
    let mut file = csv::Writer::from_writer(Vec::new());
    // Writing to memory cannot fail.
    let _ = file.write_record(before.into_iter().chain(joints).chain(after));
    for row in rows {
        let part = if row.part == Part::Fitted { "fitted" } else { "judged" };
        let angles = row.q.iter().map(|q| format!("{:.6}", q / DEG));
        let errors = row.error.iter().map(|e| format!("{:.6}", e / MM));
        let free_ball = row.free_ball.clone().unwrap_or_default();
        let _ = file
            .write_record([part.into(), row.posture.to_string()].into_iter().chain(angles).chain([free_ball]).chain(errors));
    }
    file.into_inner().ok().and_then(|bytes| String::from_utf8(bytes).ok()).unwrap_or_default()
}
