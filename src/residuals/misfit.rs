//! Test whether data fit their robot at all: the residual of the nominal arm with only its frames fitted, compared with
//! that of real arms. If the data do not fit, common mistakes (slips) are tried as an explanation.
//!
//! The nominal fit is tested because an identification may absorb a wrong sign into absurd lengths and angles; its
//! residual then says nothing.

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
pub(crate) use self::expected::reach;
use crate::identify::problem::Use;
use crate::measure::dataset::{Dataset, NamedDataset};
use crate::measure::poses::Postures;

/// Approximate number of rows to which the frames are fitted: they show a slip as clearly as ten thousand would.
const ROWS: usize = 400;
/// Smallest number of degrees of freedom with which a misfit can be judged.
const LEAST_FREEDOM: isize = 9;

/// Smallest number of postures with which a misfit can be judged, however often each was measured.
const LEAST_POSTURES: usize = 4;

/// Tests whether each dataset fits its robot, from the rows that `which` selects. Datasets without such rows are
/// omitted.
pub fn data_fit(datasets: &[NamedDataset<'_>], which: Use) -> Vec<DataFit> {
    datasets.iter().filter_map(|NamedDataset { name, dataset }| of_dataset(name, dataset, which)).collect()
}

fn of_dataset(name: &str, dataset: &Dataset, which: Use) -> Option<DataFit> {
    let whole = Campaign::of(&[NamedDataset::new(name, dataset)], which)?;
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
    let postures =
        Postures::of(&[NamedDataset::new(name, dataset)], |s| which.takes(s)).of_samples().iter().max().map_or(0, |p| p + 1);
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
