//! Comparison of a calibration with samples: the noise floor first, then the unexplained residual above it, then the
//! views of the residuals.

mod finding;
mod fit_relation;
mod lack_of_fit;
mod layout;
mod sentences;
mod standout;
mod suggestions;
mod views;

use std::collections::HashSet;

use crate::effects::registry::Registry;
use crate::identify::Application;
use crate::identify::calibration::{Calibration, IdentifyError};
use crate::identify::fit::FitError;
use crate::identify::problem::Use;
use crate::math::rms;
use crate::measure::dataset::{NamedDataset, Sample};
use crate::measure::poses::Postures;

use self::layout::Layout;
use super::OrientationErrors;
use super::noise_floor::{NoiseFloor, NoisySample};
use super::views::{
    BallView, JointCurve, JointOffset, SampleResidual, Scores, SeenSample, SetupView, ToolView, Whitened, WorldView,
    WorstSample,
};

pub use self::finding::SIGNIFICANCE;
pub use self::fit_relation::FitRelation;
pub use self::lack_of_fit::LackOfFit;
pub use self::standout::{Standout, Subject};

/// A calibration compared with samples.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// Name of the robot.
    pub robot: String,
    /// Number of samples.
    pub samples: usize,
    /// Root mean square of the 3-D residual, m.
    pub rms: f64,
    /// Root mean square of the angles by which measured orientations deviate, rad; `None` if none were measured.
    pub rms_orientation: Option<f64>,
    /// Relation of the samples to the calibration.
    pub fit_relation: FitRelation,
    /// Noise of the measurement alone.
    pub noise: NoiseFloor,
    /// Residual beyond that noise.
    pub lack_of_fit: LackOfFit,
    /// Residuals by ball, in the order of the datasets.
    pub balls: Vec<BallView>,
    /// In the tool's axes, all set-ups combined.
    pub tool: ToolView,
    /// In the world's axes, all set-ups combined.
    pub world: WorldView,
    /// Each set-up (base and tool) separately.
    pub setups: Vec<SetupView>,
    /// Apparent angle errors of the joints; the curves that are significant come first.
    pub joints: Vec<JointCurve>,
    /// Mean apparent angle errors of the joints.
    pub offsets: Vec<JointOffset>,
    /// The samples with the worst fit, worst first.
    pub worst: Vec<WorstSample>,
    /// Every sample, in order.
    pub residuals: Vec<SampleResidual>,
    /// Views that are significant, strongest first, each tested beyond those before it.
    pub findings: Vec<Standout>,
    /// Share of the residual sum of squares that remains after the findings.
    pub left: f64,
    /// The families to which the effects named by the findings belong.
    pub registry: Registry,
}

