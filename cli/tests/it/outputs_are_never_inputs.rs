//! An output that the command reads, or that is another output of it, is refused before anything is done, whatever its name.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use tempfile::TempDir;

const READ: &str = "is read by this command; name another file";
const FOLDER: &str = "is read by this command; name another folder";
const ONE: &str = "are one file; name two";

/// Files of which none is read to its end: the command line is refused before.
fn desk() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [
        ("calibration.toml", "mine"),
        ("history.toml", "mine"),
        ("plan.toml", "mine"),
        ("model.toml", "mine"),
        ("map.toml", "mine"),
        ("fleet.toml", "mine"),
        ("arm.toml", "mine"),
        ("arm.urdf", "mine"),
        ("a.csv", "mine"),
        ("b.csv", "mine"),
        ("base.toml", "robot = \"arm.toml\"\n"),
        ("s.toml", "extends = \"base.toml\"\n"),
        ("cell.toml", "dataset = \"day1/dataset.toml\"\nscenario = \"s.toml\"\n[surroundings]\nscene = \"scene.toml\"\n"),
        ("scene.toml", "mine"),
        ("day1/dataset.toml", "robot = \"../arm.toml\"\n"),
        ("day1/samples.csv", "mine"),
        ("then/dataset.toml", "robot = \"robot.toml\"\n"),
        ("then/samples.csv", "mine"),
        ("then/robot.toml", "mine"),
        ("run/result.json", "mine"),
        ("run/trical.toml", "mine"),
        ("run/report.html", "mine"),
        ("run/trical/dataset.toml", "mine"),
        ("run/trical/samples.csv", "mine"),
    ] {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }
    folder
}

fn contents(folder: &Path, found: &mut BTreeMap<PathBuf, Vec<u8>>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            contents(&path, found);
        } else {
            found.insert(path.clone(), fs::read(path).unwrap_or_default());
        }
    }
}

