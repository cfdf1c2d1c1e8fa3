//! A study gives the same bytes on any number of threads, in shards of any size, and after interruption and resumption.

use std::collections::BTreeMap;
use std::fs;
use std::process::{Command, Output};

use crate::program::scenario;
use serde_json::Value;
use tempfile::TempDir;

/// A quick cell with three points that need two plans.
const QUICK: &str = "format = \"calibench-scenario/1\"\nextends = \"CELL\"\nname = \"quick\"\nquestion = \"?\"\n
[plan]\npool_per_ball = 100\nstarts = 1\nposes_per_ball = 5\n
[tracker]\nvalidation_poses = 20\nidentification_poses = 20\n
[sweep]\n[[sweep.axis]]\nname = \"cell\"\n[[sweep.axis.case]]\nlabel = \"as it is\"\n
[[sweep.axis.case]]\nlabel = \"coarse\"\nset = { \"centring.tolerance_um\" = 100.0 }\n
[[sweep.axis.case]]\nlabel = \"three balls\"\nwithout = [\"ball[3]\", \"solid[7]\"]\n";

fn study() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    // Backslashes in a path would be escapes.
    let text = QUICK.replace("CELL", &scenario("table8.toml").replace('\\', "/"));
    fs::write(folder.path().join("s.toml"), text).unwrap();
    folder
}

fn calibench(folder: &TempDir, arguments: &[&str], threads: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_calibench"));
    command.current_dir(folder).args(arguments).env("RAYON_NUM_THREADS", threads).output().unwrap()
}

#[track_caller]
fn done(folder: &TempDir, arguments: &[&str]) -> Vec<u8> {
    let output = calibench(folder, arguments, "2");
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    output.stdout
}

#[track_caller]
fn refused(folder: &TempDir, arguments: &[&str], says: &str) {
    let output = calibench(folder, arguments, "2");
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {error}");
    assert!(error.contains(says) && error.matches('\n').count() == 1, "{arguments:?}: {error}");
}

fn bytes(folder: &TempDir, file: &str) -> Vec<u8> {
    fs::read(folder.path().join(file)).unwrap()
}

#[test]
fn threads_change_no_byte() {
    let folder = study();
    for threads in ["1", "4"] {
        let output = calibench(&folder, &["sim", "study", "s.toml", "--trials", "7", "-o", &format!("{threads}.csv")], threads);
        assert!(output.status.success());
    }
    let rows = bytes(&folder, "1.csv");
    assert_eq!(rows.iter().filter(|&&b| b == b'\n').count(), 1 + 7 * 3 * 2, "a header, and a row a trial, point and method");
    assert!(rows == bytes(&folder, "4.csv"));
}

#[test]
fn a_method_alone_gives_its_rows_of_both() {
    let folder = study();
    let rows = |file: &str, method: &str| {
        let mut table = csv::Reader::from_path(folder.path().join(file)).unwrap();
        let header = table.headers().unwrap().clone();
        let named =
            |record: &csv::StringRecord| header.iter().map(str::to_owned).zip(record.iter().map(str::to_owned)).collect();
        let mut rows: Vec<BTreeMap<String, String>> = table.records().map(|r| named(&r.unwrap())).collect();
        rows.retain(|row| row["method"] == method);
        // What tells one study from another.
        rows.iter_mut().for_each(|row| ["study", "methods"].iter().for_each(|column| _ = row.remove(*column)));
        rows
    };
    done(&folder, &["sim", "study", "s.toml", "--trials", "3", "-o", "both.csv"]);
    for method in ["trical", "tracker"] {
        let file = format!("{method}.csv");
        let told = done(&folder, &["sim", "study", "s.toml", "--trials", "3", "--method", method, "-o", &file, "--json"]);
        let alone = rows(&file, method);
        assert_eq!(alone.len(), 3 * 3, "a row a trial and point");
        assert_eq!(alone, rows("both.csv", method));
        let told: Value = serde_json::from_slice(&told).unwrap();
        assert_eq!(told["points"][0]["methods"].as_array().map(Vec::len), Some(1), "{told}");
        // Cut within a row, it continues.
        let whole = bytes(&folder, &file);
        fs::write(folder.path().join(&file), &whole[..whole.len() - 40]).unwrap();
        done(&folder, &["sim", "study", "s.toml", "--trials", "3", "--method", method, "-o", &file]);
        assert!(bytes(&folder, &file) == whole);
    }
    refused(&folder, &["sim", "study", "s.toml", "--trials", "3", "--method", "tracker", "-o", "both.csv"], "which is not");
    refused(&folder, &["sim", "merge", "trical.csv", "tracker.csv"], "merge the shards of one study");
}

