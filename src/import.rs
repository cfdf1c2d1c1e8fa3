//! Import of measurements taken elsewhere into this project's convention.
//!
//! Every format is a column map from the columns of a table to those of a dataset; the built-in ones are embedded maps, and
//! `generic` reads one from a file (see `docs/importing.md`).

mod column_map;
mod error;
mod flange_pose;
mod generic;
mod guess;
mod initial_setup;
pub mod joint_names;
mod mukca;
mod published;
mod report;
mod rotation;
mod row_order;
mod source;
mod table;
mod unknown_table;

use std::path::PathBuf;

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use self::initial_setup::{balance, take_set_up};
use crate::measure::dataset::{Dataset, NamedDataset, Sample, SampleSet};
use crate::measure::poses::Postures;

pub use error::ImportError;
pub use guess::{Guess, guess};
pub use initial_setup::{state_noise, without_noise};
pub use report::{ImportReport, Skipped};

/// Names of the formats.
pub const FORMATS: &[&str] = &["ur10-ipa", "ur5-jacobi", "mukca", "generic"];

/// Options of an import.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ImportOptions {
    /// Use of the rows of each file, in the order of the files; if empty, the format decides.
    pub sets: Vec<SampleSet>,
    /// Fraction of the rows to keep for validation, at random.
    pub holdout: Option<Holdout>,
    /// The column map of `generic`.
    pub map: Option<PathBuf>,
    /// For `mukca`: the robot that was measured (a built-in, or a file), if it is not the Panda.
    pub robot: Option<PathBuf>,
    /// For `mukca`: distance between neighbouring sockets of a place, m, if it is not 50 mm.
    pub sockets_apart: Option<f64>,
    /// A dataset that was measured on the same set-up: base, tool and targets are taken from it, not found from the rows.
    pub set_up_of: Option<PathBuf>,
}

/// How the postures kept for validation are chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum HoldoutChoice {
    /// One by one, at random: all have neighbours that are fitted.
    #[default]
    Postures,
    /// By blocks of neighbours in joint space, at random: a harder judge, and nearer to what the robot meets at its work.
    Blocks,
}

/// Rows kept for validation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Holdout {
    /// Fraction of the rows that would be fitted, between 0 and 1.
    pub fraction: f64,
    /// Seed of the draw: the same seed keeps the same rows.
    pub seed: u64,
    /// How postures are chosen.
    pub choice: HoldoutChoice,
}

