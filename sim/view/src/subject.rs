//! The subject of a replay: the files of a run folder, or of a dataset folder alone.

use std::path::{Path, PathBuf};

use calibench::effects::registry::Registry;
use calibench::identify::calibration::{Calibration, IdentifyError, read_calibration};
use calibench::identify::{Model, identify};
use calibench::measure::dataset::file::read_dataset;
use calibench::measure::dataset::{Dataset, Measured, NamedDataset, Sample, SampleSet};
use calibench::robot::solids::Surroundings;
use calibench_report::documents::Run;
use nalgebra::Vector3;

use crate::at_rest::Arm;
use crate::journal::{Journal, Stop, Try};
use crate::{ViewError, truth};

/// The dataset of a run to be replayed.
const TRICAL: &str = "trical";

/// A calibration to be replayed.
pub struct Subject {
    /// The folder.
    pub folder: PathBuf,
    /// The scenario, or the folder's name.
    pub title: String,
    /// Question of the scenario.
    pub question: Option<String>,
    /// Name of the dataset in the calibration.
    pub name: String,
    /// The fitted data.
    pub dataset: Dataset,
    /// Points at poses not used in the fit.
    pub validation: Option<Dataset>,
    /// The identified robot.
    pub calibration: Calibration,
    /// Bodies around the arm.
    pub scene: Option<Surroundings>,
    /// All stops of the arm; for a dataset alone, one per sample.
    pub journal: Journal,
    /// True if the journal is that of a campaign.
    pub is_campaign: bool,
    /// True postures of the arm in a simulated cell, by rows of the journal.
    pub true_arm: Option<Vec<Arm>>,
    /// Missing parts of the folder, with what is not shown as a consequence.
    pub left_out: Vec<String>,
}

impl Subject {
    /// Reads a run folder, or a dataset folder.
    ///
    /// # Errors
    /// When the folder is neither, a file is wrong, or a dataset does not determine its robot.
    pub fn read(folder: &Path) -> Result<Self, ViewError> {
        if folder.join(Run::FILE).is_file() {
            Subject::of_run(folder)
        } else if folder.join("dataset.toml").is_file() {
            Subject::of_dataset(folder)
        } else {
            Err(ViewError::NothingToReplay(folder.to_owned()))
        }
    }

    fn of_run(folder: &Path) -> Result<Self, ViewError> {
        let result = Run::read(folder)?;
        let dataset = read_dataset(&folder.join(TRICAL))?;
        let calibration = read_calibration(&folder.join("trical.toml"), Registry::catalogue())?;
        let validation = folder.join("validation");
        let validation = validation.is_dir().then(|| read_dataset(&validation)).transpose()?;
        let subject = Subject {
            title: result.scenario,
            question: Some(result.question).filter(|q| !q.is_empty()),
            validation,
            ..Subject::of(folder, TRICAL.into(), dataset, calibration)
        };
        subject.with_cell()
    }

    fn of_dataset(folder: &Path) -> Result<Self, ViewError> {
        let dataset = read_dataset(folder)?;
        let name = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
        let name = name.file_name().map_or_else(|| "dataset".into(), |n| n.to_string_lossy().into_owned());
        let calibration = identify(&[NamedDataset::new(&name, &dataset)], &Model::default_for(&dataset))
            .map_err(|source| ViewError::Identify { folder: folder.to_owned(), source: Box::new(source) })?;
        Subject::of(folder, name, dataset, calibration).with_cell()
    }

    fn of(folder: &Path, name: String, dataset: Dataset, calibration: Calibration) -> Self {
        Subject {
            folder: folder.to_owned(),
            title: name.clone(),
            question: None,
            name,
            dataset,
            validation: None,
            calibration,
            scene: None,
            journal: Journal::default(),
            is_campaign: false,
            true_arm: None,
            left_out: Vec::new(),
        }
    }

    /// Adds the other information about the cell that the folder holds.
    fn with_cell(mut self) -> Result<Self, ViewError> {
        let scene = self.folder.join("scene.toml");
        if scene.is_file() {
            self.scene = Some(Surroundings::read(&scene)?);
        } else {
            self.left_out.push("table and gauge body (no scene.toml)".into());
        }
        if self.dataset.robot.solids.is_empty() {
            self.left_out.push("bodies of the arm (its robot file has no [[solid]]): it is drawn as lines".into());
        }
        match Journal::read(&self.folder, self.dataset.robot.joints())? {
            Some(journal) => {
                self.true_arm = truth::read(&self.folder, self.dataset.robot.joints(), journal.rows)?;
                (self.journal, self.is_campaign) = (journal, true);
            }
            None => {
                self.journal = one_stop_a_sample(&self.dataset);
                self.left_out.push("the centring (no iterations.csv and probings.csv): one stop a sample".into());
            }
        }
        if !self.has_judging_points() {
            self.left_out.push("validation points (none there)".into());
        }
        Ok(self)
    }

    /// Measured positions, world, m: the balls, or, if there are none, the points.
    pub fn targets(&self) -> Vec<Vector3<f64>> {
        let balls: Vec<_> = self.dataset.balls.iter().map(|b| b.position).collect();
        let point = |sample: &Sample| match &sample.measured {
            Measured::Point(point) => Some(*point),
            Measured::Ball { .. } | Measured::Distance { .. } => None,
        };
        if balls.is_empty() { self.dataset.samples.iter().filter_map(point).collect() } else { balls }
    }

    /// True if there are points not used in the fit.
    pub fn has_judging_points(&self) -> bool {
        self.validation.is_some() || self.dataset.samples.iter().any(|s| s.set == SampleSet::Validation)
    }

    /// True if the indicators of a gauge were read.
    pub fn has_gauge(&self) -> bool {
        self.journal.stops.iter().any(|stop| stop.reading.is_some())
    }

    /// Attributes the failure of an identification to the folder.
    pub fn locate(&self, source: IdentifyError) -> ViewError {
        ViewError::Identify { folder: self.folder.clone(), source: Box::new(source) }
    }
}

/// The journal equivalent to a dataset: every sample is an attempt with one stop.
fn one_stop_a_sample(dataset: &Dataset) -> Journal {
    let mut journal = Journal::default();
    for (probing, sample) in dataset.samples.iter().enumerate() {
        let (ball, reading) = match &sample.measured {
            Measured::Ball { ball, reading } => (dataset.balls[*ball].id.clone(), *reading),
            Measured::Point(_) | Measured::Distance { .. } => (String::new(), None),
        };
        journal.tries.push(Try { id: sample.id.clone(), ball, outcome: "measured".into(), clearance_mm: None });
        journal.stops.push(Stop {
            row: probing,
            probing,
            on_ball: reading.is_some(),
            time_s: sample.time_s,
            joints: sample.q.clone(),
            reading,
        });
    }
    journal
}
