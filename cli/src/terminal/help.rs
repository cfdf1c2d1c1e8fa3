//! The help of the program: verbs by the stage of the work, and examples of each.

use clap::Command;

/// The verbs, in the order in which they are met.
const STAGES: [(&str, &[&str]); 7] = [
    ("Data and robots", &["import", "robots", "effects", "gallery"]),
    ("Measure", &["plan", "cell", "measure", "repeatability", "next"]),
    ("Calibrate", &["calibrate", "identify", "validate", "compare", "runs", "fleet"]),
    ("Find what is missing", &["diagnose", "add", "ladder", "prove", "report", "workbench"]),
    ("Use the calibration", &["compensate", "check"]),
    ("Simulate and study", &["run", "serve", "study", "merge", "design", "precision", "suite"]),
    ("The program itself", &["completions", "man", "help"]),
];

/// Command lines of each verb, without the name of the program.
const EXAMPLES: [(&str, &[&str]); 32] = [
    (
        "calibrate",
        &["calibrate measurements.csv --robot ur5 --noise 20um --tolerance 0.2mm -o ur5", "calibrate runs/paper/trical -o kr6"],
    ),
    ("run", &["run scenarios/paper.toml", "run scenarios/paper.toml --out runs/paper --seed 7"]),
    ("plan", &["plan scenarios/paper.toml -o plan.toml", "plan cell.toml -o plan.toml"]),
    (
        "measure",
        &[
            "measure scenarios/paper.toml --plan plan.toml --out runs/campaign",
            "measure --cell cell.toml --plan plan.toml --dry-run",
            "measure --cell cell.toml --plan plan.toml --out runs/campaign --resume",
        ],
    ),
    ("cell", &["cell check cell.toml"]),
    ("identify", &["identify runs/paper/trical -o calibration.toml", "identify runs/A runs/B --model model.toml"]),
    ("validate", &["validate runs/paper/trical.toml runs/paper/validation"]),
    ("diagnose", &["diagnose runs/paper/trical", "diagnose runs/A runs/B --model model.toml --json"]),
    ("add", &["add harmonic:2:17 runs/ur10 -o model.toml", "add curve:3:tau2 runs/ur10 --model model.toml"]),
    ("ladder", &["ladder runs/ur10 -o model.toml", "ladder runs/A --check runs/B"]),
    ("next", &["next runs/paper/trical --scenario scenarios/paper.toml -o more.toml"]),
    ("study", &["study scenarios/study-poses.toml --trials 100 -o study.csv"]),
    ("design", &["design scenarios/design-artifact.toml -o designed.toml"]),
    ("merge", &["merge first.csv second.csv -o study.csv"]),
    ("precision", &["precision scenarios/paper.toml --repetitions 10"]),
    ("repeatability", &["repeatability scenarios/paper.toml", "repeatability --cell cell.toml --plan plan.toml"]),
    ("prove", &["prove runs/ur10", "prove runs/ur10 -o prove.html", "prove runs/ur10 --folds 5"]),
    ("suite", &["suite scenarios/blind-suite.toml --seed 1001"]),
    (
        "runs",
        &[
            "runs runs/march runs/june runs/october",
            "runs A B D --dates 2026-03-14,2026-06-02,2026-10-20 --drift theta2=0.001 -o now.toml",
        ],
    ),
    ("fleet", &["fleet robots/*.calibration.toml -o kr6.fleet.toml"]),
    ("compare", &["compare runs/paper/trical.toml runs/paper/trical"]),
    (
        "check",
        &[
            "check calibration.toml --then runs/campaign --sentinels 5",
            "check calibration.toml runs/monday --then runs/campaign",
        ],
    ),
    ("compensate", &["compensate calibration.toml targets.csv -o fake.csv", "compensate calibration.toml weld.src -o out"]),
    ("report", &["report runs/paper", "report runs/ur10 --model model.toml -o report.html"]),
    ("serve", &["serve scenarios/paper.toml"]),
    ("workbench", &["workbench runs/ur10", "workbench runs/A runs/B --model model.toml", "workbench --static page"]),
    ("import", &["import guess measurements.csv -o map.toml", "import generic measurements.csv --map map.toml -o runs/mine"]),
    ("effects", &["effects", "effects harmonic", "effects --json"]),
    ("gallery", &["gallery scenarios/gallery.toml -o docs/gallery", "gallery runs/ur10 -o gallery"]),
    ("robots", &["robots", "robots from-urdf arm.urdf -o arm.robot.toml"]),
    ("completions", &["completions bash > ~/.local/share/bash-completion/completions/calibench"]),
    ("man", &["man -o ~/.local/share/man/man1"]),
];

