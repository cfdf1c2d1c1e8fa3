//! The story in words, beside the pictures.

use calibench::units::MM;

use crate::film::Wishes;
use crate::steps::Left;
use crate::subject::Subject;

/// The story, in Markdown.
pub fn story(subject: &Subject, steps: &[Left], wishes: &Wishes) -> String {
    let mut story = format!("# {}\n\n", subject.title);
    if let Some(question) = &subject.question {
        story += &format!("*{question}*\n\n");
    }
    let journal = &subject.journal;
    if subject.is_campaign {
        let centred = journal.tries.iter().filter(|t| t.outcome == "centred").count();
        let on_ball = journal.stops.iter().filter(|s| s.on_ball && s.reading.is_some()).count();
        story += &format!(
            "1. **The robot centres the gauge** on {} balls: {centred} of {} probings, {:.1} readings each. Every line of the charts is \
             ten times nearer; within 3 um (green) a ball is centred.\n",
            subject.dataset.balls.len(),
            journal.tries.len(),
            on_ball as f64 / journal.tries.len().max(1) as f64
        );
    }
    story += &format!(
        "1. **Grey** is the arm as identified, **purple** as drawn, {} times as far off as it is.\n",
        wishes.exaggerate
    );
    story += "1. **Arrows**: what is left where it was measured, **orange before a step, blue after it**. Rms ";
    let falls: Vec<String> = steps.iter().map(|s| format!("{} {:.4} mm", s.name, s.rms / MM)).collect();
    story += &format!("{}.\n\n", falls.join(", "));
    if subject.validation.is_some() {
        story += "Dots are the tracker's points that judge the calibration, the brighter the more is wrong there. ";
    }
    story += "Play `probing` for one pose after the other, `iteration` for every stop, `time`, where it was noted, at the pace of the cell.\n";
    if !subject.left_out.is_empty() {
        story += &format!("\nLeft out: {}.\n", subject.left_out.join("; "));
    }
    story
}
