//! A dataset is read back as it was written, and a folder is never left half written.

use std::sync::Arc;

use calibench::measure::dataset::file::{read_dataset, write_dataset};
use calibench::measure::dataset::{
    Anchor, Ball, BallDistance, Dataset, Measured, Noise, Orientation, Sample, SampleSet, Shared, ToolTarget,
};
use calibench::robot::FramePose;
use calibench::robot::statics::Payload;
use calibench::units::{ARCSEC, DEG, MM, UM};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Relative error that writing in mm and deg may add: a few roundings of 1.1e-16 each.
const ROUNDING: f64 = 1e-15;

struct Generator(ChaCha8Rng);

impl Generator {
    fn sometimes<T>(&mut self, make: impl FnOnce(&mut Self) -> T) -> Option<T> {
        self.0.random::<bool>().then(|| make(self))
    }

    /// Numbers of every size, round ones among them.
    fn number(&mut self, scale: f64) -> f64 {
        let u: f64 = self.0.random_range(-1.0..1.0);
        match self.0.random_range(0..4) {
            0 => (u * 1000.0).round() / 1000.0 * scale,
            1 => u * scale * 10f64.powi(self.0.random_range(-12..1)),
            2 => 0.0,
            _ => u * scale,
        }
    }

    fn positive(&mut self, scale: f64) -> f64 {
        self.0.random_range(1e-3..1.0) * scale
    }

