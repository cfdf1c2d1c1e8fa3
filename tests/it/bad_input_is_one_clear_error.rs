//! Whatever is wrong with a file, there is one error that names file, line, field and remedy, and never a panic.
//!
//! A new kind of file is one entry of [`kinds`]; a new mistake is one row.

use std::fs;
use std::path::Path;

use calibench::effects::Subject;
use calibench::effects::registry::Registry;
use calibench::files::FileError;
use calibench::identify::calibration::read_calibration;
use calibench::identify::model_file::read_model;
use calibench::import::{ImportError, ImportOptions, import};
use calibench::measure::dataset::file::read_dataset;
use calibench::measure::dataset::{Ball, Dataset};
use calibench::measure::poses::read_plan;
use calibench::robot::built_in;
use calibench::robot::robot_file::load_robot;
use calibench::robot::statics::Payload;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A kind of file: a good specimen, how it is read, and what can be done to it.
struct Kind {
    /// The file that is corrupted.
    file: &'static str,
    /// Good files, by name.
    specimen: &'static [(&'static str, &'static str)],
    /// Reads them from their folder.
    read: fn(&Path) -> Result<(), FileError>,
    mistakes: Vec<Mistake>,
}

struct Mistake {
    name: &'static str,
    corrupt: Corrupt,
    line: Option<usize>,
    field: &'static str,
    remedy: &'static str,
}

type Corrupt = Box<dyn Fn(&Path)>;

fn row(
    name: &'static str,
    corrupt: Corrupt,
    line: impl Into<Option<usize>>,
    field: &'static str,
    remedy: &'static str,
) -> Mistake {
    Mistake { name, corrupt, line: line.into(), field, remedy }
}

/// Puts `new` in the place of the first `old`, which must be there.
fn replace(old: &'static str, new: &'static str) -> Corrupt {
    Box::new(move |path| {
        let text = fs::read_to_string(path).expect("a good specimen");
        assert!(text.contains(old), "the specimen has no {old:?}");
        fs::write(path, text.replacen(old, new, 1)).expect("writable");
    })
}

/// Changes the text of the file.
fn text(change: fn(String) -> String) -> Corrupt {
    Box::new(move |path| fs::write(path, change(fs::read_to_string(path).expect("a good specimen"))).expect("writable"))
}

/// Changes the bytes of the file.
fn bytes(change: fn(Vec<u8>) -> Vec<u8>) -> Corrupt {
    Box::new(move |path| fs::write(path, change(fs::read(path).expect("a good specimen"))).expect("writable"))
}

/// Takes the file away.
fn remove() -> Corrupt {
    Box::new(|path| fs::remove_file(path).expect("removable"))
}

/// Puts a folder in its place.
fn folder() -> Corrupt {
    Box::new(|path| {
        fs::remove_file(path).expect("removable");
        fs::create_dir(path).expect("writable");
    })
}

const DATASET: &str = r#"format = "calibench-dataset/1"
robot = "kr6_r700"
gravity_m_s2 = [0.0, 0.0, -9.81]

[base]
x_mm = -536.320
y_mm = -21.901
z_mm = -58.349

[tool]
x_mm = 60.0
y_mm = 0.0
z_mm = -125.0
sigma_um = 5.0

[[payload]]
name = "heavy"
mass_kg = 6.0
com_mm = [25.0, 0.0, -70.0]

[[ball]]
id = "1"
x_mm = -79.539
y_mm = -330.141
z_mm = 17.531
sigma_um = 1.9

[[ball]]
id = "2"
x_mm = -79.193
y_mm = 287.805
z_mm = 18.740

[[ball_distance]]
between = ["1", "2"]
d_mm = 617.9
sigma_um = 20.0

[[anchor]]
id = "drum"
x_mm = 100.0
y_mm = 0.0
z_mm = 0.0

[noise]
ball_um = 2.2
joint_arcsec = [1.4, 1.4, 1.9, 2.9, 4.1, 4.1]
"#;

const SAMPLES: &str = "\
id,kind,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,ball,r1_um,r2_um,r3_um,x_mm,y_mm,z_mm,anchor,d_mm,set,payload,sigma_um,approach1,approach2,approach3,approach4,approach5,approach6
a,ball,0,-90,90,0,45,0,1,0.5,-0.5,1,,,,,,fit,heavy,,1,1,-1,0,1,1
b,ball,10,-80,80,5,40,1,2,0,0,0,,,,,,,,2.5,,,,,,
c,point,20,-70,70,0,30,2,,,,,100.5,200.25,300,,,validation,,,,,,,,
d,distance,30,-60,60,0,20,3,,,,,,,,drum,812.5,,,,,,,,,
";

const MODEL: &str = r#"effects = ["base_frame", "mdh",
  "joint_compliance:2"]
[[effect]]
name = "ripple"
unit = "deg"
terms = [{ site = "theta:3", basis = "sin(17*q3)" }]
"#;

