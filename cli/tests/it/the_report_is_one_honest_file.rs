//! The report of a run is one self-contained file, has the same numbers as the verbs, and treats hostile names as plain text.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::program::{done, json, run_of, scenario};
use serde_json::Value;

/// Allowed difference from another verb's output for the same data: the rounding of files to fifteen digits.
const ROUNDING: f64 = 1e-9;

/// The document in a page.
fn document(page: &str) -> Value {
    let (_, rest) = page.split_once(r#"<script type="application/json" id="data">"#).unwrap();
    serde_json::from_str(rest.split_once("</script>").unwrap().0).unwrap()
}

/// A page without the contents of its scripts, and the attributes of the script tags.
fn outside_scripts(page: &str) -> (String, Vec<&str>) {
    let (mut rest, mut outside, mut tags) = (page, String::new(), Vec::new());
    while let Some((before, after)) = rest.split_once("<script") {
        let (tag, after) = after.split_once('>').unwrap();
        outside.push_str(before);
        tags.push(tag);
        rest = after.split_once("</script>").unwrap().1;
    }
    outside.push_str(rest);
    (outside, tags)
}

#[track_caller]
fn assert_same(a: &Value, b: &Value, keys: &[&str]) {
    for key in keys {
        match (a[*key].as_f64(), b[*key].as_f64()) {
            (Some(x), Some(y)) => assert!((x - y).abs() <= ROUNDING * x.abs().max(y.abs()), "{key}: {x} and {y}"),
            _ => assert_eq!(a[*key], b[*key], "{key}"),
        }
        assert!(!a[*key].is_null(), "{key}");
    }
}

#[test]
fn one_file_the_same_every_time_with_the_numbers_of_the_other_verbs() {
    let folder = run_of("gear-ripple.toml");
    let at = folder.path().join("run");
    let page = fs::read_to_string(at.join("report.html")).unwrap();

    // One file: nothing is loaded, and a policy tells the browser so.
    let (outside, tags) = outside_scripts(&page);
    assert_eq!(tags, ["", r#" type="application/json" id="data""#, "", ""]);
    for loads in ["src=", "href=", "url(", "@import", "<link", "<img", "<iframe", "<base"] {
        assert!(!outside.contains(loads), "{loads}");
    }
    assert!(outside.contains("Content-Security-Policy") && outside.contains("default-src 'none'"));
    assert!(
        outside.contains("Apache ECharts") && outside.contains("The Apache Software Foundation"),
        "the notice of the charts"
    );

    // The same bytes: regenerated from the run's folder, from elsewhere, and from another run.
    done(folder.path(), &["report", "run", "-o", "again.html"]);
    assert!(fs::read_to_string(folder.path().join("again.html")).unwrap() == page);
    let other = run_of("gear-ripple.toml");
    assert!(fs::read_to_string(other.path().join("run/report.html")).unwrap() == page);

    // The numbers agree with the other verbs. The error over the workspace is given at the poses on which the run was
    // validated.
    let report = document(&page);
    let diagnosis = json(&at, &["diagnose", "trical", "--json"]);
    for (key, value) in
        diagnosis.as_object().unwrap().iter().filter(|(k, _)| !["workspace", "outside_range", "advice"].contains(&k.as_str()))
    {
        assert_eq!(report["diagnosis"][key], *value, "{key}");
    }
    assert_eq!(report["verdict"]["headline"], "Missing in the model: gear ripple of joint 3, 202 per turn");
    let judged = json(&at, &["validate", "trical.toml", "validation", "--json"]);
    assert_same(&report["validation"], &judged, &["samples", "mean_mm", "max_mm", "std_mm", "rms_mm"]);
    let compared = json(&at, &["compare", "trical.toml", "trical", "validation", "--json"]);
    assert_same(&report["diagnosis"]["workspace"], &compared["workspace"], &["mean_mm", "max_mm", "poses", "from"]);
    let result: Value = serde_json::from_slice(&fs::read(at.join("result.json")).unwrap()).unwrap();
    assert_eq!(report["run"], result);
    let step = json(&at, &["add", "harmonic:3:202", "trical", "--json"]);
    let steps = report["ladder"]["rungs"].as_array().unwrap();
    for (ladder_step, of_step) in steps.iter().zip(["before", "after"]) {
        assert_same(ladder_step, &step[of_step], &["residual_mm", "cross_validated_mm", "noise_left_mm", "effects"]);
    }
    assert_eq!(steps.len(), 2);

    // The candidate's points come from a separate fit: subtracting its effect from the residuals gives the stated remainder.
    let candidate = &report["candidates"][0];
    assert_eq!(candidate["effect"], "harmonic:3:202");
    let samples = report["residuals"]["samples"].as_array().unwrap();
    let square = |sample: &Value, takes: &Value| -> f64 {
        (0..3).map(|k| (sample["residual_um"][k].as_f64().unwrap() - takes[k].as_f64().unwrap()).powi(2)).sum()
    };
    let takes = candidate["takes_um"].as_array().unwrap();
    let left = (samples.iter().zip(takes).map(|(s, t)| square(s, t)).sum::<f64>() / samples.len() as f64).sqrt();
    // Points are rounded to six digits.
    assert!((left / 1000.0 - candidate["rms_after_mm"].as_f64().unwrap()).abs() < 1e-6, "{left}");
    assert_eq!((samples.len(), &report["telling"]["kind"]), (80, &"phase".into()));
}

/// One grey pixel (ISO/IEC 15948).
const PIXEL: &[u8] = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\x01\0\0\0\x01\x08\0\0\0\0\x3a\x7e\x9b\x55\
    \0\0\0\nIDATx\xda\x63\x68\0\0\0\x82\0\x81\xda\x45\x08\x3b\0\0\0\0IEND\xaeB`\x82";

#[test]
fn the_cell_as_it_was_drawn_is_in_the_page_itself_and_the_model_of_the_run_beside_it() {
    let folder = run_of("gear-ripple.toml");
    let at = folder.path().join("run");
    let without = document(&fs::read_to_string(at.join("report.html")).unwrap());
    assert_eq!(without["pictures"], serde_json::json!([]));

    fs::write(at.join("cell.png"), PIXEL).unwrap();
    fs::write(at.join("gauge.png"), PIXEL).unwrap();
    done(folder.path(), &["report", "run"]);
    let page = fs::read_to_string(at.join("report.html")).unwrap();
    let pictures = document(&page)["pictures"].as_array().unwrap().clone();
    assert_eq!(pictures.len(), 2);
    for picture in &pictures {
        // The first six bytes of the signature, in base 64 (RFC 4648).
        assert!(picture["data"].as_str().unwrap().starts_with("data:image/png;base64,iVBORw0K"), "{picture}");
        assert!(picture["shows"].as_str().unwrap().len() > 20, "who does not see it is told what it shows");
    }
    assert!(page.contains("img-src data:") && !outside_scripts(&page).0.contains("<img"));

    // A file that is not a picture is rejected.
    fs::write(at.join("gauge.png"), "<svg onload=alert(1)>").unwrap();
    let output =
        Command::new(env!("CARGO_BIN_EXE_calibench")).current_dir(folder.path()).args(["report", "run"]).output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(said.contains("gauge.png") && said.contains("is not a PNG picture"), "{said}");

    // The run's model is stored beside it.
    let report = json(folder.path(), &["diagnose", "run/trical", "--model", "run/model.toml", "--json"]);
    assert_eq!(report["fitted"], without["diagnosis"]["fitted"]);

    // A run is replaced by another one.
    let again = scenario("gear-ripple.toml");
    done(folder.path(), &["run", &again, "--out", "run"]);
    assert!(!at.join("gauge.png").exists());
}

#[test]
fn hostile_names_stay_text() {
    const HOSTILE: &str = "</script><img src=x onerror=alert(1)>&<!--";
    let folder = run_of("gear-ripple.toml");
    let trical = folder.path().join("run/trical");
    let described = fs::read_to_string(trical.join("dataset.toml")).unwrap();
    let renamed = described.replace("id = \"3\"", &format!("id = '{HOSTILE}'"));
    assert_ne!(described, renamed);
    fs::write(trical.join("dataset.toml"), renamed).unwrap();
    let samples = fs::read_to_string(trical.join("samples.csv")).unwrap();
    let mut reader = csv::Reader::from_reader(samples.as_bytes());
    let header = reader.headers().unwrap().clone();
    let ball = header.iter().position(|h| h == "ball").unwrap();
    let mut writer = csv::Writer::from_path(trical.join("samples.csv")).unwrap();
    writer.write_record(&header).unwrap();
    for row in reader.records() {
        let row = row.unwrap();
        writer.write_record(row.iter().enumerate().map(|(k, f)| if k == ball && f == "3" { HOSTILE } else { f })).unwrap();
    }
    writer.flush().unwrap();
    drop(writer);
    let hostile_folder = folder.path().join("<b>run&");
    fs::rename(&trical, &hostile_folder).unwrap();

    done(folder.path(), &["report", "<b>run&", "-o", "hostile.html"]);
    let page = fs::read_to_string(folder.path().join("hostile.html")).unwrap();
    let (outside, tags) = outside_scripts(&page);
    assert_eq!(tags.len(), 4);
    assert!(!outside.contains("<img") && !page.contains("<img src=x") && !page.contains("<b>run&"));
    let report = document(&page);
    assert_eq!(report["title"], "<b>run&");
    let balls = report["residuals"]["balls"].as_array().unwrap();
    assert!(balls.iter().any(|b| b["ball"] == HOSTILE), "{balls:?}");
    // Copied for a check in a browser: tests/browser/report_in_a_browser.py.
    fs::copy(folder.path().join("hostile.html"), Path::new(env!("CARGO_TARGET_TMPDIR")).join("hostile.html")).unwrap();
}

#[test]
fn what_is_no_run_and_no_dataset_ends_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |arguments: &[&str], because: &str| {
        let output = Command::new(env!("CARGO_BIN_EXE_calibench")).current_dir(folder.path()).args(arguments).output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!((output.status.code(), said.trim_end().lines().count()), (Some(2), 1), "{said}");
        assert!(said.contains(because), "{said}");
    };
    refused(&["report", "nothing"], "nothing");
    fs::create_dir(folder.path().join("run")).unwrap();
    fs::write(folder.path().join("run/result.json"), "{}").unwrap();
    refused(&["report", "run"], "result.json:1: missing field `format`");
    fs::write(folder.path().join("run/result.json"), "{").unwrap();
    refused(&["report", "run"], "result.json:1: EOF while parsing");
    refused(&["report", "run", "--model", "model.toml"], "--model is for datasets");
}
