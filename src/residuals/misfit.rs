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
mod freed;
mod instrument;
mod left_out;
mod orientation_slips;
mod orientations;
mod row_blocks;
mod search;
mod slip;
mod slip_words;
mod starts;
mod stuck;
mod targets;
mod ties;

pub use believable::{Abnormal, Unbelievable, abnormal, unbelievable};
pub use data_fit::{Cause, DataFit, Measure, Misfit, NominalFit, SlipTried};

use self::campaign::Campaign;
use self::expected::expected;
pub(crate) use self::expected::reach;
use crate::identify::problem::Use;
use crate::measure::dataset::{Dataset, NamedDataset};
use crate::measure::poses::Postures;

/// Approximate number of rows to which the frames are fitted: they show a slip as clearly as ten thousand would.
const ROWS: usize = 400;
/// Approximate number of rows whose orientations are judged.
const ORIENTED_ROWS: usize = 120;
/// Smallest number of degrees of freedom with which a misfit can be judged.
const LEAST_FREEDOM: isize = 9;

/// Largest residual, in multiples of the largest one expected, at which a fit of the arm that is linear about the nominal one is tried
/// first.
const NEAR: f64 = 3.0;

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
    let mut whole = Campaign::of(&[NamedDataset::new(name, dataset)], which)?;
    let mut some = whole.selection(ROWS);
    let fitted = starts::fit_anywhere(&some);
    if dataset.noise.seen_from_tool {
        let more = orientations::noise_of_places(dataset, &some.selection(ORIENTED_ROWS), &fitted.frames);
        [&mut whole, &mut some].into_iter().for_each(|campaign| campaign.noise = campaign.noise.hypot(more));
    }
    let [most, _] = expected(&some, &fitted.frames);
    let reach = reach(&whole.robot);
    let is_larger = fitted.robust > most;
    let mut nominal = NominalFit {
        dataset: name.into(),
        residual: fitted.robust,
        plain: fitted.plain,
        expected: most,
        left_out: is_larger.then(|| left_out::predicted_by_the_arm(&some, &fitted.frames, fitted.robust, most)).flatten(),
        reach,
        rows: whole.shots.len(),
    };
    let judged = Judged { dataset, whole: &whole, some: &some, fitted: &fitted, nominal: &nominal };
    let misfit = judged
        .rows()
        .or_else(|| judged.instrument_of_distances())
        .or_else(|| judged.places(which, name))
        .or_else(|| judged.orientations())
        .or_else(|| judged.targets())
        .or_else(|| judged.instrument())
        .or_else(|| judged.ball_distances());
    if misfit.is_some() {
        nominal.left_out = None;
    }
    Some(DataFit { misfit, nominal })
}

/// What is judged, in the order in which it is judged: what comes first makes what follows meaningless.
struct Judged<'a> {
    dataset: &'a Dataset,
    whole: &'a Campaign,
    some: &'a Campaign,
    fitted: &'a frames::Fitted,
    nominal: &'a NominalFit,
}

