//! What a crash moved, in words and a table.

use calibench::units::MM;
use calibench_recovery::{Recovery, Verdict};

use super::documents::{self, RecoveredTool, RecoveredZero};
use super::effect_names::{capital, enumerated};
use super::printout::Printout;
use super::tables::{Table, plain_rows};

/// Most rivals that are printed.
const MOST_RIVALS: usize = 2;

/// The result as text, with the numbers of its document.
#[must_use]
pub fn recovery_text(found: &Recovery, document: &documents::Recovery) -> Printout {
    let mut out = Printout::default();
    let touches = document.touches;
    let residual = format!("{:.3} mm, {:.3} mm before", document.residual_mm, document.before_mm);
    match found.verdict {
        Verdict::NothingMoved => out.push(format!(
            "Nothing moved that these {touches} touches show; they leave {:.3} mm.\n",
            document.residual_mm
        )),
        Verdict::Unexplained => out.push(format!(
            "No lost zero, moved tool or bent link explains these {touches} touches ({residual}).\nFurthest is '{}', by {:.3} mm.\n",
            found.worst.id,
            found.worst.residual / MM
        )),
        _ => out.push(format!(
            "{} ({:.0} %; {touches} touches leave {residual}).\n",
            capital(&document.words),
            100.0 * document.probability
        )),
    }
    out.push(format!("Do: {}.\n", document.to_do));
    if found.verdict == Verdict::Moved {
        if !document.zeros.is_empty() {
            out = out + zeros_table(&document.zeros) + "\n";
        }
        if let Some(RecoveredTool { change_mm, within_95_mm, tcp_mm, on_flange_mm }) = &document.tool {
            let [x, y, z] = std::array::from_fn(|k| format!("{:+.3} ± {:.3}", change_mm[k], within_95_mm[k]));
            let at = |[x, y, z]: &[f64; 3]| format!("x {x:.3}, y {y:.3}, z {z:.3} mm");
            out.push(format!("The TCP moved in the last frame by x {x}, y {y}, z {z} mm (95 %).\n"));
            out.push(format!("New TCP on the flange: {}; in the last frame: {}.\n", at(on_flange_mm), at(tcp_mm)));
        }
    }
    if let Some(left) = document.elsewhere_mm {
        out.push(format!(
            "Otherwise: only pin, artifact or instrument stand elsewhere than before (--instrument-moved); then the touches leave {left:.3} mm.\n"
        ));
    }
    for rival in document.rivals.iter().take(MOST_RIVALS) {
        let touch = rival.touch.as_ref().map_or_else(String::new, |q| {
            let q: Vec<String> = q.iter().map(|v| format!("{v:.0}")).collect();
            format!("; a touch near {} tells", q.join(" "))
        });
        out.push(format!("Otherwise ({:.0} %): {}{touch}.\n", 100.0 * rival.probability, rival.words));
    }
    let unseen: Vec<String> = document.unseen_joints.iter().map(ToString::to_string).collect();
    match unseen.as_slice() {
        [] => {}
        [one] => out.push(format!("These touches do not show the zero of joint {one}.\n")),
        several => out.push(format!("These touches do not show the zeros of joints {}.\n", enumerated(several))),
    }
    out
}

fn zeros_table(zeros: &[RecoveredZero]) -> Table {
    let with_entry = zeros.iter().any(|zero| zero.enter.is_some());
    let mut header = vec!["joint", "stands further by", "95 %"];
    if with_entry {
        header.extend(["enter", "95 % ", "shown at zero"]);
    }
    let row = |zero: &RecoveredZero| {
        let mut row =
            vec![zero.joint.to_string(), format!("{:+.4} {}", zero.change, zero.unit), format!("± {:.4}", zero.within_95)];
        if with_entry {
            row.extend(zero.enter.as_ref().map_or_else(
                || vec![String::new(); 3],
                |e| {
                    let digits = if e.unit == "counts" { 0 } else { 5 };
                    let sign = if e.is_new_value { "=" } else { "+=" };
                    vec![
                        format!("{} {sign} {:.digits$} {}", e.name, e.value, e.unit),
                        format!("± {:.digits$}", e.within_95),
                        format!("{:.4} deg", e.shown_at_zero_deg),
                    ]
                },
            ));
        }
        row
    };
    plain_rows(header, zeros.iter().map(row).collect())
}