const ROBOT: &str = r#"format = "calibench-robot/1"
name = "two"

[[link]]
alpha_deg = 0.0
a_mm = 0.0
d_mm = 300.0
min_deg = -170.0
max_deg = 170.0

[[link]]
alpha_deg = 90.0
a_mm = 25.0
d_mm = 0.0
min_deg = -90.0
max_deg = 90.0
"#;

const CALIBRATION: &str = r#"format = "calibench-calibration/1"
robot = "kr6_r700"
effects = ["base_frame", "mdh"]
dataset_sha256 = ["0000000000000000000000000000000000000000000000000000000000000000"]
unresolved = [["d2", "d3"]]
correlation = [[1.0], [0.5, 1.0]]

[fit]
samples = 80
rms_mm = 0.01
chi2_per_dof = 1.0
dof = 200
rank = 2
condition = 18.0
noise_stated = true
iterations = 3
O1 = 0.3
O2 = 0.001
O3 = 0.3
O4 = 0.001
O5 = 0.05

[[joint_range]]
joint = 1
min_deg = -100.0
max_deg = 100.0
[[joint_range]]
joint = 2
min_deg = -100.0
max_deg = 0.0
[[joint_range]]
joint = 3
min_deg = 0.0
max_deg = 100.0
[[joint_range]]
joint = 4
min_deg = -100.0
max_deg = 100.0
[[joint_range]]
joint = 5
min_deg = -100.0
max_deg = 100.0
[[joint_range]]
joint = 6
min_deg = -100.0
max_deg = 100.0

[[setup]]
label = ""
dataset = "d"
session = ""
gravity_m_s2 = [0.0, 0.0, -9.81]
base_start = { x_mm = -536.0, y_mm = -22.0, z_mm = -58.0, a_deg = 0.0, b_deg = 0.0, c_deg = 0.0 }
tool = { x_mm = 60.0, y_mm = 0.0, z_mm = -125.0, a_deg = 0.0, b_deg = 0.0, c_deg = 0.0 }

[[parameter]]
name = "a2"
effect = "mdh"
value = 455.16
sigma = 0.003
unit = "mm"
nominal = 455.0

[[parameter]]
name = "base_x"
effect = "base_frame"
value = -538.0
sigma = 0.01
unit = "mm"
nominal = -536.32
stated_sigma = 0.1
"#;

const PLAN: &str = r#"format = "calibench-plan/1"
robot = "kr6_r700"

[[pose]]
id = "p01"
ball = "1"
payload = "none"
contact_deg = [0.0, -90.0, 90.0, 0.0, 45.0, 0.0]
approach_deg = [0.0, -80.0, 90.0, 0.0, 45.0, 0.0]

[[pose]]
id = "r01"
ball = "1"
payload = "none"
contact_deg = [1.0, -90.0, 90.0, 0.0, 45.0, 0.0]
approach_deg = [1.0, -80.0, 90.0, 0.0, 45.0, 0.0]
reserve = true
"#;

const MAP: &str = r#"format = "calibench-import/1"

[columns]
id = { column = "nr" }
q1 = { column = "j1", unit = "rad" }
q2 = { column = "j2", unit = "rad" }
q3 = { column = "j3", unit = "rad" }
q4 = { column = "j4", unit = "rad" }
q5 = { column = "j5", unit = "rad" }
q6 = { column = "j6", unit = "rad" }
x = { column = "x", unit = "m" }
y = { column = "y", unit = "m" }
z = { column = "z", unit = "m" }

[dataset]
robot = "ur5"

[dataset.tool]
x_mm = 0.0
y_mm = 0.0
z_mm = 28.0
"#;

const TABLE: &str = "nr,j1,j2,j3,j4,j5,j6,x,y,z
1,0.10,-1.50,1.30,-0.20,1.20,0.00,0.4012,-0.2087,0.3105
2,-0.35,-1.20,1.10,-0.60,1.00,0.50,0.5120,0.1033,0.2871
3,0.60,-0.90,0.80,0.30,0.70,-0.40,0.2934,-0.4402,0.4056
";

fn calibration(folder: &Path) -> Result<(), FileError> {
    read_calibration(&folder.join("calibration.toml"), Registry::catalogue()).map(drop)
}

fn plan(folder: &Path) -> Result<(), FileError> {
    let ball = Ball { id: "1".into(), position: Default::default(), sigma: 0.0, free: false };
    let robot = built_in("kr6_r700").expect("built in").into();
    let cell = Dataset {
        robot,
        robot_reference: "kr6_r700".into(),
        balls: vec![ball],
        payloads: vec![Payload { name: "none".into(), ..Payload::none() }],
        ..Dataset::default()
    };
    read_plan(&folder.join("plan.toml"), &cell).map(drop)
}

