//! The candidates: every effect of the catalogue, and of the user, that the fitted model does not hold and the data can test.

use crate::effects::{self, Effect, EffectId, Family, Offered, Role, Scan};
use crate::identify::{Model, Use, missing};
use crate::measure::{Dataset, Measured, Sample};
use crate::robot::Robot;

/// An effect of fixed shape that may be missing.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// Its id.
    pub id: String,
    /// Its family, the id up to the first colon.
    pub family: String,
}

impl Candidate {
    /// Of that id.
    pub fn new(id: String) -> Self {
        Candidate { family: EffectId::new(&id).family().to_owned(), id }
    }
}

/// An effect that these data cannot test.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Untestable {
    /// Its id.
    pub effect: String,
    /// What is missing.
    pub needs: &'static str,
}

/// What may be missing in a model of these data.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Library {
    /// Effects that can be tested, in the order of the catalogue.
    pub candidates: Vec<Candidate>,
    /// Effects that cannot, and why.
    pub untestable: Vec<Untestable>,
    /// Names of the balls, where all datasets have the same artifact.
    pub balls: Vec<String>,
    /// Whether something else than balls is measured as well.
    pub other_targets: bool,
}

impl Library {
    /// The candidates for one robot measured in `datasets`, beside those that `model` holds.
    pub fn new(datasets: &[(&str, &Dataset)], model: &Model) -> Self {
        let mut library = Library::default();
        let Some((_, first)) = datasets.first() else { return library };
        let balls = first.ball_ids();
        library.balls = if datasets.iter().all(|(_, d)| d.ball_ids() == balls) { balls.clone() } else { Vec::new() };
        library.other_targets = fitted(datasets).any(|s| !matches!(s.measured, Measured::Ball { .. }));
        let subject = model.subject(&first.robot, &balls);
        let not_in = |f: &&Family| !model.effects.iter().any(|e| EffectId::new(e).family() == f.id);
        let as_wholes = model.registry.families().filter(|f| f.offered == Offered::AsWholeToo).filter(not_in);
        let wholes: Vec<String> = as_wholes.map(|f| f.id.to_owned()).collect();
        for id in wholes.iter().cloned().chain(effects::ids(&subject)).chain(gear_ripple(&first.robot)) {
            let Some(candidate) = candidate(id, model) else { continue };
            let Ok(effect) = effects::build(&candidate.id, &subject) else { continue };
            if !is_offered(&candidate.id, model, datasets) {
                continue;
            }
            match missing_somewhere(effect.as_ref(), datasets, model) {
                // What its members lack is said of them.
                Some(_) if wholes.contains(&candidate.id) && !model.is_unregularised(&candidate.id) => {}
                Some(needs) => library.untestable.push(Untestable { effect: candidate.id, needs }),
                None => library.candidates.push(candidate),
            }
        }
        library
    }

    /// Every candidate for a robot that measures everything: what may be hidden in it.
    pub fn of_robot(cell: &Dataset, model: &Model) -> Self {
        let balls = cell.ball_ids();
        let subject = model.subject(&cell.robot, &balls);
        let ids = effects::ids(&subject)
            .into_iter()
            .chain(gear_ripple(&cell.robot))
            .filter(|id| is_offered(id, model, &[("", cell)]));
        let ids = ids.filter_map(|id| candidate(id, model));
        Library { candidates: ids.collect(), balls: balls.clone(), ..Library::default() }
    }

    /// The candidate of that id.
    pub fn place(&self, id: &str) -> Option<usize> {
        self.candidates.iter().position(|c| c.id == id)
    }
}

/// The effects whose order or moment is to be found, which these data can test: each at this order (periods per turn), or at this moment
/// (s since the session began), where there is one.
pub(super) fn scanned_at(datasets: &[(&str, &Dataset)], model: &Model, order: &str, moment: Option<&str>) -> Vec<Candidate> {
    let Some((_, first)) = datasets.first() else { return Vec::new() };
    let balls = first.ball_ids();
    let subject = model.subject(&first.robot, &balls);
    let of_family = |family: &'static Family| match (family.scan, moment) {
        (Scan::Order, _) => family.scanned(&subject, order),
        (Scan::Time, Some(moment)) => family.scanned(&subject, moment),
        _ => Vec::new(),
    };
    let can_be_tested = |c: &Candidate| {
        let effect = effects::build(&c.id, &subject);
        is_offered(&c.id, model, datasets) && effect.is_ok_and(|e| missing_somewhere(e.as_ref(), datasets, model).is_none())
    };
    let ids = model.registry.families().flat_map(of_family);
    ids.filter_map(|id| candidate(id, model)).filter(can_be_tested).collect()
}

/// The samples that are fitted.
fn fitted<'d>(datasets: &'d [(&'d str, &'d Dataset)]) -> impl Iterator<Item = &'d Sample> {
    datasets.iter().flat_map(|(_, d)| d.samples.iter().filter(|s| Use::Fit.takes(s)))
}

/// Whether a diagnosis of these data is to think of an effect by itself.
fn is_offered(id: &str, model: &Model, datasets: &[(&str, &Dataset)]) -> bool {
    match model.family(id).map_or(Offered::Always, |f| f.offered) {
        Offered::Always | Offered::AsWholeToo => true,
        Offered::BesideOtherTargets => fitted(datasets).any(|s| !matches!(s.measured, Measured::Ball { .. })),
        Offered::WithoutPayload => datasets.iter().all(|(_, d)| d.payloads.iter().all(|p| p.mass == 0.0)),
        Offered::WithoutMasses => datasets.iter().all(|(_, d)| !d.robot.has_masses()),
        Offered::ToLogs => {
            fitted(datasets).next().is_some()
                && fitted(datasets).all(|s| s.time_s.is_some() || s.approach.is_some() || s.q_commanded.is_some())
        }
        Offered::ByName => false,
    }
}

/// Ripple of gears of known ratio, once and twice per turn of the wave generator: where it is to be expected, it needs no scan.
fn gear_ripple(robot: &Robot) -> Vec<String> {
    let of_joint = |(j, ratio): (usize, &f64)| [1.0, 2.0].map(|k| format!("harmonic:{}:{}", j + 1, (k * ratio).round()));
    robot.gear_ratios.iter().enumerate().flat_map(of_joint).collect()
}

/// An effect as a candidate beside a model; `None` when it is no hypothesis, or the model holds it.
fn candidate(id: String, model: &Model) -> Option<Candidate> {
    // A shape that draws any curve is what a joint's heat map leads to, and no rival of a named effect.
    let any_shape = model.family(&id).is_some_and(|f| f.role == Role::AnyShape);
    (!any_shape && !model.holds(&id)).then(|| Candidate::new(id))
}

/// What an effect lacks in any of the datasets.
pub(super) fn missing_somewhere(effect: &dyn Effect, datasets: &[(&str, &Dataset)], model: &Model) -> Option<&'static str> {
    datasets.iter().find_map(|(_, d)| missing(effect, d, model, Use::Fit))
}
