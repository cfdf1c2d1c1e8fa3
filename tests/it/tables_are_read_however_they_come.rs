//! The same measurements give the same samples from text, from columns in white space, from a sheet of a workbook that another program
//! wrote, and from two files side by side; and the map that is proposed for a table is right, or says why there is none.

use std::cell::Cell;
use std::fs;
use std::path::{Path, PathBuf};

use calibench::import::{Guess, ImportError, ImportOptions, guess, import};
use calibench::measure::dataset::{Dataset, Measured, SampleSet};
use calibench::robot::kinematics::world_from_tool;
use calibench::robot::{FramePose, Robot, built_in};
use calibench::units::MM;

use crate::oracles::data;

fn tables() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/tables")
}

const COLUMNS: &str = "
[columns]
id = { column = 'point' }
q1 = { column = 'q_0', unit = 'rad' }
q2 = { column = 'q_1', unit = 'rad' }
q3 = { column = 'q_2', unit = 'rad' }
q4 = { column = 'q_3', unit = 'rad' }
q5 = { column = 'q_4', unit = 'rad' }
q6 = { column = 'q_5', unit = 'rad' }
x = { column = 'x [mm]', unit = 'mm' }
y = { column = 'y [mm]', unit = 'mm' }
z = { column = 'z [mm]', unit = 'mm' }

[dataset]
robot = 'ur5'
[dataset.tool]
x_mm = 0.0
y_mm = 0.0
z_mm = 0.0
free = true
";

struct Scratch(tempfile::TempDir);

impl Scratch {
    fn new() -> Self {
        Scratch(tempfile::tempdir().unwrap())
    }

    fn file(&self, name: &str, text: &str) -> PathBuf {
        let path = self.0.path().join(name);
        fs::write(&path, text).unwrap();
        path
    }

    /// Imports by a map that begins with `head`.
    fn read(&self, files: &[PathBuf], head: &str) -> Result<(Dataset, Vec<String>), ImportError> {
        let map = self.file("map.toml", &format!("format = 'calibench-import/1'\n{head}{COLUMNS}"));
        let (dataset, report) = import("generic", files, &ImportOptions { map: Some(map), ..ImportOptions::default() })?;
        Ok((dataset, report.notes))
    }
}

/// Rows of the table without its header, and the header.
fn rows() -> (String, Vec<Vec<String>>) {
    let text = fs::read_to_string(tables().join("table.csv")).unwrap();
    let mut lines = text.lines();
    let header = lines.next().unwrap().to_owned();
    (header, lines.map(|l| l.split(',').map(str::to_owned).collect()).collect())
}

#[test]
fn the_same_samples_from_every_kind_of_file() {
    let scratch = Scratch::new();
    let plain = scratch.read(&[tables().join("table.csv")], "").unwrap().0;
    assert_eq!(plain.samples.len(), 40);
    let (header, rows) = rows();

    let sheet = scratch.read(&[tables().join("table.xlsx")], "sheet = 'Measurements'\n").unwrap().0;
    assert_eq!(sheet.samples, plain.samples);
    let first = scratch.read(&[tables().join("table.xlsx")], "").unwrap().0;
    assert_eq!(first.samples, plain.samples, "the sheet of remarks is no table");

    let spaced = format!("  {}\n\n", header.replace(" [", "[").replace(',', " \t "))
        + &rows.iter().map(|r| format!("  {}\n", r.join("   "))).collect::<String>();
    let map = format!("format = 'calibench-import/1'\ndelimiter = ' '\n{}", COLUMNS.replace(" [mm]", "[mm]"));
    let options = ImportOptions { map: Some(scratch.file("spaced.toml", &map)), ..ImportOptions::default() };
    let spaced = import("generic", &[scratch.file("spaced.txt", &spaced)], &options).unwrap().0;
    assert_eq!(spaced.samples, plain.samples);

    // Joints and points in two files: by their order, and by their names in another order.
    let cut = |from: usize, to: usize| move |r: &Vec<String>| r[from..to].join(",") + "\n";
    let titles: Vec<&str> = header.split(',').collect();
    let joints = titles[..7].join(",") + "\n" + &rows.iter().map(cut(0, 7)).collect::<String>();
    let points = titles[7..].join(",") + "\n" + &rows.iter().map(cut(7, 10)).collect::<String>();
    let side_by_side = [scratch.file("joints.csv", &joints), scratch.file("points.csv", &points)];
    let joined = scratch.read(&side_by_side, "join = 'rows'\n").unwrap().0;
    assert_eq!(joined.samples, plain.samples);
    let named = |r: &Vec<String>| format!("{},{}\n", r[0], r[7..].join(","));
    let shuffled = format!("point,{}\n", titles[7..].join(",")) + &rows.iter().rev().map(named).collect::<String>();
    let by_name = [side_by_side[0].clone(), scratch.file("by_name.csv", &shuffled)];
    let (joined, notes) = scratch.read(&by_name, "join = 'point'\n").unwrap();
    assert_eq!(joined.samples, plain.samples);
    assert!(notes.is_empty(), "{notes:?}");
    // One of them was not measured.
    let fewer = format!("point,{}\n", titles[7..].join(",")) + &rows.iter().skip(1).map(named).collect::<String>();
    let (joined, notes) =
        scratch.read(&[side_by_side[0].clone(), scratch.file("fewer.csv", &fewer)], "join = 'point'\n").unwrap();
    assert_eq!(joined.samples, plain.samples[1..]);
    assert!(notes[0].contains("1 rows have no partner by 'point'"), "{notes:?}");
}

