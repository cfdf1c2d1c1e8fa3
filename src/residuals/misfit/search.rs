//! Search for the cause of a misfit: gross rows, single slips, then plausible pairs.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::campaign::Campaign;
use super::data_fit::{Cause, SlipTried};
use super::expected::{expected, signal, spread};
use super::frames::{Fitted, Frames, misses};
use super::freed::{Family, all_joints};
use super::slip::{LENGTHS, Slip};
use super::slip_words::{scaled, words_of_place};
use super::starts::fit;
use crate::measure::dataset::Dataset;
use crate::robot::{Pose, rotation_vector};
use crate::units::DEG;

/// Number of rows on which single slips are screened.
const SCREENED: usize = 80;
/// Number of rows on which pairs of slips are screened.
const PAIRS_SCREENED: usize = 40;
/// Number of slips that are then tried on more rows.
const CONFIRMED: usize = 8;
/// A row is gross if its residual exceeds this multiple of the residual of the others,
const GROSS: f64 = 12.0;
/// and this share of the reach: a smaller one is an outlier that a diagnosis names.
const GROSS_OF_REACH: f64 = 0.03;
/// A slip explains a misfit if it leaves at most this share of the residual.
const EXPLAINS: f64 = 1.0 / 2.0;
/// If the data fit, a slip must leave at most this share of the residual to be accepted.
const BETTER: f64 = 1.0 / 3.0;
/// With fewer degrees of freedom per unknown, no slip is accepted for such data: chance may leave as little.
const FREEDOM_PER_UNKNOWN: isize = 2;
/// The same for a slip whose size is fitted, or that adds unknowns: these can only reduce the residual.
const BETTER_FREED: f64 = 1.0 / 5.0;
/// And its degrees of freedom per unknown.
const FREEDOM_PER_FREED: isize = 4;
/// Multiple of the stated noise up to which a residual is noise.
const NOISE_LEFT: f64 = 1.3;
/// Multiple of that from which it is none.
const ABOVE_NOISE: f64 = 1.5;
/// More slips together are preferred to fewer if they leave less than this share of their residual.
const MORE_IS_BETTER: f64 = 1.0 / 5.0;
/// The same of a scale and a zero of every joint, on arms so short that one of them explains most.
const ALL_ARE_BETTER: f64 = 1.0 / 3.0;
/// Trials that leave more than this share of the residual explain nothing and are not told.
const TOLD_BELOW: f64 = 0.8;
/// Residuals that differ by less than this share are the same.
const SAME: f64 = 0.005;
/// A slip leaves the same as another if their residuals differ by no more than this share.
const LEAVES_SAME: f64 = 0.01;
/// Slips with residuals up to this multiple of the smallest cannot be distinguished.
const ALIKE: f64 = 1.25;
/// Penalty factor on the residual of a slip with additional unknowns.
const FREEDOM: f64 = 1.5;
/// Largest limit of data with another length of the arm, in multiples of that of the data as they are.
const MOST_LIMIT: f64 = 3.0;
/// Largest share of gross rows that a slip may leave and still explain the others.
const FEW_GROSS: f64 = 0.05;
/// Distance, m, within which a fitted base is taken to be at the stated place.
const STATED: f64 = 0.05;
/// Rotation from the stated orientation, rad, that such a base should not reach.
const TURNED: f64 = 20.0 * DEG;
/// A slip corrects the base if the base then deviates from its stated orientation by no more than this, rad.
const PUT_RIGHT: f64 = 2.0 * DEG;
/// Number of best trials that are reported if none explains the misfit.
const TOLD: usize = 3;
/// Number of gross rows named individually, at most.
const NAMED: usize = 20;

/// Input of the search.
pub(super) struct Search<'a> {
    pub dataset: &'a Dataset,
    pub whole: &'a Campaign,
    pub some: &'a Campaign,
    pub nominal: &'a Fitted,
    /// Reach of the arm, m.
    pub reach: f64,
    /// Largest residual expected of the nominal arm, m.
    pub most: f64,
}

/// Slips, and the fit with these corrected.
struct Trial {
    slips: Vec<Slip>,
    fitted: Fitted,
    /// Residual on the scale of the uncorrected data, m, with the penalty for additional unknowns.
    score: f64,
}