impl Comparison {
    /// Compares a calibration with the samples of named datasets that `which` selects.
    ///
    /// # Errors
    /// When the data are from another robot, do not fit the model, or do not determine the robot's base and tool.
    pub fn of(calibration: &Calibration, datasets: &[NamedDataset<'_>], which: Use) -> Result<Self, IdentifyError> {
        let application = calibration.apply(datasets, which)?;
        let Application { problem, values, .. } = &application;
        let rows: Vec<&Sample> = datasets.iter().flat_map(|d| d.dataset.samples.iter().filter(|s| which.takes(s))).collect();
        let seen = SeenSample::all(problem, values, &rows, datasets);
        let replicates = Postures::replicates(datasets, |s| which.takes(s));
        let noisy: Vec<NoisySample> = seen
            .iter()
            .zip(replicates.of_samples())
            .map(|(s, &group)| NoisySample { group, whitened: s.whitener * s.residual, height: s.height, variance: s.variance })
            .collect();
        let noise = NoiseFloor::of(&noisy, problem.noise_stated());
        let (fit_relation, known) =
            fit_relation::of(calibration, &application, datasets, which, &noise).map_err(FitError::from)?;
        let whitened = Whitened::new(problem, values, &known).map_err(FitError::from)?;
        let rms = rms(&seen.iter().map(|s| s.residual).collect::<Vec<_>>());
        let lack_of_fit = LackOfFit::of(&noise, rms, &whitened, problem.row_count());

        let normalised: Vec<(f64, usize)> = seen.iter().map(|s| whitened.normalised(s.first_row, s.height)).collect();
        let mut layout = Layout::new(&seen, problem.setups().len(), datasets, &normalised);
        layout.acquit(&fit_relation.refitted, datasets);
        let places: Vec<(usize, usize)> = seen.iter().map(|s| (s.first_row, s.height)).collect();
        let mut show = |place: usize, patterns: &mut _| layout.show(&seen[place], place, patterns);
        let scores = Scores::new(&whitened, &known, &places, layout.patterns(), &mut show).map_err(FitError::from)?;
        // If the stated noise exceeds the whole residual, it would hide every defect; the views are then judged by the
        // remaining residuals.
        let noise_scale = NoiseFloor { level: noise.level.filter(|_| !lack_of_fit.noise_overstated), ..noise.clone() };
        let judge = finding::Judge { noise: &noise_scale, samples: seen.len(), repetition: repetition(&seen) };
        let views = views::Views {
            robot: problem.robot(),
            layout: &layout,
            seen: &seen,
            scores: &scores,
            judge: &judge,
            fitted: known.fitted,
        };
        let unit = judge.unit(&scores);
        let setups = views.setups(problem.setups());
        let curves = views.curves();
        let (mut findings, left) = finding::findings(&layout, &judge, &scores);
        for finding in &mut findings {
            finding.effects = layout.suggestions(finding.subject, calibration, datasets);
            if let Subject::Curve(place) = &mut finding.subject {
                *place = curves.iter().position(|(at, _)| at == place).unwrap_or(*place);
            }
        }
        let (tool, world) = views.of_all();
        Ok(Comparison {
            robot: problem.robot().name.clone(),
            samples: seen.len(),
            rms,
            rms_orientation: OrientationErrors::of(&problem.orientation_residuals(values)).map(|o| o.rms),
            fit_relation,
            lack_of_fit,
            balls: views.balls(datasets),
            tool,
            world,
            setups,
            joints: curves.into_iter().map(|(_, curve)| curve).collect(),
            offsets: views.offsets(),
            worst: views.worst(&normalised),
            residuals: seen
                .iter()
                .zip(&normalised)
                .map(|(s, &(squares, dof))| SampleResidual {
                    id: s.sample.id.clone(),
                    setup: s.setup,
                    world: s.residual,
                    tool: s.world_from_tool.inverse() * s.residual,
                    normalised: (squares / dof.max(1) as f64).sqrt() / unit,
                })
                .collect(),
            findings,
            left,
            noise,
            registry: calibration.model.registry.clone(),
        })
    }
}

/// Number of times that a posture's error is counted: scalar measurements over three per posture, at least 1. Samples
/// share a posture if they have the same `repeat` name, or the same angles to a tenth of a milliradian.
fn repetition(seen: &[SeenSample<'_>]) -> f64 {
    /// Grid to which joint angles are rounded when postures are compared, rad.
    const SAME_ANGLE: f64 = 1e-4;
    let posture = |s: &SeenSample<'_>| s.sample.q.iter().map(|q| (q / SAME_ANGLE).round() as i64).collect::<Vec<i64>>();
    let replicates = |s: &SeenSample<'_>| s.sample.repeat.as_deref().map(|name| (s.setup, name.to_owned()));
    let named: HashSet<_> = seen.iter().filter_map(replicates).collect();
    let others: HashSet<_> = seen.iter().filter(|s| s.sample.repeat.is_none()).map(|s| (s.setup, posture(s))).collect();
    let numbers: usize = seen.iter().map(|s| s.height).sum();
    (numbers as f64 / (3 * (named.len() + others.len())).max(1) as f64).max(1.0)
}