#[test]
fn shards_of_any_size_merge_to_the_bytes_of_one_run() {
    let folder = study();
    done(&folder, &["sim", "study", "s.toml", "--trials", "6", "--first", "2", "-o", "whole.csv"]);
    for (first, trials) in [("2", "3"), ("5", "1"), ("6", "2")] {
        done(&folder, &["sim", "study", "s.toml", "--trials", trials, "--first", first, "-o", &format!("{first}.csv")]);
    }
    let told: Value =
        serde_json::from_slice(&done(&folder, &["sim", "merge", "6.csv", "2.csv", "5.csv", "-o", "merged.csv", "--json"]))
            .unwrap();
    assert!(bytes(&folder, "merged.csv") == bytes(&folder, "whole.csv"));
    assert_eq!((told["first"].as_u64(), told["trials"].as_u64()), (Some(2), Some(6)));
    // A number that a study never writes is named by its line and column.
    let text = String::from_utf8(bytes(&folder, "6.csv")).unwrap();
    let column = text.lines().next().unwrap().split(',').position(|name| name == "rms_mm").unwrap();
    let spoiled = |(k, line): (usize, &str)| {
        let mut fields: Vec<&str> = line.split(',').collect();
        if k == 2 {
            fields[column] = "NaN";
        }
        fields.join(",") + "\n"
    };
    fs::write(folder.path().join("spoiled.csv"), text.lines().enumerate().map(spoiled).collect::<String>()).unwrap();
    refused(&folder, &["sim", "merge", "2.csv", "spoiled.csv", "5.csv"], "spoiled.csv:3: rms_mm: `NaN` is not a finite number");
    // The summary of the shards is that of the whole.
    let mut whole: Value = serde_json::from_slice(&done(&folder, &["sim", "merge", "whole.csv", "--json"])).unwrap();
    assert_eq!(whole, told);
    let run: Value =
        serde_json::from_slice(&done(&folder, &["sim", "study", "s.toml", "--trials", "6", "--first", "2", "--json"])).unwrap();
    // Keys that the rows do not contain.
    for key in ["trials_per_second", "question"] {
        whole[key] = run[key].clone();
    }
    assert_eq!(whole, run);

    refused(&folder, &["sim", "merge", "2.csv", "6.csv", "-o", "no.csv"], "trials 5 to 5 are in no shard");
    refused(&folder, &["sim", "merge", "2.csv", "whole.csv", "-o", "no.csv"], "which");
    done(&folder, &["sim", "study", "s.toml", "--trials", "1", "--first", "8", "--seed", "2", "-o", "other.csv"]);
    refused(&folder, &["sim", "merge", "whole.csv", "other.csv", "-o", "no.csv"], "merge the shards of one study");
    refused(&folder, &["sim", "merge", "s.toml"], "is not a table");
    assert!(!folder.path().join("no.csv").exists());
}

