//! The candidates: every effect of the catalogue and of the user that is not in the fitted model and that the data can
//! test.

use std::ops::Range;

use nalgebra::DMatrix;

use crate::effects;
use crate::effects::facts::{Offered, Role};
use crate::effects::family::{Family, Scan};
use crate::effects::{Effect, EffectId};
use crate::identify::Model;
use crate::identify::problem::{Use, missing};
use crate::measure::dataset::{Dataset, Measured, NamedDataset, Sample};
use crate::robot::Robot;

/// An effect of fixed shape that may be missing.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// Its id.
    pub id: EffectId,
}

impl Candidate {
    /// The candidate with this id.
    pub fn new(id: impl Into<EffectId>) -> Self {
        Candidate { id: id.into() }
    }
}

/// An effect that these data cannot test.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Untestable {
    /// Its id.
    pub effect: EffectId,
    /// The data that are missing.
    pub needs: &'static str,
}

/// Effects that a model of these data may be missing.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Library {
    /// Testable effects, in the order of the catalogue.
    pub candidates: Vec<Candidate>,
    /// Effects that cannot be tested, with the reason.
    pub untestable: Vec<Untestable>,
    /// Names of the balls, if all datasets have the same artifact; otherwise empty.
    pub balls: Vec<String>,
    /// True if anything other than balls is measured.
    pub other_targets: bool,
}

/// The whitened residuals of a fit beside the columns of its parameters and of every candidate.
#[derive(Debug, Clone)]
pub struct WhitenedRows<'a> {
    /// One row for each fitted parameter (per SI unit), then for each column of a candidate (per plausible size), then the
    /// residuals; one column for each scalar residual.
    pub rows: &'a DMatrix<f64>,
    /// Number of fitted parameters.
    pub fitted: usize,
    /// Information of the prior of each, in the unit of the rows; zero without one.
    pub information: Vec<f64>,
    /// Value of each as deviation from nominal, SI.
    pub values: Vec<f64>,
    /// The candidates' columns, by their rows in `rows`.
    pub candidates: Vec<CandidateRows<'a>>,
}

/// Columns of a candidate.
#[derive(Debug, Clone)]
pub struct CandidateRows<'a> {
    /// Its id.
    pub id: &'a EffectId,
    /// Its rows in [`WhitenedRows::rows`].
    pub rows: Range<usize>,
}

