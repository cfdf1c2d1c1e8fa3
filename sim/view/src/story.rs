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
            "1. **The robot centres** a TriCal on {} balls: {centred} of {} probings, {:.1} readings each. In the charts every line is ten \
             times nearer; in the green band, 3 um, a ball counts as centred. Vermillion, green and blue are the three plungers.\n",
            subject.dataset.balls.len(),
            journal.tries.len(),
            on_ball as f64 / journal.tries.len().max(1) as f64
        );
    }
    story += &format!(
        "1. **Grey** is the arm as identified; **purple** the arm as drawn, {:.0} times as far off as it is.\n",
        wishes.exaggerate
    );
    story += "1. **The arrows** are what the model leaves at every ball or point, measured minus predicted: ";
    let falls: Vec<String> = steps.iter().map(|s| format!("{} {:.4} mm", s.name, s.rms / MM)).collect();
    story += &format!("{} (rms).\n\n", falls.join(", "));
    story += "Play `probing` for ball after ball, `iteration` for every stop, `time` at the pace of the cell.\n";
    if !subject.left_out.is_empty() {
        story += &format!("\nLeft out: {}.\n", subject.left_out.join("; "));
    }
    story
}
