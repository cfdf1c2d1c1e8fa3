//! `measure --cell CELL --dry-run`: lists every motion of a plan without moving, and shows it on a page.

use std::path::Path;

use calibench::files::disk::write_whole;
use calibench::measure::campaign::cell::Cell;
use calibench::measure::poses::ProbingPlan;
use calibench::units::{DEG, MM};
use calibench_rehearsal::{Rehearsal, Rehearsed, Sources, rehearsal_page};
use calibench_report::plain_table;

use crate::terminal::failure::{Failure, Outcome};
use crate::terminal::output::{note, print_answer, warn};

/// Prints the motions of the plan with their clearances and verdicts; writes them to a page, if one is asked for.
pub fn rehearse(cell: &Cell, plan: &ProbingPlan, page: Option<&Path>, sources: &Sources) -> Result<Outcome, Failure> {
    let rehearsal = Rehearsal::of(cell, plan);
    let rows = rehearsal.motions.iter().map(|motion| row(cell, motion)).collect();
    print_answer(plain_table(["probing", "ball", "motion", "joints deg", "TCP mm", "clearance mm", ""], rows))?;
    let steps = format!(
        "; at each contact up to {} steps of up to {:.1} mm along the tool's axes",
        cell.centring.max_steps,
        cell.guards.max_step / MM
    );
    let steps = if plan.poses.iter().any(|pose| pose.ball.is_some()) { steps.as_str() } else { "" };
    print_answer(format!(
        "{}{steps}; speed override {} %; nothing was connected to and nothing moved",
        rehearsal.count(),
        cell.speed_percent
    ))?;
    print_answer(if rehearsal.is_clear() { rehearsal.clearance_sentence() } else { rehearsal.verdict() })?;
    for warning in rehearsal.warnings() {
        warn(&format!("warning: {warning}"));
    }
    if let Some(page) = page {
        write_whole(page, rehearsal_page(cell, &rehearsal, sources).as_bytes())?;
        note(&format!("the motions as a film, and what was not checked, are in {}", page.display()));
    }
    let remedy = match (rehearsal.forbidden(), rehearsal.off_their_balls(), rehearsal.touching()) {
        (0, 0, 0) => return Ok(Outcome::Done),
        (0, 0, _) => "plan again, or correct the scene",
        (0, ..) => "plan again, or correct the balls of the dataset",
        _ => "plan again, or correct [guards]",
    };
    let against = rehearsal.motions.iter().filter(|motion| motion.wrong().is_some()).count();
    let plural = if against == 1 { " is" } else { "s are" };
    Err(format!("{against} motion{plural} forbidden by the guards, bodies or balls of the cell; {remedy}").into())
}

fn row(cell: &Cell, motion: &Rehearsed) -> [String; 7] {
    let joints: Vec<String> = motion.to.iter().map(|q| format!("{:8.3}", q / DEG)).collect();
    let tcp: Vec<String> = cell.guards.tcp(&motion.to).iter().map(|v| format!("{:8.2}", v / MM)).collect();
    let ball = motion.ball.and_then(|ball| cell.dataset.balls.get(ball));
    [
        motion.pose.clone(),
        ball.map(|ball| ball.id.clone()).unwrap_or_default(),
        motion.phase.to_string(),
        joints.join(" "),
        tcp.join(" "),
        motion.clearance.as_ref().map(|gap| format!("{:.1}", gap.distance / MM)).unwrap_or_default(),
        motion.wrong().unwrap_or_default(),
    ]
}
