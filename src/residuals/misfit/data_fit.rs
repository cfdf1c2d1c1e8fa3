//! Result of the test whether a dataset fits its robot, with the cause of a misfit.

/// Residual of the nominal arm on a dataset, with its base, a free tool and free balls fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct NominalFit {
    /// Name of the dataset.
    pub dataset: String,
    /// Residual, 3-D rms, without the rows that a robust fit excludes, m.
    pub residual: f64,
    /// The same with all rows, m.
    pub plain: f64,
    /// Largest residual expected, m: 99.9 % of arms, poorly assembled ones included, leave less.
    pub expected: f64,
    /// Of a larger residual that is right: errors of an arm, fitted to some rows, predict half of the others within this distance,
    /// m. `None` if the residual is as expected, or the data do not fit.
    pub left_out: Option<f64>,
    /// Largest distance of the flange from the second joint, m.
    pub reach: f64,
    /// Number of rows of the dataset; of many, the frames are fitted to a selection.
    pub rows: usize,
}

/// A slip, and the residual of the nominal arm once it is corrected.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SlipTried {
    /// Name: `joint_sign:2`, `ball:4`, `sample:17`; for two together, `joint_sign:2+joint_zero:2`.
    pub slip: String,
    /// Residual with the slip corrected, rms, in the unit of the [`Measure`] that does not fit.
    pub residual: f64,
    /// Description of the correction.
    pub words: String,
}

/// Cause of a misfit between data and robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Cause {
    /// The slips reduce the residual to what is expected; the first is the most likely.
    Slips,
    /// This many single rows are far off; the farthest of them, up to twenty, are named.
    Rows(usize),
    /// The fitted base is turned from the stated one, and each of the slips corrects that; or the base is stated in
    /// another unit of length.
    Base,
    /// No cause was found; the slips are the best that were tried.
    Unknown,
}

impl Cause {
    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Cause::Slips => "slip",
            Cause::Rows(_) => "rows",
            Cause::Base => "base",
            Cause::Unknown => "unknown",
        }
    }
}

/// What does not fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measure {
    /// Positions, distances or balls; residuals in m.
    Places,
    /// Orientations; residuals in rad.
    Orientations,
    /// The places of several targets on the tool; residuals in m.
    Targets,
    /// Stated distances between balls; residuals in m.
    BallDistances,
    /// Rows that contradict each other by themselves; the residual of a slip is the distance of such rows, m.
    Rows,
}

/// Data that do not fit, with the cause.
#[derive(Debug, Clone, PartialEq)]
pub struct Misfit {
    /// The nominal fit.
    pub nominal: NominalFit,
    /// What does not fit.
    pub measure: Measure,
    /// Residual of the nominal arm in all rows, rms, m, or rad of orientations.
    pub left: f64,
    /// Largest residual expected, m, or rad of orientations.
    pub most: f64,
    /// The cause.
    pub cause: Cause,
    /// Slips found, bad rows, or the best trials.
    pub slips: Vec<SlipTried>,
    /// True if slips explain the data although the residual is within what is expected.
    pub within_expected: bool,
}

/// Result of the test whether a dataset fits its robot.
#[derive(Debug, Clone, PartialEq)]
pub struct DataFit {
    /// Fit of the nominal arm.
    pub nominal: NominalFit,
    /// Cause of the misfit; `None` if the data fit.
    pub misfit: Option<Misfit>,
}