#[test]
fn a_study_that_was_cut_goes_on_wherever_it_was() {
    let folder = study();
    let arguments = ["sim", "study", "s.toml", "--trials", "4", "-o", "cut.csv"];
    done(&folder, &["sim", "study", "s.toml", "--trials", "4", "-o", "whole.csv"]);
    let whole = bytes(&folder, "whole.csv");
    let lines: Vec<usize> = (0..whole.len()).filter(|&k| whole[k] == b'\n').collect();
    let without_its_speed = |told: &[u8]| {
        let mut told: Value = serde_json::from_slice(told).unwrap();
        told["trials_per_second"] = Value::Null;
        told
    };
    let in_one_go = without_its_speed(&done(&folder, &["sim", "study", "s.toml", "--trials", "4", "--json"]));
    // Within the header; after it; within a row; within a trial, between two rows; after a complete trial; after everything.
    for end in [20, lines[0] + 1, lines[3] - 5, lines[8] + 1, lines[6] + 1, whole.len() - 1, whole.len()] {
        fs::write(folder.path().join("cut.csv"), &whole[..end]).unwrap();
        let told = done(&folder, &["sim", "study", "s.toml", "--trials", "4", "-o", "cut.csv", "--json"]);
        assert!(bytes(&folder, "cut.csv") == whole, "cut at byte {end}");
        assert_eq!(without_its_speed(&told), in_one_go, "what is told does not depend on where it was cut");
    }
    // More trials are appended to the existing ones.
    done(&folder, &["sim", "study", "s.toml", "--trials", "5", "-o", "cut.csv"]);
    assert!(bytes(&folder, "cut.csv").starts_with(&whole));
    let as_it_is = bytes(&folder, "cut.csv");

    // Mismatches are refused, and the file stays unchanged.
    refused(&folder, &arguments, "contains more than 4 trials");
    refused(
        &folder,
        &["sim", "study", "s.toml", "--trials", "9", "--first", "1", "-o", "cut.csv"],
        "begins with trial 0, not 1",
    );
    refused(&folder, &["sim", "study", "s.toml", "--trials", "9", "--seed", "7", "-o", "cut.csv"], "contains trials of quick-");
    let path = folder.path().join("s.toml");
    fs::write(&path, fs::read_to_string(&path).unwrap().replace("100.0", "101.0")).unwrap();
    refused(&folder, &["sim", "study", "s.toml", "--trials", "9", "-o", "cut.csv"], "as it is now");
    assert!(bytes(&folder, "cut.csv") == as_it_is);
    refused(&folder, &["sim", "study", "s.toml", "--trials", "9", "-o", "s.toml"], "is read by this command");
    fs::write(folder.path().join("letter"), "mine\n").unwrap();
    refused(&folder, &["sim", "study", "s.toml", "--trials", "9", "-o", "letter"], "is not a table");
    // A row changed by hand is detected.
    fs::write(folder.path().join("edited.csv"), String::from_utf8(whole).unwrap().replacen(",tracker,", ",trical,", 1))
        .unwrap();
    refused(&folder, &["sim", "merge", "edited.csv"], "edited.csv:3: trial: is not the row that must follow");
}

#[test]
fn a_shard_that_was_cut_within_a_row_is_refused_there_and_goes_on() {
    let folder = study();
    let path = folder.path().join("s.toml");
    let one_point = fs::read_to_string(&path).unwrap().split("[sweep]").next().unwrap().to_owned();
    fs::write(&path, one_point).unwrap();
    // One row a trial: without the cut row the trials that are left are whole.
    let arguments = ["sim", "study", "s.toml", "--trials", "3", "--method", "trical", "-o", "cut.csv"];
    done(&folder, &arguments);
    let whole = bytes(&folder, "cut.csv");
    for cut in [1, 50] {
        fs::write(folder.path().join("cut.csv"), &whole[..whole.len() - cut]).unwrap();
        let says = "cut.csv:4: was cut in trial 2; give the command that wrote it again";
        refused(&folder, &["sim", "merge", "cut.csv", "-o", "merged.csv"], says);
        assert!(!folder.path().join("merged.csv").exists());
        done(&folder, &arguments);
        assert!(bytes(&folder, "cut.csv") == whole);
    }
    done(&folder, &["sim", "merge", "cut.csv", "-o", "merged.csv"]);
    assert!(bytes(&folder, "merged.csv") == whole);
}

#[test]
fn trials_out_of_range_are_refused_by_their_option() {
    let folder = study();
    let first = u64::MAX.to_string();
    refused(
        &folder,
        &["sim", "study", "s.toml", "--trials", "2", "--first", &first],
        "--first: is out of range; with --trials 2 give",
    );
    refused(&folder, &["sim", "study", "s.toml", "--trials", "0"], "--trials: is out of range; give a number from 1");
}

