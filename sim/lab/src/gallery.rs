//! The gallery of signatures: one effect of each family, injected alone into a campaign, and seen in the residuals of the model
//! that lacks it.

mod campaigns;

use std::sync::OnceLock;

use calibench::diagnosis::Examination;
use calibench::effects::catalogue::CATALOGUE;
use calibench::effects::catalogue::setting_aside;
use calibench::effects::facts::{Follows, Offered, Physical};
use calibench::effects::family::{Family, Scan};
use calibench::effects::{EffectError, EffectId, build, reference_torque};
use calibench::identify::Model;
use calibench::identify::calibration::{Estimate, IdentifyError};
use calibench::identify::problem::{Use, missing};
use calibench::measure::dataset::{Measured, NamedDataset};
use calibench::residuals::Look;
use calibench::units::Unit;
use calibench_report::{Entry, Imitator, Plausible, Seen, see};
use calibench_sim::random::{Streams, fnv1a};
use rayon::prelude::*;
use thiserror::Error;

pub use campaigns::{Campaign, of_scenario};

use crate::injection::{InjectedNoise, NoiseChoice, Subject};

/// Size of an effect's residual after the fit of the model, rms in units of the noise, to which it is enlarged where one
/// plausible size leaves less: a picture of noise shows nothing.
const SHOWS: f64 = 3.0;

/// Shares of an effect, explained by its best imitator, between which a second picture shows the residual of that fit: below,
/// it is not an imitation; above, nothing is left.
const BESIDE: std::ops::Range<f64> = 0.5..0.97;

/// Order of a ripple, per turn, and part of the session after which events occur.
const ORDER: &str = "17";
/// Part of the session after which events occur, as a share of it: well inside, with samples on both sides.
const DURING: f64 = 0.4;

/// Share of the best score from which a member is as good as the best; the first of them is shown.
const NEARLY: f64 = 0.5;

/// Ratio of scores from which a later campaign is preferred, dimensionless.
const BETTER: f64 = 1.5;

/// Weight of a coupling of joints that are not neighbours; that of neighbours is 1.
const UNLIKELY: f64 = 0.1;

/// Smallest residual of an effect of one plausible size that a campaign can show, rms in units of the noise.
const LEAST: f64 = 1e-3;

/// A family that no campaign can show, and what they lack.
pub type Lack = (String, String);

/// Reasons why there is no gallery.
#[derive(Debug, Error)]
pub enum GalleryError {
    /// An effect could not be fitted.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// An effect does not fit the robot.
    #[error(transparent)]
    Effect(#[from] EffectError),
}

/// A campaign, calibrated.
struct Ground<'a> {
    campaign: &'a Campaign,
    named: Vec<NamedDataset<'a>>,
    subject: Subject<'a>,
    examination: Examination,
}

/// An effect, and where it is shown.
struct Chosen<'g, 'a> {
    family: &'static Family,
    id: String,
    ground: &'g Ground<'a>,
    /// Its parameters in plausible sizes, before they are enlarged.
    signs: Vec<f64>,
    visible: f64,
}

/// The families shown in `campaigns`, in the order of the catalogue, each in the first campaign that shows it; and those that
/// none of them can show, with what they lack. `only` names families; all if it is empty. `done` is called after each.
///
/// # Errors
/// If a campaign does not determine its model.
pub fn gallery(
    campaigns: &[Campaign],
    only: &[String],
    seed: u64,
    done: &(dyn Fn() + Sync),
) -> Result<(Vec<Entry>, Vec<Lack>), GalleryError> {
    let named: Vec<Vec<NamedDataset<'_>>> =
        campaigns.iter().map(|c| c.datasets.iter().map(|(name, d)| NamedDataset::new(name.as_str(), d)).collect()).collect();
    let grounds: Vec<OnceLock<Ground<'_>>> = campaigns.iter().map(|_| OnceLock::new()).collect();
    // A campaign is calibrated when the first effect asks for it.
    let ground = |k: usize| -> Result<&Ground<'_>, GalleryError> {
        if let Some(ground) = grounds[k].get() {
            return Ok(ground);
        }
        let new = Ground::new(&campaigns[k], named[k].as_slice(), seed)?;
        Ok(grounds[k].get_or_init(|| new))
    };
    if only.is_empty() {
        (0..campaigns.len()).into_par_iter().try_for_each(|k| ground(k).map(drop))?;
    }
    let families: Vec<&'static Family> =
        CATALOGUE.iter().filter(|f| only.is_empty() || only.iter().any(|name| EffectId::new(name).family() == f.id)).collect();
    let one = |family: &&'static Family| {
        let entry = match choose(family, campaigns.len(), &ground)? {
            Ok(chosen) => Ok(chosen.entry(seed)?),
            Err(lack) => Err((family.id.to_owned(), lack)),
        };
        done();
        Ok::<_, GalleryError>(entry)
    };
    let shown: Vec<Result<Entry, Lack>> = families.par_iter().map(one).collect::<Result<_, _>>()?;
    let (mut entries, mut lacking) = (Vec::new(), Vec::new());
    for one in shown {
        match one {
            Ok(entry) => entries.push(entry),
            Err(lack) => lacking.push(lack),
        }
    }
    Ok((entries, lacking))
}

