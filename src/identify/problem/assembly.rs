//! From datasets and a model to a problem: set-ups, named unknowns, and rows.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use nalgebra::Vector3;

use super::cell::{Cell, Placed};
use super::distance_row::DistanceRow;
use super::load_state::LoadState;
use super::missing::missing;
use super::order::inherited;
use super::prior_row::{PriorRow, hold_about_nominal};
use super::sample_row::SampleRow;
use super::start::{datum_freedoms, start};
use super::wanted::{StatedPrior, wanted};
use super::{Parameter, Prior, Problem, ProblemError, Setup, Use};
use crate::effects;
use crate::effects::facts::Follows;
use crate::effects::own::OwnEffect;
use crate::effects::{Effect, EffectId, Needs, Owner};
use crate::identify::{Model, TorquePosture};
use crate::measure::dataset::{Dataset, NamedDataset};
use crate::robot::Robot;
use crate::robot::sites::Site;

impl Problem {
    /// Lays out the samples of `datasets` (with a label each) selected by `which`, under `model`.
    ///
    /// # Errors
    /// When an effect is unknown or lacks its data, the robots differ, or no sample remains.
    pub fn new(datasets: &[NamedDataset<'_>], model: &Model, which: Use) -> Result<Self, ProblemError> {
        Assembly::new(datasets, model, which)?.problem()
    }
}

/// Everything in a problem except its rows.
pub(super) struct Assembly<'a> {
    datasets: &'a [NamedDataset<'a>],
    robot: Arc<Robot>,
    which: Use,
    model: &'a Model,
    torque_posture: TorquePosture,
    setups: Vec<Setup>,
    /// Set-up of (dataset, session).
    setup_of: HashMap<(usize, Option<&'a str>), usize>,
    /// Initial positions of the balls of each dataset.
    balls: Vec<Vec<Vector3<f64>>>,
    parameters: Vec<Parameter>,
    /// Effects of each dataset, with the first parameter of each for every owner: robot, or set-up, or dataset.
    effects: Vec<Vec<Placed>>,
}

