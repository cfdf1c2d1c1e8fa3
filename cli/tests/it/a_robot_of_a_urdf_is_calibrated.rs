//! A robot known only by its URDF goes from measurements to a calibrated URDF: it fits its data, and the file written fits them
//! better; a robot that does not fit is named.

use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::process::Output;

use calibench::robot::kinematics::world_from_tool;
use calibench::robot::{FramePose, Pose, Robot, built_in};
use nalgebra::{Rotation3, Translation3};
use serde_json::Value;

use crate::compensate_goes_through_the_program::calibench;
use crate::oracles::data;

/// The base link on its stand: x, y, z (m) and the angle about z (rad).
const STAND: [f64; 4] = [0.2, -0.1, 0.55, 2.0];

/// A URDF of a robot on a stand whose link frames are not those of its MDH rows: turned and shifted along the axes, which are -y there.
fn urdf_of(robot: &Robot, names: &[&str]) -> String {
    let offset = |i: usize| -> Pose {
        let shift = Translation3::new(0.0, 0.0, 0.01 * i as f64);
        shift * Rotation3::from_euler_angles(std::f64::consts::FRAC_PI_2, 0.0, 0.0)
    };
    let mut text =
        String::from("<robot name=\"five\">\n  <!-- kept -->\n  <link name=\"stand\"/>\n  <link name=\"base_link\"/>\n");
    let [x, y, z, yaw] = STAND;
    _ = write!(
        text,
        "  <joint name=\"on the stand\" type=\"fixed\">\n    <parent link=\"stand\"/>\n    <child link=\"base_link\"/>\n    \
         <origin xyz=\"{x} {y} {z}\" rpy=\"0 0 {yaw}\"/>\n  </joint>\n"
    );
    for (i, link) in robot.links.iter().enumerate() {
        let before = if i == 0 { Pose::identity() } else { offset(i) };
        let origin = FramePose::from_pose(&(before.inverse() * link.mdh.transform(0.0) * offset(i + 1)));
        let ([x, y, z], [yaw, pitch, roll]) = (origin.xyz, origin.rz_ry_rx);
        let parent = if i == 0 { "base_link".to_owned() } else { format!("link_{i}") };
        let [low, high] = link.limits;
        _ = write!(
            text,
            "  <link name=\"link_{0}\"/>\n  <joint name=\"{1}\" type=\"revolute\">\n    <parent link=\"{parent}\"/>\n    <child link=\"link_{0}\"/>\n    \
             <origin xyz=\"{x:?} {y:?} {z:?}\" rpy=\"{roll:?} {pitch:?} {yaw:?}\"/>\n    <axis xyz=\"0 1 0\"/>\n    \
             <limit lower=\"{low}\" upper=\"{high}\" effort=\"1\" velocity=\"1\"/>\n  </joint>\n",
            i + 1,
            names[i],
        );
    }
    let FramePose { xyz: [x, y, z], rz_ry_rx: [yaw, pitch, roll] } = FramePose::from_pose(&offset(robot.joints()).inverse());
    _ = write!(
        text,
        "  <link name=\"tool0\"/>\n  <joint name=\"tool\" type=\"fixed\">\n    <parent link=\"link_{}\"/>\n    <child link=\"tool0\"/>\n    \
         <origin xyz=\"{x:?} {y:?} {z:?}\" rpy=\"{roll:?} {pitch:?} {yaw:?}\"/>\n  </joint>\n</robot>\n",
        robot.joints()
    );
    text
}

const UR: [&str; 6] =
    ["shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint"];

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

