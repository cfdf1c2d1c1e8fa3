//! What a crash moved, in words and a table.

use calibench::recovery::mastering::MasteringEntry;
use calibench::recovery::{Moved, Recovery, Verdict};
use calibench::robot::JointKind;
use calibench::units::{DEG, MM};

use super::printout::Printout;
use super::tables::plain_rows;

/// Half of the 95 % interval of a normal distribution, in standard deviations.
pub(crate) const COVERS_95: f64 = 1.96;

/// Most rivals that are printed.
const MOST_RIVALS: usize = 2;

/// The verdict as it stands in files.
pub(crate) fn verdict_name(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::NothingMoved => "nothing_moved",
        Verdict::Moved => "moved",
        Verdict::BentLink => "bent_link",
        _ => "unexplained",
    }
}

/// What moved, in words.
pub(crate) fn moved_words(moved: &Moved) -> String {
    let joints: Vec<String> = moved.zeros.iter().map(ToString::to_string).collect();
    let mut all = Vec::new();
    match joints.as_slice() {
        [] => {}
        [one] => all.push(format!("joint {one} lost its zero")),
        [rest @ .., last] => all.push(format!("joints {} and {last} lost their zeros", rest.join(", "))),
    }
    if moved.tool {
        all.push("the tool moved on the flange, or was bent".into());
    }
    if moved.base {
        all.push("the base, the artifact or the instrument moved".into());
    }
    if let Some(joint) = moved.bent {
        all.push(format!("the link between joints {joint} and {} is bent", joint + 1));
    }
    if all.is_empty() { "nothing moved".into() } else { all.join("; ") }
}

/// What to do.
pub(crate) fn recovery_to_do(found: &Recovery) -> &'static str {
    match found.verdict {
        Verdict::NothingMoved => "go on with the robot as it is",
        Verdict::Moved if found.zeros.is_empty() => "enter the new TCP or frame; no joint is to be mastered",
        Verdict::Moved => "enter these zeros, and the new TCP if the tool moved; then make three touches again",
        Verdict::BentLink => "do not re-master: look at that link, and calibrate the robot again when it was mended",
        _ => "enter nothing: make the furthest touch again, or calibrate the robot again",
    }
}

fn first_large(words: &str) -> String {
    let mut letters = words.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// The result as text; `entries` are what to enter for each zero, in their order, if the controller is known.
#[must_use]
pub fn recovery_text(found: &Recovery, entries: &[Option<MasteringEntry>]) -> Printout {
    let mut out = Printout::default();
    let residual = format!("{:.3} mm, {:.3} mm before", found.after / MM, found.before / MM);
    match found.verdict {
        Verdict::NothingMoved => out.push(format!(
            "Nothing moved that these {} touches show; they leave {:.3} mm.\n",
            found.touches,
            found.after / MM
        )),
        Verdict::Unexplained => out.push(format!(
            "No lost zero, moved tool or bent link explains these {} touches ({residual}).\nFurthest is '{}', by {:.3} mm.\n",
            found.touches,
            found.worst.id,
            found.worst.residual / MM
        )),
        _ => out.push(format!(
            "{} ({:.0} %; {} touches leave {residual}).\n",
            first_large(&moved_words(&found.moved)),
            100.0 * found.probability,
            found.touches
        )),
    }
    out.push(format!("Do: {}.\n", recovery_to_do(found)));
    if found.verdict == Verdict::Moved {
        if !found.zeros.is_empty() {
            out = out + zeros_table(found, entries) + "\n";
        }
        if let Some(tool) = &found.tool {
            let change = tool.map(|c| format!("{:+.3} ± {:.3}", c.change / MM, COVERS_95 * c.sigma / MM));
            out.push(format!("TCP in the last frame: x {}, y {}, z {} mm (95 %).\n", change[0], change[1], change[2]));
        }
    }
    for rival in found.rivals.iter().take(MOST_RIVALS) {
        let robot = &found.now.robot;
        let touch = rival.posture.as_ref().map_or_else(String::new, |q| {
            let q: Vec<String> = robot.in_columns(q).iter().map(|v| format!("{v:.0}")).collect();
            format!("; a touch near {} tells", q.join(" "))
        });
        out.push(format!("Otherwise ({:.0} %): {}{touch}.\n", 100.0 * rival.probability, moved_words(&rival.moved)));
    }
    let unseen: Vec<String> = found.unseen().iter().map(ToString::to_string).collect();
    if !unseen.is_empty() {
        out.push(format!("These touches do not show the zero of joint {}.\n", unseen.join(", ")));
    }
    out
}

fn zeros_table(found: &Recovery, entries: &[Option<MasteringEntry>]) -> super::tables::Table {
    let with_entry = entries.iter().any(Option::is_some);
    let mut header = vec!["joint", "stands further by", "95 %"];
    if with_entry {
        header.extend(["enter", "95 % ", "shown at zero"]);
    }
    let row = |(k, z): (usize, &calibench::recovery::ZeroChange)| {
        let is_turn = found.now.robot.kind(z.joint - 1) == JointKind::Revolute;
        let (size, unit) = if is_turn { (DEG, "deg") } else { (MM, "mm") };
        let within = COVERS_95 * z.sigma / size;
        let mut row = vec![z.joint.to_string(), format!("{:+.4} {unit}", z.change / size), format!("± {within:.4}")];
        if with_entry {
            row.extend(entries.get(k).copied().flatten().map_or_else(
                || vec![String::new(); 3],
                |e| {
                    let digits = if e.quantity.unit() == "counts" { 0 } else { 5 };
                    let sign = if e.is_new_value { "=" } else { "+=" };
                    let name = e.quantity.name(e.joint);
                    vec![
                        format!("{name} {sign} {:.digits$} {}", e.value, e.quantity.unit()),
                        format!("± {:.digits$}", COVERS_95 * e.sigma),
                        format!("{:.4} deg", e.shown_at_zero),
                    ]
                },
            ));
        }
        row
    };
    plain_rows(header, found.zeros.iter().enumerate().map(row).collect())
}
