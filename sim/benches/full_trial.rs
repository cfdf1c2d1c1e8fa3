//! W4 with the full geometry: plungers that meet balls with disk and rim, an approach to each ball, and the arm in equilibrium
//! with gravity and the gauge's springs wherever it is measured.
#![allow(clippy::unwrap_used, missing_docs)]

#[path = "../../benches/works/mod.rs"]
mod works;

use std::hint::black_box;
use std::sync::Arc;

use calibench::effects::{EffectId, Subject, build};
use calibench::identify::problem::{Problem, Use};
use calibench::identify::{Adjustment, Model};
use calibench::measure::dataset::{Dataset, Measured, NamedDataset, Sample};
use calibench::robot::rel_tool::RelTool;
use calibench::units::{MM, UM};
use calibench_sim::contact::{DATUM_RADIUS, MASTER_READING};
use calibench_sim::flaw::{Flaw, Flaws, TrueEffect};
use calibench_sim::gauge::Gauge;
use calibench_sim::mechanics::{BallForm, Parts, Plant, Stand};
use calibench_sim::plant::AnalyticPlant;
use calibench_sim::plunger::{PlungerSpec, PresentedBall};
use calibench_sim::random::{Streams, normal};
use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::Vector3;
use works::golden::{self, GoldenModel};

/// One-sigma of each joint after each motion, rad, as in W4.
const JOINT_NOISE: f64 = 1e-6;
/// One-sigma of each reading, m, as in W4.
const READING_NOISE: f64 = 0.6 * UM;
/// Limit of every reading at which a ball is centred, m, as in W4.
const CENTRED: f64 = 3.0 * UM;
/// Number of readings after which a centring is given up, as in W4.
const MOST_READINGS: usize = 12;
/// Start of an approach, m along each axis of the tool: the plungers are still free there.
const STAND_OFF: f64 = 8.0 * MM;
/// The mean error of W4 is 1.09 um; the model includes the effect of the gauge's springs, and the equilibrium tolerance is
/// far smaller.
const MOST_MEAN_ERROR: f64 = 1.5 * UM;

/// A gauge with the springs of the paper's indicators and no flaw but noise.
fn gauge(streams: &Streams) -> Gauge {
    let spec = PlungerSpec { preload: 0.65, full_force: 0.90, noise: [READING_NOISE; 2], ..PlungerSpec::ideal() };
    Gauge::draw(&spec, streams)
}

/// The procedure, with its preallocated buffers.
struct FullTrial<'a> {
    model: &'a GoldenModel,
    starts: Vec<Vec<f64>>,
    dataset: Dataset,
    validation: Dataset,
    parts: Parts,
    problem: Problem,
    predicted: Problem,
    adjustment: Adjustment,
    start: Vec<f64>,
    rel_tool: RelTool,
}

impl<'a> FullTrial<'a> {
    fn new(model: &'a GoldenModel) -> Self {
        let starts = works::centring_starts();
        let mut dataset = works::dataset(model, &starts);
        // Some starts are a tenth of a degree from a limit, so the limits are removed.
        let mut robot = model.robot.clone();
        robot.links.iter_mut().for_each(|link| link.limits = [-1e3, 1e3]);
        let streams = Streams { seed: 0, trial: 0 };
        let ball = |centre: &Vector3<f64>| PresentedBall { centre: *centre, radius: DATUM_RADIUS };
        dataset.robot = Arc::new(robot.clone());
        dataset.contact_force = gauge(&streams).force_from(Some(&ball(&Vector3::zeros())));
        let point = |(k, q): (usize, Vec<f64>)| Sample::new(format!("v{k}"), q, Measured::Point(Vector3::zeros()));
        let validation =
            Dataset { samples: works::validation().into_iter().enumerate().map(point).collect(), ..dataset.clone() };
        let parts = Parts {
            nominal: Dataset { samples: Vec::new(), ..dataset.clone() },
            robot,
            tool: model.tool,
            payload: model.payload.clone(),
            balls: model.balls.iter().map(ball).collect(),
            gauge: gauge(&streams).mechanisms(),
        };
        let paper = Model::paper();
        let problem = Problem::new(&[NamedDataset::new("w4", &dataset)], &paper, Use::Fit).unwrap();
        let predicted = Problem::new(&[NamedDataset::new("w4", &validation)], &paper, Use::All).unwrap();
        assert!(problem.parameters().iter().map(|p| &p.name).eq(predicted.parameters().iter().map(|p| &p.name)));
        let start = problem.start();
        let all: Vec<usize> = (0..start.len()).collect();
        FullTrial {
            model,
            starts: starts.into_iter().map(|s| s.q).collect(),
            adjustment: Adjustment::new(&problem, &start, &all).unwrap(),
            rel_tool: RelTool::new(&parts.robot),
            start,
            dataset,
            validation,
            parts,
            problem,
            predicted,
        }
    }