/// Imports files of a [format](FORMATS) into one dataset, and reports the outcome of every row.
///
/// Rows without a measurement and rows that repeat another to the last digit are skipped and reported; any other problem is an
/// error. The initial base and tool are fitted in closed form if neither the format nor a dataset of the same set-up gives them.
///
/// ```
/// use calibench::import::{ImportOptions, import};
/// # use calibench::robot::kinematics::world_from_tool;
/// # use calibench::robot::{FramePose, built_in};
/// use calibench::units::DEG;
/// # let folder = tempfile::tempdir()?;
/// # let (table, map) = (folder.path().join("table.csv"), folder.path().join("map.toml"));
/// # let robot = built_in("ur5").ok_or("built in")?;
/// # let mut text = "j1,j2,j3,j4,j5,j6,px,py,pz\n".to_owned();
/// # for k in 0..12 {
/// #     let q: Vec<f64> = (1..=6).map(|i| ((30 + 37 * k * i) % 90) as f64).collect();
/// #     let radians: Vec<f64> = q.iter().map(|q| q * DEG).collect();
/// #     let seen = world_from_tool(&robot, &FramePose::default(), &FramePose::default(), &radians).translation.vector * 1000.0;
/// #     let fields: Vec<String> = q.into_iter().chain(seen.iter().copied()).map(|x| x.to_string()).collect();
/// #     text += &format!("{}\n", fields.join(","));
/// # }
/// # std::fs::write(&table, text)?;
/// # let joints: String = (1..=6).map(|i| format!("q{i} = {{ column = 'j{i}', unit = 'deg' }}\n")).collect();
/// # let point: String = ["x", "y", "z"].map(|a| format!("{a} = {{ column = 'p{a}', unit = 'mm' }}\n")).concat();
/// # let tool = "[dataset.tool]\nx_mm = 0.0\ny_mm = 0.0\nz_mm = 0.0\nfree = true\n";
/// # let set_up = format!("[dataset]\nrobot = 'ur5'\n{tool}");
/// # std::fs::write(&map, format!("format = 'calibench-import/1'\n[columns]\n{joints}{point}{set_up}"))?;
///
/// // A table of twelve rows: joints in deg, positions in mm.
/// let options = ImportOptions { map: Some(map), ..ImportOptions::default() };
/// let (data, report) = import("generic", &[table], &options)?;
/// assert_eq!((report.rows_read, report.rows_kept), (12, 12));
/// assert!((data.samples[0].q[0] - 30.0 * DEG).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// See [`ImportError`].
pub fn import(format: &str, files: &[PathBuf], options: &ImportOptions) -> Result<(Dataset, ImportReport), ImportError> {
    if !FORMATS.contains(&format) {
        return Err(ImportError::UnknownFormat { format: format.into() });
    }
    if files.is_empty() {
        return Err(ImportError::NoFiles);
    }
    if options.robot.is_some() && format != "mukca" {
        return Err(ImportError::RobotIsKnown { format: format.into() });
    }
    if let Some(Holdout { fraction, .. }) = options.holdout
        && !(0.0..=1.0).contains(&fraction)
    {
        return Err(ImportError::NotAShare { fraction });
    }
    if !options.sets.is_empty() && options.sets.len() != files.len() {
        return Err(ImportError::SetsAndFiles { sets: options.sets.len(), files: files.len() });
    }
    let imported = match format {
        "ur10-ipa" => published::ur10_ipa(files, options)?,
        "ur5-jacobi" => published::ur5_jacobi(files, options)?,
        "mukca" => mukca::import(files, options)?,
        _ => generic::import(files, options)?,
    };
    let (dataset, report) = imported;
    finished(dataset, report, options)
}

/// The parts of an import that follow its rows.
fn finished(
    mut dataset: Dataset,
    mut report: ImportReport,
    options: &ImportOptions,
) -> Result<(Dataset, ImportReport), ImportError> {
    if let Some(folder) = &options.set_up_of {
        take_set_up(&mut dataset, folder)?;
    }
    if let Some(holdout) = options.holdout {
        holdout.apply(&mut dataset);
    }
    balance(&mut dataset, &mut report);
    Ok((dataset, report))
}

/// Number of blocks into which postures are divided before whole ones of them are held out, if there are several postures a block.
const BLOCKS: usize = 20;
/// Fewest postures a block.
const IN_A_BLOCK: usize = 3;

impl Holdout {
    /// Marks a fraction of the postures of set `fit` as validation, each with all its rows: another target seen from a posture that
    /// was fitted is no new one.
    pub fn apply(self, dataset: &mut Dataset) {
        let is_fit = |s: &Sample| s.set == SampleSet::Fit;
        let postures = Postures::of(&[NamedDataset::new("", dataset)], is_fit);
        let places: Vec<usize> = (0..dataset.samples.len()).filter(|&k| is_fit(&dataset.samples[k])).collect();
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        let count = (self.fraction * postures.count() as f64).round() as usize;
        let mut members = postures.members();
        match self.choice {
            HoldoutChoice::Postures => members.shuffle(&mut random),
            HoldoutChoice::Blocks => {
                let joints: Vec<&[f64]> = places.iter().map(|&k| dataset.samples[k].q.as_slice()).collect();
                let blocks = (postures.count() / IN_A_BLOCK).clamp(1, BLOCKS);
                let of = postures.blocks(&joints, blocks, self.seed);
                let mut order: Vec<usize> = (0..blocks).collect();
                order.shuffle(&mut random);
                let rank = |posture: usize| order.iter().position(|block| *block == of[posture]);
                let mut by_block: Vec<usize> = (0..members.len()).collect();
                by_block.sort_by_key(|&posture| rank(posture));
                members = by_block.into_iter().map(|posture| std::mem::take(&mut members[posture])).collect();
            }
        }
        for &k in members[..count].iter().flatten() {
            dataset.samples[places[k]].set = SampleSet::Validation;
        }
    }
}
