//! `measure --cell CELL --dry-run`: lists every motion of a plan without moving.

use calibench::cell::guards::Forbidden;
use calibench::measure::campaign::cell::Cell;
use calibench::measure::poses::{PlannedPose, ProbingPlan};
use calibench::units::{DEG, MM};
use calibench_report::plain_table;

use crate::terminal::failure::{Failure, Outcome};
use crate::terminal::output::print_answer;

/// Prints the motions of the plan in order, each with its joints and the TCP of the nominal arm, the least clearance of each
/// pose's path and approach, and the verdict of the guards.
pub fn rehearse(cell: &Cell, plan: &ProbingPlan) -> Result<Outcome, Failure> {
    let mut rows = Vec::new();
    let mut forbidden = 0;
    let mut from: Option<&[f64]> = plan.ways.as_ref().map(|ways| ways.home.as_slice());
    for pose in plan.poses.iter().filter(|pose| !pose.reserve) {
        let via = pose.via.iter().map(|q| ("way", q));
        let ends = [("approach", &pose.approach), ("contact", &pose.contact), ("retreat", &pose.approach)];
        for (phase, target) in via.chain(ends) {
            // The position of the arm before the first motion is unknown; then only its end is checked.
            let verdict = cell.guards.joint_motion(from.unwrap_or(target), target);
            forbidden += usize::from(verdict.is_err());
            rows.push(row(cell, pose, phase, target, verdict));
            from = Some(target);
        }
    }
    let motions = rows.len();
    print_answer(plain_table(["probing", "ball", "motion", "joints deg", "TCP mm", "clearance mm", ""], rows))?;
    let steps = format!(
        "at each contact up to {} steps of up to {:.1} mm along the tool's axes; speed override {} %",
        cell.centring.max_steps,
        cell.guards.max_step / MM,
        cell.speed_percent
    );
    print_answer(format!("{motions} motions, {steps}; nothing was connected to and nothing moved"))?;
    let known = plan.poses.iter().filter_map(|pose| Some((pose, pose.clearance?)));
    match known.min_by(|a, b| a.1.total_cmp(&b.1)) {
        Some((pose, gap)) => print_answer(format!("the least clearance is {:.1} mm, of '{}'", gap / MM, pose.id))?,
        None => print_answer("the plan does not say how clear its motions are: plan with `calibench plan CELL`")?,
    }
    if forbidden > 0 {
        return Err(
            format!("{forbidden} motions are forbidden by the guards of the cell; plan again, or correct [guards]").into()
        );
    }
    Ok(Outcome::Done)
}

fn row(cell: &Cell, pose: &PlannedPose, phase: &str, target: &[f64], verdict: Result<(), Forbidden>) -> [String; 7] {
    let joints: Vec<String> = target.iter().map(|q| format!("{:8.3}", q / DEG)).collect();
    let tcp: Vec<String> = cell.guards.tcp(target).iter().map(|v| format!("{:8.2}", v / MM)).collect();
    [
        pose.id.clone(),
        cell.dataset.balls.get(pose.ball).map(|ball| ball.id.clone()).unwrap_or_default(),
        phase.into(),
        joints.join(" "),
        tcp.join(" "),
        pose.clearance.filter(|_| phase == "approach").map(|gap| format!("{:.1}", gap / MM)).unwrap_or_default(),
        verdict.err().map(|forbidden| format!("FORBIDDEN: {forbidden}")).unwrap_or_default(),
    ]
}