impl<'a> Assembly<'a> {
    pub(super) fn new(datasets: &'a [NamedDataset<'a>], model: &'a Model, which: Use) -> Result<Self, ProblemError> {
        let NamedDataset { dataset: first, .. } = datasets.first().ok_or(ProblemError::NoSamples { of: "at all" })?;
        let robot = first.robot.clone();
        let other = datasets.iter().find(|d| !d.dataset.robot.is_same_arm(&robot));
        if let Some(NamedDataset { dataset: other, .. }) = other {
            return Err(ProblemError::DifferentRobots { first: robot.name.clone(), other: other.robot.name.clone() });
        }
        let mut assembly = Assembly {
            datasets,
            robot,
            which,
            model,
            torque_posture: model.torque_posture,
            setups: Vec::new(),
            setup_of: HashMap::new(),
            balls: Vec::new(),
            parameters: Vec::new(),
            effects: Vec::new(),
        };
        assembly.find_setups(model.lists(EffectId::BASE_FRAME))?;
        assembly.place_effects()?;
        Ok(assembly)
    }

    fn find_setups(&mut self, base_is_sought: bool) -> Result<(), ProblemError> {
        for (d, NamedDataset { name, dataset }) in self.datasets.iter().enumerate() {
            if self.datasets[..d].iter().any(|earlier| earlier.name == *name) {
                return Err(ProblemError::SameName { name: (*name).into() });
            }
            let mut sessions: Vec<Option<&str>> = Vec::new();
            for sample in dataset.samples.iter().filter(|s| self.which.takes(s)) {
                if !sessions.contains(&sample.session.as_deref()) {
                    sessions.push(sample.session.as_deref());
                }
            }
            let start = start(&self.robot, dataset, self.which, &sessions, base_is_sought);
            for (k, (session, (start, probe))) in sessions.iter().zip(start.bases.iter().zip(start.probes)).enumerate() {
                let (own, earlier) =
                    if dataset.shared.base { (&sessions[..], &[][..]) } else { (&sessions[k..=k], &sessions[..k]) };
                self.setup_of.insert((d, *session), self.setups.len());
                self.setups.push(Setup {
                    label: String::new(),
                    dataset: (*name).into(),
                    session: session.unwrap_or_default().into(),
                    base: dataset.base,
                    start: *start,
                    datum_freedoms: datum_freedoms(dataset, self.which, own, earlier, start),
                    tool: dataset.tool,
                    probe,
                    gravity: dataset.gravity,
                    duration_s: duration(dataset, *session),
                });
            }
            self.balls.push(start.balls);
        }
        if self.setups.len() > 1 {
            let sessions: HashSet<&str> = self.setups.iter().map(|s| s.session.as_str()).filter(|s| !s.is_empty()).collect();
            let distinct = sessions.len() == self.setups.len();
            for setup in &mut self.setups {
                setup.label = match (distinct, setup.session.is_empty()) {
                    (true, _) => setup.session.clone(),
                    (false, true) => setup.dataset.clone(),
                    (false, false) => format!("{}/{}", setup.dataset, setup.session),
                };
            }
        }
        Ok(())
    }

    /// Builds the effects of every dataset and appends their parameters.
    fn place_effects(&mut self) -> Result<(), ProblemError> {
        let (datasets, model, robot) = (self.datasets, self.model, self.robot.clone());
        let mut robot_owned: HashMap<EffectId, usize> = HashMap::new();
        for (d, NamedDataset { dataset, .. }) in datasets.iter().enumerate() {
            let balls = dataset.ball_ids();
            let subject = model.subject(&robot, &balls);
            let mut placed: Vec<Placed> = Vec::new();
            for (id, belief) in wanted(dataset, model, self.which) {
                if placed.iter().any(|p| id == *p.effect.id()) {
                    continue; // also in the model, which then holds the stated uncertainty in its prior
                }
                let effect = effects::build(&id, &subject)?;
                if let Some(needs) = missing(effect.as_ref(), dataset, model, self.which) {
                    return Err(ProblemError::Missing { effect: effect.id().into(), needs });
                }
                let first = match effect.owner() {
                    Owner::Robot => {
                        let new = || {
                            let first = add(&mut self.parameters, effect.as_ref(), "", belief);
                            size_as_in_fleet(&mut self.parameters[first..], model, belief);
                            first
                        };
                        vec![*robot_owned.entry(id).or_insert_with(new)]
                    }
                    Owner::Artifact => vec![self.place_on_artifact(d, effect.as_ref(), belief)],
                    Owner::Session => self.place_in_sessions(d, effect.as_ref(), belief),
                };
                placed.push(Placed { effect, first });
            }
            let NamedDataset { name, .. } = datasets[d];
            for change in &model.changes {
                let Some(effect) = change.built(name, &subject)? else { continue };
                let flat = StatedPrior::Flat;
                let first = match effect.owner() {
                    Owner::Robot => {
                        let new = || add(&mut self.parameters, effect.as_ref(), "", flat);
                        vec![*robot_owned.entry(effect.id().into()).or_insert_with(new)]
                    }
                    Owner::Artifact => vec![self.place_on_artifact(d, effect.as_ref(), flat)],
                    Owner::Session => self.place_in_sessions(d, effect.as_ref(), flat),
                };
                placed.push(Placed { effect, first });
            }
            self.effects.push(placed);
        }
        Ok(())
    }

    /// Appends the parameters of an effect of dataset `d`'s artifact; returns the index of the first.
    fn place_on_artifact(&mut self, d: usize, effect: &dyn Effect, belief: StatedPrior) -> usize {
        let NamedDataset { name: label, dataset } = self.datasets[d];
        let label = if self.datasets.len() > 1 { label } else { "" };
        let first = add(&mut self.parameters, effect, label, belief);
        let own = &mut self.parameters[first..];
        let home = self.setup_of.iter().filter(|(key, _)| key.0 == d).map(|(_, &setup)| setup).min();
        own.iter_mut().for_each(|p| p.setup = home);
        let ball = dataset.balls.iter().position(|b| EffectId::of_ball(&b.id) == *effect.id());
        if let Some(b) = ball {
            place(own, dataset.balls[b].position.as_slice(), self.balls[d][b].as_slice());
        }
        if let Some(r) = dataset.tool_targets.iter().find(|r| EffectId::of_target(&r.id) == *effect.id()) {
            place(own, r.position.as_slice(), r.position.as_slice());
        }
        first
    }

    /// Appends the parameters of an effect for each set-up of dataset `d`, or once if its sessions share them; returns the index
    /// of the first for each set-up of the problem, `usize::MAX` for those of other datasets.
    fn place_in_sessions(&mut self, d: usize, effect: &dyn Effect, belief: StatedPrior) -> Vec<usize> {
        let mine = |s: usize| self.setup_of.iter().any(|(key, &setup)| key.0 == d && setup == s);
        let own: Vec<usize> = (0..self.setups.len()).filter(|&s| mine(s)).collect();
        let NamedDataset { name, dataset } = self.datasets[d];
        let shared = own.len() > 1
            && match effect.id() {
                EffectId::BASE_FRAME => dataset.shared.base,
                EffectId::TOOL_FRAME | EffectId::PROBE_ROTATION => dataset.shared.tool,
                _ => false,
            };
        let mut first = vec![usize::MAX; self.setups.len()];
        for &s in &own {
            if shared && s != own[0] {
                first[s] = first[own[0]];
                continue;
            }
            let setup = &self.setups[s];
            let label = match shared {
                true if self.datasets.len() > 1 => name,
                true => "",
                false => &setup.label,
            };
            first[s] = add(&mut self.parameters, effect, label, belief);
            let parameters = &mut self.parameters[first[s]..];
            parameters.iter_mut().for_each(|p| (p.setup, p.shared) = (Some(s), shared));
            match effect.id() {
                EffectId::BASE_FRAME => {
                    place(parameters, &setup.base.to_array(), &setup.start.to_array());
                    setup.datum_freedoms.iter().for_each(|&axis| parameters[axis as usize].defines_world = true);
                }
                EffectId::TOOL_FRAME => place(parameters, &setup.tool.xyz, &setup.tool.xyz),
                EffectId::PROBE_ROTATION => place(parameters, &[0.0; 3], setup.probe.as_slice()),
                _ => {}
            }
        }
        first
    }

    /// Sets the duration of each session to that of the other's.
    pub(super) fn take_session_durations_of(&mut self, others: &[Setup]) {
        for (own, other) in self.setups.iter_mut().zip(others) {
            own.duration_s = other.duration_s;
        }
    }

    /// The problem of all samples.
    pub(super) fn problem(self) -> Result<Problem, ProblemError> {
        let Assembly { datasets, robot, which, model, torque_posture, setups, setup_of, balls, mut parameters, effects } = self;
        hold_about_nominal(&mut parameters, model);
        let priors = PriorRow::of(&mut parameters, model);
        let known = datasets.iter().zip(&balls).zip(&effects);
        let distances =
            known.flat_map(|((NamedDataset { dataset: d, .. }, balls), effects)| known_distances(d, balls, effects)).collect();
        let shared = datasets.iter().zip(balls).zip(effects);
        let cells =
            shared.map(|((NamedDataset { dataset: d, .. }, balls), effects)| Cell::of(d, balls, effects, model)).collect();
        let compliances = compliances(&parameters, robot.joints());
        let mut problem = Problem {
            robot,
            which,
            setups,
            parameters,
            cells,
            rows: Vec::new(),
            nominal: LoadState::default(),
            cached: None,
            distances,
            priors,
            field_numbers: model.field.as_ref().filter(|_| model.lists(EffectId::ERROR_FIELD)).map_or(0.0, |f| f.numbers),
            row_count: 0,
            torque_posture,
            compliances,
            acts_through_compliance: false,
            sample_ids: Vec::new(),
            room: None,
            most_steps: None,
            without_indices: false,
            unit_variance: 1.0,
        };
        for (d, NamedDataset { dataset, .. }) in datasets.iter().enumerate() {
            let of_catalogue = |e: &EffectId| model.family(e).is_some_and(|f| f.follows.contains(&Follows::LastMove));
            let moves_matter = model.effects.iter().any(of_catalogue) || model.own.iter().any(OwnEffect::follows_last_move);
            let mut inherited = if moves_matter { inherited(&dataset.samples) } else { Vec::new() }.into_iter();
            for (sample, inherited) in dataset.samples.iter().map(|s| (s, inherited.next())).filter(|(s, _)| which.takes(s)) {
                let setup = setup_of[&(d, sample.session.as_deref())];
                let mut row = SampleRow::new(&problem.cells, d, setup, problem.row_count, sample);
                row.inherited = inherited;
                problem.row_count += row.height();
                problem.rows.push(row);
                problem.sample_ids.push(sample.id.clone());
            }
        }
        if problem.rows.is_empty() {
            let of = match which {
                Use::Fit => "of set 'fit'",
                Use::Validation => "of set 'validation'",
                Use::All => "at all",
            };
            return Err(ProblemError::NoSamples { of });
        }
        problem.row_count += problem.distances.len() + problem.priors.len();
        let through = |placed: &Placed| placed.effect.needs().contains(&Needs::Compliance);
        problem.acts_through_compliance = problem.cells.iter().any(|cell| cell.effects.iter().any(through));
        problem.load_nominal()?;
        problem.check_values()?;
        for moves in problem.nominal.patterns.iter().flatten() {
            if let Site::Mdh(i, _) = moves.site {
                problem.parameters[moves.parameter].link = Some(i.into());
            }
        }
        Ok(problem)
    }
}