/// Exit code and standard error of a command line.
fn told(folder: &Path, line: &str) -> (Option<i32>, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_calibench"));
    let output = command.current_dir(folder).args(line.split(' ')).stdin(Stdio::null()).output().unwrap();
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

#[track_caller]
fn refused(folder: &Path, line: &str, output: &str, says: &str) {
    let (mut before, mut after) = (BTreeMap::new(), BTreeMap::new());
    contents(folder, &mut before);
    let (code, error) = told(folder, line);
    contents(folder, &mut after);
    assert_eq!(code, Some(2), "{line}: {error}");
    assert_eq!(error, format!("calibench: {output}: {says}\n"), "{line}");
    assert!(before == after, "{line}: nothing is written");
}

#[test]
fn an_output_that_is_read_is_refused() {
    let folder = desk();
    let check = "keep check calibration.toml --then then";
    let on = "--on 2025-12-01";
    for (line, output) in [
        (format!("{check} day1 --history history.toml {on} --page calibration.toml"), "--page calibration.toml"),
        (format!("{check} day1 --history history.toml {on} --page then/samples.csv"), "--page then/samples.csv"),
        (format!("{check} day1 --history calibration.toml {on}"), "--history calibration.toml"),
        (format!("{check} day1 --history day1/dataset.toml {on}"), "--history day1/dataset.toml"),
        (format!("{check} --plan plan.toml -o plan.toml"), "-o plan.toml"),
        (format!("{check} --plan plan.toml --output calibration.toml"), "-o calibration.toml"),
    ] {
        refused(folder.path(), &line, output, READ);
    }
    for (line, output) in [
        ("identify then -o then/samples.csv", "-o then/samples.csv"),
        ("identify then -o then/robot.toml", "-o then/robot.toml"),
        ("identify day1 -o arm.toml", "-o arm.toml"),
        ("identify day1 --model model.toml -o ./model.toml", "-o ./model.toml"),
        ("identify day1 --fleet fleet.toml -o day1/../fleet.toml", "-o day1/../fleet.toml"),
        ("keep runs day1 then -o day1/samples.csv", "-o day1/samples.csv"),
        ("keep fleet calibration.toml fleet.toml -o fleet.toml", "-o fleet.toml"),
        ("add mdh day1 --model model.toml -o model.toml", "-o model.toml"),
        ("ladder day1 --model model.toml -o model.toml", "-o model.toml"),
        ("ladder day1 --check then -o then/dataset.toml", "-o then/dataset.toml"),
        ("plan next day1 --scenario s.toml -o s.toml", "-o s.toml"),
        ("effects prove day1 -o day1/samples.csv", "-o day1/samples.csv"),
        ("report run -o run/trical.toml", "-o run/trical.toml"),
        ("report run -o run/trical/samples.csv", "-o run/trical/samples.csv"),
        ("report day1 --against model.toml -o model.toml", "-o model.toml"),
        ("compensate calibration.toml a.csv -o a.csv", "-o a.csv"),
        ("compensate calibration.toml a.csv -o calibration.toml", "-o calibration.toml"),
        ("compensate calibration.toml --mdh calibration.toml", "--mdh calibration.toml"),
        ("compensate calibration.toml --urdf arm.urdf --urdf-of arm.urdf", "--urdf arm.urdf"),
        ("compensate calibration.toml --urdf arm.urdf --urdf-of arm.urdf#base:tool", "--urdf arm.urdf"),
        ("robots from-urdf arm.urdf -o arm.urdf", "-o arm.urdf"),
        ("plan s.toml -o s.toml", "-o s.toml"),
        ("plan s.toml -o base.toml", "-o base.toml"),
        ("plan cell.toml -o day1/dataset.toml", "-o day1/dataset.toml"),
        ("plan cell.toml -o scene.toml", "-o scene.toml"),
        ("measure s.toml --plan plan.toml -o plan.toml", "-o plan.toml"),
        ("run s.toml --out s.toml", "-o s.toml"),
        ("sim study s.toml --trials 3 -o s.toml", "-o s.toml"),
        ("sim study s.toml --trials 3 -o x.csv --report base.toml", "--report base.toml"),
        ("sim study s.toml --trials 3 -o x.csv --parquet arm.toml", "--parquet arm.toml"),
        ("sim merge a.csv b.csv -o a.csv", "-o a.csv"),
        ("sim merge a.csv b.csv --report b.csv", "--report b.csv"),
        ("sim design s.toml -o base.toml", "-o base.toml"),
        ("sim suite s.toml -o s.toml", "-o s.toml"),
        ("import guess a.csv --robot ur5 -o a.csv", "-o a.csv"),
        ("import generic a.csv --map map.toml -o map.toml", "-o map.toml"),
    ] {
        refused(folder.path(), line, output, READ);
    }
    // So is a folder that would be replaced.
    for (line, output) in [
        ("import generic a.csv --map map.toml --set-up-of day1 -o day1", "-o day1"),
        ("import generic day1/samples.csv --map map.toml -o day1", "-o day1"),
        ("keep check calibration.toml --then then --cell cell.toml --plan plan.toml -o then", "-o then"),
        ("compare calibration.toml day1 --plots day1", "--plots day1"),
        ("effects gallery day1 -o day1", "-o day1"),
    ] {
        refused(folder.path(), line, output, FOLDER);
    }
}

#[test]
fn two_outputs_are_two_files() {
    let folder = desk();
    for (line, outputs) in [
        ("sim study s.toml --trials 3 -o x.csv --report x.csv", "-o x.csv and --report x.csv"),
        ("sim study s.toml --trials 3 -o new/x.csv --parquet new/../new/x.csv", "-o new/x.csv and --parquet new/../new/x.csv"),
        ("sim design s.toml -o d.toml --report d.toml", "-o d.toml and --report d.toml"),
        ("compensate calibration.toml --urdf d.urdf --mdh d.urdf", "--urdf d.urdf and --mdh d.urdf"),
        (
            "keep check calibration.toml day1 --then then --history h.toml --on 2025-12-01 --page h.toml",
            "--history h.toml and --page h.toml",
        ),
    ] {
        refused(folder.path(), line, outputs, ONE);
    }
}

#[cfg(unix)]
#[test]
fn links_are_no_other_names() {
    use std::os::unix::fs::symlink;

    let folder = desk();
    let at = |name: &str| folder.path().join(name);
    for (to, link) in [("model.toml", "link.toml"), ("link.toml", "again.toml"), ("new.toml", "later.toml"), ("then", "now")] {
        symlink(to, at(link)).unwrap();
    }
    for (line, output, says) in [
        ("identify day1 --model model.toml -o again.toml", "-o again.toml", READ),
        ("identify day1 --model again.toml -o model.toml", "-o model.toml", READ),
        ("identify now -o then/samples.csv", "-o then/samples.csv", READ),
        ("identify then -o now/robot.toml", "-o now/robot.toml", READ),
        ("sim design s.toml -o new.toml --report later.toml", "-o new.toml and --report later.toml", ONE),
    ] {
        refused(folder.path(), line, output, says);
    }
    assert!(!at("new.toml").exists());
}

/// These are refused too, since nothing here is what it is called, but not for their outputs.
#[test]
fn outputs_beside_the_inputs_and_updates_in_place_go_on() {
    let folder = desk();
    let mut lines = vec![
        "identify then -o then/calibration.toml",
        "identify run/trical -o run/trical.toml",
        "report run -o run/report.html",
        "report then -o then/report.html",
        "effects prove then --folds 2 --rows then",
        "workbench then --save-to then",
        "add mdh then --model model.toml",
        "keep check calibration.toml day1 --then then --history history.toml --on 2025-12-01",
        "measure s.toml --plan plan.toml -o campaign --resume",
        "sim study s.toml --trials 1 -o a.csv",
        "import generic a.csv --map map.toml -o then",
        "import generic a.csv --map map.toml --set-up-of day1 -o then",
        "sim merge a.csv -o - --report page.html",
    ];
    if cfg!(unix) {
        lines.push("sim study s.toml --trials 1 -o /dev/null --report /dev/null");
    }
    for line in lines {
        let (code, error) = told(folder.path(), line);
        assert_eq!(code, Some(2), "{line}: {error}");
        assert!(!error.contains("is read by this command") && !error.contains("are one file"), "{line}: {error}");
    }
}