    fn vector(&mut self, scale: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.number(scale))
    }

    fn frame(&mut self) -> FramePose {
        FramePose { xyz: self.vector(1.0).into(), rz_ry_rx: self.vector(1.0).into() }
    }

    /// Text with everything that a CSV field or a TOML string must carry.
    fn text(&mut self) -> String {
        let letters: Vec<char> = "aZ09 _-,;\"'#=[]\\é漢".chars().collect();
        let middle: String = (0..self.0.random_range(0..8)).map(|_| letters[self.0.random_range(0..letters.len())]).collect();
        format!("x{middle}y")
    }

    fn dataset(&mut self, robot: &Dataset) -> Dataset {
        let (balls, anchors, payloads) = (self.0.random_range(1..5), self.0.random_range(1..3), self.0.random_range(1..4));
        let extra = self.0.random_range(0..3);
        let joints = robot.robot.joints();
        let mut provenance = toml::Table::new();
        provenance.insert("operator".into(), self.text().into());
        provenance.insert("room_c".into(), self.number(30.0).into());
        let balls: Vec<Ball> = (0..balls)
            .map(|k| Ball {
                id: format!("{}{k}", self.text()),
                position: Vector3::new(k as f64, 0.0, 0.0) + self.vector(0.2),
                sigma: self.sometimes(|g| g.positive(UM)).unwrap_or(0.0),
                free: self.0.random(),
            })
            .collect();
        let tool_targets: Vec<ToolTarget> = (0..self.0.random_range(0..3))
            .map(|k| ToolTarget {
                id: format!("{}{k}", self.text()),
                position: self.vector(0.2),
                sigma: self.sometimes(|g| g.positive(UM)).unwrap_or(0.0),
                free: self.0.random(),
            })
            .collect();
        let ball_distances = if balls.len() > 1 && self.0.random() {
            vec![BallDistance { between: [1, 0], distance: self.positive(1.0), sigma: self.positive(MM) }]
        } else {
            Vec::new()
        };
        let mut dataset = Dataset {
            robot: Arc::clone(&robot.robot),
            robot_reference: robot.robot_reference.clone(),
            gravity: self.vector(9.81),
            base: self.frame(),
            base_found: self.0.random(),
            tool: self.frame(),
            tool_sigma: self.sometimes(|g| g.positive(UM)).unwrap_or(0.0),
            probe_sigma: self.sometimes(|g| g.positive(0.01)).unwrap_or(0.0),
            tool_free: self.0.random(),
            shared: Shared { base: self.0.random(), tool: self.0.random() },
            contact_force: self.vector(1.0),
            absolute_accuracy: self.sometimes(|g| g.0.random()),
            payloads: (0..payloads)
                .map(|k| Payload { name: format!("{}{k}", self.text()), mass: self.positive(9.0), com: self.vector(0.1) })
                .collect(),
            balls,
            tool_targets,
            ball_distances,
            anchors: (0..anchors).map(|k| Anchor { id: format!("{}{k}", self.text()), position: self.vector(2.0) }).collect(),
            noise: Noise {
                ball: self.sometimes(|g| g.positive(3.0 * UM)),
                point: self.sometimes(|g| g.positive(30.0 * UM)),
                orientation: self.sometimes(|g| g.positive(1e-4)),
                joint: self.sometimes(|g| (0..joints).map(|_| g.positive(ARCSEC)).collect()).unwrap_or_default(),
                seen_from_tool: self.sometimes(|_| ()).is_some(),
            },
            extra_columns: (0..extra).map(|k| format!("extra_{}{k}", self.text())).collect(),
            provenance,
            samples: Vec::new(),
            hash: String::new(),
        };
        for k in 0..self.0.random_range(1..12) {
            let sample = self.sample(k, &dataset);
            dataset.samples.push(sample);
        }
        dataset
    }

    fn sample(&mut self, k: usize, dataset: &Dataset) -> Sample {
        let joints = dataset.robot.joints();
        let measured = match self.0.random_range(0..3) {
            0 => Measured::Ball {
                ball: self.0.random_range(0..dataset.balls.len()),
                reading: self.sometimes(|g| g.vector(3.0 * UM)),
            },
            1 => Measured::Point(self.vector(2.0)),
            _ => Measured::Distance { anchor: self.0.random_range(0..dataset.anchors.len()), distance: self.positive(3.0) },
        };
        // Without a stated noise of orientations in general, each must state its own.
        let orientation = matches!(measured, Measured::Point(_))
            .then(|| self.sometimes(|g| Orientation { rotation: g.vector(1.0), sigma: Some(g.positive(1e-3)) }));
        let nulled = matches!(measured, Measured::Ball { .. });
        let commanded = matches!(measured, Measured::Point(_)).then(|| self.sometimes(|g| g.vector(2.0)));
        let sign = |g: &mut Self| g.0.random_range(-1..=1);
        Sample {
            tool_target: self.sometimes(|g| g.0.random_range(0..4)).filter(|r| *r < dataset.tool_targets.len()),
            orientation: orientation.flatten(),
            posture: self.sometimes(Self::text),
            set: if self.0.random() { SampleSet::Fit } else { SampleSet::Validation },
            payload: self.0.random_range(0..dataset.payloads.len()),
            time_s: self.sometimes(|g| g.positive(1e5)),
            temp_c: self.sometimes(|g| g.number(40.0)),
            approach: self.sometimes(|g| (0..joints).map(|_| sign(g)).collect()),
            plungers: if nulled { self.sometimes(|g| [0; 3].map(|_| if g.0.random() { 1 } else { -1 })) } else { None },
            repeat: self.sometimes(Self::text),
            session: self.sometimes(Self::text),
            q_commanded: self.sometimes(|g| (0..joints).map(|_| g.number(1.0)).collect()),
            commanded: commanded.flatten(),
            tau: self.sometimes(|g| (0..joints).map(|_| g.number(300.0)).collect()),
            sigma: self.sometimes(|g| g.positive(50.0 * UM)),
            extra: dataset.extra_columns.iter().map(|_| self.text()).collect(),
            ..Sample::new(format!("{}{k}", self.text()), (0..joints).map(|_| self.number(40.0 * DEG)).collect(), measured)
        }
    }
}

/// A dataset of the KR6 with nothing in it that matters here.
fn kr6(folder: &std::path::Path) -> Dataset {
    let toml = "format = \"calibench-dataset/1\"\nrobot = \"kr6_r700\"\n[base]\nx_mm=0\ny_mm=0\nz_mm=0\n[tool]\nx_mm=0\ny_mm=0\nz_mm=0\n";
    std::fs::write(folder.join("dataset.toml"), toml).expect("a writable folder");
    let csv = "id,kind,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,x_mm,y_mm,z_mm\na,point,0,0,0,0,0,0,1,2,3\n";
    std::fs::write(folder.join("samples.csv"), csv).expect("a writable folder");
    read_dataset(folder).expect("a good dataset")
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= ROUNDING * a.abs().max(b.abs())
}