impl Library {
    /// Lists the candidates for one robot measured in `datasets`, except those that `model` contains.
    pub fn new(datasets: &[NamedDataset<'_>], model: &Model) -> Self {
        let mut library = Library::default();
        let Some(first) = datasets.first().map(|d| d.dataset) else { return library };
        let balls = first.ball_ids();
        library.balls = if datasets.iter().all(|d| d.dataset.ball_ids() == balls) { balls.clone() } else { Vec::new() };
        library.other_targets = fitted(datasets).any(|s| !matches!(s.measured, Measured::Ball { .. }));
        let subject = model.subject(&first.robot, &balls);
        let not_in = |f: &&Family| !model.effects.iter().any(|e| e.family() == f.id);
        let as_wholes = model.registry.families().filter(|f| f.offered == Offered::AsWholeToo).filter(not_in);
        let wholes: Vec<String> = as_wholes.map(|f| f.id.to_owned()).collect();
        for id in wholes.iter().cloned().chain(effects::registry::ids(&subject)).chain(gear_ripple(&first.robot)) {
            let Some(candidate) = candidate(id, model) else { continue };
            let Ok(effect) = effects::build(&candidate.id, &subject) else { continue };
            if !is_offered(&candidate.id, model, datasets) {
                continue;
            }
            match missing_somewhere(effect.as_ref(), datasets, model) {
                // The missing data are reported for the members instead.
                Some(_) if wholes.iter().any(|whole| candidate.id == *whole) && !model.is_unregularised(&candidate.id) => {}
                Some(needs) => library.untestable.push(Untestable { effect: candidate.id, needs }),
                None => library.candidates.push(candidate),
            }
        }
        library
    }

    /// Lists every candidate for a robot, whatever is measured: the effects that it may have.
    pub fn of_robot(cell: &Dataset, model: &Model) -> Self {
        let balls = cell.ball_ids();
        let subject = model.subject(&cell.robot, &balls);
        let ids = effects::registry::ids(&subject)
            .into_iter()
            .chain(gear_ripple(&cell.robot))
            .filter(|id| is_offered(id, model, &[NamedDataset::new("", cell)]));
        let ids = ids.filter_map(|id| candidate(id, model));
        Library { candidates: ids.collect(), balls: balls.clone(), ..Library::default() }
    }

    /// Index of the candidate with this id.
    pub fn place(&self, id: &str) -> Option<usize> {
        self.candidates.iter().position(|c| c.id == id)
    }
}

/// Testable effects whose order or moment is found by a scan: those with an order at `order` (periods per turn), those
/// with a moment at `moment` (s since the session began), if given.
pub(crate) fn scanned_at(datasets: &[NamedDataset<'_>], model: &Model, order: &str, moment: Option<&str>) -> Vec<Candidate> {
    let Some(first) = datasets.first().map(|d| d.dataset) else { return Vec::new() };
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
fn fitted<'d>(datasets: &'d [NamedDataset<'d>]) -> impl Iterator<Item = &'d Sample> {
    datasets.iter().flat_map(|d| d.dataset.samples.iter().filter(|s| Use::Fit.takes(s)))
}

/// True if a diagnosis of these data considers an effect unprompted.
fn is_offered(id: &str, model: &Model, datasets: &[NamedDataset<'_>]) -> bool {
    match model.family(id).map_or(Offered::Always, |f| f.offered) {
        Offered::Always | Offered::AsWholeToo => true,
        Offered::BesideOtherTargets => fitted(datasets).any(|s| !matches!(s.measured, Measured::Ball { .. })),
        Offered::WithoutPayload => datasets.iter().all(|d| d.dataset.payloads.iter().all(|p| p.mass == 0.0)),
        Offered::WithoutMasses => datasets.iter().all(|d| !d.dataset.robot.lists_masses()),
        Offered::ToLogs => {
            fitted(datasets).next().is_some()
                && fitted(datasets).all(|s| s.time_s.is_some() || s.approach.is_some() || s.q_commanded.is_some())
        }
        // Of a free tool, they are free in any case.
        Offered::ToOrientations => datasets.iter().any(|d| {
            let oriented = |s: &Sample| Use::Fit.takes(s) && s.orientation.is_some();
            !d.dataset.tool_free && d.dataset.weighs_orientations() && d.dataset.samples.iter().any(oriented)
        }),
        Offered::InOrder => fitted(datasets).next().is_some(),
        Offered::OnKnownBalls => {
            // Of a cell that nothing was measured in, all.
            fitted(datasets).next().is_none() || datasets.iter().any(|d| probes_known(d.dataset, &EffectId::new(id)))
        }
        Offered::ByName => false,
    }
}

/// True if a fitted sample probes the ball that this effect is about, at a place known beforehand.
fn probes_known(dataset: &Dataset, effect: &EffectId) -> bool {
    let known = |ball: usize| !dataset.balls[ball].free && effect.ball_name() == Some(dataset.balls[ball].id.as_str());
    let on = |s: &Sample| Use::Fit.takes(s) && matches!(s.measured, Measured::Ball { ball, .. } if known(ball));
    dataset.samples.iter().any(on)
}

/// Ripple of gears with a known ratio, once and twice per turn of the wave generator: with the order known, no scan is
/// needed.
fn gear_ripple(robot: &Robot) -> Vec<String> {
    let of_joint =
        |(j, ratio): (usize, &f64)| [1.0, 2.0].map(|k| format!("{}:{}:{}", EffectId::HARMONIC, j + 1, (k * ratio).round()));
    robot.gear_ratios.iter().enumerate().flat_map(of_joint).collect()
}

/// An effect as a candidate; `None` if it cannot be a hypothesis, or if the model contains it.
fn candidate(id: String, model: &Model) -> Option<Candidate> {
    // Curves of any shape belong to the heat map of the joints and do not compete with named effects.
    let any_shape = model.family(&id).is_some_and(|f| f.role == Role::AnyShape);
    (!any_shape && !model.holds(&id)).then(|| Candidate::new(id))
}

/// The data that an effect lacks in any of the datasets.
pub(crate) fn missing_somewhere(effect: &dyn Effect, datasets: &[NamedDataset<'_>], model: &Model) -> Option<&'static str> {
    datasets.iter().find_map(|d| missing(effect, d.dataset, model, Use::Fit))
}