impl<'a> Ground<'a> {
    fn new(campaign: &'a Campaign, named: &'a [NamedDataset<'a>], seed: u64) -> Result<Self, IdentifyError> {
        let noise = InjectedNoise::of(named, &campaign.model, NoiseChoice::Instrument)?;
        let subject = Subject::new(named, &campaign.model, noise, seed)?;
        let examination = Examination::new(named, &campaign.model)?;
        Ok(Ground { campaign, named: named.to_vec(), subject, examination })
    }

    /// The ids of a family's members in this campaign.
    fn members(&self, family: &Family) -> Vec<String> {
        let first = self.named[0].dataset;
        let balls = first.ball_ids();
        let subject = self.campaign.model.subject(&first.robot, &balls);
        if self.campaign.model.effects.iter().any(|e| e == family.id) {
            return vec![family.id.to_owned()];
        }
        let rows: Vec<_> = first.samples.iter().filter(|s| Use::Fit.takes(s)).collect();
        let middle = rows.get((rows.len() as f64 * DURING) as usize);
        match family.scan {
            // Members that only data know.
            Scan::None if family.ids(&subject).is_empty() => {
                first.tool_targets.iter().map(|t| format!("{}:{}", family.id, t.id)).collect()
            }
            Scan::None => family.ids(&subject),
            Scan::Order => family.scanned(&subject, ORDER),
            Scan::Time => self.moment().map_or_else(Vec::new, |t| family.scanned(&subject, &t)),
            Scan::Sample => middle.map(|s| setting_aside(&s.id)).into_iter().collect(),
        }
    }

    /// Time at which events occur, s.
    fn moment(&self) -> Option<String> {
        let first = self.named[0].dataset;
        let last = first.samples.iter().filter(|s| Use::Fit.takes(s)).filter_map(|s| s.time_s).reduce(f64::max)?;
        Some(format!("{:.0}", DURING * last))
    }

    /// The first of a family's members that shows nearly as much as any.
    fn shown<'g>(&'g self, family: &'static Family, members: Vec<String>) -> Result<Option<Chosen<'g, 'a>>, GalleryError> {
        let injected: Vec<(String, Vec<f64>)> =
            members.into_iter().map(|id| signs(family, self, &id).map(|signs| (id, signs))).collect::<Result<_, _>>()?;
        let held = self.campaign.model.effects.iter().any(|e| e == family.id);
        let visible = if held { vec![f64::INFINITY; injected.len()] } else { self.visible(&injected)? };
        let score = |k: usize| visible[k] * self.likely(family, &injected[k].0);
        let most = (0..injected.len()).map(score).fold(0.0, f64::max);
        let first = (0..injected.len()).find(|&k| score(k) >= NEARLY * most && visible[k] > LEAST);
        Ok(first.map(|k| {
            let (id, signs) = injected[k].clone();
            Chosen { family, id, ground: self, signs, visible: visible[k] }
        }))
    }