    /// The flaws of an arm with the parameters `truth` (SI, absolute, in the order of the works).
    fn flaws(&self, truth: &[f64]) -> Flaws {
        let mut sizes = vec![0.0; self.start.len()];
        for (p, value) in self.model.parameters.iter().zip(truth) {
            let size = if p.compliance { p.nominal - value } else { value - p.nominal };
            sizes[works::place_in(&self.problem, &p.name)] = size;
        }
        let of = |name: &str| self.problem.parameters().iter().position(|p| p.name == name).map_or(0.0, |k| sizes[k]);
        let subject = Subject::new(&self.parts.robot, &[]);
        let effect = |id: &EffectId| -> Arc<dyn Flaw> {
            let effect: Arc<dyn calibench::effects::Effect> = build(id, &subject).unwrap().into();
            let sizes = effect.parameters().iter().map(|spec| of(&spec.name)).collect();
            Arc::new(TrueEffect { effect, sizes })
        };
        Flaws { all: Model::paper().effects.iter().map(effect).collect(), ..Flaws::none(self.parts.robot.joints()) }
    }

    /// Calibrates the robot of `truth`; returns the mean error over the validation configurations, m, and the readings
    /// per centring.
    fn run(&mut self, truth: &[f64], trial: u64) -> (f64, f64) {
        let streams = Streams { seed: 1, trial };
        let (mut motion, mut gauge) = (streams.stream("motion"), gauge(&streams));
        let mut plant = AnalyticPlant::new(&self.parts, self.flaws(truth), 0.0);
        let mut form = BallForm { sigma: 0.0, random: streams.stream("ball form") };
        let mut motors = [0.0; 6];
        let mut stand = |plant: &mut AnalyticPlant, q: &[f64], came_far: bool| {
            motors.iter_mut().zip(q).for_each(|(motor, q)| *motor = q + normal(JOINT_NOISE, &mut motion));
            let stand = Stand {
                motors: &motors,
                came_far,
                commanded: q,
                approach: &[1; 6],
                plungers: Some([1; 3]),
                sample: None,
                time_s: 0.0,
                temp_c: 20.0,
            };
            plant.settle(&stand, &mut form).unwrap()
        };
        let Dataset { robot, base, tool, .. } = &self.parts.nominal;
        let mut readings = 0;
        for (sample, start) in self.dataset.samples.iter_mut().zip(&self.starts) {
            let mut q = [0.0; 6];
            q.copy_from_slice(start);
            self.rel_tool.shift(robot, base, tool, &mut q, &Vector3::repeat(STAND_OFF)).unwrap();
            gauge.rest(stand(&mut plant, &q, true).touches);
            q.copy_from_slice(start);
            gauge.rest(stand(&mut plant, &q, true).touches);
            for _ in 0..MOST_READINGS {
                readings += 1;
                // A plunger at its stop gives no reading; it is taken to read the end of its range, so the tool
                // retreats by that.
                let reading = Vector3::from_fn(|k, _| gauge.read(k).unwrap_or(MASTER_READING));
                if reading.amax() < CENTRED {
                    break;
                }
                self.rel_tool.shift(robot, base, tool, &mut q, &reading).unwrap();
                gauge.rest(stand(&mut plant, &q, false).touches);
            }
            sample.q.copy_from_slice(&q);
        }
        self.problem.renew(&[&self.dataset.samples]).unwrap();
        self.adjustment.adjust(&self.problem, &self.start).unwrap();
        plant.remove_artifact();
        for sample in &mut self.validation.samples {
            let rest = stand(&mut plant, &sample.q, true);
            sample.measured = Measured::Point(rest.world_from_tool.translation.vector);
        }
        self.predicted.renew(&[&self.validation.samples]).unwrap();
        self.predicted.update_loads(self.adjustment.values());
        let errors = self.predicted.residuals(self.adjustment.values());
        let mean = errors.iter().map(|e| e.norm()).sum::<f64>() / errors.len() as f64;
        (mean, readings as f64 / self.starts.len() as f64)
    }
}

fn full_trial(c: &mut Criterion) {
    let model = golden::golden_model();
    let truths = works::truths();
    let mut trial = FullTrial::new(&model);
    let outcomes: Vec<(f64, f64)> = (0..).zip(&truths[..50]).map(|(k, truth)| trial.run(truth, k)).collect();
    let n = outcomes.len() as f64;
    let mean = outcomes.iter().map(|o| o.0).sum::<f64>() / n;
    println!("mean error {:.3} µm, {:.2} readings a centring", mean / UM, outcomes.iter().map(|o| o.1).sum::<f64>() / n);
    assert!(mean < MOST_MEAN_ERROR, "{mean}");
    let mut k = 0;
    let mut next = || {
        k += 1;
        black_box(trial.run(&truths[k as usize % truths.len()], k));
    };
    works::print_least("W4 by the full geometry", 1, &mut next);
    c.bench_function("W4 by the full geometry", |b| b.iter(&mut next));
}

criterion_group!(benches, full_trial);
criterion_main!(benches);