#[test]
fn what_cannot_be_joined_or_read_is_named() {
    let scratch = Scratch::new();
    let (header, rows) = rows();
    let table = tables().join("table.csv");
    let short = header.clone() + "\n" + &rows[0].join(",") + "\n";
    let short = scratch.file("short.csv", &short);
    let twice = scratch.file("twice.csv", &format!("{header}\n{0}\n{0}\n", rows[0].join(",")));
    let no_book = scratch.file("no.xlsx", "point,q_0\n");
    for (files, head, said) in [
        (vec![table.clone(), short.clone()], "join = 'rows'\n", "short.csv: has 1 rows where"),
        (vec![table.clone(), twice], "join = 'point'\n", "twice.csv:3: point: 'p1' is there twice"),
        (vec![table.clone(), short.clone()], "join = 'name'\n", "table.csv:1: name: there is no such column to join by"),
        (vec![short.clone(), table.clone()], "join = 'rows'\nsession_per_file = true\n", "joined files are one table"),
        (
            vec![tables().join("table.xlsx")],
            "sheet = 'Data'\n",
            "there is no sheet 'Data'; its sheets are Remarks, Measurements",
        ),
        (vec![no_book], "", "no.xlsx: cannot be read as a workbook"),
        (vec![tables().join("table.xlsx")], "sheet = 'Remarks'\n", "measured by night"),
        (vec![scratch.0.path().to_owned()], "delimiter = ' '\n", "is a directory"),
    ] {
        let error = scratch.read(&files, head).unwrap_err().to_string();
        assert!(error.contains(said), "{head}: {error}");
    }
    let map = scratch.file("joined.toml", &format!("format = 'calibench-import/1'\njoin = 'rows'\n{COLUMNS}"));
    let sets = vec![SampleSet::Fit, SampleSet::Validation];
    let options = ImportOptions { map: Some(map), sets, ..ImportOptions::default() };
    let error = import("generic", &[table.clone(), table], &options).unwrap_err();
    assert!(matches!(error, ImportError::SetsOfJoined), "{error}");
}

/// Interpretation of a file by the proposed map.
fn understood(path: &Path, robot: &str) -> (Guess, Dataset) {
    let scratch = Scratch::new();
    let found = guess(path, &ur(robot), robot).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let options = ImportOptions { map: Some(scratch.file("map.toml", &found.map)), ..ImportOptions::default() };
    let (dataset, _) = import("generic", &[path.to_owned()], &options).unwrap();
    (found, dataset)
}

fn ur(name: &str) -> Robot {
    built_in(name).unwrap()
}