/// The command with its verbs by stage, and the examples of each.
pub fn told(command: Command) -> Command {
    let mut listed = String::new();
    for (stage, verbs) in STAGES {
        listed.push_str(&format!("{stage}:\n"));
        for verb in verbs {
            let about = command.find_subcommand(verb).and_then(Command::get_about).map(ToString::to_string);
            let about = about.unwrap_or_else(|| "Print the help of a verb".into());
            listed.push_str(&hanging(&format!("  {verb:<15}"), &about));
        }
        listed.push('\n');
    }
    let template = format!("{{about}}\n\n{{usage-heading}} {{usage}}\n\n{listed}Options:\n{{options}}\n");
    EXAMPLES
        .iter()
        .fold(command, |command, (verb, lines)| {
            let lines: String = lines.iter().map(|line| format!("\n  calibench {line}")).collect();
            command.mut_subcommand(verb, |verb| verb.after_help(format!("Examples:{lines}")))
        })
        .help_template(template)
        .max_term_width(WIDTH)
}

/// Columns of the help, of its list of verbs and of its options.
const WIDTH: usize = 80;

/// Text after a label, further lines below its beginning.
fn hanging(label: &str, text: &str) -> String {
    let (mut out, mut column) = (label.to_owned(), label.len());
    for (k, word) in text.split_whitespace().enumerate() {
        if k > 0 && column + 1 + word.len() > WIDTH {
            out.push_str(&format!("\n{}{word}", " ".repeat(label.len())));
            column = label.len() + word.len();
        } else {
            let space = if k > 0 { " " } else { "" };
            out.push_str(&format!("{space}{word}"));
            column += space.len() + word.len();
        }
    }
    out.push('\n');
    out
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use clap::CommandFactory;

    use super::*;
    use crate::verbs::Arguments;

    #[test]
    fn every_verb_is_listed_once_and_has_an_example_that_it_understands() {
        let command = Arguments::command();
        let verbs: BTreeSet<&str> = command.get_subcommands().map(Command::get_name).collect();
        let listed: Vec<&str> = STAGES.iter().flat_map(|(_, verbs)| *verbs).copied().filter(|v| *v != "help").collect();
        assert_eq!(listed.iter().copied().collect::<BTreeSet<_>>(), verbs);
        assert_eq!(listed.len(), verbs.len());
        assert_eq!(EXAMPLES.iter().map(|(verb, _)| *verb).collect::<BTreeSet<_>>(), verbs);
        let mut wrong = Vec::new();
        for (verb, lines) in EXAMPLES {
            for line in lines {
                let words = line.split(" > ").next().unwrap_or_default().split_whitespace();
                let parsed = Arguments::command().try_get_matches_from(std::iter::once("calibench").chain(words));
                wrong.extend(parsed.err().map(|e| format!("{line}: {e}")));
                assert!(line.starts_with(verb), "{line}");
                for scenario in line.split_whitespace().filter(|word| word.starts_with("scenarios/")) {
                    assert!(std::path::Path::new("..").join(scenario).is_file(), "{line}");
                }
            }
        }
        assert!(wrong.is_empty(), "{}", wrong.concat());
    }

    #[test]
    fn the_list_of_verbs_fits_a_terminal() {
        let mut command = told(Arguments::command());
        let help = command.render_help().to_string();
        assert!(help.lines().all(|line| line.chars().count() <= WIDTH), "{help}");
    }
}
