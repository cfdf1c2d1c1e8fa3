//! Whether a dataset fits its robot, and why not.

/// What the nominal arm leaves of a dataset when its base, a free tool and free balls are fitted; m.
#[derive(Debug, Clone, PartialEq)]
pub struct NominalFit {
    /// Dataset.
    pub dataset: String,
    /// Root mean square, 3-D, without the rows that a robust fit sets aside.
    pub residual: f64,
    /// Root mean square of all rows.
    pub plain: f64,
    /// At most expected: 99.9 % of arms, ill assembled ones included, leave less.
    pub expected: f64,
    /// How far the flange reaches from the second joint.
    pub reach: f64,
    /// Rows looked at.
    pub rows: usize,
}

/// A slip, and what the nominal arm leaves without it.
#[derive(Debug, Clone, PartialEq)]
pub struct SlipTried {
    /// Its name: `joint_sign:2`, `ball:4`, `sample:17`; of two together, `joint_sign:2+joint_zero:2`.
    pub slip: String,
    /// Root mean square, 3-D, with the slip undone, m.
    pub residual: f64,
    /// What was undone.
    pub words: String,
}

/// Why data do not fit their robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Cause {
    /// The slips found bring the residual within what is expected; the first is the likeliest.
    Slips,
    /// Single rows are far off; each is named.
    Rows,
    /// The base would stand elsewhere than stated, and the slips put it there.
    Base,
    /// None was found; the slips are the best that were tried.
    Unknown,
}

impl Cause {
    /// As in files.
    pub fn name(self) -> &'static str {
        match self {
            Cause::Slips => "slip",
            Cause::Rows => "rows",
            Cause::Base => "base",
            Cause::Unknown => "unknown",
        }
    }
}

/// Data that do not fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Misfit {
    /// The fit that fails.
    pub nominal: NominalFit,
    /// Why.
    pub cause: Cause,
    /// Slips found, rows named, or the best tries.
    pub slips: Vec<SlipTried>,
    /// Whether the residual is within what is expected, and yet several times as large as without the slip.
    pub within_expected: bool,
}

/// Whether a dataset fits its robot.
#[derive(Debug, Clone, PartialEq)]
pub struct DataFit {
    /// What the nominal arm leaves.
    pub nominal: NominalFit,
    /// Why the data do not fit; `None` where they do.
    pub misfit: Option<Misfit>,
}