impl Judged<'_> {
    fn misfit(&self, measure: Measure, [left, most]: [f64; 2], cause: Cause, slips: Vec<SlipTried>) -> Misfit {
        let within_expected = cause == Cause::Slips && measure == Measure::Places && left <= most;
        Misfit { nominal: self.nominal.clone(), measure, left, most, cause, slips, within_expected }
    }

    /// Rows that contradict each other by themselves.
    fn rows(&self) -> Option<Misfit> {
        let sizes = [self.nominal.plain, self.nominal.expected];
        if let Some(slip) = stuck::stuck(self.dataset, self.whole, self.nominal.reach) {
            return Some(self.misfit(Measure::Rows, sizes, Cause::Slips, vec![slip]));
        }
        let (a, b, same) = stuck::copied(self.whole)?;
        let [name_a, name_b] = [a, b].map(|s| self.whole.places[s].name.as_str());
        let words = format!("{same} rows of {name_b} hold the numbers of {name_a}: it is a copy");
        let slip = format!("copied:{}:{}", bare(name_a), bare(name_b));
        Some(self.misfit(Measure::Rows, sizes, Cause::Slips, vec![SlipTried { slip, residual: 0.0, words }]))
    }

    fn places(&self, which: Use, name: &str) -> Option<Misfit> {
        let NominalFit { residual, plain, expected: most, reach, .. } = *self.nominal;
        let taken = Postures::of(&[NamedDataset::new(name, self.dataset)], |s| which.takes(s));
        let postures = taken.of_samples().iter().max().map_or(0, |p| p + 1);
        let sizes = [residual.max(plain), most];
        if self.fitted.dof < LEAST_FREEDOM || postures < LEAST_POSTURES {
            return (residual > most).then(|| self.misfit(Measure::Places, sizes, Cause::Unknown, Vec::new()));
        }
        let (dataset, whole, some, nominal) = (self.dataset, self.whole, self.some, self.fitted);
        let (cause, slips) = search::Search { dataset, whole, some, nominal, reach, most }.run()?;
        if cause == Cause::Unknown && self.nominal.left_out.is_some() {
            return None;
        }
        if cause == Cause::Unknown
            && let Some(still) = stuck::never_moved(whole)
        {
            return Some(self.misfit(Measure::Rows, sizes, Cause::Slips, vec![still]));
        }
        Some(self.misfit(Measure::Places, sizes, cause, slips))
    }

    fn orientations(&self) -> Option<Misfit> {
        let some = self.some.selection(ORIENTED_ROWS);
        let orientations::Turned { left, most, rows, slips } = orientations::judge(self.dataset, &some, &self.fitted.frames)?;
        let cause = match rows {
            0 if slips.is_empty() => Cause::Unknown,
            0 => Cause::Slips,
            rows => Cause::Rows(rows),
        };
        if cause == Cause::Unknown
            && let Some(still) = stuck::never_moved(self.whole)
        {
            return Some(self.misfit(Measure::Rows, [self.nominal.plain, self.nominal.expected], Cause::Slips, vec![still]));
        }
        Some(self.misfit(Measure::Orientations, [left, most], cause, slips))
    }

    fn targets(&self) -> Option<Misfit> {
        let (frames, NominalFit { residual, reach, .. }) = (&self.fitted.frames, self.nominal);
        let targets::Misplaced { left, most, slips } = targets::judge(self.dataset, self.some, frames, *residual, *reach)?;
        let cause = if slips.is_empty() { Cause::Unknown } else { Cause::Slips };
        Some(self.misfit(Measure::Targets, [left, most], cause, slips))
    }
}

impl Judged<'_> {
    fn instrument(&self) -> Option<Misfit> {
        if self.fitted.dof < LEAST_FREEDOM {
            return None;
        }
        let instrument::Instrument { left, slips } = instrument::judge(self.some)?;
        Some(self.misfit(Measure::Places, [left, self.nominal.expected], Cause::Slips, slips))
    }

    /// Distances that exceed what is expected, and that a slip of the instrument explains beside a fitted arm: the nominal arm
    /// leaves too much to tell the constant of an anchor from its place.
    fn instrument_of_distances(&self) -> Option<Misfit> {
        let NominalFit { residual, expected: most, .. } = *self.nominal;
        let is_near = residual > most && residual <= NEAR * most;
        (is_near && self.some.has_distances_alone()).then(|| self.instrument()).flatten()
    }

    fn ball_distances(&self) -> Option<Misfit> {
        let (left, most, slips) = ties::judge(self.some, self.nominal.reach)?;
        let cause = if slips.is_empty() { Cause::Unknown } else { Cause::Slips };
        let tried = slips.into_iter().map(|(slip, residual, words)| SlipTried { slip, residual, words }).collect();
        Some(self.misfit(Measure::BallDistances, [left, most], cause, tried))
    }
}

/// The name of a target without the word before it.
fn bare(name: &str) -> &str {
    ["target ", "the "].iter().find_map(|word| name.strip_prefix(word)).unwrap_or(name)
}
