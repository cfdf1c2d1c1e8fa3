//! The help of the program: verbs by the stage of the work, and examples of each.

use clap::Command;

/// The verbs, in the order in which they are met.
const STAGES: [(&str, &[&str]); 5] = [
    ("Calibrate", &["calibrate", "import", "identify", "validate"]),
    ("Find what is missing", &["diagnose", "add", "ladder", "compare", "report", "workbench"]),
    ("Use the calibration", &["compensate"]),
    ("Measure", &["plan", "measure"]),
    (MORE, &["discover", "sim", "cell", "keep", "effects", "bench", "robots", "completions", "man", "help"]),
];

/// The stage of the groups, listed with the verbs in them.
const MORE: &str = "More";

/// Command lines of each verb, without the name of the program.
const EXAMPLES: [(&str, &[&str]); 39] = [
    (
        "calibrate",
        &["calibrate measurements.csv --robot ur5 --noise 20um --tolerance 0.2mm -o ur5", "calibrate runs/paper/trical -o kr6"],
    ),
    ("import", &["import guess measurements.csv -o map.toml", "import generic measurements.csv --map map.toml -o runs/mine"]),
    ("identify", &["identify runs/paper/trical -o calibration.toml", "identify runs/A runs/B --model model.toml"]),
    ("validate", &["validate runs/paper/trical.toml runs/paper/validation"]),
    ("diagnose", &["diagnose runs/paper/trical", "diagnose runs/A runs/B --model model.toml --json"]),
    ("add", &["add harmonic:2:17 runs/ur10 -o model.toml", "add curve:3:tau2 runs/ur10 --model model.toml"]),
    ("ladder", &["ladder runs/ur10 -o model.toml", "ladder runs/A --check runs/B"]),
    ("discover", &["discover runs/ur10 -o model.toml"]),
    ("compare", &["compare runs/paper/trical.toml runs/paper/trical"]),
    ("report", &["report runs/paper", "report runs/ur10 --model model.toml -o report.html"]),
    ("workbench", &["workbench runs/ur10", "workbench runs/A runs/B --model model.toml", "workbench --static page"]),
    ("compensate", &["compensate calibration.toml targets.csv -o fake.csv", "compensate calibration.toml weld.src -o out"]),
    (
        "plan",
        &["plan scenarios/paper.toml -o plan.toml", "plan cell.toml -o plan.toml", "plan next runs/paper/trical -o more.toml"],
    ),
    ("plan next", &["plan next runs/paper/trical --scenario scenarios/paper.toml -o more.toml"]),
    (
        "measure",
        &[
            "measure scenarios/paper.toml --plan plan.toml --out runs/campaign",
            "measure --cell cell.toml --plan plan.toml --dry-run",
            "measure --cell cell.toml --plan plan.toml --out runs/campaign --resume",
        ],
    ),
    ("run", &["run scenarios/paper.toml", "run scenarios/paper.toml --out runs/paper --seed 7"]),
    ("sim", &["sim run scenarios/paper.toml", "sim study scenarios/study-poses.toml --trials 100 -o study.csv"]),
    ("sim run", &["sim run scenarios/paper.toml", "sim run scenarios/paper.toml --out runs/paper --seed 7"]),
    ("sim serve", &["sim serve scenarios/paper.toml"]),
    ("sim study", &["sim study scenarios/study-poses.toml --trials 100 -o study.csv"]),
    ("sim merge", &["sim merge first.csv second.csv -o study.csv"]),
    ("sim suite", &["sim suite scenarios/blind-suite.toml --seed 1001"]),
    ("sim design", &["sim design scenarios/design-artifact.toml -o designed.toml"]),
    ("sim precision", &["sim precision scenarios/paper.toml --repetitions 10"]),
    ("cell", &["cell check cell.toml", "cell program -o krl", "cell repeatability --cell cell.toml --plan plan.toml"]),
    (
        "cell repeatability",
        &["cell repeatability scenarios/paper.toml", "cell repeatability --cell cell.toml --plan plan.toml"],
    ),
    ("keep", &["keep check calibration.toml --then runs/campaign", "keep runs runs/march runs/june runs/october"]),
    (
        "keep check",
        &[
            "keep check calibration.toml --then runs/campaign --sentinels 5",
            "keep check calibration.toml runs/monday --then runs/campaign",
        ],
    ),
    (
        "keep recover",
        &[
            "keep recover calibration.toml runs/campaign --plan 12 -o touches.toml",
            "keep recover calibration.toml runs/touches --controller kuka --present 4=0 -o recovered",
        ],
    ),
    (
        "keep runs",
        &[
            "keep runs runs/march runs/june runs/october",
            "keep runs A B D --dates 2026-03-14,2026-06-02,2026-10-20 --drift theta2=0.001 -o now.toml",
        ],
    ),
    ("keep fleet", &["keep fleet robots/*.calibration.toml -o kr6.fleet.toml"]),
    ("effects", &["effects", "effects harmonic", "effects --json"]),
    ("effects list", &["effects list", "effects list harmonic"]),
    ("effects gallery", &["effects gallery scenarios/gallery.toml -o docs/gallery", "effects gallery runs/ur10 -o gallery"]),
    (
        "effects prove",
        &["effects prove runs/ur10", "effects prove runs/ur10 -o prove.html", "effects prove runs/ur10 --folds 5"],
    ),
    ("bench", &["bench -o runs/bench", "bench --only ur5 --rival mine=./mine -o runs/bench"]),
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
            let found = command.find_subcommand(verb);
            let about = found.and_then(Command::get_about).map(ToString::to_string);
            let mut about = about.unwrap_or_else(|| "Print the help of a verb".into());
            let inner: Vec<&str> = found.iter().flat_map(|verb| verb.get_subcommands()).map(Command::get_name).collect();
            if stage == MORE && !inner.is_empty() {
                about.push_str(&format!(": {}", inner.join(", ")));
            }
            listed.push_str(&hanging(&format!("  {verb:<15}"), &about));
        }
        listed.push('\n');
    }
    let template = format!("{{about}}\n\n{{usage-heading}} {{usage}}\n\n{listed}Options:\n{{options}}\n");
    EXAMPLES
        .iter()
        .fold(command, |command, (verb, lines)| {
            let lines: String = lines.iter().map(|line| format!("\n  calibench {line}")).collect();
            let words: Vec<&str> = verb.split(' ').collect();
            with_examples(command, &words, &format!("Examples:{lines}"))
        })
        .help_template(template)
        .max_term_width(WIDTH)
}

