//! A sweep changes every key it names, at every point as stated, and reports clearly if it cannot.

use std::fs;
use std::path::Path;

use calibench_lab::study::{Study, sweep_points};
use calibench_sim::run::Methods;
use calibench_sim::scenario::{Document, Scenario};

fn document(sweep: &str) -> Document {
    let folder = tempfile::tempdir().unwrap();
    let scenarios = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios");
    for file in ["table8.toml", "kr6-trical.toml"] {
        fs::copy(scenarios.join(file), folder.path().join(file)).unwrap();
    }
    let head = "format = \"calibench-scenario/1\"\nextends = \"table8.toml\"\nname = \"swept\"\nquestion = \"?\"\n";
    let quick = "[plan]\npool_per_ball = 50\nstarts = 1\nposes_per_ball = 4\nreserves_per_ball = 0\n[tracker]\nvalidation_poses = 5\nidentification_poses = 20\n";
    fs::write(folder.path().join("s.toml"), format!("{head}{quick}{sweep}")).unwrap();
    Document::read(&folder.path().join("s.toml")).unwrap()
}

/// The labels on the axes and the scenario of every point.
fn points(sweep: &str) -> Vec<(Vec<String>, Scenario)> {
    let document = document(sweep);
    let (_, points) = sweep_points(&document, document.scenario().unwrap().sweep.as_ref()).unwrap();
    points.into_iter().map(|p| (p.at, p.document.scenario().unwrap())).collect()
}

#[track_caller]
fn refused(sweep: &str, says: &[&str]) {
    let document = document(sweep);
    let error = match document.scenario() {
        Ok(_) => Study::new(&document, Methods::Both, false, &|_, _| {}).err().expect("refused"),
        Err(error) => error,
    };
    let text = error.to_string();
    assert!(says.iter().all(|word| text.contains(word)) && !text.contains('\n'), "{sweep}: {text}");
    assert!(error.path.ends_with("s.toml") && error.line.is_some(), "{text}");
}

#[test]
fn values_ranges_and_cases_reach_numbers_lists_and_tables() {
    let all = points(
        "[[sweep.axis]]\nkey = \"plan.poses_per_ball\"\nvalues = [5, 7]\n
        [[sweep.axis]]\nkey = \"ball[3].z_mm\"\nfrom = 170\nto = 180\nsteps = 3\n
        [[sweep.axis]]\nname = \"balls\"\n[[sweep.axis.case]]\nlabel = \"four\"\n
        [[sweep.axis.case]]\nlabel = \"two\"\nwithout = [\"ball[1]\", \"ball[2]\"]\nset = { \"truth.effects.\\\"harmonic1:2\\\".sin_urad\" = 80.0 }\n",
    );
    assert_eq!(all.len(), 2 * 3 * 2);
    for (at, scenario) in &all {
        assert_eq!(scenario.plan.poses_per_ball.to_string(), at[0]);
        let cell = scenario.dataset();
        let last = cell.balls.last().unwrap();
        assert!((last.position.z * 1e3 - at[1].parse::<f64>().unwrap()).abs() < 1e-9 && last.id == "4");
        let ids: Vec<&str> = cell.balls.iter().map(|b| b.id.as_str()).collect();
        let [balls, effects] = if at[2] == "four" { [4, 3] } else { [2, 4] };
        assert_eq!((ids.len(), ids[0], scenario.truth().effects().len()), (balls, "1", effects), "{at:?}");
    }
    let names: Vec<String> = all.iter().map(|(at, _)| at.join(" ")).collect();
    assert_eq!(names[..3], ["5 170.0 four", "5 170.0 two", "5 175.0 four"], "the last axis changes fastest");
}

#[test]
fn ranges_go_by_equal_ratios_and_whole_numbers_stay_whole() {
    let at = |sweep: &str| points(sweep).into_iter().map(|(at, _)| at.concat()).collect::<Vec<_>>();
    let log = "[[sweep.axis]]\nkey = \"centring.tolerance_um\"\nfrom = 1\nto = 100\nsteps = 3\nscale = \"log\"";
    assert_eq!(at(log), ["1.0", "10.0", "100.0"]);
    assert_eq!(at("[[sweep.axis]]\nkey = \"plan.poses_per_ball\"\nfrom = 5\nto = 8\nsteps = 3"), ["5", "7", "8"]);
    // A list is labelled by its index.
    assert_eq!(
        at("[[sweep.axis]]\nkey = \"tracker.position_mm\"\nvalues = [[1800, -1500, 600], [1500, 1500, 600]]"),
        ["value 1", "value 2"]
    );
}

/// Of 64 points of a Sobol sequence in two dimensions, each of 8 by 8 equal cells holds one: a (0, 2)-sequence in base 2.
#[test]
fn sobol_points_fill_the_square_evenly() {
    let all = points(
        "[sweep]\ndesign = \"sobol\"\npoints = 64\n[[sweep.axis]]\nkey = \"centring.tolerance_um\"\nfrom = 1\nto = 9\n
        [[sweep.axis]]\nkey = \"ball[0].x_mm\"\nfrom = -80\nto = -72\n",
    );
    let mut cells = [[0; 8]; 8];
    for (at, _) in &all {
        let [u, v]: [f64; 2] = std::array::from_fn(|k| at[k].parse::<f64>().unwrap() - [1.0, -80.0][k]);
        cells[u as usize][v as usize] += 1;
    }
    assert_eq!(cells, [[1; 8]; 8]);
}

