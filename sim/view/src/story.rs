//! The story in words, shown beside the pictures.

use calibench::units::MM;

use crate::arm::Arms;
use crate::judgement::Judgement;
use crate::steps::{Left, Steps};
use crate::subject::Subject;

/// Returns the story in Markdown.
pub fn story(subject: &Subject, arms: &Arms, steps: &Steps, judgement: Option<&Judgement>) -> String {
    let mut story = format!("# {}\n\n", subject.title);
    if let Some(question) = &subject.question {
        story += &format!("*{question}*\n\n");
    }
    if let Some(Judgement { before, after }) = judgement {
        let of = |value: f64| format!("{:.3}", value / MM);
        story += &format!(
            "On {} poses that were not fitted the error falls from **{} to {} mm** in the mean, at most from {} to {} mm. Dots in the \
             cell are these points, the brighter the more is wrong there.\n\n",
            after.samples,
            of(before.mean),
            of(after.mean),
            of(before.max),
            of(after.max)
        );
    }
    story += &centring(subject);
    story += &format!("1. **Grey** is the {} arm", if subject.true_arm.is_some() { "true" } else { "identified" });
    for ghost in &arms.ghosts {
        story += &format!("; **{}** the {} one, its deviation x{}", ghost.colour_name, ghost.title, ghost.factor);
    }
    story += ".\n1. **Arrows**: residuals at the measured points, **orange before a step, blue after it**. Rms ";
    let fall = |left: &Left| format!("{} {:.4} mm", left.name, left.rms / MM);
    let falls: Vec<String> = steps.models.iter().chain(&steps.other).map(fall).collect();
    story += &format!("{}.\n\n", falls.join(", "));
    story += "Play `probing` for one pose after the other, `iteration` for every stop, `time`, where it was noted, at the pace of the cell.\n";
    if !subject.left_out.is_empty() {
        story += &format!("\nLeft out: {}.\n", subject.left_out.join("; "));
    }
    story
}

fn centring(subject: &Subject) -> String {
    if !subject.is_campaign {
        return String::new();
    }
    let journal = &subject.journal;
    let centred = journal.tries.iter().filter(|t| t.outcome == "centred").count();
    let on_ball = journal.stops.iter().filter(|s| s.on_ball && s.reading.is_some()).count();
    let mut story = format!(
        "1. **The robot centres the gauge** on {} balls: {centred} of {} probings, {:.1} readings each. The charts are logarithmic, one \
         decade a line; within 3 um (green) a ball is centred.\n",
        subject.dataset.balls.len(),
        journal.tries.len(),
        on_ball as f64 / journal.tries.len().max(1) as f64
    );
    let ways = journal.tries.iter().filter_map(|t| Some((t.clearance_mm?, &t.id)));
    if let Some((clearance, id)) = ways.min_by(|(a, _), (b, _)| a.total_cmp(b)) {
        story +=
            &format!("1. **Least clearance** of the nominal arm on its planned ways: {clearance:.1} mm, on the way to {id}.\n");
    }
    story
}