#[test]
fn a_map_is_proposed_for_real_tables() {
    // Goals stand beside measurements, and fit the nominal arm better; titles have no numbers, decimals have commas.
    for (series, file) in [
        ("Series_A", "measurements_grid.csv"),
        ("Series_B", "measurements_joint_configurations.csv"),
        ("Series_D", "measurements_iso_cubes.csv"),
    ] {
        let path = data("ur10-ipa").join(series).join(file);
        let (_, dataset) = understood(&path, "ur10");
        let (known, _) = import("ur10-ipa", &[path], &ImportOptions::default()).unwrap();
        assert_eq!(dataset.samples.len(), known.samples.len(), "{series}");
        for (ours, theirs) in dataset.samples.iter().zip(&known.samples) {
            assert_eq!((&ours.q, &ours.measured), (&theirs.q, &theirs.measured), "{series}");
        }
    }
    // Targets computed from the joints, and their differences from what was measured.
    let grid = data("ur5-jacobi").join("3D_UR5_uncalibrated_grid_cleaned.csv");
    let (found, dataset) = understood(&grid, "ur5");
    let (known, _) = import("ur5-jacobi", std::slice::from_ref(&grid), &ImportOptions::default()).unwrap();
    let same =
        |(a, b): (&calibench::measure::dataset::Sample, &calibench::measure::dataset::Sample)| match (&a.measured, &b.measured)
        {
            (Measured::Point(a), Measured::Point(b)) => (a - b).norm() < 1e-9,
            _ => false,
        };
    assert!(dataset.samples.iter().zip(&known.samples).all(same));
    assert!(found.reasons.iter().any(|r| r.contains("were computed from the joints")), "{:?}", found.reasons);
    assert!(found.reasons.iter().any(|r| r.contains("measured minus target, so check which")), "{:?}", found.reasons);
}