fn by_map(folder: &Path) -> Result<(), FileError> {
    let options = ImportOptions { map: Some(folder.join("map.toml")), ..ImportOptions::default() };
    match import("generic", &[folder.join("table.csv")], &options) {
        Ok(_) => Ok(()),
        Err(ImportError::File(e)) => Err(e),
        Err(other) => panic!("a map is wrong in itself: {other}"),
    }
}

fn dataset(folder: &Path) -> Result<(), FileError> {
    read_dataset(folder).map(drop)
}

fn model(folder: &Path) -> Result<(), FileError> {
    let robot = built_in("kr6_r700").expect("built in");
    let balls = ["1".to_owned(), "2".to_owned()];
    read_model(&folder.join("model.toml"), &Subject::new(&robot, &balls)).map(drop)
}

fn robot(folder: &Path) -> Result<(), FileError> {
    load_robot(&folder.join("robot.toml")).map(drop)
}

fn kinds() -> Vec<Kind> {
    let both = &[("dataset.toml", DATASET), ("samples.csv", SAMPLES)];
    let toml = || {
        vec![
            row("empty", text(|_| String::new()), None, "", "content"),
            row("blank", text(|_| " \n\n".into()), None, "", "content"),
            row("a folder", folder(), None, "", "a file"),
            row("not UTF-8", bytes(|b| [&b[..3], &[0xff, 0xfe, b'\n'], &b[3..]].concat()), 1, "", "UTF-8"),
            row(
                "UTF-16",
                bytes(|b| [0xff, 0xfe].into_iter().chain(b.into_iter().flat_map(|c| [c, 0])).collect()),
                1,
                "",
                "UTF-8",
            ),
            row("prose", text(|_| "See the other file.\n".into()), 1, "", "TOML"),
        ]
    };
    let mut in_dataset = vec![
        row("missing file", remove(), None, "", "dataset.toml and samples.csv"),
        row("other format", replace("dataset/1", "dataset/2"), 1, "format", "calibench-dataset/1"),
        row("no format", replace("format = \"calibench-dataset/1\"", ""), None, "format", "add"),
        row("unknown robot", replace("kr6_r700", "kr5"), 2, "robot", "built-in"),
        row("missing key", replace("y_mm = -21.901", ""), 5, "base.y_mm", "add `y_mm`"),
        row("missing table", replace("[base]\nx_mm = -536.320\ny_mm = -21.901\nz_mm = -58.349", ""), None, "base", "add"),
        row("key without unit", replace("x_mm = 60.0", "x = 60.0"), 11, "tool.x", "the unit is part of the name"),
        row("key in another unit", replace("x_mm = 60.0", "x_m = 0.06"), 11, "tool.x_m", "as `x_mm`, in that unit"),
        row("unknown table", replace("[noise]", "[nose]"), 45, "nose", "did you mean `noise`"),
        row("unknown key", replace("mass_kg", "weight_of_it"), 18, "payload[0].weight_of_it", "known here"),
        row("NaN", replace("x_mm = -536.320", "x_mm = nan"), 6, "base.x_mm", "finite"),
        row("infinity", replace("-9.81", "-inf"), 3, "gravity_m_s2[2]", "finite"),
        row("text for a number", replace("6.0", "\"six\""), 18, "payload[0].mass_kg", "a number"),
        row("two coordinates", replace("[25.0, 0.0, -70.0]", "[25.0, 0.0]"), 19, "payload[0].com_mm", "that many"),
        row("decimal comma", replace("-79.539", "-79,539"), 23, "", "decimal points"),
        row("key twice", replace("y_mm = 0.0", "x_mm = 0.0"), 12, "", "keep one"),
        row("quote not closed", replace("\"heavy\"", "\"heavy"), 17, "", ""),
        row("cut off", text(|t| t[..t.len() - 20].into()), 47, "", ""),
        row("negative mass", replace("6.0", "-6.0"), 18, "payload[0].mass_kg", "zero or more"),
        row("negative sigma of a ball", replace("sigma_um = 1.9", "sigma_um = -1.9"), 26, "ball[0].sigma_um", "zero or more"),
        row("negative sigma of the tool", replace("sigma_um = 5.0", "sigma_um = -5.0"), 14, "tool.sigma_um", "zero or more"),
        row("noise zero", replace("2.2", "0"), 46, "noise.ball_um", "positive"),
        row("noise of four joints", replace("1.4, 1.4, ", ""), 47, "noise.joint_arcsec", "one a joint"),
        row("negative lost motion", replace("2.9", "-2.9"), 47, "noise.joint_arcsec[3]", "zero or more"),
        row("ball twice", replace("id = \"2\"", "id = \"1\""), 29, "ball[1].id", "its own name"),
        row("ball without a name", replace("id = \"2\"", "id = \"\""), 29, "ball[1].id", "plain name"),
        row(
            "two balls at one place",
            replace("x_mm = -79.193\ny_mm = 287.805\nz_mm = 18.740", "x_mm = -79.539\ny_mm = -330.141\nz_mm = 17.6"),
            28,
            "ball[1]",
            "position",
        ),
        row(
            "distance to an unknown ball",
            replace("[\"1\", \"2\"]", "[\"1\", \"7\"]"),
            35,
            "ball_distance[0].between[1]",
            "balls: 1, 2",
        ),
        row("distance to itself", replace("[\"1\", \"2\"]", "[\"1\", \"1\"]"), 35, "ball_distance[0].between", "two balls"),
        row("distance zero", replace("617.9", "0.0"), 36, "ball_distance[0].d_mm", "positive"),
        row("distance sigma zero", replace("sigma_um = 20.0", "sigma_um = 0"), 37, "ball_distance[0].sigma_um", "positive"),
        row("distance without sigma", replace("sigma_um = 20.0", ""), 34, "ball_distance[0].sigma_um", "add `sigma_um`"),
    ];
    in_dataset.extend(toml());

    let in_samples = vec![
        row("missing file", remove(), None, "", "dataset.toml and samples.csv"),
        row("a folder", folder(), None, "", "samples.csv"),
        row("empty", text(|_| String::new()), None, "", "header"),
        row("blank", text(|_| "\n \n\r\n".into()), None, "", "header"),
        row("header only", text(|t| t.lines().next().unwrap_or_default().into()), None, "", "one row a measurement"),
        row("header missing", text(|t| t.split_once('\n').unwrap_or_default().1.into()), 1, "", "names the columns"),
        row("numbers for a header", text(|t| format!("1,2,3\n{t}")), 1, "", "names the columns"),
        row("cut in the last row", text(|t| t[..t.len() - 12].into()), 5, "set", "restore"),
        row("a field too few", replace("a,ball,", "a,"), 2, "approach6", "between two commas"),
        row("a field too many", replace("b,ball,10,", "b,ball,10,5,"), 3, "", "decimal points"),
        row("decimal comma", replace("100.5", "100,5"), 4, "", "decimal points"),
        row("decimal comma in quotes", replace("100.5", "\"100,5\""), 4, "x_mm", "decimal point"),
        row("semicolons", text(|t| t.replace(',', ";")), 1, "", "import"),
        row("tabs", text(|t| t.replace(',', "\t")), 1, "", "import"),
        row("unknown column", replace("sigma_um", "humidity"), 1, "humidity", "extra_humidity"),
        row("column misspelt", replace("payload", "payloads"), 1, "payloads", "did you mean `payload`"),
        row("column without unit", replace("d_mm", "d"), 1, "d", "the unit is part of the name"),
        row("joint without unit", replace("q3_deg", "q3"), 1, "q3", "`q3_deg`"),
        row("joint in radians", replace("q3_deg", "q3_rad"), 1, "q3_rad", "as `q3_deg`, in that unit"),
        row("coordinate without unit", replace("x_mm", "x"), 1, "x", "the unit is part of the name"),
        row("prefix alone", replace("sigma_um", "extra_"), 1, "extra_", ""),
        row("column without a name", replace(",sigma_um,", ",,"), 1, "", "name it"),
        row("column twice", replace("q2_deg", "q1_deg"), 1, "q1_deg", "keep one"),
        row("no id column", replace("id,kind", "extra_id,kind"), 1, "id", "add it"),
        row("no kind column", replace("kind", "extra_kind"), 1, "kind", "add it"),
        row("no joint 6", replace("q6_deg", "extra_q6"), 1, "q6_deg", "6"),
        row("no y", replace("y_mm", "extra_y"), 1, "y_mm", "3"),
        row("a joint too many", replace("sigma_um", "q7_deg"), 1, "q7_deg", "did you mean"),
        row("no id", replace("\nc,", "\n,"), 4, "id", "fill it"),
        row("id twice", replace("\nb,", "\na,"), 3, "id", "its own id"),
        row("unknown kind", replace("point", "points"), 4, "kind", "did you mean `point`"),
        row("no kind", replace("point", ""), 4, "kind", "fill it"),
        row("NaN", replace("90,0,45", "nan,0,45"), 2, "q3_deg", "leave the row out"),
        row("infinity", replace("200.25", "-inf"), 4, "y_mm", "leave the row out"),
        row("too large for a number", replace("200.25", "1e999"), 4, "y_mm", "leave the row out"),
        row("text for a number", replace("200.25", "far"), 4, "y_mm", "without its unit"),
        row("number with its unit", replace("200.25", "200.25 mm"), 4, "y_mm", "without its unit"),
        row("no joint", replace("20,-70,70", "20,,70"), 4, "q2_deg", "fill it"),
        row("joint beyond two turns", replace("20,-70,70", "20,-70,1575"), 4, "q3_deg", "degrees"),
        row("unknown ball", replace("45,0,1,", "45,0,3,"), 2, "ball", "dataset.toml has 1, 2"),
        row("no ball", replace("45,0,1,", "45,0,,"), 2, "ball", "fill it"),
        row("unknown payload", replace("heavy", "light"), 2, "payload", "dataset.toml has heavy"),
        row("unknown anchor", replace("drum", "box"), 5, "anchor", "dataset.toml has drum"),
        row("no distance", replace("812.5", ""), 5, "d_mm", "fill it"),
        row("distance zero", replace("812.5", "0"), 5, "d_mm", "positive"),
        row("point without a coordinate", replace("200.25", ""), 4, "y_mm", "fill it"),
        row("point without any", replace("100.5,200.25,300", ",,"), 4, "x_mm", "x_mm, y_mm, z_mm"),
        row("point with a ball", replace("30,2,,", "30,2,1,"), 4, "ball", "correct the kind"),
        row("ball with a point", replace("0,0,0,,,", "0,0,0,1,2,3"), 3, "x_mm", "correct the kind"),
        row("two of three readings", replace("0.5,-0.5,1", "0.5,,1"), 2, "r2_um", "leave all of them empty"),
        row("another set", replace("validation", "test"), 4, "set", "`fit` or `validation`"),
        row("sigma zero", replace("2.5", "0"), 3, "sigma_um", "positive"),
        row("sigma negative", replace("2.5", "-2.5"), 3, "sigma_um", "positive"),
        row("approach of two", replace("1,1,-1,0,1,1", "1,1,-2,0,1,1"), 2, "approach3", "-1, 0, 1"),
        row("approach missing", replace("1,1,-1,0,1,1", "1,1,,0,1,1"), 2, "approach3", "leave all of them empty"),
        row("not UTF-8", bytes(|b| b.iter().map(|&c| if c == b'x' { 0xe9 } else { c }).collect()), 1, "", "UTF-8"),
        row(
            "not UTF-8 in a row",
            bytes(|b| {
                b.split(|&c| c == b'\n')
                    .enumerate()
                    .map(|(k, l)| if k == 3 { [&[0xe9][..], l].concat() } else { l.to_vec() })
                    .collect::<Vec<_>>()
                    .join(&b'\n')
            }),
            4,
            "",
            "UTF-8",
        ),
        row("quote not closed", replace("\nc,", "\n\"c,"), 4, "", "close it"),
        row(
            "a line of 2 MB",
            text(|t| t.replacen("\nc,", &format!("\n{},", "c".repeat(2 << 20)), 1)),
            4,
            "",
            "quotes are closed",
        ),
        row("zeros", bytes(|b| vec![0; b.len()]), 1, "", ""),
        // The line is right whatever ends the lines, and with blank ones between.
        row("Windows line ends", text(|t| t.replace('\n', "\r\n").replace("point", "pint")), 4, "kind", "did you mean `point`"),
        row("blank lines", text(|t| t.replace("\nc,point", "\n\n \n\nc,pint")), 7, "kind", "did you mean `point`"),
        row("byte-order mark", text(|t| format!("\u{feff}{}", t.replace("point", "pint"))), 4, "kind", "did you mean `point`"),
    ];

    let mut in_model = vec![
        row("missing file", remove(), None, "", "check the path"),
        row("no effects", text(|_| "# nothing\n".into()), None, "effects", "add"),
        row("empty list", text(|_| "effects = []\n".into()), 1, "effects", "at least one"),
        row("not a list", text(|_| "effects = \"mdh\"\n".into()), 1, "effects", "sequence"),
        row("not a name", text(|_| "effects = [1]\n".into()), 1, "effects[0]", "string"),
        row("unknown effect", replace("mdh", "mhd"), 1, "effects[1]", "did you mean `mdh`"),
        row("nothing like it", replace("mdh", "phlogiston"), 1, "effects[1]", "catalogue"),
        row("joint that is not there", replace(":2", ":9"), 2, "effects[2]", "joint_compliance:J"),
        row("argument too many", replace(":2", ":2:3"), 2, "effects[2]", "joint_compliance:J"),
        row("named twice", replace("mdh", "base_frame"), 1, "effects[1]", "keep one"),
        row("unknown key", text(|t| format!("effcts = []\n{t}")), 1, "effcts", "did you mean `effects`"),
        row("own effect with a slip", replace("sin(17*q3)", "sin(17*q3"), 6, "effect[0].terms[0].basis", "close it"),
        row("own effect of a joint that is not there", replace("q3)", "q7)"), 6, "effect[0].terms[0].basis", "did you mean"),
        row("own effect of nothing", replace("sin(17*q3)", ""), 6, "effect[0].terms[0].basis", "`1`"),
        row("own effect read in two ways", replace("sin(17*q3)", "-q1^2"), 6, "effect[0].terms[0].basis", "(-a)^b"),
        row(
            "own effect too deep",
            text(|t| t.replace("sin(17*q3)", &"(".repeat(99))),
            6,
            "effect[0].terms[0].basis",
            "several terms",
        ),
        row(
            "own effect too long",
            text(|t| t.replace("sin(17*q3)", &"q1+".repeat(999))),
            6,
            "effect[0].terms[0].basis",
            "several terms",
        ),
        row("own effect at no site", replace("theta:3", "theta:7"), 6, "effect[0].terms[0].site", "theta:J"),
        row("own effect at a ball that is not there", replace("theta:3", "ball:9:x"), 6, "effect[0].terms[0].site", "ball:x"),
        row("own effect in no unit", replace("\"deg\"", "\"wobble\""), 5, "effect[0].unit", "known here"),
        row("own effect of no name", replace("\"ripple\"", "\"rip:ple\""), 4, "effect[0].name", "letters"),
        row("own effect named as one of the catalogue", replace("\"ripple\"", "\"mdh\""), 4, "effect[0].name", "another name"),
        row("own effect with a size of zero", replace("unit =", "plausible = 0\nunit ="), 5, "effect[0].plausible", "surprise"),
        row("own effect with a key misspelt", replace("terms", "term"), 6, "effect[0].term", "did you mean `terms`"),
        row(
            "own effect without terms",
            text(|t| t.lines().filter(|l| !l.starts_with("terms")).map(|l| format!("{l}\n")).collect()),
            3,
            "effect[0].terms",
            "add `terms`",
        ),
        row(
            "own effect twice",
            text(|t| {
                let own = t.split_once("[[effect]]").unwrap_or_default().1;
                format!("{t}[[effect]]{own}")
            }),
            8,
            "effect[1].name",
            "differently",
        ),
    ];
    in_model.extend(toml());

    let mut in_calibration = vec![
        row("missing file", remove(), None, "", "check the path"),
        row("other format", replace("calibration/1", "calibration/9"), 1, "format", "identify"),
        row("unknown robot", replace("kr6_r700", "kr5"), 2, "robot", "built-in"),
        row("another number of joints", replace("kr6_r700", "panda"), 23, "joint_range", "identify"),
        row("unknown effect", replace("\"mdh\"]", "\"mhd\"]"), 3, "effects[1]", "did you mean `mdh`"),
        row("unknown key", replace("rank = 2", "ranks = 2"), 13, "fit.ranks", "did you mean `rank`"),
        row("missing table", text(|t| t.replace("[fit]", "[fitt]")), 8, "fitt", "did you mean `fit`"),
        row("missing key", replace("nominal = 455.0", ""), 56, "parameter[0].nominal", "add"),
        row("NaN", replace("chi2_per_dof = 1.0", "chi2_per_dof = nan"), 11, "fit.chi2_per_dof", "finite"),
        row("infinity", replace("455.16", "inf"), 59, "parameter[0].value", "finite"),
        row("a number no arm has", replace("455.16", "1e300"), 59, "parameter[0].value", "identify"),
        row("negative residual", replace("rms_mm = 0.01", "rms_mm = -5.0"), 10, "fit.rms_mm", "identify"),
        row(
            "range upside down",
            replace("min_deg = -100.0\nmax_deg = 0.0", "min_deg = 0.0\nmax_deg = -1.0"),
            27,
            "joint_range[1]",
            "identify",
        ),
        row(
            "range of unknown key",
            replace("min_deg = -100.0\nmax_deg = 0.0", "min_deg = -100.0\nmax_deg = 0.0\nmean_deg = -50.0"),
            31,
            "joint_range[1].mean_deg",
            "did you mean",
        ),
        row(
            "range in two units",
            replace("min_deg = -100.0\nmax_deg = 0.0", "min_deg = -100.0\nmax_deg = 0.0\nmin_mm = 0.0"),
            27,
            "joint_range[1]",
            "identify",
        ),
        row("negative count", replace("samples = 80", "samples = -80"), 9, "fit.samples", "not negative"),
        row("negative sigma", replace("sigma = 0.003", "sigma = -0.003"), 60, "parameter[0].sigma", "identify"),
        row("negative stated sigma", replace("0.1\n", "-0.1\n"), 71, "parameter[1].stated_sigma", "identify"),
        row("unknown unit", replace("unit = \"mm\"", "unit = \"inch\""), 61, "parameter[0].unit", "identify"),
        row("length in degrees", replace("unit = \"mm\"", "unit = \"deg\""), 61, "parameter[0].unit", "give it in mm"),
        row(
            "effect not listed",
            replace("effects = [\"base_frame\", \"mdh\"]", "effects = [\"base_frame\"]"),
            58,
            "parameter[0].effect",
            "add it to `effects`",
        ),
        row("parameter of another effect", replace("name = \"a2\"", "name = \"c2\""), 57, "parameter[0].name", "identify"),
        row(
            "unknown outcome",
            replace("iterations = 3", "iterations = 3\noutcome = \"convergd\""),
            17,
            "fit.outcome",
            "did you mean `converged`",
        ),
        row("parameter twice", replace("\"base_x\"", "\"a2\""), 65, "parameter[1].name", "keep one"),
        row("correlation of one", replace("[[1.0], [0.5, 1.0]]", "[[1.0]]"), 6, "correlation", "identify"),
        row("correlation above one", replace("0.5, 1.0", "5.0, 1.0"), 6, "correlation", "identify"),
        row("text for a number", replace("455.16", "\"455.16\""), 59, "parameter[0].value", "a number"),
        row("cut off", text(|t| t[..t.len() - 12].into()), None, "", ""),
    ];
    in_calibration.extend(toml());

    let mut in_plan = vec![
        row("missing file", remove(), None, "", "check the path"),
        row("other format", replace("plan/1", "plan/2"), 1, "format", "make the plan again"),
        row("another robot", replace("kr6_r700", "ur5"), 2, "robot", "this cell"),
        row("no pose", text(|t| t[..t.find("[[").unwrap_or(0)].into()), None, "pose", "at least one"),
        row("unknown ball", replace("ball = \"1\"", "ball = \"9\""), 6, "pose[0].ball", "a ball of the cell"),
        row("unknown payload", replace("none", "heavy"), 7, "pose[0].payload", "a payload of the cell"),
        row("pose twice", replace("r01", "p01"), 12, "pose[1].id", "its own id"),
        row("five joints", replace("[0.0, -90.0,", "[-90.0,"), 8, "pose[0].contact_deg", "6 joints"),
        row("outside the limits", replace("[1.0, -80.0,", "[1.0, 80.0,"), 16, "pose[1].approach_deg", "again"),
        row("radians taken for a huge angle", replace("45.0", "1e300"), 8, "pose[0].contact_deg", "again"),
        row("NaN", replace("45.0", "nan"), 8, "pose[0].contact_deg[4]", "finite"),
        row("unknown key", replace("reserve", "reserved"), 17, "pose[1].reserved", "did you mean `reserve`"),
        row("missing key", replace("payload = \"none\"", ""), 4, "pose[0].payload", "add"),
        row("not a list", replace("[0.0, -90.0, 90.0, 0.0, 45.0, 0.0]", "3"), 8, "pose[0].contact_deg", ""),
        row("cut off", text(|t| t[..t.len() - 20].into()), None, "", ""),
    ];
    in_plan.extend(toml());

    let mut in_map = vec![
        row("missing file", remove(), None, "", "check the path"),
        row("other format", replace("import/1", "import/2"), 1, "format", "calibench-import/1"),
        row("unknown quantity", replace("q3 =", "q33 ="), 7, "columns.q33", "did you mean"),
        row("unknown unit", replace("\"m\"", "\"inch\""), 11, "columns.x.unit", "mm, m, um"),
        row("unit missing", replace(", unit = \"m\"", ""), 11, "columns.x.unit", "mm, m, um"),
        row("unit of a name", replace("\"nr\"", "\"nr\", unit = \"mm\""), 4, "columns.id.unit", "remove it"),
        row("unknown robot", replace("ur5", "ur6"), 16, "dataset.robot", "built-in"),
        row("no dataset", text(|t| t.replace("[dataset]", "[data]").replace("[dataset.tool]", "[data.tool]")), 15, "data", ""),
        row("NaN", replace("28.0", "nan"), 21, "dataset.tool.z_mm", "finite"),
        row("scale NaN", replace("\"x\",", "\"x\", scale = nan,"), 11, "columns.x.scale", "finite"),
        row("place zero", replace("\"x\"", "0"), 11, "columns.x.column", "the place"),
        row("unknown key", replace("[columns]", "delimeter = \";\"\n[columns]"), 3, "delimeter", "did you mean `delimiter`"),
        row("wide delimiter", replace("[columns]", "delimiter = \"→\"\n[columns]"), 3, "delimiter", "a tab"),
        row("one sign for both", replace("[columns]", "decimal = \",\"\n[columns]"), 3, "decimal", ""),
        row("unknown kind", replace("[columns]", "kind = \"place\"\n[columns]"), 3, "kind", "point"),
    ];
    in_map.extend(toml());

    let mut in_robot = vec![
        row("missing file", remove(), None, "", "check the path"),
        row("unknown key", replace("a_mm = 25.0", "a_mm = 25.0\ncolour = \"orange\""), 14, "link[1].colour", ""),
        row("missing key", replace("a_mm = 25.0", ""), 11, "link[1].a_mm", "add"),
        row("key without unit", replace("a_mm = 25.0", "a = 25.0"), 13, "link[1].a", "the unit is part of the name"),
        row("NaN", replace("a_mm = 25.0", "a_mm = nan"), 13, "link[1].a_mm", "finite"),
        row("text for a number", replace("a_mm = 25.0", "a_mm = \"25\""), 13, "link[1].a_mm", "a number"),
        row("limits of many turns", replace("max_deg = 90.0", "max_deg = 1e9"), 16, "link[1].max_deg", "at most 720"),
        row("limits the wrong way round", replace("min_deg = -90.0", "min_deg = 95.0"), None, "link[1]", ""),
        row("other format", replace("robot/1", "robot/7"), 1, "format", "calibench-robot/1"),
    ];
    in_robot.extend(toml());

    vec![
        Kind { file: "dataset.toml", specimen: both, read: dataset, mistakes: in_dataset },
        Kind { file: "samples.csv", specimen: both, read: dataset, mistakes: in_samples },
        Kind { file: "model.toml", specimen: &[("model.toml", MODEL)], read: model, mistakes: in_model },
        Kind {
            file: "calibration.toml",
            specimen: &[("calibration.toml", CALIBRATION)],
            read: calibration,
            mistakes: in_calibration,
        },
        Kind { file: "plan.toml", specimen: &[("plan.toml", PLAN)], read: plan, mistakes: in_plan },
        Kind { file: "map.toml", specimen: &[("map.toml", MAP), ("table.csv", TABLE)], read: by_map, mistakes: in_map },
        Kind { file: "robot.toml", specimen: &[("robot.toml", ROBOT)], read: robot, mistakes: in_robot },
    ]
}

