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

pub use believable::{Abnormal, Unbelievable, abnormal, unbelievable};
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
///
/// ```
/// use calibench::identify::problem::Use;
/// # use calibench::measure::dataset::{Dataset, Measured, NamedDataset, Noise, Sample};
/// use calibench::residuals::misfit::data_fit;
/// # use calibench::robot::kinematics::world_from_tool;
/// # use calibench::robot::{FramePose, built_in};
/// # let robot = std::sync::Arc::new(built_in("ur5").ok_or("built in")?);
/// # let sample = |k: usize| {
/// #     let q: Vec<f64> = (1..=6).map(|i| 2.0 * ((k * i) as f64 * 0.618).fract() - 1.0).collect();
/// #     let seen = world_from_tool(&robot, &FramePose::default(), &FramePose::default(), &q).translation.vector;
/// #     Sample::new(format!("p{k}"), q, Measured::Point(seen))
/// # };
/// # let samples = (0..40).map(sample).collect();
/// # let noise = Noise { point: Some(20e-6), ..Noise::default() };
/// # let mut data = Dataset { robot: robot.clone(), noise, samples, ..Dataset::default() };
///
/// // Joints 2 and 3 exchanged in all rows of a UR5.
/// data.samples.iter_mut().for_each(|sample| sample.q.swap(1, 2));
/// let misfit = data_fit(&[NamedDataset::new("campaign", &data)], Use::All).remove(0).misfit.ok_or("they do not fit")?;
/// assert_eq!(misfit.slips[0].slip, "joints_swapped:2:3");
/// # Ok::<(), &str>(())
/// ```
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
