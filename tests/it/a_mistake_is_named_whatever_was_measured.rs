//! Mistakes in positions, poses, distances, several targets and balls are named, none passes as noise, and no campaign without
//! one is refused. Mistakes are made by the generator here: robots, postures, errors of the arm and sizes are drawn anew.

use std::f64::consts::PI;
use std::sync::Arc;

use calibench::identify::problem::Use;
use calibench::measure::dataset::{Anchor, Ball, Dataset, Measured, NamedDataset, Noise, Orientation, Sample, ToolTarget};
use calibench::residuals::misfit::{Cause, Measure, Misfit, data_fit};
use calibench::robot::kinematics::world_from_tool;
use calibench::robot::{FramePose, Robot, built_in};
use calibench::units::{DEG, MM};
use nalgebra::{Quaternion, Rotation3, UnitQuaternion, Vector3};

/// Splitmix64.
struct Dice(u64);

impl Dice {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    fn below(&mut self, n: usize) -> usize {
        (self.unit() * n as f64) as usize
    }

    fn sign(&mut self) -> f64 {
        if self.unit() < 0.5 { -1.0 } else { 1.0 }
    }

    fn normal(&mut self) -> f64 {
        (-2.0 * (1.0 - self.unit()).ln()).sqrt() * (2.0 * PI * self.unit()).cos()
    }