/// All numbers of a dataset that change unit on the way.
fn numbers(d: &Dataset) -> Vec<f64> {
    let mut all: Vec<f64> = [d.base.to_array(), d.tool.to_array()].concat();
    all.extend(d.noise.ball.iter().chain(&d.noise.point).chain(&d.noise.joint).chain(&d.noise.orientation));
    all.extend([d.tool_sigma, d.probe_sigma]);
    all.extend(d.payloads.iter().flat_map(|p| p.com.iter().copied().chain([p.mass])));
    all.extend(d.balls.iter().flat_map(|b| b.position.iter().copied().chain([b.sigma])));
    all.extend(d.ball_distances.iter().flat_map(|b| [b.distance, b.sigma]));
    all.extend(d.anchors.iter().flat_map(|a| a.position.iter().copied()));
    for s in &d.samples {
        all.extend(s.orientation.iter().flat_map(|o| o.rotation.iter().chain(&o.sigma).copied()));
        all.extend(s.q.iter().chain(s.q_commanded.iter().flatten()).chain(&s.sigma));
        match &s.measured {
            Measured::Ball { reading, .. } => all.extend(reading.iter().flat_map(|r| r.iter().copied())),
            Measured::Point(p) => all.extend(p.iter().copied()),
            Measured::Distance { distance, .. } => all.push(*distance),
        }
    }
    all
}

#[test]
fn any_dataset_reads_back_as_written() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let robot = kr6(folder.path());
    let mut generator = Generator(ChaCha8Rng::seed_from_u64(1));
    for case in 0..100 {
        let dataset = generator.dataset(&robot);
        let at = folder.path().join("set");
        write_dataset(&dataset, &at).unwrap_or_else(|e| panic!("case {case}: {e}"));
        let first = read_dataset(&at).unwrap_or_else(|e| panic!("case {case}: {e}"));
        let (written, read) = (numbers(&dataset), numbers(&first));
        assert_eq!(written.len(), read.len(), "case {case}");
        for (w, r) in written.iter().zip(&read) {
            assert!(close(*w, *r), "case {case}: {w:e} was read back as {r:e}");
        }
        // Numbers that came from a file are written so that they come back to the last bit, and so does the rest.
        write_dataset(&first, &at).unwrap_or_else(|e| panic!("case {case}: {e}"));
        let second = read_dataset(&at).unwrap_or_else(|e| panic!("case {case}: {e}"));
        assert_eq!(first, second, "case {case}");
        assert_eq!(first.samples.len(), dataset.samples.len());
        for (w, r) in dataset.samples.iter().zip(&first.samples) {
            let numberless = |s: &Sample| Sample {
                q: vec![],
                q_commanded: None,
                commanded: None,
                sigma: None,
                orientation: None,
                measured: Measured::Point(Vector3::zeros()),
                ..s.clone()
            };
            assert_eq!(numberless(w), numberless(r), "case {case}");
        }
        assert_eq!(
            (
                dataset.contact_force,
                dataset.absolute_accuracy,
                &dataset.provenance,
                dataset.ball_ids(),
                &dataset.extra_columns,
                dataset.tool_free,
                dataset.gravity
            ),
            (
                first.contact_force,
                first.absolute_accuracy,
                &first.provenance,
                first.ball_ids(),
                &first.extra_columns,
                first.tool_free,
                first.gravity
            )
        );
    }
}

