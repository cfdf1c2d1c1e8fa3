//! Do these data fit this robot at all? The nominal arm with only its frames fitted, against what real arms leave; and where the data
//! do not fit, which of the usual slips explains it.
//!
//! The question is put to the nominal fit: a wrong sign may be absorbed by absurd lengths and angles, so that the residual of an
//! identification says nothing.

mod believable;
mod campaign;
mod expected;
mod frames;
mod row_blocks;
mod search;
mod slip;

pub use believable::{Unbelievable, unbelievable};

use self::campaign::Campaign;
use self::expected::expected;
pub(super) use self::expected::reach;
use crate::identify::Use;
use crate::measure::{Dataset, Postures};

/// Most rows that the frames are fitted to: what these say of a slip, ten thousand say too.
const ROWS: usize = 400;
/// Fewer degrees of freedom than this say nothing of a misfit.
const LEAST_FREEDOM: isize = 9;

/// Nor do fewer postures, however often each was measured.
const LEAST_POSTURES: usize = 4;

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

/// Whether each dataset fits its robot, judged by the rows that `which` takes. Datasets without such rows are left out.
pub fn data_fit(datasets: &[(&str, &Dataset)], which: Use) -> Vec<DataFit> {
    datasets.iter().filter_map(|(name, dataset)| of_dataset(name, dataset, which)).collect()
}

fn of_dataset(name: &str, dataset: &Dataset, which: Use) -> Option<DataFit> {
    let whole = Campaign::of(&[(name, dataset)], which)?;
    let some = whole.selection(ROWS);
    let fitted = frames::fit(&some);
    let [most, _] = expected(&some, &fitted.frames);
    let reach = reach(&whole.robot);
    let nominal = NominalFit {
        dataset: name.into(),
        residual: fitted.robust,
        plain: fitted.plain,
        expected: most,
        reach,
        rows: whole.shots.len(),
    };
    let postures = Postures::of(&[(name, dataset)], |s| which.takes(s)).of_samples().iter().max().map_or(0, |p| p + 1);
    if fitted.dof < LEAST_FREEDOM || postures < LEAST_POSTURES {
        return Some(DataFit { nominal, misfit: None });
    }
    let search = search::Search { dataset, whole: &whole, some: &some, nominal: &fitted, reach, most };
    let found = search.run();
    let misfit = found.map(|(cause, slips)| Misfit {
        within_expected: cause == Cause::Slips && fitted.robust <= most,
        nominal: nominal.clone(),
        cause,
        slips,
    });
    Some(DataFit { nominal, misfit })
}