/// The command with these examples at the end of the help of a verb, which is named by the verbs that it is in and its own.
fn with_examples(command: Command, verb: &[&str], examples: &str) -> Command {
    match verb.split_first() {
        None => command.after_help(examples.to_owned()),
        Some((first, rest)) => command.mut_subcommand(first, |inner| with_examples(inner, rest, examples)),
    }
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
        let shown: BTreeSet<&str> = command.get_subcommands().filter(|v| !v.is_hide_set()).map(Command::get_name).collect();
        let listed: Vec<&str> = STAGES.iter().flat_map(|(_, verbs)| *verbs).copied().filter(|v| *v != "help").collect();
        assert_eq!(listed.iter().copied().collect::<BTreeSet<_>>(), shown);
        assert_eq!(listed.len(), shown.len());
        let of_stages = STAGES.iter().filter(|(stage, _)| *stage != MORE).flat_map(|(_, verbs)| *verbs).count();
        assert!(of_stages <= 13, "{of_stages} verbs are no short list");
        let exemplified: BTreeSet<&str> = EXAMPLES.iter().map(|(verb, _)| *verb).collect();
        assert!(command.get_subcommands().all(|verb| exemplified.contains(verb.get_name())));
        for group in ["sim", "keep", "effects"] {
            let inner = command.find_subcommand(group).into_iter().flat_map(Command::get_subcommands);
            let without: Vec<&str> =
                inner.map(Command::get_name).filter(|verb| !exemplified.contains(format!("{group} {verb}").as_str())).collect();
            assert!(without.is_empty(), "{group}: {without:?}");
        }
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