    /// Relative likelihood of a member, 1 for the most likely: an effect that follows a joint's torque belongs to a loaded
    /// joint, and one that couples two joints to neighbours.
    fn likely(&self, family: &Family, id: &str) -> f64 {
        let id = EffectId::new(id);
        let first = self.named[0].dataset;
        let torque = reference_torque(&first.robot);
        let loaded = match family.joint(&id) {
            Some(j) if family.follows.contains(&Follows::JointTorque) => {
                torque.get(j - 1).copied().unwrap_or(0.0) / torque.iter().copied().fold(f64::MIN_POSITIVE, f64::max)
            }
            _ => 1.0,
        };
        match (family.arguments, id.number(0), id.number(1)) {
            (":J:K", Some(a), Some(b)) if a.abs_diff(b) != 1 => UNLIKELY * loaded,
            _ => loaded,
        }
    }

    /// True if a diagnosis of this campaign would offer an effect, or if it is only ever requested.
    fn offers(&self, family: &Family, id: &str) -> bool {
        let balls_alone = || {
            let samples = self.named.iter().flat_map(|d| &d.dataset.samples);
            samples.filter(|s| Use::Fit.takes(s)).all(|s| matches!(s.measured, Measured::Ball { .. }))
        };
        let library = self.examination.library();
        match family.offered {
            Offered::BesideOtherTargets => !balls_alone(),
            Offered::Always | Offered::AsWholeToo | Offered::ByName => true,
            _ => library.place(id).is_some() || library.untestable.iter().any(|u| u.effect == id),
        }
    }

    /// Rms of what the fitted model does not absorb of each effect, whose parameters are in plausible sizes; in units of the
    /// noise.
    fn visible(&self, effects: &[(String, Vec<f64>)]) -> Result<Vec<f64>, GalleryError> {
        let in_si = |(id, sizes): &(String, Vec<f64>)| {
            let specs = self.subject.parameters_of(id)?;
            Ok((id.clone(), specs.iter().zip(sizes).map(|(spec, size)| spec.prior * size).collect()))
        };
        let effects: Vec<(String, Vec<f64>)> = effects.iter().map(in_si).collect::<Result<_, IdentifyError>>()?;
        Ok(self.examination.visible_rms(&self.named, &effects)?)
    }

    /// The reason why this campaign cannot show an effect.
    fn lacks(&self, id: &str) -> Option<&'static str> {
        let first = self.named[0].dataset;
        let balls = first.ball_ids();
        let effect = build(id, &self.campaign.model.subject(&first.robot, &balls)).ok()?;
        self.named.iter().find_map(|d| missing(effect.as_ref(), d.dataset, &self.campaign.model, Use::Fit))
    }
}

/// The member of a family that shows, in the first campaign that shows one at its plausible size, or else in that which shows
/// most of it; or what they lack.
fn choose<'g, 'a: 'g>(
    family: &'static Family,
    campaigns: usize,
    ground: &(dyn Fn(usize) -> Result<&'g Ground<'a>, GalleryError> + Sync),
) -> Result<Result<Chosen<'g, 'a>, String>, GalleryError> {
    let mut lack = "a robot or an artifact that has it".to_owned();
    let mut best: Option<Chosen<'_, '_>> = None;
    for k in 0..campaigns {
        let ground = ground(k)?;
        let members: Vec<String> = ground.members(family).into_iter().filter(|id| ground.offers(family, id)).collect();
        let (testable, lacking): (Vec<String>, Vec<String>) = members.into_iter().partition(|id| ground.lacks(id).is_none());
        if let Some(needs) = lacking.first().and_then(|id| ground.lacks(id)) {
            lack = needs.to_owned();
        } else if !testable.is_empty() {
            lack = "measurements that the fitted model does not absorb".to_owned();
        }
        let shown = ground.shown(family, testable)?;
        if let Some(chosen) = shown.filter(|c| c.visible > best.as_ref().map_or(LEAST, |b| BETTER * b.visible)) {
            best = Some(chosen);
        }
        if best.as_ref().is_some_and(|b| b.visible >= 1.0) {
            break;
        }
    }
    Ok(best.ok_or(lack))
}

/// The parameters of an effect, each one plausible size, with signs that physics allows; otherwise mixed, as equal ones would
/// cancel or be absorbed more than most.
fn signs(family: &Family, ground: &Ground<'_>, id: &str) -> Result<Vec<f64>, GalleryError> {
    let count = ground.subject.parameters_of(id)?.len();
    let sign = |k: usize| match family.physical {
        Physical::AtLeast(..) | Physical::AtLeastMinusPayload(_) => 1.0,
        Physical::AtMost(..) => -1.0,
        Physical::Any if k == 0 => 1.0,
        Physical::Any if fnv1a(&[k as u8]) & 8 == 0 => 1.0,
        Physical::Any => -1.0,
    };
    Ok((0..count).map(sign).collect())
}

