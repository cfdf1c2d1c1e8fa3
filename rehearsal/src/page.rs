//! A rehearsal as one HTML file.

use calibench::cell::RobotSettings;
use calibench::cell::ur::numbers_of;
use calibench::measure::campaign::cell::Cell;
use calibench::robot::Robot;
use calibench::robot::solids::{Shape, Solid};
use calibench::units::{DEG, MM};
use calibench_report::{Module, chart_page_html};
use nalgebra::Vector3;
use serde::Serialize;

use crate::film::Film;
use crate::motion::Rehearsed;
use crate::rehearsal::{MotionTime, Rehearsal};
use crate::unchecked::unchecked;

const SCRIPT: Module = Module { name: "calibench-rehearsal/page.js", text: include_str!("page/page.js") };
const MODULES: &[Module] = &[Module { name: "calibench-rehearsal/stage.js", text: include_str!("page/stage.js") }];

/// The files of a rehearsal, as the page names them.
#[derive(Debug, Clone)]
pub struct Sources {
    /// The cell file.
    pub cell: String,
    /// The plan.
    pub plan: String,
}

/// What the page shows.
#[derive(Serialize)]
struct Document {
    cell: String,
    plan: String,
    robot: String,
    /// True if nothing forbids the plan.
    is_clear: bool,
    verdict: String,
    /// What is wrong or may be, in sentences.
    warnings: Vec<String>,
    /// What the measurement sets and how long its motions take: name and value.
    facts: Vec<[String; 2]>,
    gaps: Vec<GapRow>,
    motions: Vec<MotionRow>,
    bodies: Vec<Body>,
    /// True if the arm has no bodies and is drawn as lines from joint to joint.
    is_bare: bool,
    pictures: Vec<Vec<i32>>,
    tcp_mm: Vec<[i32; 3]>,
    unchecked: Vec<String>,
}

#[derive(Serialize)]
struct GapRow {
    body: String,
    other: String,
    gap_mm: f64,
    /// Index of the motion.
    motion: usize,
}

#[derive(Serialize)]
struct MotionRow {
    pose: String,
    /// True if it is made only in case.
    spare: bool,
    ball: String,
    phase: String,
    joints_deg: Vec<f64>,
    tcp_mm: [f64; 3],
    gap_mm: Option<f64>,
    between: Option<[String; 2]>,
    wrong: Option<String>,
    /// Index of its last picture.
    end: usize,
}

/// A body of the arm, or of the cell (`frame` is null), mm.
#[derive(Serialize)]
struct Body {
    name: String,
    frame: Option<usize>,
    #[serde(flatten)]
    form: Form,
}

#[derive(Serialize)]
#[serde(rename_all = "snake_case")]
enum Form {
    Capsule { ends: [[f64; 3]; 2], radius: f64 },
    Box { centre: [f64; 3], half: [f64; 3] },
}

/// The page of a rehearsal.
pub fn rehearsal_page(cell: &Cell, rehearsal: &Rehearsal, sources: &Sources) -> String {
    let document = serde_json::json!(document(cell, rehearsal, sources));
    chart_page_html("calibench measure: what the robot is going to do", SCRIPT, MODULES, &document)
}

fn document(cell: &Cell, rehearsal: &Rehearsal, sources: &Sources) -> Document {
    let film = Film::of(cell, &rehearsal.motions);
    let gaps = rehearsal.gaps.iter();
    let motions = rehearsal.motions.iter().zip(&film.ends);
    Document {
        cell: sources.cell.clone(),
        plan: sources.plan.clone(),
        robot: cell.dataset.robot.name.clone(),
        is_clear: rehearsal.is_clear(),
        verdict: rehearsal.verdict(),
        warnings: rehearsal.warnings(),
        facts: facts(cell, rehearsal),
        gaps: gaps
            .map(|g| GapRow { body: g.body.clone(), other: g.other.clone(), gap_mm: tenths(g.gap), motion: g.motion })
            .collect(),
        motions: motions.map(|(motion, &end)| motion_row(cell, motion, end)).collect(),
        bodies: bodies(cell),
        is_bare: cell.dataset.robot.solids.is_empty(),
        pictures: film.pictures,
        tcp_mm: film.tcp,
        unchecked: unchecked(cell, rehearsal),
    }
}