/// A fresh folder with the good files of a kind.
fn good(kind: &Kind) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, text) in kind.specimen {
        fs::write(folder.path().join(name), text).expect("writable");
    }
    folder
}

#[test]
fn every_mistake_is_named_with_its_place_and_remedy() {
    let mut wrong = Vec::new();
    for kind in kinds() {
        for mistake in &kind.mistakes {
            let folder = good(&kind);
            let path = folder.path().join(kind.file);
            (mistake.corrupt)(&path);
            let what = format!("{}: {}", kind.file, mistake.name);
            match (kind.read)(folder.path()) {
                Ok(()) => wrong.push(format!("{what}: was accepted")),
                Err(e) => {
                    // A row that gives no line leaves it open only where the whole file is to blame.
                    let placed =
                        e.path == path && (mistake.line.is_none() || e.line == mistake.line) && e.field.contains(mistake.field);
                    if !placed || !e.remedy.contains(mistake.remedy) || e.problem.is_empty() || e.remedy.is_empty() {
                        wrong.push(format!("{what}: {e} [line {:?}, field {:?}, remedy {:?}]", e.line, e.field, e.remedy));
                    }
                    assert!(!e.to_string().contains('\n'), "{what}: an error is one line: {e}");
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{} of the mistakes:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn the_specimens_are_good_whatever_ends_their_lines() {
    for kind in kinds() {
        for change in [
            |t: &str| t.to_owned(),
            |t: &str| t.replace('\n', "\r\n"),
            |t: &str| format!("\u{feff}{t}"),
            |t: &str| format!("{t}\n\n"),
        ] {
            let folder = good(&kind);
            for (name, text) in kind.specimen {
                fs::write(folder.path().join(name), change(text)).expect("writable");
            }
            (kind.read)(folder.path()).unwrap_or_else(|e| panic!("{}: {e}", kind.file));
        }
    }
}

/// Damaged files of each kind.
const CASES: usize = 1000;

#[test]
fn random_damage_never_panics() {
    // Damage of five kinds, one to four at a time; what is still good may be read, what is not is one error of the damaged file.
    let mut random = ChaCha8Rng::seed_from_u64(20_201_019);
    for kind in kinds() {
        let folder = good(&kind);
        let path = folder.path().join(kind.file);
        let whole = fs::read(&path).expect("a good specimen");
        let mut refused = 0;
        for _ in 0..CASES {
            let mut bytes = whole.clone();
            for _ in 0..random.random_range(1..5) {
                if bytes.len() < 2 {
                    break;
                }
                let at = random.random_range(0..bytes.len());
                let end = at + random.random_range(0..(bytes.len() - at).min(40));
                match random.random_range(0..5) {
                    0 => bytes[at] ^= 1 << random.random_range(0..8),
                    1 => bytes.truncate(at),
                    2 => drop(bytes.drain(at..end)),
                    3 => {
                        // The next number becomes another one.
                        let digit = |b: &u8| b.is_ascii_digit() || b".-".contains(b);
                        let from = at + bytes[at..].iter().take_while(|b| !digit(b)).count();
                        let to = from + bytes[from..].iter().take_while(|b| digit(b)).count();
                        let other = [
                            "nan",
                            "-inf",
                            "1e300",
                            "-1e300",
                            "-1",
                            "0",
                            "1e-300",
                            "99999999999999999999",
                            "18446744073709551615",
                        ];
                        bytes.splice(from..to, other[random.random_range(0..other.len())].bytes());
                    }
                    _ => {
                        let piece = bytes[at..end].to_vec();
                        bytes.splice(end..end, piece);
                    }
                }
            }
            fs::write(&path, &bytes).expect("writable");
            if let Err(e) = (kind.read)(folder.path()) {
                refused += 1;
                assert!(!e.problem.is_empty() && !e.remedy.is_empty(), "{e}");
            }
        }
        assert!(refused > CASES / 2, "{}: only {refused} of {CASES} damaged files were refused", kind.file);
    }
}