impl Search<'_> {
    /// Finds the cause of a misfit, with the slips; `None` if the data fit.
    pub fn run(&self) -> Option<(Cause, Vec<SlipTried>)> {
        let gross = self.gross_rows();
        let too_large = self.nominal.robust > self.most;
        let singles: Vec<Vec<Slip>> = Slip::all(self.some).into_iter().map(|s| vec![s]).collect();
        let screen = self.some.selection(SCREENED);
        let before = fit(&screen);
        // If the robust residual is as expected, slips are scored by all rows including gross ones, otherwise by the
        // rows not excluded.
        let by_all = !too_large;
        let mut tried = try_all(&screen, &singles, by_all);
        if !too_large && gross.is_empty() {
            let fitted =
                Family::of_the_measurement(&screen).into_par_iter().map(|f| vec![f.fitted(&screen)]).collect::<Vec<_>>();
            tried.extend(try_all(&screen, &fitted, true));
            let found = self.of_data_that_fit(tried, &before);
            if found.is_empty() {
                return self.base_misplaced();
            }
            return Some((Cause::Slips, self.tried(found)));
        }
        let singles_left = |t: &Trial, limit: f64| self.explains(t, limit, &gross);
        let mut found = self.confirmed(tried, by_all, singles_left);
        let is_ordinary = |t: &Trial| t.fitted.robust <= expected(&undone(self.some, &t.slips), &t.fitted.frames)[1];
        let few = self.some.selection(PAIRS_SCREENED);
        // What needs more to be wrong at once is tried only while less does not explain the data well.
        let stages: [(f64, &dyn Fn() -> Vec<Trial>); 3] = [
            (MORE_IS_BETTER, &|| {
                let all: Vec<_> = Family::all(&screen).into_par_iter().map(|f| vec![f.fitted(&few)]).collect();
                try_all(&screen, &all, false)
            }),
            (MORE_IS_BETTER, &|| try_all(&few, &self.pairs(), false)),
            (ALL_ARE_BETTER, &|| {
                let all: Vec<_> = all_joints(&few).into_iter().map(|s| vec![s]).collect();
                try_all(&screen, &all, false)
            }),
        ];
        for (share, stage) in stages {
            if !too_large || found.first().is_some_and(is_ordinary) {
                break;
            }
            let more = self.confirmed(stage(), false, singles_left);
            let best = found.first().map(|t| t.fitted.robust);
            if more.first().is_some_and(|m| best.is_none_or(|b| m.fitted.robust < share * b)) {
                found = more;
            }
        }
        if too_large && !found.is_empty() {
            self.add_equivalent(&mut found, &singles, &few);
        }
        if !found.is_empty() {
            return Some((Cause::Slips, self.tried(found)));
        }
        if !too_large {
            return Some((Cause::Rows(gross.len()), self.rows(&gross)));
        }
        let mut tried = try_all(&screen, &singles, false);
        tried.retain(|t| t.score <= TOLD_BELOW * before.robust);
        tried.sort_by(|a, b| a.score.total_cmp(&b.score));
        told_apart(&mut tried);
        tried.truncate(TOLD);
        Some((Cause::Unknown, self.tried(tried)))
    }

    /// Adds to the best of what was found signs and zeros of joints, one or two, that leave the same, the simplest first: a joint that
    /// counts the other way is, on many wrists, another one half a turn farther. What is listed and something without a trace is
    /// nothing else.
    fn add_equivalent(&self, found: &mut Vec<Trial>, singles: &[Vec<Slip>], few: &Campaign) {
        let counts = |s: &Slip| matches!(s, Slip::JointSign(_) | Slip::JointZero(..));
        let is_of_arm = |s: &Slip| counts(s) || matches!(s, Slip::JointScale(..) | Slip::Length(..));
        let best = &found[0];
        if !best.slips.iter().all(is_of_arm) {
            return;
        }
        let is_same = |other: f64, own: f64, by: f64| (other - own).abs() <= by * own;
        let on_few = fit(&undone(few, &best.slips)).robust;
        let name = |slips: &[Slip]| slips.iter().map(|s| s.name(self.some)).collect::<Vec<_>>();
        let contains = |all: &[Slip], part: &[Slip]| name(part).iter().all(|p| name(all).contains(p));
        let mut all: Vec<Vec<Slip>> = singles.iter().cloned().chain(self.pairs()).collect();
        all.retain(|slips| slips.iter().all(counts) && !contains(slips, &best.slips));
        let screened = try_all(few, &all, false).into_iter().filter(|t| is_same(t.fitted.robust, on_few, ALIKE - 1.0));
        let again: Vec<Vec<Slip>> = screened.map(|t| t.slips).collect();
        let mut again = try_all(self.some, &again, false);
        // A size that was fitted makes the residual smaller by itself.
        let is_fitted = best.slips.iter().any(|s| s.fitted() > 0);
        let by = if is_fitted { ALIKE - 1.0 } else { LEAVES_SAME };
        again.retain(|t| is_same(t.fitted.robust, best.fitted.robust, by));
        let size = |t: &Trial| {
            let fitted = t.slips.iter().map(Slip::fitted).sum::<usize>();
            (t.slips.len() + fitted, fitted)
        };
        again.sort_by_key(size);
        if let Some(other) = again.into_iter().next() {
            let is_simpler = size(&other) < size(&found[0]);
            found.truncate(1);
            found.insert(usize::from(!is_simpler), other);
        }
    }

    /// All pairs of slips that plausibly occur together.
    fn pairs(&self) -> Vec<Vec<Slip>> {
        let all = Slip::all(self.some);
        (0..all.len())
            .flat_map(|i| (0..all.len()).map(move |k| (i, k)))
            .filter(|&(i, k)| all[i].goes_with(&all[k]) && (i < k || !all[k].goes_with(&all[i])))
            .map(|(i, k)| vec![all[i].clone(), all[k].clone()])
            .collect()
    }

    /// Slips of the measurement in data whose residual is no larger than expected: those that leave far less, in most rows, or
    /// nothing but the stated noise. One with unknowns of its own needs rows enough to tell.
    fn of_data_that_fit(&self, mut tried: Vec<Trial>, before: &Fitted) -> Vec<Trial> {
        let noise = NOISE_LEFT * self.whole.stated_noise;
        let enough = |of: &Fitted, by: isize| of.dof >= by * of.unknowns as isize;
        let mends = |t: &Trial, of: &Fitted| {
            let frees = t.slips[0].adds_freedom() || t.slips[0].fitted() > 0;
            let better = if frees { BETTER_FREED } else { BETTER };
            let far_less = t.score <= better * of.plain && t.fitted.robust <= better * of.robust;
            // The score is relative to the spread: of places that are taken to be smaller, everything is.
            let only_noise =
                t.score.max(t.fitted.robust) <= FREEDOM * noise && of.robust >= ABOVE_NOISE * noise.max(t.fitted.robust);
            (far_less || only_noise) && enough(&t.fitted, if frees { FREEDOM_PER_FREED } else { FREEDOM_PER_UNKNOWN })
        };
        tried.retain(|t| t.slips[0].is_never_physical() && mends(t, before));
        self.confirmed(tried, true, |t, _| mends(t, self.nominal))
    }

    /// Indices of rows, and of known distances between balls, with residuals far beyond anything expected, and the
    /// lengths of these residuals, m, largest first.
    fn gross_rows(&self) -> Vec<(usize, f64)> {
        let misses = misses(self.whole, &self.nominal.frames);
        let limit = self.gross(self.nominal.robust);
        let mut gross: Vec<(usize, f64)> = misses.into_iter().enumerate().filter(|(_, d)| *d > limit).collect();
        gross.sort_by(|a, b| b.1.total_cmp(&a.1));
        gross
    }

    /// Residual beyond which a row is gross if the others leave `robust`, m.
    fn gross(&self, robust: f64) -> f64 {
        (GROSS * robust).max(GROSS_OF_REACH * self.reach)
    }

    /// Detects a base whose origin is as stated but which is turned, and the slips that turn it back, since they show
    /// in no other way; and a base stated in another unit of length.
    fn base_misplaced(&self) -> Option<(Cause, Vec<SlipTried>)> {
        let campaign = self.some;
        let stands = |(place, base): (&super::campaign::Place, &Pose)| {
            let stated = place.base.pose();
            let (near, shift) = (stated.translation.vector, base.translation.vector);
            place.base_free && (near - shift).norm() <= STATED
        };
        let bases = &self.nominal.frames.bases;
        if self.turned(&self.nominal.frames) >= TURNED && campaign.places.iter().zip(bases).all(stands) {
            let slips: Vec<Vec<Slip>> = Slip::turning_the_base(campaign).into_iter().map(|s| vec![s]).collect();
            let mut tried = try_all(campaign, &slips, false);
            tried.retain(|t| t.score <= 1.1 * self.nominal.robust && self.turned(&t.fitted.frames) <= PUT_RIGHT);
            return (!tried.is_empty()).then(|| (Cause::Base, self.tried(tried)));
        }
        let in_unit = |by: f64| {
            campaign.places.iter().zip(bases).all(|(place, base)| {
                let (stated, found) = (Vector3::from(place.base.xyz) * by, base.translation.vector);
                place.base_free && (stated - found).norm() <= 0.02 * found.norm()
            })
        };
        let by = LENGTHS.into_iter().find(|by| in_unit(*by))?;
        let words = format!("the stated base {}", scaled(by));
        Some((Cause::Base, vec![SlipTried { slip: "base_unit".into(), residual: self.nominal.robust, words }]))
    }

    /// True if a trial leaves no more than expected, markedly less than before, and hardly any gross rows.
    fn explains(&self, trial: &Trial, limit: f64, gross: &[(usize, f64)]) -> bool {
        let left = trial.fitted.misses.iter().filter(|d| **d > self.gross(trial.fitted.robust)).count();
        let all = trial.fitted.misses.len();
        let before = gross.len() as f64 / (self.whole.shots.len() + self.whole.ties.len()) as f64;
        let few = (left as f64) <= (FEW_GROSS * all as f64).min(0.25 * before * all as f64);
        let better = trial.score <= EXPLAINS * if gross.is_empty() { self.nominal.robust } else { self.nominal.plain };
        let rescales = trial.slips.iter().any(|s| s.rescales_motion() || s.rescales_places());
        let less = rescales || trial.fitted.robust <= EXPLAINS * self.nominal.robust.max(self.nominal.plain);
        trial.fitted.robust <= limit && few && better && less
    }

    /// Tries the best on more rows. Keeps those that pass and cannot be distinguished from the best of them, the least
    /// turned base first.
    fn confirmed(&self, mut tried: Vec<Trial>, by_all: bool, passes: impl Fn(&Trial, f64) -> bool) -> Vec<Trial> {
        tried.sort_by(|a, b| a.score.total_cmp(&b.score));
        tried.truncate(CONFIRMED);
        let slips: Vec<Vec<Slip>> = tried.into_iter().map(|t| t.slips).collect();
        let mut again = try_all(self.some, &slips, by_all);
        again.retain(|t| {
            // A longer arm would be expected to leave more.
            let longer = t.slips.iter().any(|s| matches!(s, Slip::Length(..)));
            let most = if longer { MOST_LIMIT * self.most } else { f64::INFINITY };
            let limit = expected(&undone(self.some, &t.slips), &t.fitted.frames)[0].min(most);
            t.fitted.robust <= limit && passes(t, limit)
        });
        again.sort_by(|a, b| a.score.total_cmp(&b.score));
        let best = again.first().map_or(0.0, |t| t.score);
        again.retain(|t| t.score <= ALIKE * best);
        again.sort_by(|a, b| self.turned(&a.fitted.frames).total_cmp(&self.turned(&b.fitted.frames)));
        // Which axis of a left-handed frame is the wrong one, only a base that stands as stated can tell.
        let stated = again.first().is_some_and(|t| self.turned(&t.fitted.frames) <= PUT_RIGHT);
        again.sort_by_key(|t| (!stated && t.slips != [Slip::LeftHanded], t.slips.iter().map(Slip::fitted).sum::<usize>()));
        told_apart(&mut again);
        again
    }

    /// Largest angle between a fitted base and the stated one, rad: the criterion between slips of equal residual.
    fn turned(&self, frames: &Frames) -> f64 {
        let turn = |(base, place): (&Pose, &super::campaign::Place)| {
            rotation_vector(&(place.base.pose().rotation.inverse() * base.rotation)).norm()
        };
        frames.bases.iter().zip(&self.some.places).map(turn).fold(0.0, f64::max)
    }

    fn tried(&self, trials: Vec<Trial>) -> Vec<SlipTried> {
        let slip = |t: Trial| {
            let names: Vec<String> = t.slips.iter().map(|s| s.name(self.some)).collect();
            let words_of = |s: &Slip| match *s {
                Slip::Anchor(a) => words_of_place(self.some, a, &t.fitted.frames.anchors[a]),
                _ => s.words(self.some),
            };
            let words: Vec<String> = t.slips.iter().map(words_of).collect();
            SlipTried { slip: names.join("+"), residual: t.fitted.robust, words: words.join(" and ") }
        };
        let mut seen = Vec::new();
        let mut all: Vec<SlipTried> = trials.into_iter().map(slip).collect();
        all.retain(|t| {
            let new = !seen.contains(&t.slip);
            seen.push(t.slip.clone());
            new
        });
        all
    }

    fn rows(&self, gross: &[(usize, f64)]) -> Vec<SlipTried> {
        let row = |&(k, miss): &(usize, f64)| {
            let Some(shot) = self.whole.shots.get(k) else {
                let [a, b] = self.whole.ties[k - self.whole.shots.len()].between.map(|b| &self.whole.balls[b].id);
                let words =
                    format!("without the stated distance of balls {a} and {b}, {:.0} mm off, the nominal arm", miss * 1e3);
                return SlipTried { slip: format!("ball_distance:{a}:{b}"), residual: self.nominal.robust, words };
            };
            let id = &self.dataset.samples[shot.source[1]].id;
            let words = format!("without sample {id}, {:.0} mm off, the nominal arm", miss * 1e3);
            SlipTried { slip: format!("sample:{id}"), residual: self.nominal.robust, words }
        };
        gross.iter().take(NAMED).map(row).collect()
    }
}