impl Chosen<'_, '_> {
    fn entry(&self, seed: u64) -> Result<Entry, GalleryError> {
        let Chosen { family, id, ground, .. } = self;
        let held = !self.visible.is_finite();
        let times = self.times()?;
        let sizes: Vec<f64> = self.signs.iter().map(|s| s * times).collect();
        let mut random = Streams { seed, trial: fnv1a(id.as_bytes()) }.stream("gallery");
        let (truth, injected) = ground.subject.truth_of_size(id, &sizes)?;
        let measured = ground.subject.measured(&truth, &mut random)?;
        let data: Vec<NamedDataset<'_>> =
            ground.named.iter().zip(&measured).map(|(of, d)| NamedDataset::new(of.name, d)).collect();
        let model = if held { ground.campaign.model.without(id) } else { ground.campaign.model.clone() };
        let seen = see(&data, &model, id, times)?;
        let imitators = if held { Vec::new() } else { self.imitators(&injected)? };
        let beside = self.beside(&data, &model, &imitators, times);
        let first = ground.named[0].dataset;
        let balls = first.ball_ids();
        let effect = build(id, &ground.campaign.model.subject(&first.robot, &balls))?;
        Ok(Entry {
            family: family.id,
            effect: id.clone(),
            campaign: ground.campaign.words.clone(),
            sizes: injected.iter().map(shown).collect(),
            times,
            visible: self.visible,
            imitators,
            seen,
            beside,
            plausible: Plausible::of(effect.as_ref()),
            needs: effect.needs().to_vec(),
            baseline: held,
        })
    }

    /// The size at which the effect shows, in plausible sizes: one, or as many as it takes, rounded to a tenth.
    fn times(&self) -> Result<f64, GalleryError> {
        // One sample is one of many in an rms.
        let samples = self.ground.examination.problem().sample_count() as f64;
        let wanted = if Look::of(self.family) == Look::Samples { 3.0 * SHOWS / samples.sqrt() } else { SHOWS };
        let specs = self.ground.subject.parameters_of(&self.id)?;
        let mut times = (10.0 * wanted / self.visible).ceil().max(10.0) / 10.0;
        while times > 1.0 && !specs.iter().all(|spec| self.family.linear_range.holds(spec, times * spec.prior)) {
            times = (times * 0.8).max(1.0);
        }
        Ok(times)
    }

    /// The best imitator of every other family, best first.
    fn imitators(&self, injected: &[Estimate]) -> Result<Vec<Imitator>, GalleryError> {
        let Chosen { family, id, ground, .. } = self;
        let sizes: Vec<f64> = injected.iter().map(|e| e.value - e.nominal).collect();
        let steps = CATALOGUE.iter().filter(|f| f.scan == Scan::Time).flat_map(|f| ground.members(f));
        let more: Vec<String> = steps.filter(|id| ground.lacks(id).is_none()).collect();
        let mut best: Vec<Imitator> = Vec::new();
        for (effect, share) in ground.examination.imitators(&ground.named, id, &sizes, &more)? {
            let of = |e: &str| EffectId::new(e).family().to_owned();
            if of(&effect) != family.id && best.iter().all(|b| of(&b.effect) != of(&effect)) {
                best.push(Imitator { effect, share });
            }
        }
        Ok(best)
    }

    /// The effect with its best imitator in the model, if that leaves something to see.
    fn beside(&self, data: &[NamedDataset<'_>], model: &Model, imitators: &[Imitator], times: f64) -> Option<Seen> {
        let rival = imitators.first().filter(|i| BESIDE.contains(&i.share))?;
        let seen = see(data, &model.with(&rival.effect), &self.id, times).ok()?;
        seen.in_a_view.then_some(seen)
    }
}

/// A parameter, in the unit in which it is shown.
fn shown(e: &Estimate) -> (String, f64, String) {
    let unit = if e.unit == Unit::RATIO { String::new() } else { e.unit.printed().to_string() };
    (e.name.clone(), e.unit.from_si(e.value - e.nominal), unit)
}