#[test]
fn the_parquet_file_holds_the_rows() {
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::Field;

    let folder = study();
    done(&folder, &["sim", "study", "s.toml", "--trials", "3", "-o", "t.csv", "--parquet", "t.parquet"]);
    let mut table = csv::Reader::from_path(folder.path().join("t.csv")).unwrap();
    let header = table.headers().unwrap().clone();
    let reader = SerializedFileReader::new(fs::File::open(folder.path().join("t.parquet")).unwrap()).unwrap();
    let mut rows = 0;
    for (written, read) in table.records().zip(reader.get_row_iter(None).unwrap()) {
        let (written, read) = (written.unwrap(), read.unwrap());
        for ((name, text), (column, field)) in header.iter().zip(&written).zip(read.get_column_iter()) {
            let same = match field {
                Field::Null => text.is_empty(),
                Field::Str(s) => s == text,
                Field::Double(v) => text.parse() == Ok(*v),
                Field::ULong(v) => text.parse() == Ok(*v),
                other => panic!("{name} holds {other}"),
            };
            assert!(name == column && same, "{name}: '{text}' became {field}");
        }
        rows += 1;
    }
    assert_eq!(rows, 18);
}

#[test]
fn a_diagnosed_study_says_what_every_trial_would_have_been_told() {
    let folder = study();
    let told = done(&folder, &["sim", "study", "s.toml", "--trials", "2", "--diagnose", "-o", "d.csv", "--json"]);
    let told: Value = serde_json::from_slice(&told).unwrap();
    let verdicts = told["points"][0]["methods"][0]["verdicts"].as_object().unwrap();
    assert_eq!(verdicts.values().filter_map(Value::as_u64).sum::<u64>(), 2, "{verdicts:?}");
    let text = String::from_utf8(bytes(&folder, "d.csv")).unwrap();
    assert!(text.lines().next().unwrap().contains(",cell_s,verdict,finding,z_"));
    // The options are part of the study's identity: rows with others are not mixed in.
    refused(&folder, &["sim", "study", "s.toml", "--trials", "3", "-o", "d.csv"], "contains trials of");
}

/// A table of 100,000 trials, 100 MB, is continued and summarised in a fraction of that memory: keeping the rows would show.
#[test]
#[cfg(target_os = "linux")]
fn memory_does_not_grow_with_the_trials() {
    use std::io::Write;

    /// Number of trials in the file.
    const TRIALS: u64 = 100_000;
    /// Largest memory of the program, MB: less than the file takes.
    const MOST_MB: u64 = 60;
    let folder = study();
    let path = folder.path().join("s.toml");
    let one_point = fs::read_to_string(&path).unwrap().split("[sweep]").next().unwrap().to_owned();
    fs::write(&path, one_point).unwrap();
    done(&folder, &["sim", "study", "s.toml", "--trials", "1", "-o", "one.csv"]);
    let one = String::from_utf8(bytes(&folder, "one.csv")).unwrap();
    let (header, rows) = one.split_once('\n').unwrap();
    let mut table = std::io::BufWriter::new(fs::File::create(folder.path().join("many.csv")).unwrap());
    writeln!(table, "{header}").unwrap();
    // The sixth digit of these errors differs from trial to trial, as in a study.
    for trial in 0..TRIALS {
        let at = format!(",{trial},1,");
        write!(table, "{}", rows.replace(",0,1,", &at).replace(",done,0.0", &format!(",done,0.0{:04}", trial % 9999))).unwrap();
    }
    table.into_inner().unwrap().sync_all().unwrap();
    assert!(fs::metadata(folder.path().join("many.csv")).unwrap().len() > 80_000_000);
    let more = (TRIALS + 1).to_string();
    for arguments in [
        vec!["sim", "study", "s.toml", "--trials", &more, "-o", "many.csv", "--parquet", "many.parquet"],
        vec!["sim", "merge", "many.csv", "-o", "again.csv"],
    ] {
        let mut child = Command::new(env!("CARGO_BIN_EXE_calibench"))
            .current_dir(&folder)
            .args(&arguments)
            .stdout(std::process::Stdio::null())
            .spawn()
            .unwrap();
        let mut peak_kb = 0;
        let status = loop {
            let status = fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap_or_default();
            let peak = status.lines().find_map(|l| l.strip_prefix("VmHWM:")?.trim().strip_suffix(" kB")?.parse().ok());
            peak_kb = peak.unwrap_or(0).max(peak_kb);
            if let Some(status) = child.try_wait().unwrap() {
                break status;
            }
            std::thread::sleep(std::time::Duration::from_millis(20));
        };
        println!("{}: {} MB at most", arguments[..2].join(" "), peak_kb >> 10);
        assert!(status.success() && peak_kb > 0 && peak_kb >> 10 < MOST_MB, "{arguments:?}: {peak_kb} kB");
    }
    assert!(bytes(&folder, "again.csv") == bytes(&folder, "many.csv"));
}