#[test]
fn numbers_are_written_as_people_write_them() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut dataset = kr6(folder.path());
    dataset.base.xyz = [-536.320 * MM, -21.901 * MM, -58.349 * MM];
    dataset.samples[0].q[2] = 12.345 * DEG;
    write_dataset(&dataset, folder.path()).expect("a writable folder");
    let text = |name: &str| std::fs::read_to_string(folder.path().join(name)).expect("written");
    assert!(text("dataset.toml").contains("x_mm = -536.32\ny_mm = -21.901\nz_mm = -58.349\n"), "{}", text("dataset.toml"));
    assert!(text("samples.csv").contains("a,point,0,0,12.345,0,0,0,1,2,3"), "{}", text("samples.csv"));
}

#[test]
fn the_hash_is_that_of_the_two_files() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let before = kr6(folder.path()).hash;
    // `cat dataset.toml samples.csv | sha256sum`
    assert_eq!(before, "0795e3a95fcd251ce025628e8c0a6d8d55f03aec7d394c49d76982a012bb4dcf");
    for name in ["dataset.toml", "samples.csv"] {
        let path = folder.path().join(name);
        let mut text = std::fs::read_to_string(&path).expect("written");
        text.push('\n');
        std::fs::write(&path, text).expect("a writable folder");
        assert_ne!(read_dataset(folder.path()).expect("still good").hash, before);
        std::fs::write(&path, std::fs::read_to_string(&path).expect("written").trim_end_matches('\n').to_owned() + "\n")
            .expect("writable");
        assert_eq!(read_dataset(folder.path()).expect("still good").hash, before);
    }
}

#[test]
fn a_folder_of_something_else_is_left_alone() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let dataset = kr6(folder.path());
    let other = folder.path().join("photographs");
    std::fs::create_dir(&other).expect("writable");
    std::fs::write(other.join("cat.txt"), "meow").expect("writable");
    let error = write_dataset(&dataset, &other).expect_err("must refuse");
    assert!(error.problem.contains("not a dataset"), "{error}");
    assert_eq!(std::fs::read_to_string(other.join("cat.txt")).expect("still there"), "meow");
    let file = folder.path().join("file");
    std::fs::write(&file, "x").expect("writable");
    assert!(write_dataset(&dataset, &file).is_err());
    // An empty folder is as good as none.
    let empty = folder.path().join("empty");
    std::fs::create_dir(&empty).expect("writable");
    write_dataset(&dataset, &empty).expect("an empty folder is filled");
}

#[test]
fn a_dataset_that_contradicts_itself_replaces_nothing() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let good = kr6(folder.path());
    let at = folder.path().join("set");
    write_dataset(&good, &at).expect("writable");
    std::fs::write(at.join("notes.txt"), "kept").expect("writable");
    let mut bad = good.clone();
    bad.samples[0].measured = Measured::Ball { ball: 7, reading: None };
    let error = write_dataset(&bad, &at).expect_err("there is no such ball");
    assert_eq!(error.path, at.join("samples.csv"));
    assert_eq!(read_dataset(&at).expect("the old one").samples, good.samples);
    write_dataset(&good, &at).expect("writable");
    assert_eq!(std::fs::read_to_string(at.join("notes.txt")).expect("carried over"), "kept");
    let left: Vec<_> = std::fs::read_dir(folder.path()).expect("readable").flatten().map(|e| e.file_name()).collect();
    assert_eq!(left.len(), 3, "nothing temporary stays: {left:?}");
}

#[test]
fn a_robot_that_is_not_built_in_travels_with_its_dataset() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut dataset = kr6(folder.path());
    let mut robot = (*dataset.robot).clone();
    robot.name = "mine".into();
    robot.links[0].mdh.d = 0.5;
    dataset.robot = Arc::new(robot);
    dataset.robot_reference = "/nowhere/mine.toml".into();
    let at = folder.path().join("set");
    write_dataset(&dataset, &at).expect("writable");
    let moved = folder.path().join("elsewhere").join("set");
    std::fs::create_dir(folder.path().join("elsewhere")).expect("writable");
    std::fs::rename(&at, &moved).expect("writable");
    let back = read_dataset(&moved).expect("self-contained");
    assert_eq!(
        (back.robot_reference.as_str(), back.robot.name.as_str(), back.robot.links[0].mdh.d),
        ("robot.toml", "mine", 0.5)
    );
}