/// A length in millimetres, to a tenth.
fn tenths(metres: f64) -> f64 {
    (metres / MM * 10.0).round() / 10.0
}

fn motion_row(cell: &Cell, motion: &Rehearsed, end: usize) -> MotionRow {
    let ball = motion.ball.and_then(|ball| cell.dataset.balls.get(ball));
    MotionRow {
        pose: motion.pose.clone(),
        spare: motion.spare,
        ball: ball.map(|ball| ball.id.clone()).unwrap_or_default(),
        phase: motion.phase.to_string(),
        joints_deg: motion.to.iter().map(|q| (q / DEG * 100.0).round() / 100.0).collect(),
        tcp_mm: <[f64; 3]>::from(cell.guards.tcp(&motion.to)).map(tenths),
        gap_mm: motion.clearance.as_ref().map(|gap| tenths(gap.distance)),
        between: motion.clearance.as_ref().map(|gap| gap.between.clone()),
        wrong: motion.wrong(),
        end,
    }
}

/// What the measurement sets on the controller, and the time of its motions.
fn facts(cell: &Cell, rehearsal: &Rehearsal) -> Vec<[String; 2]> {
    let tool = cell.flange_from_tool();
    let [x, y, z] = tool.xyz.map(|v| v / MM);
    let turned = match &cell.robot {
        RobotSettings::Ur(_) => {
            let [_, _, _, rx, ry, rz] = numbers_of(&tool.pose());
            format!("rotation vector {rx:.4}, {ry:.4}, {rz:.4} rad")
        }
        _ => {
            let [rz, ry, rx] = tool.rz_ry_rx.map(|v| v / DEG);
            format!("A {rz:.3}, B {ry:.3}, C {rx:.3} deg")
        }
    };
    let fact = |what: &str, is: String| [what.to_owned(), is];
    let mut all = vec![
        fact("speed override", format!("{} %", cell.speed_percent)),
        fact("tool, in the controller's flange", format!("{x:.3}, {y:.3}, {z:.3} mm; {turned}")),
    ];
    match &cell.robot {
        RobotSettings::Ur(settings) if let Some(payload) = &settings.payload => {
            all.push(fact("payload", format!("{:.3} kg", payload.mass)));
        }
        _ => all.push(fact("payload", "as it is on the controller: enter what the flange carries there".into())),
    }
    for MotionTime { speed, time } in &rehearsal.times {
        let minutes = (time / 60.0).ceil();
        all.push(fact(
            &match cell.robot {
                RobotSettings::Ur(_) => format!("motions at a speed override of {} %", cell.speed_percent),
                _ => format!("motions at {:.0} deg/s of the joint that turns most", speed / DEG),
            },
            format!("{minutes:.0} min, and the {} on top", if rehearsal.probes() { "centrings" } else { "points" }),
        ));
    }
    all
}

fn bodies(cell: &Cell) -> Vec<Body> {
    let Robot { solids, .. } = &*cell.dataset.robot;
    let last = cell.dataset.robot.joints();
    let arm = solids.iter().map(|solid| Body::of(solid, Some(solid.frame)));
    let Some(known) = &cell.surroundings else {
        // Without a scene the balls are known at least.
        let balls = cell.dataset.balls.iter().map(|ball| Body {
            name: Solid::ball_name(&ball.id),
            frame: None,
            form: Form::Capsule { ends: [millimetres(&ball.position); 2], radius: cell.trical.datum_radius / MM },
        });
        return arm.chain(balls).collect();
    };
    let carried = known.carried.iter().map(|solid| Body::of(solid, Some(last)));
    arm.chain(carried).chain(known.fixed.iter().map(|solid| Body::of(solid, None))).collect()
}

fn millimetres(v: &Vector3<f64>) -> [f64; 3] {
    [v.x, v.y, v.z].map(tenths)
}

impl Body {
    fn of(solid: &Solid, frame: Option<usize>) -> Self {
        let form = match &solid.shape {
            Shape::Capsule { ends, radius } => {
                Form::Capsule { ends: [millimetres(&ends[0]), millimetres(&ends[1])], radius: tenths(*radius) }
            }
            Shape::Box { centre, half_size } => Form::Box { centre: millimetres(centre), half: millimetres(half_size) },
        };
        Body { name: solid.name.clone(), frame, form }
    }
}