/// A quick cell whose robots differ.
const ROBOTS: &str = "format = \"calibench-scenario/1\"\nextends = \"CELL\"\nname = \"robots\"\nquestion = \"?\"\n
[plan]\npool_per_ball = 100\nstarts = 1\nposes_per_ball = 10\n
[tracker]\nvalidation_poses = 20\nidentification_poses = 20\n
[truth.effects.harmonic1]\ndraw = 1.0\n[truth.effects.joint_scale]\ndraw = 1.0\n";

#[test]
fn rare_robots_are_weighed_and_cut_like_others() {
    let folder = study();
    let text = ROBOTS.replace("CELL", &scenario("table8.toml").replace('\\', "/"));
    fs::write(folder.path().join("robots.toml"), text).unwrap();
    let of = |more: &[&str]| {
        let base = ["sim", "study", "robots.toml", "--method", "trical", "--rare", "0.99"];
        done(&folder, &[&base, more].concat())
    };
    let told: Value = serde_json::from_slice(&of(&["--trials", "60", "-o", "whole.csv", "--json"])).unwrap();
    of(&["--trials", "25", "-o", "first.csv"]);
    of(&["--first", "25", "--trials", "35", "-o", "second.csv"]);
    let merged: Value =
        serde_json::from_slice(&done(&folder, &["sim", "merge", "second.csv", "first.csv", "-o", "merged.csv", "--json"]))
            .unwrap();
    let whole = bytes(&folder, "whole.csv");
    assert!(bytes(&folder, "merged.csv") == whole);
    assert_eq!(merged["methods"], told["methods"]);
    // Cut within a row, it continues.
    fs::write(folder.path().join("whole.csv"), &whole[..whole.len() - 40]).unwrap();
    of(&["--trials", "60", "-o", "whole.csv"]);
    assert!(bytes(&folder, "whole.csv") == whole);

    // No weight exceeds the inverse of the share sampled as stated, and the worst robots are many and light.
    let mut table = csv::Reader::from_path(folder.path().join("whole.csv")).unwrap();
    let header = table.headers().unwrap().clone();
    let column = |name: &str| header.iter().position(|h| h == name).unwrap();
    let (weight, rms) = (column("weight"), column("rms_mm"));
    let rows: Vec<[f64; 2]> =
        table.records().map(|r| r.unwrap()).map(|r| [weight, rms].map(|k| r[k].parse::<f64>().unwrap())).collect();
    assert!(rows.iter().all(|[w, _]| *w > 0.0 && *w <= 5.0));
    let mut by_error = rows.clone();
    by_error.sort_by(|a, b| a[1].total_cmp(&b[1]));
    let mean = |part: &[[f64; 2]]| part.iter().map(|[w, _]| w).sum::<f64>() / part.len() as f64;
    assert!(mean(&by_error[40..]) < 0.2 * mean(&by_error[..20]), "{by_error:?}");
    let tail = &told["methods"][0]["rms_mm"];
    assert_eq!((tail["share"].as_f64(), tail["trials"].as_u64()), (Some(0.99), Some(60)));
    assert!(told["methods"][0].get("coverage").is_none(), "counts of weighted trials are no shares");

    // Other robots, another study.
    done(&folder, &["sim", "study", "robots.toml", "--method", "trical", "--trials", "60", "-o", "plain.csv"]);
    refused(&folder, &["sim", "merge", "plain.csv", "first.csv"], "merge the shards of one study");
    let rare = |more: &[&'static str]| [&["sim", "study", "robots.toml", "--trials", "3", "--rare", "0.99"], more].concat();
    refused(&folder, &rare(&["--diagnose"]), "leave out --diagnose");
    refused(&folder, &rare(&["--report", "page.html"]), "leave out --rare");
    refused(&folder, &["sim", "merge", "first.csv", "--report", "page.html"], "these are of rare robots");
    refused(&folder, &["sim", "study", "s.toml", "--trials", "3", "--rare", "0.99"], "samples no error of the robot");
}