/// Of trials that leave the same residual, keeps the first.
fn told_apart(tried: &mut Vec<Trial>) {
    let mut seen: Vec<f64> = Vec::new();
    tried.retain(|t| {
        let new = seen.iter().all(|s| (s - t.fitted.robust).abs() > SAME * s.max(t.fitted.robust));
        seen.push(t.fitted.robust);
        new
    });
}

fn undone(campaign: &Campaign, slips: &[Slip]) -> Campaign {
    slips.iter().fold(campaign.clone(), |c, slip| slip.undone(&c))
}

/// Tries slips on the rows of a campaign, scored by all rows if `by_all`, otherwise by those not excluded. Omits slips
/// that leave less than half of the rows.
fn try_all(campaign: &Campaign, all: &[Vec<Slip>], by_all: bool) -> Vec<Trial> {
    let (own, places) = (signal(campaign), spread(campaign));
    let one = |slips: &Vec<Slip>| {
        let changed = undone(campaign, slips);
        if changed.shots.len() < campaign.shots.len() / 2 {
            return None;
        }
        let fitted = fit(&changed);
        // An arm that hardly moves leaves a small residual, and so do places that hardly differ: residuals are compared
        // relative to both.
        let mut scale = 1.0;
        if slips.iter().any(Slip::rescales_motion) {
            scale *= own / signal(&changed).max(f64::MIN_POSITIVE);
        }
        if slips.iter().any(Slip::rescales_places) {
            scale *= places / spread(&changed).max(f64::MIN_POSITIVE);
        }
        let freed = slips.iter().any(Slip::adds_freedom) || slips.iter().any(|s| s.fitted() > 0);
        let score = if by_all { fitted.plain } else { fitted.robust } * scale * if freed { FREEDOM } else { 1.0 };
        Some(Trial { slips: slips.clone(), fitted, score })
    };
    all.par_iter().filter_map(one).collect()
}
