//! What a rehearsal does not know.

use calibench::measure::campaign::cell::Cell;
use calibench::planning::aim::FURTHEST;
use calibench::units::MM;

use super::rehearsal::Rehearsal;

/// What a rehearsal did not check, in sentences; never empty.
pub(super) fn unchecked(cell: &Cell, rehearsal: &Rehearsal) -> Vec<String> {
    let probes = rehearsal.probes();
    let mut all = Vec::new();
    match &cell.surroundings {
        None => all.push(
            "The bodies around the arm are not known here: `surroundings.scene` of the cell file names none. No gap is checked; those \
             of the plan are of the bodies for which it was made."
                .to_owned(),
        ),
        Some(bodies) => all.push(format!(
            "Only the bodies of the scene are checked, {} fixed and {} on the flange, as capsules and boxes. What the scene does not \
             name is not there for it: fences, tracker, tripod, tools on the table, people.",
            bodies.fixed.len(),
            bodies.carried.len()
        )),
    }
    if cell.dataset.robot.solids.is_empty() {
        all.push("The robot's file names no bodies: the arm itself is not checked, and is drawn as lines.".into());
    }
    all.push(
        "Bodies on neighbouring links are not compared, for they meet at their joint: neither what is on the flange with the link \
         before it, nor the base with what it stands on."
            .into(),
    );
    all.push(if probes {
        "The gauge is not compared with the ball that it probes, on which it closes.".into()
    } else {
        "Whether the instrument sees its target is not checked here; the plan saw to it where it knew the instrument's place."
            .into()
    });
    all.push("Cables and hoses, of the gauge and of the arm, are not modelled.".into());
    all.push(
        "The arm is the nominal one. One that is not calibrated stands up to some millimetres beside it: a gap of less than 5 mm may \
         be none."
            .into(),
    );
    let steps = format!(
        "On each ball the arm is led by the gauge: up to {} steps of up to {:.1} mm along the axes of the tool, which are not shown; \
         nor is that it comes onto a ball where the probings before say, up to {:.0} mm beside the posture shown.",
        cell.centring.max_steps,
        cell.guards.max_step / MM,
        FURTHEST / MM
    );
    all.extend(probes.then_some(steps));
    all.push(
        "The first motion depends on where the arm stands: it is found, checked and announced when the measurement begins."
            .into(),
    );
    all.push(
        "Between two postures all joints are taken to move in proportion, as in a synchronous point-to-point motion; what a controller \
         does after a stop, or by hand, is not known."
            .into(),
    );
    all
}
