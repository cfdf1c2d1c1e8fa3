//! Every document that the program prints is read by its type and written again without a change; a wrong file is refused with
//! its line.

use std::fs;

use calibench_report::documents::{
    Calibration, Comparison, Compensation, Detectability, Diagnosis, Discovery, ImportReport, Ladder, Misfit, Next, Run, Step,
    Validated, to_value,
};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::compensate_goes_through_the_program::{calibench, run_folder};
use crate::oracles::data;

/// Asserts that `printed` is exactly a document of type `T`.
fn is_a<T: DeserializeOwned + Serialize>(verb: &str, printed: &[u8]) {
    let value: Value = serde_json::from_slice(printed).unwrap_or_else(|e| panic!("{verb}: {e}"));
    let document: T = serde_json::from_slice(printed).unwrap_or_else(|e| panic!("{verb}: {e}"));
    assert_eq!(to_value(&document), value, "{verb}");
}

#[test]
fn every_verb_prints_a_document_of_its_type() {
    let folder = tempfile::tempdir().unwrap();
    let run = |arguments: &str| {
        let output = calibench(folder.path(), &arguments.split(' ').collect::<Vec<_>>());
        assert!(!output.stdout.is_empty(), "{arguments}: {}", String::from_utf8_lossy(&output.stderr));
        output.stdout
    };
    let from = run_folder().join("r");
    for name in ["trical", "validation"] {
        fs::create_dir(folder.path().join(name)).unwrap();
        for file in ["dataset.toml", "samples.csv"] {
            fs::copy(from.join(name).join(file), folder.path().join(name).join(file)).unwrap();
        }
    }
    is_a::<Run>("run", &fs::read(from.join(Run::FILE)).unwrap());
    is_a::<Calibration>("identify", &run("identify trical --json -o c.toml"));
    is_a::<Calibration>("identify --shifts", &run("identify trical --json --shifts"));
    is_a::<Validated>("validate", &run("validate c.toml validation --json"));
    is_a::<Comparison>("compare", &run("compare c.toml trical --json"));
    is_a::<Diagnosis>("diagnose", &run("diagnose trical --json"));
    is_a::<Step>("add", &run("add harmonic2:3 trical --json"));
    is_a::<Ladder>("ladder", &run("ladder trical --json"));
    is_a::<Discovery>("discover", &run("discover trical --json"));
    is_a::<Next>("next", &run("plan next trical --json -o plan.toml"));
    fs::write(
        folder.path().join("t.csv"),
        "id,x_mm,y_mm,z_mm,a_deg,b_deg,c_deg\nnear,420,60,400,170,10,175\nfar,4500,60,400,170,10,175\n",
    )
    .unwrap();
    is_a::<Compensation>("compensate", &run("compensate c.toml t.csv -o f.csv --json"));
    is_a::<Compensation>("compensate --urdf", &run("compensate c.toml --urdf r.urdf --json"));
    let plan = format!("plan {} --json -o p.toml", run_folder().join("s.toml").display());
    is_a::<Detectability>("plan", &run(&plan));
    // Joint 4 in the other sense.
    let samples = fs::read_to_string(folder.path().join("trical/samples.csv")).unwrap();
    let column = samples.lines().next().unwrap().split(',').position(|c| c == "q4_deg").unwrap();
    let flipped = samples.lines().enumerate().map(|(k, line)| {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        if k > 0 {
            cells[column] = format!("{}", -cells[column].parse::<f64>().unwrap());
        }
        cells.join(",")
    });
    fs::write(folder.path().join("trical/samples.csv"), flipped.collect::<Vec<_>>().join("\n")).unwrap();
    is_a::<Misfit>("diagnose of a misfit", &run("diagnose trical --json"));
    is_a::<Diagnosis>("diagnose --force", &run("diagnose trical --json --force"));
    let random = data("ur5-jacobi").join("3D_UR5_uncalibrated_random_cleaned.csv");
    is_a::<ImportReport>("import", &run(&format!("import ur5-jacobi {} -o imported --json", random.display())));
}

#[test]
fn the_document_of_another_kind_is_refused_with_its_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("result.json");
    for (text, named) in [
        ("{\n  \"format\": \"calibench-run/1\"\n}", "result.json:2: "),
        ("{\n  \"format\": \"calibench-run/2\"\n}", "missing field `scenario`"),
        ("[1, 2", "result.json:1: "),
    ] {
        fs::write(&path, text).unwrap();
        let error = Run::read(folder.path()).unwrap_err().to_string();
        assert!(error.contains(named) && error.contains("calibench run"), "{text}: {error}");
    }
    fs::write(&path, "").unwrap();
    assert!(Run::read(folder.path()).unwrap_err().to_string().contains("result.json: is empty"));
}