#[test]
fn what_a_sweep_cannot_do_is_said_with_its_place() {
    let axis = |rest: &str| format!("[[sweep.axis]]\n{rest}");
    for (sweep, says) in [
        (
            axis("key = \"plan.pose_per_ball\"\nvalues = [5]"),
            ["sweep", "at plan.pose_per_ball = 5", "no such key; did you mean"].as_slice(),
        ),
        (axis("key = \"plan.poses_per_ball\"\nvalues = [5, 0]"), &["at plan.poses_per_ball = 0", "from 1 to"]),
        (axis("key = \"ball[4].x_mm\"\nvalues = [5]"), &["sweep.axis[0]", "nothing at `ball[4].x_mm`"]),
        (axis("key = \"plan..x\"\nvalues = [5]"), &["sweep.axis[0].key", "is not a key"]),
        (axis("key = \"expect.rank\"\nvalues = [5]"), &["sweep.axis[0].key", "changes nothing"]),
        (axis("key = \"plan.order\"\nfrom = 1\nto = 2\nsteps = 2"), &["sweep.axis[0].key", "is not a number"]),
        (axis("key = \"plan.starts\"\nvalues = []"), &["sweep.axis[0].values", "is empty"]),
        (axis("key = \"plan.starts\"\nfrom = 2\nto = 1\nsteps = 2"), &["sweep.axis[0].from", "not such a range"]),
        (axis("key = \"plan.starts\"\nfrom = 0\nto = 1\nsteps = 2\nscale = \"log\""), &["sweep.axis[0].from", "above zero"]),
        (axis("key = \"plan.starts\"\nfrom = 1\nto = 2"), &["sweep.axis[0].steps", "at least 2"]),
        (axis("key = \"plan.starts\""), &["sweep.axis[0]", "neither a list of values"]),
        (axis("[[sweep.axis.case]]\nlabel = \"a\""), &["sweep.axis[0]", "a name with"]),
        (axis("name = \"a\"\n[[sweep.axis.case]]\nlabel = \"a\"\nwithout = [\"ball[9]\"]"), &["sweep.axis[0]", "`ball[9]`"]),
        (
            axis("key = \"plan.starts\"\nvalues = [1]\n[[sweep.axis]]\nkey = \"plan.starts\"\nvalues = [2]"),
            &["sweep.axis[1]", "second one"],
        ),
        (axis("key = \"seed\"\nvalues = [1, 2]"), &["sweep.axis[0]", "as a column of every study", "another `name`"]),
        ("[sweep]\npoints = 3\n[[sweep.axis]]\nkey = \"plan.starts\"\nvalues = [1]".into(), &["sweep.points", "sobol"]),
        ("[sweep]\ndesign = \"sobol\"\n[[sweep.axis]]\nkey = \"plan.starts\"\nvalues = [1]".into(), &["sweep.points", "1 to"]),
        ("[sweep]\naxis = []".into(), &["sweep", "no axis"]),
        (axis("key = \"plan.starts\"\nvalue = [1]"), &["sweep.axis[0].value", "did you mean"]),
    ] {
        refused(&sweep, says);
    }
}

#[test]
fn a_point_that_cannot_be_planned_is_a_row_and_plans_are_shared_where_they_may_be() {
    let document = document(
        "[[sweep.axis]]\nkey = \"plan.cone_deg\"\nvalues = [70.0, 0.001]\n
        [[sweep.axis]]\nkey = \"truth.indicators.noise_um\"\nvalues = [0.1, 0.2]\n",
    );
    let study = Study::new(&document, Methods::Both, false, &|_, _| {}).unwrap();
    let plans: Vec<_> = study.points.iter().map(|p| p.plans.as_ref().ok()).collect();
    assert!(std::sync::Arc::ptr_eq(plans[0].unwrap(), plans[1].unwrap()), "noise does not change where the arm can go");
    assert!(plans[2].is_none() && plans[3].is_none());
    // The plan is the one made without the ground truth in which the points differ.
    let alone = calibench_sim::planning::plan(&study.points[1].scenario, study.points[1].scenario.seed).unwrap();
    assert_eq!(format!("{:?}", alone.probing.poses), format!("{:?}", plans[1].unwrap().plan.probing.poses));

    // If no point is possible, the scenario is in error.
    let nowhere = self::document("[[sweep.axis]]\nkey = \"plan.cone_deg\"\nvalues = [0.001, 0.002]\n");
    let error = Study::new(&nowhere, Methods::Both, false, &|_, _| {}).err().expect("refused").to_string();
    assert!(error.contains("cannot be probed") && error.contains("plan.cone_deg"), "{error}");
}
