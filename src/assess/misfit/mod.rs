//! Do these data fit this robot at all? The nominal arm with only its frames fitted, against what real arms leave; and where the data
//! do not fit, which of the usual slips explains it.
//!
//! The question is put to the nominal fit: a wrong sign may be absorbed by absurd lengths and angles, so that the residual of an
//! identification says nothing.

mod believable;
mod campaign;
mod data_fit;
mod expected;
mod frames;
mod row_blocks;
mod search;
mod slip;

pub use believable::{Unbelievable, unbelievable};
pub use data_fit::{Cause, DataFit, Misfit, NominalFit, SlipTried};

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