    fn vector(&mut self, sigma: f64) -> Vector3<f64> {
        Vector3::new(self.normal(), self.normal(), self.normal()) * sigma
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Positions,
    Poses,
    Distances,
    Targets,
    Balls,
}

const KINDS: [Kind; 5] = [Kind::Positions, Kind::Poses, Kind::Distances, Kind::Targets, Kind::Balls];
const POINT: f64 = 30e-6;
const ANGLE: f64 = 0.005 * DEG;

/// The arm as it is: lengths and angles off by a few plausible sizes.
fn real_arm(nominal: &Robot, dice: &mut Dice, sizes: f64) -> Robot {
    let mut robot = nominal.clone();
    for link in &mut robot.links {
        link.mdh.alpha += dice.normal() * sizes * 0.05 * DEG;
        link.mdh.theta += dice.normal() * sizes * 0.05 * DEG;
        link.mdh.a += dice.normal() * sizes * 0.3 * MM;
        link.mdh.d += dice.normal() * sizes * 0.3 * MM;
    }
    robot
}

/// A campaign without a mistake, its base stated within a degree.
fn campaign(kind: Kind, dice: &mut Dice, sizes: f64, moving: usize) -> Dataset {
    let robot = built_in(["ur5", "ur10", "kr6_r700", "panda"][dice.below(4)]).unwrap();
    let n = robot.joints();
    let arm = real_arm(&robot, dice, sizes);
    let base = FramePose {
        xyz: [dice.between(-2.0, 2.0), dice.between(-2.0, 2.0), dice.between(0.1, 0.9)],
        rz_ry_rx: [dice.between(-2.0, 2.0), dice.between(-0.1, 0.1), dice.between(-0.1, 0.1)],
    };
    let tool = FramePose {
        xyz: [dice.between(0.03, 0.1), dice.between(-0.1, -0.03), dice.between(0.1, 0.2)],
        rz_ry_rx: [dice.between(-0.5, 0.5), dice.between(-0.5, 0.5), dice.between(-0.5, 0.5)],
    };
    let noise = Noise {
        point: Some(POINT),
        ball: Some(POINT),
        orientation: (kind == Kind::Poses).then_some(ANGLE),
        ..Noise::default()
    };
    let mut data = Dataset { robot: Arc::new(robot.clone()), base, tool, tool_free: true, noise, ..Dataset::default() };
    let rows = 40 + dice.below(40);
    let start: Vec<f64> =
        robot.links.iter().map(|l| dice.between(0.6 * l.limits[0].max(-PI), 0.6 * l.limits[1].min(PI))).collect();
    let posture = |dice: &mut Dice| -> Vec<f64> {
        let one = |(j, l): (usize, &calibench::robot::Link)| {
            let [low, high] = [l.limits[0].max(-PI), l.limits[1].min(PI)];
            let q = dice.between(0.9 * low, 0.9 * high);
            if j < moving.min(n) { q } else { start[j] }
        };
        robot.links.iter().enumerate().map(one).collect()
    };
    if kind == Kind::Distances {
        for k in 0..3 + dice.below(2) {
            let at = Vector3::new(dice.between(-3.0, 3.0), dice.between(-3.0, 3.0), dice.between(0.2, 2.5));
            data.anchors.push(Anchor { id: format!("a{}", k + 1), position: at });
        }
    }
    if kind == Kind::Targets {
        for (k, id) in ["b", "c"].into_iter().enumerate() {
            let position = Vector3::new(
                dice.between(0.05, 0.15),
                -dice.between(0.03, 0.15) * k as f64,
                dice.sign() * dice.between(0.02, 0.1),
            );
            data.tool_targets.push(ToolTarget { id: id.into(), position, sigma: 0.0, free: false });
        }
    }
    for k in 0..rows {
        let q = posture(dice);
        let held = world_from_tool(&arm, &base, &tool, &q);
        let at = held.translation.vector;
        match kind {
            Kind::Positions => {
                let seen = at + dice.vector(POINT);
                data.samples.push(Sample::new(format!("p{k}"), q, Measured::Point(seen)));
            }
            Kind::Poses => {
                let mut sample = Sample::new(format!("p{k}"), q, Measured::Point(at + dice.vector(POINT)));
                let turned = Rotation3::new(dice.vector(ANGLE)) * held.rotation;
                sample.orientation = Some(Orientation { rotation: turned.scaled_axis(), sigma: None });
                data.samples.push(sample);
            }
            Kind::Distances => {
                for a in 0..data.anchors.len() {
                    let distance = (at - data.anchors[a].position).norm() + dice.normal() * POINT;
                    data.samples.push(Sample::new(format!("p{k}a{a}"), q.clone(), Measured::Distance { anchor: a, distance }));
                }
            }
            Kind::Targets => {
                let places: Vec<_> = std::iter::once((None, Vector3::zeros()))
                    .chain(data.tool_targets.iter().enumerate().map(|(t, p)| (Some(t), p.position)))
                    .collect();
                for (t, place) in places {
                    let seen = held.transform_point(&place.into()).coords + dice.vector(POINT);
                    let mut sample = Sample::new(format!("p{k}t{}", t.map_or(0, |t| t + 1)), q.clone(), Measured::Point(seen));
                    sample.tool_target = t;
                    data.samples.push(sample);
                }
            }
            // A ball stands wherever the arm is led within reach of its indicators, five postures each.
            Kind::Balls => {
                let reading = dice.vector(0.5 * MM);
                let ball = held.transform_point(&reading.into()).coords + dice.vector(POINT);
                if data.balls.len() < 8 {
                    data.balls.push(Ball { id: format!("b{}", k + 1), position: ball, sigma: 0.0, free: false });
                    data.samples.push(Sample::new(format!("s{k}"), q, Measured::Ball { ball: k, reading: Some(reading) }));
                }
            }
        }
    }
    if kind == Kind::Balls {
        more_postures(&mut data, &arm, dice);
    }
    data
}

/// Other postures at the balls: steps of Newton from postures nearby.
fn more_postures(data: &mut Dataset, arm: &Robot, dice: &mut Dice) {
    let first = data.samples.clone();
    for (k, sample) in first.iter().enumerate() {
        let Measured::Ball { ball, .. } = sample.measured else { continue };
        let target = data.balls[ball].position;
        for m in 0..7 {
            let mut q: Vec<f64> = sample.q.iter().map(|q| q + dice.between(-0.7, 0.7)).collect();
            for _ in 0..30 {
                let at = |q: &[f64]| world_from_tool(arm, &data.base, &data.tool, q).translation.vector;
                let off = target - at(&q);
                let mut jacobian = nalgebra::Matrix3xX::<f64>::zeros(q.len());
                for j in 0..q.len() {
                    let mut more = q.clone();
                    more[j] += 1e-6;
                    jacobian.set_column(j, &((at(&more) - at(&q)) / 1e-6));
                }
                let square = &jacobian * jacobian.transpose() + nalgebra::Matrix3::identity() * 1e-4;
                let step = jacobian.transpose() * (square.try_inverse().unwrap() * off);
                q.iter_mut().zip(step.iter()).for_each(|(q, s)| *q += s.clamp(-0.3, 0.3));
            }
            let held = world_from_tool(arm, &data.base, &data.tool, &q);
            let reading = held.inverse().transform_point(&target.into()).coords + dice.vector(POINT);
            if reading.norm() < 5.0 * MM {
                data.samples.push(Sample::new(format!("s{k}_{m}"), q, Measured::Ball { ball, reading: Some(reading) }));
            }
        }
    }
}

fn joints(data: &mut Dataset, change: impl Fn(&mut Vec<f64>)) {
    data.samples.iter_mut().for_each(|s| change(&mut s.q));
}

fn points(data: &mut Dataset, change: impl Fn(&mut Vector3<f64>)) {
    data.balls.iter_mut().for_each(|b| change(&mut b.position));
    data.anchors.iter_mut().for_each(|a| change(&mut a.position));
    for s in &mut data.samples {
        if let Measured::Point(p) = &mut s.measured {
            change(p);
        }
    }
}

fn distances(data: &mut Dataset, change: impl Fn(f64) -> f64) {
    for s in &mut data.samples {
        if let Measured::Distance { distance, .. } = &mut s.measured {
            *distance = change(*distance);
        }
    }
}

fn turned(data: &mut Dataset, change: impl Fn(Rotation3<f64>) -> Rotation3<f64>) {
    for s in &mut data.samples {
        if let Some(o) = &mut s.orientation {
            o.rotation = change(Rotation3::new(o.rotation)).scaled_axis();
        }
    }
}

fn abc(r: &Rotation3<f64>) -> [f64; 3] {
    let (c, b, a) = r.euler_angles();
    [a, b, c]
}

fn of_abc([a, b, c]: [f64; 3]) -> Rotation3<f64> {
    Rotation3::from_euler_angles(c, b, a)
}

/// Makes the mistake of this number; what it may be called, by the beginning of the name, or `None` if there is none of this
/// number for data of this kind.
fn make(kind: Kind, number: usize, data: &mut Dataset, dice: &mut Dice) -> Option<Vec<String>> {
    let n = data.robot.joints();
    let names = |all: &[&str]| Some(all.iter().map(|s| (*s).to_owned()).collect::<Vec<_>>());
    let one = |name: String| Some(vec![name]);
    let inner = 1 + dice.below(n - 2);
    let angle = dice.sign() * dice.between(12.0, 170.0) * DEG;
    match (number, kind) {
        (0, _) => {
            let q = data.samples[0].q.clone();
            joints(data, |own| own.clone_from(&q));
            if kind == Kind::Balls {
                let first = data.samples[0].measured.clone();
                if data.samples.iter().all(|s| s.measured == first) {
                    return None;
                }
            }
            names(&["joints_constant"])
        }
        (1, _) => {
            let from = data.samples.len() / 4 + dice.below(data.samples.len() / 3);
            let q = data.samples[from].q.clone();
            data.samples[from..].iter_mut().for_each(|s| s.q.clone_from(&q));
            names(&["joints_frozen"])
        }
        (2, Kind::Positions | Kind::Poses) => {
            let every = 3 + dice.below(4);
            for k in (every..data.samples.len()).step_by(every) {
                data.samples[k].q = data.samples[k - 1].q.clone();
            }
            names(&["joints_stale"])
        }
        (3, _) => {
            let by = dice.sign();
            joints(data, |q| q[2] += by * q[1]);
            names(&["joint_coupled:3:2"])
        }
        (4, _) => {
            joints(data, |q| q[inner] = angle - q[inner]);
            one(format!("joint_sign:{}", inner + 1))
        }
        (5, _) => {
            joints(data, |q| q[inner] += angle);
            one(format!("joint_zero:{}", inner + 1))
        }
        (6, _) => {
            let other = 1 + inner % (n - 2);
            let more = dice.sign() * dice.between(12.0, 60.0) * DEG;
            joints(data, |q| (q[inner], q[other]) = (q[inner] + angle, q[other] + more));
            let [a, b] = [inner.min(other) + 1, inner.max(other) + 1];
            Some(vec![
                "joint_zeros".into(),
                format!("joint_zero:{a}+joint_zero:{b}"),
                format!("joint_zero:{b}+joint_zero:{a}"),
                "joint_signs_and_zeros".into(),
            ])
        }
        (7, _) => {
            let by = dice.between(1.2, 2.2).powf(dice.sign());
            joints(data, |q| q[inner] *= by);
            one(format!("joint_scale:{}", inner + 1))
        }
        (8, _) => {
            let scales: Vec<[f64; 2]> = (0..n).map(|_| [dice.between(0.7, 1.5), dice.between(-0.3, 0.3)]).collect();
            joints(data, |q| q.iter_mut().zip(&scales).for_each(|(q, [by, zero])| *q = by * *q + zero));
            names(&["joint_scales"])
        }
        (9, _) => {
            let more = dice.sign() * dice.between(60.0, 180.0) * MM;
            let mut robot = Robot::clone(&data.robot);
            // The length of the upper arm.
            let (i, along_x) = if robot.links[2].mdh.a.abs() > 0.1 { (2, true) } else { (2, false) };
            let mdh = &mut robot.links[i].mdh;
            *(if along_x { &mut mdh.a } else { &mut mdh.d }) += more;
            data.robot = Arc::new(robot);
            // It is that of the built-in arm.
            names(&[if along_x { "length:a2" } else { "length:d3" }, "robot:"])
        }
        (10, _) => {
            let mut robot = Robot::clone(&data.robot);
            let old = data.robot.links.clone();
            for (i, link) in robot.links.iter_mut().enumerate() {
                let from = old.get(i + 1).map_or((0.0, 0.0), |l| (l.mdh.alpha, l.mdh.a));
                (link.mdh.alpha, link.mdh.a) = from;
            }
            data.robot = Arc::new(robot);
            names(&["dh_convention", "robot:"])
        }
        // Three anchors and their mirror image are one triangle: the distances are the same.
        (11, Kind::Distances) if data.anchors.len() == 3 => None,
        (11, _) => {
            let a = dice.below(3);
            points(data, |p| p[a] = -p[a]);
            if kind == Kind::Poses {
                turned(data, |r| {
                    let mut v = -r.scaled_axis();
                    v[a] = -v[a];
                    Rotation3::new(v)
                });
            }
            names(&["left_handed", "axis_sign"])
        }
        (12, Kind::Positions | Kind::Poses | Kind::Targets) => {
            points(data, |p| p.swap_rows(0, 1));
            if kind == Kind::Poses {
                names(&["left_handed", "axes_swapped"])
            } else {
                names(&["left_handed", "axes_swapped", "axis_sign"])
            }
        }
        (13, _) => {
            let by = [1000.0, 1e-3, 25.4][dice.below(3)];
            points(data, |p| *p *= by);
            distances(data, |d| d * by);
            names(&["unit:points"])
        }
        (14, Kind::Positions | Kind::Poses) => {
            for k in (1..data.samples.len()).rev() {
                let before = data.samples[k - 1].clone();
                (data.samples[k].measured, data.samples[k].orientation) = (before.measured, before.orientation);
            }
            data.samples.remove(0);
            names(&["rows_shifted"])
        }
        (15, Kind::Poses) => {
            turned(data, |r| of_abc(abc(&r).map(|x| x / 0.9)));
            names(&["orientation_unit"])
        }
        (16, Kind::Poses) => {
            turned(data, |r| of_abc(abc(&r).map(|x| x * DEG)));
            names(&["orientation_unit"])
        }
        (17, Kind::Poses) => {
            let first = dice.sign() > 0.0;
            turned(data, |r| {
                let q = UnitQuaternion::from_rotation_matrix(&r).into_inner();
                let other = if first { Quaternion::new(q.i, q.j, q.k, q.w) } else { Quaternion::new(q.k, q.w, q.i, q.j) };
                UnitQuaternion::from_quaternion(other).to_rotation_matrix()
            });
            names(&["orientation_form"])
        }
        (18, Kind::Poses) => {
            turned(data, |r| {
                let [a, b, c] = abc(&r);
                of_abc([c, b, a])
            });
            names(&["orientation_columns"])
        }
        (19, Kind::Poses) => {
            turned(data, |r| of_abc(r.scaled_axis().into()));
            names(&["orientation_form"])
        }
        (20, Kind::Poses) => {
            turned(data, |r| Rotation3::new(abc(&r).into()));
            names(&["orientation_form"])
        }
        (21, Kind::Poses) => {
            turned(data, |r| r.inverse());
            names(&["orientation_inverse"])
        }
        (22, Kind::Poses) => {
            let k = dice.below(3);
            turned(data, |r| {
                let mut n = abc(&r);
                n[k] = -n[k];
                of_abc(n)
            });
            names(&["orientation_sign"])
        }
        (23, Kind::Poses) => {
            let base = data.base.pose().rotation;
            turned(data, |r| base.inverse() * r);
            names(&["orientation_frame"])
        }
        (24, Kind::Poses) => {
            data.tool_free = false;
            let tool = data.tool.pose().rotation;
            turned(data, |r| r * tool.inverse());
            names(&["orientation_tool"])
        }
        (25, Kind::Poses) => {
            let k = dice.below(data.samples.len());
            let flip = Rotation3::from_axis_angle(&Vector3::z_axis(), PI);
            if let Some(o) = &mut data.samples[k].orientation {
                o.rotation = (Rotation3::new(o.rotation) * flip).scaled_axis();
            }
            one(format!("sample:{}", data.samples[k].id))
        }
        (26, Kind::Poses) => {
            for k in (1..data.samples.len()).rev() {
                data.samples[k].orientation = data.samples[k - 1].orientation;
            }
            data.samples.remove(0);
            names(&["orientation_rows_shifted"])
        }
        (15, Kind::Distances) => {
            let by = [2.0, 0.5][dice.below(2)];
            distances(data, |d| d * by);
            names(&["distances_doubled"])
        }
        (16, Kind::Distances) => {
            distances(data, |d| d * d * 1000.0);
            names(&["distances_squared"])
        }
        (17, Kind::Distances) => {
            let more = dice.sign() * dice.between(0.0, 5.0).exp() * MM;
            distances(data, |d| d + more);
            names(&["distance_constant"])
        }
        (18, Kind::Distances) => {
            let by = 1.0 + dice.sign() * dice.between(-8.0, -2.3).exp();
            distances(data, |d| d * by);
            names(&["scale:distances"])
        }
        (19, Kind::Distances) => {
            let by = [1000.0, 1e-3, 25.4][dice.below(3)];
            distances(data, |d| d * by);
            names(&["unit:distances"])
        }
        (20, Kind::Distances) => {
            let (a, b) = (data.anchors[0].position, data.anchors[2].position);
            (data.anchors[0].position, data.anchors[2].position) = (b, a);
            names(&["anchors_swapped:a1:a3"])
        }
        (21, Kind::Distances) => {
            let off = dice.vector(1.0).normalize() * dice.between(0.01, 0.3);
            let a = dice.below(data.anchors.len());
            data.anchors[a].position += off;
            one(format!("anchor:{}", data.anchors[a].id))
        }
        (22, Kind::Distances) => {
            let more = dice.sign() * dice.between(1.0, 60.0) * MM;
            let a = dice.below(data.anchors.len());
            for s in &mut data.samples {
                if let Measured::Distance { anchor, distance } = &mut s.measured {
                    *distance += if *anchor == a { more } else { 0.0 };
                }
            }
            one(format!("distance_constant:{}", data.anchors[a].id))
        }
        (15, Kind::Targets) => {
            let t = dice.below(2);
            let by = [1000.0, 1e-3][dice.below(2)];
            data.tool_targets[t].position *= by;
            one(format!("unit:target:{}", data.tool_targets[t].id))
        }
        (16, Kind::Targets) => {
            let (b, c) = (data.tool_targets[0].position, data.tool_targets[1].position);
            (data.tool_targets[0].position, data.tool_targets[1].position) = (c, b);
            names(&["targets_swapped:b:c"])
        }
        (17, Kind::Targets) => {
            for k in 0..data.samples.len() / 3 {
                data.samples[3 * k + 1].measured = data.samples[3 * k].measured.clone();
            }
            names(&["copied:TCP:b"])
        }
        (18, Kind::Targets) => {
            for k in (1..data.samples.len() / 3).rev() {
                data.samples[3 * k + 1].measured = data.samples[3 * k - 2].measured.clone();
            }
            data.samples.remove(1);
            names(&["rows_shifted@target b"])
        }
        (19, Kind::Targets) => {
            let off = dice.vector(1.0).normalize() * dice.between(0.03, 0.1);
            let t = dice.below(2);
            data.tool_targets[t].position += off;
            one(format!("target:{}", data.tool_targets[t].id))
        }
        (15, Kind::Balls) => {
            let (a, b) = (data.balls[1].position, data.balls[4].position);
            (data.balls[1].position, data.balls[4].position) = (b, a);
            names(&["balls_swapped:b2:b5"])
        }
        (16, Kind::Balls) => {
            let off = dice.vector(1.0).normalize() * dice.between(0.06, 0.3);
            let b = dice.below(data.balls.len());
            data.balls[b].position += off;
            one(format!("ball:{}", data.balls[b].id))
        }
        _ => None,
    }
}

fn misfit(data: &Dataset) -> Option<Misfit> {
    data_fit(&[NamedDataset::new("data", data)], Use::All).pop().and_then(|fit| fit.misfit)
}

/// What contradicts itself in a misfit.
fn contradiction(m: &Misfit) -> Option<String> {
    let least = m.slips.iter().map(|s| s.residual).fold(f64::INFINITY, f64::min);
    let wrong = match m.cause {
        Cause::Slips if m.measure == Measure::Rows => false,
        Cause::Slips => least > m.left || (m.left <= m.most && !m.within_expected),
        Cause::Unknown => m.left <= m.most,
        _ => false,
    };
    wrong.then(|| format!("{m:?}"))
}

/// Makes so many mistakes; the share that is named.
fn try_mistakes(count: usize, seed: u64) -> f64 {
    let (mut made, mut named, mut passed, mut contradicted) = (0usize, 0usize, 0usize, 0usize);
    let mut round = 0;
    'all: loop {
        for number in 0..27 {
            for kind in KINDS {
                if made == count {
                    break 'all;
                }
                // A slice of the whole meets every mistake of some kind.
                if count < 200 && !(number + kind as usize + round).is_multiple_of(3) {
                    continue;
                }
                let mut dice = Dice(seed + (round * 1000 + number * 10 + kind as usize) as u64);
                let mut data = campaign(kind, &mut dice, 2.0, 9);
                let Some(names) = make(kind, number, &mut data, &mut dice) else { continue };
                made += 1;
                let found = misfit(&data);
                let right = found.as_ref().is_some_and(|m| {
                    m.cause != Cause::Unknown && m.slips.iter().any(|s| names.iter().any(|n| s.slip.starts_with(n.as_str())))
                });
                named += usize::from(right);
                passed += usize::from(found.is_none());
                contradicted += usize::from(found.as_ref().and_then(contradiction).is_some());
                if !right {
                    let said = found.map(|m| {
                        let slips: Vec<String> = m.slips.iter().map(|s| format!("{} {:.4}", s.slip, s.residual)).collect();
                        format!("{:?} {:?} {:.4} of {:.4}: {}", m.measure, m.cause, m.left, m.most, slips.join(", "))
                    });
                    println!(
                        "{kind:?} {number} {} {}: {}",
                        data.robot.name,
                        names.join("|"),
                        said.unwrap_or_else(|| "PASSED".into())
                    );
                }
            }
        }
        round += 1;
    }
    println!("{made} mistakes: {named} named, {passed} passed as noise, {contradicted} contradict themselves");
    assert_eq!((passed, contradicted), (0, 0));
    named as f64 / made as f64
}

