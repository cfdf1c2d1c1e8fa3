//! From datasets and a model to a problem: set-ups, unknowns, and the samples one after the other.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use nalgebra::Vector3;

use super::problem::WeighingRoom;
use super::sample_row::{Cell, DistanceRow, Placed, SampleRow};
use super::{Knowledge, Model, Parameter, Problem, ProblemError, Setup, TorquePosture, Use};
use crate::effects::{self, Effect, Needs, Owner, Subject};
use crate::measure::{Dataset, Measured, Sample};
use crate::robot::{FramePose, Robot, Site};
use crate::units::MM;

/// Everything of a problem but its rows.
pub(super) struct Assembly<'a> {
    datasets: &'a [(&'a str, &'a Dataset)],
    robot: Arc<Robot>,
    which: Use,
    measured_torques: bool,
    torque_posture: TorquePosture,
    setups: Vec<Setup>,
    /// Set-up of (dataset, session).
    setup_of: HashMap<(usize, Option<&'a str>), usize>,
    parameters: Vec<Parameter>,
    /// Effects of each dataset, with the first parameter of each for every owner: robot, or set-up, or dataset.
    effects: Vec<Vec<Placed>>,
}

impl<'a> Assembly<'a> {
    pub fn new(datasets: &'a [(&'a str, &'a Dataset)], model: &Model, which: Use) -> Result<Self, ProblemError> {
        let (_, first) = datasets.first().ok_or(ProblemError::NoSamples { of: "at all" })?;
        let robot = first.robot.clone();
        let other = datasets.iter().find(|(_, d)| d.robot.links != robot.links);
        if let Some((_, other)) = other {
            return Err(ProblemError::DifferentRobots { first: robot.name.clone(), other: other.robot.name.clone() });
        }
        let mut assembly = Assembly {
            datasets,
            robot,
            which,
            measured_torques: model.measured_torques,
            torque_posture: model.torque_posture,
            setups: Vec::new(),
            setup_of: HashMap::new(),
            parameters: Vec::new(),
            effects: Vec::new(),
        };
        assembly.find_setups();
        assembly.place_effects(model)?;
        Ok(assembly)
    }