#[test]
fn a_map_is_proposed_whatever_the_dialect() {
    let scratch = Scratch::new();
    let (_, rows) = rows();
    let (known, _) = understood(&tables().join("table.csv"), "ur5");
    // No header, tabs, decimal commas, degrees and metres; a running number in front.
    let dialect = |r: &Vec<String>| {
        let q = r[1..7].iter().map(|v| format!("{:.9}", v.parse::<f64>().unwrap().to_degrees()));
        let p = r[7..].iter().map(|v| format!("{:.9}", v.parse::<f64>().unwrap() * MM));
        q.chain(p).collect::<Vec<_>>().join("\t").replace('.', ",") + "\n"
    };
    let bare = scratch.file("bare.txt", &rows.iter().map(dialect).collect::<String>());
    for path in [tables().join("table.xlsx"), bare] {
        let (found, dataset) = understood(&path, "ur5");
        assert!((found.residual - known.residual).abs() < 1e-6, "{}: {}", path.display(), found.residual);
        assert_eq!(dataset.samples.len(), 40);
        assert!(found.shown[0].contains("joints 73.201, 73.906, 3.678"), "{:?}", found.shown);
    }
    // Whole numbers of rows, torques and velocities are not joints.
    let written = Cell::new(0);
    let table = |titles: &str, row: &dyn Fn(&Vec<String>) -> String| {
        written.set(written.get() + 1);
        scratch.file(
            &format!("t{}.csv", written.get()),
            &(titles.to_owned() + "\n" + &rows.iter().map(|r| row(r) + "\n").collect::<String>()),
        )
    };
    let zeros = ["0.5"; 6].join(",");
    let path = table("tau_1,tau_2,tau_3,tau_4,tau_5,tau_6,joint1,joint2,joint3,joint4,joint5,joint6,px,py,pz", &|r| {
        format!("{zeros},{}", r[1..].join(","))
    });
    let (found, _) = understood(&path, "ur5");
    assert!((found.residual - known.residual).abs() < 1e-6 && found.map.contains("\"joint1\""), "{}", found.map);

    // A measurement that failed is left out.
    for failed in ["NaN", "n/a"] {
        let path = table("q1,q2,q3,q4,q5,q6,x,y,z", &|r| match r[0] == "p7" {
            true => format!("{},{failed},{}", r[1..8].join(","), r[9]),
            false => r[1..].join(","),
        });
        let (found, dataset) = understood(&path, "ur5");
        assert!((found.residual - known.residual).abs() < 0.1 * known.residual && dataset.samples.len() + 1 == rows.len());
    }

    // Signs of degrees in the cells, and micrometres of which no title tells.
    let path = table("q1,q2,q3,q4,q5,q6,x,y,z", &|r| {
        let q = r[1..7].iter().map(|v| format!("{:.6}°", v.parse::<f64>().unwrap().to_degrees()));
        let p = r[7..].iter().map(|v| format!("{:.1}", v.parse::<f64>().unwrap() * 1e3));
        q.chain(p).collect::<Vec<_>>().join(",")
    });
    let (found, dataset) = understood(&path, "ur5");
    assert!((found.residual - known.residual).abs() < 1e-6 && found.map.contains("\"um\""), "{}", found.map);
    assert_eq!(dataset.samples.len(), 40);
    // A row that is a field short or long is left out, and does not take those before it with it.
    for (name, end) in [("p3", 9), ("p5", 11)] {
        let path = table("q1,q2,q3,q4,q5,q6,x,y,z", &|r| match r[0] == name {
            true => [&r[1..], &[String::from("7")]].concat()[..end - 1].join(","),
            false => r[1..].join(","),
        });
        let (found, dataset) = understood(&path, "ur5");
        assert!((found.residual - known.residual).abs() < 0.1 * known.residual, "{}", found.residual);
        assert_eq!(dataset.samples.len(), 39, "{name}");
    }

    // Where the arm was told to go, rounded, fits better than what was measured; columns of the format's own names keep their meaning.
    let robot = ur("ur5");
    let told = |r: &Vec<String>| {
        let q: Vec<f64> = r[1..7].iter().map(|v| v.parse().unwrap()).collect();
        let at = world_from_tool(&robot, &FramePose::default(), &FramePose::default(), &q).translation.vector / MM;
        format!("{:.1},{:.1},{:.1}", at.x, at.y, at.z)
    };
    let path = table("q1,q2,q3,q4,q5,q6,x,y,z,x_meas,y_meas,z_meas,set,operator", &|r| {
        let set = if r[0].ends_with('3') { "validation" } else { "fit" };
        format!("{},{},{},{set},Kim", r[1..7].join(","), told(r), r[7..].join(","))
    });
    let (found, dataset) = understood(&path, "ur5");
    assert!(
        found.map.contains("\"x_meas\"") && (found.residual - known.residual).abs() < 0.1 * known.residual,
        "{}",
        found.map
    );
    let validation = dataset.samples.iter().filter(|s| s.set == SampleSet::Validation).count();
    assert_eq!(validation, rows.iter().filter(|r| r[0].ends_with('3')).count());
    assert!(found.reasons.iter().any(|r| r.contains("may be positions too: `x`, `y`, `z`")), "{:?}", found.reasons);
    assert!(found.reasons.iter().any(|r| r.starts_with("not used: ") && r.ends_with("`operator`")), "{:?}", found.reasons);

    for (path, said) in [
        (table("q1,q2,q3,q4,q5,q6,x [in],y [in],z [in]", &|r| r[1..].join(",")), "holds positions in inches, as `x [in]` says"),
        (
            scratch.file(
                "three.csv",
                &("q1,q2,q3,q4,q5,q6,x,y,z\n".to_owned()
                    + &rows[..3].iter().map(|r| r[1..].join(",") + "\n").collect::<String>()),
            ),
            "has too few rows: 3",
        ),
        (
            table("goal_x,goal_y,goal_z,joint1,joint2,joint3,joint4,joint5,joint6", &|r| {
                format!("{},{}", r[7..].join(","), r[1..7].join(","))
            }),
            "shows no 6 columns",
        ),
        (table("a,b,c,d,e,f,g,h,i", &|r| r[1..].join(",")), "shows no 6 columns"),
        // Units that the titles state, and that the numbers are not in.
        (table("q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,x,y,z", &|r| r[1..].join(",")), "with `q1_deg`, `q2_deg`, "),
        (scratch.file("prose.csv", "Measured in May\nby us, and others\n"), "is not a regular table"),
        (scratch.file("empty.csv", ""), "is empty"),
    ] {
        let error = guess(&path, &ur("ur5"), "ur5").unwrap_err().to_string();
        assert!(error.contains(said), "{}: {error}", path.display());
    }
}