/// Campaigns without a mistake, of good and of poor arms, with all joints or the first few moving.
fn try_right_campaigns(count: usize, seed: u64) {
    let mut refused = 0;
    for k in 0..count {
        let mut dice = Dice(seed + k as u64);
        let kind = KINDS[k % KINDS.len()];
        let (sizes, moving) = ([1.0, 2.0, 4.0][dice.below(3)], [9, 9, 9, 4, 2][dice.below(5)]);
        let data = campaign(kind, &mut dice, sizes, if kind == Kind::Balls { 9 } else { moving });
        if let Some(m) = misfit(&data) {
            refused += 1;
            println!("{k} {kind:?} {} {moving} joints, {sizes} sizes: {m:?}", data.robot.name);
        }
    }
    println!("{count} right campaigns, {refused} refused");
    assert_eq!(refused, 0);
}

#[test]
fn a_mistake_in_what_was_measured_is_named() {
    assert!(try_mistakes(30, 72_000) >= 0.9);
}

#[test]
fn a_campaign_without_a_mistake_is_not_refused() {
    try_right_campaigns(20, 73_000);
}

/// 500 mistakes, at least 95 % named, none passed; 300 right campaigns, none refused.
#[test]
#[ignore = "a study: validation/run a_mistake_is_named_whatever_was_measured"]
fn five_hundred_mistakes_are_named_and_three_hundred_campaigns_pass() {
    assert!(try_mistakes(500, 74_000) >= 0.95);
    try_right_campaigns(300, 75_000);
}