    fn find_setups(&mut self) {
        for (d, (name, dataset)) in self.datasets.iter().enumerate() {
            for sample in dataset.samples.iter().filter(|s| self.which.takes(s)) {
                let key = (d, sample.session.as_deref());
                if self.setup_of.contains_key(&key) {
                    continue;
                }
                self.setup_of.insert(key, self.setups.len());
                self.setups.push(Setup {
                    label: String::new(),
                    dataset: (*name).into(),
                    session: sample.session.clone().unwrap_or_default(),
                    base: dataset.base,
                    start: starting_base(&self.robot, dataset, sample.session.as_deref()),
                    tool: dataset.tool,
                    gravity: dataset.gravity,
                });
            }
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
    }

    /// Effects of the model, and those that the datasets themselves ask for (free or uncertain balls and tools).
    fn place_effects(&mut self, model: &Model) -> Result<(), ProblemError> {
        let mut robot_owned: HashMap<String, usize> = HashMap::new();
        for (d, (label, dataset)) in self.datasets.iter().enumerate() {
            let balls = dataset.ball_ids();
            let subject = Subject { robot: &self.robot, balls: &balls };
            let mut wanted: Vec<(String, Knowledge)> = Vec::new();
            let probed = |b: usize| {
                let on = |s: &&Sample| matches!(s.measured, Measured::Ball { ball, .. } if ball == b);
                dataset.samples.iter().filter(|s| self.which.takes(s)).any(|s| on(&s))
            };
            // Free balls first: where no ball is known, it is the base that cannot be told.
            for (b, ball) in dataset.balls.iter().enumerate() {
                if ball.free && probed(b) {
                    wanted.push((format!("ball:{}", ball.id), Knowledge::Flat));
                }
            }
            wanted.extend(model.effects.iter().map(|e| (e.clone(), Knowledge::Flat)));
            if dataset.tool_free {
                wanted.push(("tool_frame".into(), Knowledge::Flat));
            } else if dataset.tool_sigma > 0.0 {
                wanted.push(("tool_frame".into(), Knowledge::Stated(dataset.tool_sigma)));
            }
            for (b, ball) in dataset.balls.iter().enumerate() {
                if !ball.free && ball.sigma > 0.0 && probed(b) {
                    wanted.push((format!("ball:{}", ball.id), Knowledge::Stated(ball.sigma)));
                }
            }
            let mut placed: Vec<Placed> = Vec::new();
            for (id, knowledge) in wanted {
                if placed.iter().any(|p| p.effect.id() == id) {
                    continue; // named by the model as well: the model's word counts
                }
                let effect = effects::build(&id, &subject)?;
                check_needs(effect.as_ref(), &self.robot, dataset, self.measured_torques)?;
                let all = &mut self.parameters;
                let first = match effect.owner() {
                    Owner::Robot => vec![*robot_owned.entry(id).or_insert_with(|| add(all, effect.as_ref(), "", knowledge))],
                    Owner::Artifact => {
                        let first = add(all, effect.as_ref(), if self.datasets.len() > 1 { label } else { "" }, knowledge);
                        let ball = dataset.balls.iter().find(|b| effect.id() == format!("ball:{}", b.id));
                        if let Some(ball) = ball {
                            place(&mut all[first..], ball.position.as_slice(), ball.position.as_slice());
                        }
                        vec![first]
                    }
                    Owner::Session => {
                        let mine = |s: usize| self.setup_of.iter().any(|(key, &setup)| key.0 == d && setup == s);
                        let mut first = vec![usize::MAX; self.setups.len()];
                        for s in (0..self.setups.len()).filter(|&s| mine(s)) {
                            let setup = &self.setups[s];
                            first[s] = add(all, effect.as_ref(), &setup.label, knowledge);
                            all[first[s]..].iter_mut().for_each(|p| p.setup = Some(s));
                            match effect.id() {
                                "base_frame" => place(&mut all[first[s]..], &setup.base.to_array(), &setup.start.to_array()),
                                "tool_frame" => place(&mut all[first[s]..], &setup.tool.xyz, &setup.tool.xyz),
                                _ => {}
                            }
                        }
                        first
                    }
                };
                placed.push(Placed { effect, first });
            }
            self.effects.push(placed);
        }
        Ok(())
    }

    /// The problem of all samples.
    pub fn problem(self) -> Result<Problem, ProblemError> {
        let Assembly { datasets, robot, which, measured_torques, torque_posture, setups, setup_of, parameters, effects } = self;
        let distances = datasets.iter().zip(&effects).flat_map(|((_, d), effects)| known_distances(d, effects)).collect();
        let cells = datasets.iter().zip(effects).map(|((_, d), effects)| Cell::of(d, effects, measured_torques)).collect();
        let scale = WeighingRoom::new(&robot);
        let mut problem = Problem {
            robot,
            which,
            setups,
            parameters,
            cells,
            rows: Vec::new(),
            patterns: Vec::new(),
            distances,
            row_count: 0,
            torque_posture,
            sample_ids: Vec::new(),
            scale,
        };
        for (d, (_, dataset)) in datasets.iter().enumerate() {
            for sample in dataset.samples.iter().filter(|s| which.takes(s)) {
                let setup = setup_of[&(d, sample.session.as_deref())];
                let row = SampleRow::new(&problem.cells, d, setup, problem.row_count, sample);
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
        problem.row_count += problem.distances.len();
        problem.weigh(None);
        for moves in problem.patterns.iter().flatten() {
            if let Site::Mdh(i, _) = moves.site {
                problem.parameters[moves.parameter].link = Some(i);
            }
        }
        Ok(problem)
    }
}

/// The known distances of a dataset that say something of an unknown ball.
fn known_distances(dataset: &Dataset, effects: &[Placed]) -> Vec<DistanceRow> {
    let rows = dataset.ball_distances.iter().filter_map(|known| {
        let ids = known.between.map(|b| format!("ball:{}", dataset.balls[b].id));
        let parameters = ids.map(|id| effects.iter().find(|p| p.effect.id() == id).map(|p| p.first[0]));
        // A free ball that none of these samples probes has no position to measure from.
        let has_position = |k: usize| parameters[k].is_some() || !dataset.balls[known.between[k]].free;
        let says_something = parameters.iter().any(Option::is_some) && has_position(0) && has_position(1);
        says_something.then(|| DistanceRow {
            balls: known.between.map(|b| dataset.balls[b].position),
            parameters,
            distance: known.distance,
            weight: 1.0 / known.sigma,
        })
    });
    rows.collect()
}

/// Appends the parameters of an effect; returns the place of the first.
fn add(all: &mut Vec<Parameter>, effect: &dyn Effect, label: &str, knowledge: Knowledge) -> usize {
    let first = all.len();
    all.extend(effect.parameters().iter().map(|spec| Parameter {
        name: if label.is_empty() { spec.name.clone() } else { format!("{}@{label}", spec.name) },
        spec: spec.clone(),
        effect: effect.id().into(),
        knowledge,
        start: spec.nominal,
        owner: effect.owner(),
        setup: None,
        link: None,
    }));
    first
}

/// Gives parameters of a set-up their drawing values and starts.
fn place(parameters: &mut [Parameter], nominal: &[f64], start: &[f64]) {
    for (p, (&nominal, &start)) in parameters.iter_mut().zip(nominal.iter().zip(start)) {
        p.spec.nominal = nominal;
        p.start = start;
    }
}

fn check_needs(effect: &dyn Effect, robot: &Robot, dataset: &Dataset, measured_torques: bool) -> Result<(), ProblemError> {
    let samples = &dataset.samples;
    for need in effect.needs() {
        let missing = match need {
            Needs::Masses if measured_torques => {
                samples.iter().any(|s| s.tau.is_none()).then_some("columns tau1_nm ... tauN_nm")
            }
            Needs::Masses => (!robot.has_masses()).then_some("link masses in the robot's description"),
            Needs::Approach => samples.iter().any(|s| s.approach.is_none()).then_some("columns approach1 ... approachN"),
            Needs::Time => samples.iter().any(|s| s.time_s.is_none()).then_some("column time_s"),
            Needs::Temperature => samples.iter().any(|s| s.temp_c.is_none()).then_some("column temp_c"),
            Needs::Balls => {
                samples.iter().all(|s| !matches!(s.measured, Measured::Ball { .. })).then_some("samples of kind 'ball'")
            }
        };
        if let Some(needs) = missing {
            return Err(ProblemError::Missing { effect: effect.id().into(), needs });
        }
    }
    Ok(())
}

/// A nominal base further than this from what the points say (rms) is replaced by a closed-form start.
const NOMINAL_BASE_IS_CLOSE: f64 = 20.0 * MM;

/// The base from which Gauss-Newton starts: the nominal one, or, where tracker points contradict it by centimetres, the rigid
/// motion that carries the nominal TCPs onto the points (Kabsch 1976).
fn starting_base(robot: &Robot, dataset: &Dataset, session: Option<&str>) -> FramePose {
    let pairs: Vec<(Vector3<f64>, Vector3<f64>)> = dataset
        .samples
        .iter()
        .filter(|s| s.session.as_deref() == session)
        .filter_map(|s| match s.measured {
            Measured::Point(point) => {
                let pose = crate::robot::world_from_tool(robot, &FramePose::default(), &dataset.tool, &s.q);
                Some((pose.translation.vector, point))
            }
            _ => None,
        })
        .collect();
    let base = dataset.base.pose();
    let mean_square = pairs
        .iter()
        .map(|(tcp, p)| (base * nalgebra::Point3::from(*tcp) - nalgebra::Point3::from(*p)).norm_squared())
        .sum::<f64>()
        / pairs.len().max(1) as f64;
    if pairs.len() < 3 || mean_square.sqrt() < NOMINAL_BASE_IS_CLOSE {
        return dataset.base;
    }
    crate::robot::rigid_fit(&pairs).map_or(dataset.base, |pose| FramePose::from_pose(&pose))
}