/// The known distances of a dataset that involve an unknown ball; `balls` are the initial positions.
fn known_distances(dataset: &Dataset, balls: &[Vector3<f64>], effects: &[Placed]) -> Vec<DistanceRow> {
    let rows = dataset.ball_distances.iter().filter_map(|known| {
        let ids = known.between.map(|b| EffectId::of_ball(&dataset.balls[b].id));
        let parameters = ids.map(|id| effects.iter().find(|p| id == *p.effect.id()).map(|p| p.first[0]));
        // A free ball probed by none of these samples has no position to measure from.
        let has_position = |k: usize| parameters[k].is_some() || !dataset.balls[known.between[k]].free;
        let says_something = parameters.iter().any(Option::is_some) && has_position(0) && has_position(1);
        says_something.then(|| DistanceRow {
            balls: known.between.map(|b| balls[b]),
            parameters,
            distance: known.distance,
            weight: 1.0 / known.sigma,
        })
    });
    rows.collect()
}

/// Appends the parameters of an effect; returns the index of the first.
fn add(all: &mut Vec<Parameter>, effect: &dyn Effect, label: &str, belief: StatedPrior) -> usize {
    let first = all.len();
    all.extend(effect.parameters().iter().map(|spec| Parameter {
        name: if label.is_empty() { spec.name.clone() } else { format!("{}@{label}", spec.name) },
        spec: spec.clone(),
        effect: effect.id().into(),
        knowledge: belief.of(spec),
        start: spec.nominal,
        owner: effect.owner(),
        setup: None,
        shared: false,
        link: None,
        through: effect.needs().contains(&Needs::Compliance),
        defines_world: false,
    }));
    first
}