#[test]
fn from_measurements_to_a_calibrated_urdf() {
    let folder = tempfile::tempdir().unwrap();
    let run = |arguments: &str| calibench(folder.path(), &arguments.split(' ').collect::<Vec<_>>());
    let done = |arguments: &str| {
        let output = run(arguments);
        assert_eq!(output.status.code(), Some(0), "{arguments}: {}", said(&output));
        output
    };
    let json = |arguments: &str| -> Value { serde_json::from_slice(&done(arguments).stdout).unwrap() };
    let grid = data("ur5-jacobi").join("3D_UR5_uncalibrated_grid_cleaned.csv");
    done(&format!("import ur5-jacobi {} -o d", grid.display()));

    let original = urdf_of(&built_in("ur5").unwrap(), &UR);
    fs::write(folder.path().join("arm.urdf"), &original).unwrap();
    let read = json("robots from-urdf arm.urdf -o arm.toml --json");
    assert_eq!(read["robots"][0]["joint_names"][2], "elbow_joint");
    let shown = done("robots show arm.urdf#stand:tool0");
    assert_eq!(shown.stdout, fs::read(folder.path().join("arm.toml")).unwrap());
    for robot in ["arm.urdf", "arm.toml", "ur5"] {
        let checked = json(&format!("robots check {robot} d --json"));
        let residual = checked["datasets"][0]["residual_mm"].as_f64().unwrap();
        assert!((residual - 0.68).abs() < 0.01 && checked["datasets"][0]["fits"] == true, "{robot}: {checked}");
    }
    let other = run("robots check ur10 d");
    assert_eq!(other.status.code(), Some(1), "{}", said(&other));
    assert!(said(&other).contains("do not fit this robot"), "{}", said(&other));
    assert_eq!(run("robots check panda d").status.code(), Some(2));

    // The dataset names the URDF itself; base and tool are those of its links, so that the tool that is stated stays right.
    let description = fs::read_to_string(folder.path().join("d/dataset.toml")).unwrap();
    fs::write(folder.path().join("d/dataset.toml"), description.replace("\"ur5\"", "\"../arm.urdf#stand:tool0\"")).unwrap();
    // The URDF has no masses: they are guessed, compliance is fitted to them, and every screen says so.
    const GUESSED: &str = "The masses of the links are guessed from the reach of the arm";
    let document = json("identify d -o with-compliance.toml --json");
    assert_eq!(document["masses_guessed"], true, "{document}");
    assert!(document["effects"].as_array().unwrap().contains(&Value::from("joint_compliance")), "{document}");
    assert_eq!(read["robots"][0]["masses_guessed"], true);
    assert_eq!(json("diagnose d --json")["masses_guessed"], true);
    for arguments in ["identify d -o with-compliance.toml", "diagnose d", "robots from-urdf arm.urdf -o arm.toml"] {
        let words = said(&done(arguments)).split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(words.contains(GUESSED), "{arguments}: {words}");
    }
    assert!(!said(&done("robots show ur5")).contains("guessed"));
    fs::write(folder.path().join("m.toml"), "effects = [\"base_frame\", \"mdh\"]\n").unwrap();
    done("identify d --model m.toml -o c.toml");
    done("compensate c.toml --urdf better.urdf --urdf-of arm.urdf --ur-kinematics ur.yaml");
    let residual = |robot: &str| -> f64 {
        json(&format!("robots check {robot} d --json"))["datasets"][0]["residual_all_rows_mm"].as_f64().unwrap()
    };
    let (before, after) = (residual("arm.urdf"), residual("better.urdf"));
    assert!(
        before > 0.6 && after < 0.13,
        "{before} {after}: the UR5's links are a tenth of a millimetre off at most, identified"
    );
    let better = fs::read_to_string(folder.path().join("better.urdf")).unwrap();
    let lines = |text: &str| text.lines().filter(|l| !l.contains("<origin")).map(str::to_owned).collect::<Vec<_>>();
    assert_eq!(lines(&better), lines(&original));
    let yaml = fs::read_to_string(folder.path().join("ur.yaml")).unwrap();
    let first = better
        .lines()
        .filter(|l| l.contains("<origin"))
        .nth(1)
        .unwrap()
        .split('"')
        .nth(1)
        .unwrap()
        .split(' ')
        .next()
        .unwrap()
        .to_owned();
    assert!(
        yaml.starts_with("kinematics:\n  shoulder:\n") && yaml.contains(&format!("    x: {first}\n")),
        "{first}: {yaml}\n{better}"
    );
    assert_eq!((yaml.matches("    yaw: ").count(), yaml.matches("\n  hash: calib_").count()), (6, 1));

    // Targets are in the base link: those in the frame of its stand are the built-in robot's.
    done(&format!("import ur5-jacobi {} -o e", grid.display()));
    done("identify e --model m.toml -o e.toml");
    fs::write(
        folder.path().join("targets.csv"),
        "id,x_mm,y_mm,z_mm,a_deg,b_deg,c_deg,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\none,-430,-100,200,10,5,178,-20,-80,120,-110,-90,10\n",
    )
    .unwrap();
    let [x, y, z] = [STAND[0], STAND[1], STAND[2]].map(|v| v * 1e3);
    let (own, of_urdf) = (
        json("compensate e.toml targets.csv -o own.csv --json"),
        json(&format!("compensate c.toml targets.csv -o of_urdf.csv --base={x},{y},{z},{},0,0 --json", STAND[3].to_degrees())),
    );
    let joints = |v: &Value| -> Vec<f64> {
        v["targets"][0]["q_deg"].as_array().unwrap_or_else(|| panic!("{v}")).iter().map(|q| q.as_f64().unwrap()).collect()
    };
    let apart = joints(&own).iter().zip(joints(&of_urdf)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(apart < 1e-5, "{apart} deg: {own} {of_urdf}");

    // What cannot be written is refused before anything is.
    let wrong = run("compensate c.toml --urdf w.urdf --urdf-of arm.urdf#stand:link_3");
    assert_eq!(wrong.status.code(), Some(2), "{}", said(&wrong));
    assert!(said(&wrong).contains("has 3 joints where the calibrated robot has 6"), "{}", said(&wrong));
    assert!(!Path::new(&folder.path().join("w.urdf")).exists());
    fs::write(folder.path().join("six.urdf"), urdf_of(&built_in("ur5").unwrap(), &["a", "b", "c", "d", "e", "f"])).unwrap();
    let wrong = run("compensate c.toml --urdf w.urdf --urdf-of six.urdf --ur-kinematics w.yaml");
    assert!(said(&wrong).contains("it is not a UR"), "{}", said(&wrong));
    assert!(!folder.path().join("w.urdf").exists() && !folder.path().join("w.yaml").exists());
}

#[test]
fn an_arm_of_five_axes_goes_all_the_way() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let whole = built_in("ur5").unwrap();
    let drawn = Robot { links: whole.links[..5].to_vec(), ..whole };
    fs::write(at.join("five.urdf"), urdf_of(&drawn, &UR)).unwrap();
    let mut arm = drawn.clone();
    arm.links[1].mdh.a += 0.6e-3;
    arm.links[2].mdh.theta += 1e-3;
    arm.links[3].mdh.alpha += 1e-3;
    // The columns stand in another order than the joints, and have their names.
    let order = [3, 0, 4, 2, 1];
    let tool = FramePose { xyz: [0.03, -0.01, 0.08], ..FramePose::default() };
    let mut text = order.map(|j| UR[j]).join(",") + ",x_mm,y_mm,z_mm\n";
    let mut targets = String::from("id,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg\n");
    for k in 0..90 {
        let part = |j: usize| ((k * (j + 2) * (j + 3)) as f64 * 0.618_034 + 0.37 * j as f64).fract() - 0.5;
        let q: Vec<f64> = (0..5).map(|j| [0.0, -1.2, 1.2, 0.0, 0.9][j] + 1.6 * part(j)).collect();
        let noise = |c: usize| 0.02e-3 * (((k * 7 + c * 13) as f64 * 0.754_877).fract() - 0.5);
        let seen = world_from_tool(&arm, &FramePose::default(), &tool, &q).translation.vector;
        let fields = order.map(|j| format!("{:.6}", q[j].to_degrees()));
        let place: Vec<String> = (0..3).map(|c| format!("{:.5}", (seen[c] + noise(c)) * 1e3)).collect();
        _ = writeln!(text, "{},{}", fields.join(","), place.join(","));
        if k < 6 {
            let fields: Vec<String> = q.iter().map(|q| format!("{:.6}", q.to_degrees())).collect();
            _ = writeln!(targets, "t{k},{}", fields.join(","));
        }
    }
    fs::write(at.join("table.csv"), text).unwrap();
    fs::write(at.join("targets.csv"), targets).unwrap();
    let run = |arguments: &str| {
        let output = calibench(at, &arguments.split(' ').collect::<Vec<_>>());
        assert!(output.status.success(), "{arguments}: {}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    let calibrated = run("calibrate table.csv --robot five.urdf --noise 10um --tolerance 0.2mm -o five");
    assert!(calibrated.contains("by the names of the robot's joints"), "{calibrated}");
    assert!(calibrated.contains("Expected inside the measured ranges: "), "{calibrated}");
    let compensated = run("compensate five/calibration.toml targets.csv -o fake.csv");
    assert!(compensated.contains("6 of 6 targets compensated") && compensated.contains("as nearly as it can"), "{compensated}");
    let next = run("plan next five --model five/model.toml");
    assert!(next.contains("tracker points over the workspace") && !next.contains("singularity"), "{next}");
}