#[test]
fn the_order_of_rows_states_sides_and_times_where_the_map_says_so() {
    let scratch = Scratch::new();
    let header = "point,q_0,q_1,q_2,q_3,q_4,q_5,x [mm],y [mm],z [mm],run";
    let rows = [
        "a,0.1,-1.5,1.3,-0.2,1.2,0,400,-208,310,1",
        "b,0.2,-1.6,1.3,-0.2,1.2,0,402,-207,312,1",
        "c,0.2,-1.4,1.3,-0.3,1.2,0,405,-206,313,1",
        "d,0.1,-1.4,1.3,-0.3,1.2,0,401,-203,311,2",
        "e,0.3,-1.5,1.3,-0.3,1.2,0,404,-202,310,2",
    ];
    let table = scratch.file("table.csv", &format!("{header}\n{}\n", rows.join("\n")));
    let head = "[rows]\napproach = true\ninterval_s = 20.0\n";
    let (dataset, notes) = scratch.read(std::slice::from_ref(&table), head).unwrap();
    let sides: Vec<Vec<i8>> = dataset.samples.iter().map(|s| s.approach.clone().unwrap()).collect();
    assert_eq!(sides[0], [0; 6]);
    assert_eq!(sides[1], [1, -1, 0, 0, 0, 0]);
    assert_eq!(sides[2], [1, 1, 0, -1, 0, 0], "joint 1 keeps the side of its last move");
    assert_eq!(sides[3], [-1, 1, 0, -1, 0, 0]);
    assert_eq!(dataset.samples.iter().map(|s| s.time_s.unwrap()).collect::<Vec<_>>(), [0.0, 20.0, 40.0, 60.0, 80.0]);
    assert!(notes.iter().any(|n| n.contains("last move from row to row")) && notes.iter().any(|n| n.contains("every 20 s")));
    // A session begins again.
    let columns = COLUMNS.replace("[dataset]\n", "session = { column = 'run' }\n[dataset]\n");
    let map = scratch.file("by-run.toml", &format!("format = 'calibench-import/1'\n{head}{columns}"));
    let options = ImportOptions { map: Some(map), ..ImportOptions::default() };
    let (dataset, _) = import("generic", std::slice::from_ref(&table), &options).unwrap();
    assert_eq!((dataset.samples[3].approach.clone().unwrap(), dataset.samples[3].time_s), (vec![0; 6], Some(0.0)));
    let (plain, _) = scratch.read(std::slice::from_ref(&table), "").unwrap();
    assert!(plain.samples.iter().all(|s| s.approach.is_none() && s.time_s.is_none()));
    let error = scratch.read(&[table], "[rows]\ninterval_s = 0.0\n").unwrap_err().to_string();
    assert!(error.contains("rows.interval_s: 0 s is not an interval"), "{error}");
}

/// A table of the nominal arm in a base of its own: joints in degrees and positions in millimetres with so many digits after the point,
/// the positions off by up to so much, m.
fn of_the_nominal_arm(digits: usize, off: f64) -> String {
    let robot = built_in("ur5").unwrap();
    let base = FramePose { xyz: [0.4, -0.2, 0.1], rz_ry_rx: [0.5, 0.1, -0.2] };
    let tool = FramePose { xyz: [0.02, 0.03, 0.12], ..FramePose::default() };
    // Neither joints nor errors repeat.
    let mixed = |k: usize, by: f64| (2.0 * (k as f64 * by).fract() - 1.0) * 1.2;
    let row = |k: usize| {
        let q: Vec<f64> = [0.618, 0.414, 0.732, 0.236, 0.317, 0.162].iter().map(|by| mixed(k + 1, *by)).collect();
        let at = world_from_tool(&robot, &base, &tool, &q).translation.vector;
        let numbers = q.iter().map(|q| q.to_degrees()).chain((0..3).map(|c| (at[c] + off * mixed(3 * k + c + 1, 0.871)) / MM));
        numbers.map(|v| format!("{v:.digits$}")).collect::<Vec<_>>().join(",") + "\n"
    };
    "q1,q2,q3,q4,q5,q6,x,y,z\n".to_owned() + &(0..40).map(row).collect::<String>()
}

#[test]
fn a_calibrated_arm_is_measured_and_computed_positions_are_not() {
    let scratch = Scratch::new();
    for (name, digits) in [("rounded.csv", 3), ("whole.csv", 12)] {
        let path = scratch.file(name, &of_the_nominal_arm(digits, 0.0));
        let refused = guess(&path, &built_in("ur5").unwrap(), "ur5").unwrap_err().to_string();
        assert!(refused.contains("were computed from the joints"), "{name}: {refused}");
    }
    let path = scratch.file("measured.csv", &of_the_nominal_arm(6, 5e-6));
    let (found, dataset) = understood(&path, "ur5");
    assert!(found.residual < 15e-6 && dataset.samples.len() == 40, "{}", found.residual);
    assert!(found.reasons.iter().any(|r| r.contains("as those of a calibrated arm do")), "{:?}", found.reasons);
}