/// Sets the nominal values and starts of a set-up's parameters.
fn place(parameters: &mut [Parameter], nominal: &[f64], start: &[f64]) {
    for (p, (&nominal, &start)) in parameters.iter_mut().zip(nominal.iter().zip(start)) {
        p.spec.nominal = nominal;
        p.start = start;
    }
}

/// Duration of a session, s: the longest time of any of its samples, whatever their use.
fn duration(dataset: &Dataset, session: Option<&str>) -> Option<f64> {
    let times = dataset.samples.iter().filter(|s| s.session.as_deref() == session).filter_map(|s| s.time_s);
    times.reduce(f64::max)
}

/// Joint and index of every joint compliance among the parameters.
fn compliances(parameters: &[Parameter], joints: usize) -> Vec<(usize, usize)> {
    let joint = |p: &Parameter| {
        let of_compliance = p.effect.family() == EffectId::JOINT_COMPLIANCE;
        (0..joints).find(|j| of_compliance && p.spec.name == format!("c{}", j + 1))
    };
    parameters.iter().enumerate().filter_map(|(k, p)| Some((joint(p)?, k))).collect()
}

/// Gives parameters of effects that not every model holds the size that they have in robots of the same type.
fn size_as_in_fleet(parameters: &mut [Parameter], model: &Model, belief: StatedPrior) {
    let Some(prior) = &model.fleet else { return };
    for p in parameters.iter_mut().filter(|p| !model.is_unregularised(&p.effect)) {
        if let Some(size) = prior.size(&p.spec.name) {
            p.spec.prior = size;
            // What is known as well as that needs no allowance.
            let known = !model.width.contains_key(p.effect.whole()) && p.knowledge != Prior::Uninformative;
            p.knowledge = if known { Prior::Plausible(size) } else { belief.of(&p.spec) };
        }
    }
}
