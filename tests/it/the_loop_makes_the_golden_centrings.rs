//! The controller makes the same 80 centrings as an independent program (Pinocchio and closed-form numpy, which agree to 1e-14 rad):
//! the arm deviates as Table 8 of the paper says, the robot's controller believes the drawing, nothing is noisy.

use std::cell::RefCell;
use std::rc::Rc;

use calibench::cell::{Indicator, IndicatorError, Manipulator, ManipulatorError, TriCal};
use calibench::measure::centring::{CenteringController, CentringSettings};
use calibench::robot::kinematics::{Posture, world_from_tool};
use calibench::robot::sites::{Axis6, MdhEntry, Site, SiteIndex};
use calibench::robot::statics::{Loads, Payload};
use calibench::robot::{FramePose, Link, MdhLink, Pose, Robot};
use calibench::units::{DEG, MM};
use nalgebra::{Matrix6, Vector3, Vector6};
use serde_json::Value;

use crate::works::golden;

/// Readings agree so closely, m. The program's RelTool stops after two Newton steps, as this one does; rounding is a thousand times less.
const READING: f64 = 1e-9;

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().map(|a| a.iter().filter_map(Value::as_f64).collect()).unwrap_or_default()
}

fn vector(value: &Value) -> Vector3<f64> {
    Vector3::from_iterator(numbers(value))
}

fn frame(value: &Value) -> FramePose {
    let ([x, y, z], [a, b, c]) = (vector(&value["xyz_mm"]).into(), vector(&value["alpha_beta_gamma_deg"]).into());
    FramePose { xyz: [x * MM, y * MM, z * MM], rz_ry_rx: [a * DEG, b * DEG, c * DEG] }
}

/// An arm that deviates and a controller that does not know.
struct Arm {
    robot: Robot,
    base: FramePose,
    tool: FramePose,
    payload: Payload,
    gravity: Vector3<f64>,
    deviations: Vec<f64>,
    compliance: [f64; 6],
    ball: Vector3<f64>,
    q: Vec<f64>,
}

impl Arm {
    fn read(model: &Value) -> Arm {
        let number = |v: &Value, key: &str| v[key].as_f64().expect("a number");
        let mut links: Vec<Link> = Vec::new();
        for mdh in model["mdh_nominal"].as_array().expect("six links") {
            let mdh = MdhLink {
                alpha: number(mdh, "alpha_prev_deg") * DEG,
                a: number(mdh, "a_prev_mm") * MM,
                beta: number(mdh, "beta_prev_deg") * DEG,
                theta: number(mdh, "theta_offs_deg") * DEG,
                d: number(mdh, "d_mm") * MM,
                ..MdhLink::default()
            };
            links.push(Link { mdh, limits: [-7.0, 7.0], mass: 0.0, com: Vector3::zeros() });
        }
        let mut payload = Payload::none();
        for body in model["inertial"]["links"].as_array().expect("bodies") {
            let (mass, com) = (number(body, "mass_kg"), vector(&body["com_m"]));
            if body["name"].is_string() {
                payload = Payload { name: "TriCal".into(), mass, com };
            } else {
                let link = &mut links[body["frame"].as_u64().expect("a frame") as usize - 1];
                (link.mass, link.com) = (mass, com);
            }
        }
        let sites = SiteIndex::new(6);
        let (mut deviations, mut compliance) = (vec![0.0; sites.len()], [0.0; 6]);
        for p in model["params"].as_array().expect("31 parameters") {
            let deviation = number(p, "identified_table8_si") - number(p, "nominal_si");
            let joint = (number(p, "joint") as usize).saturating_sub(1);
            let site = match p["kind"].as_str().expect("a kind") {
                "base_x" => Site::Base(Axis6::X),
                "base_y" => Site::Base(Axis6::Y),
                "base_z" => Site::Base(Axis6::Z),
                "base_rz" => Site::Base(Axis6::Rz),
                "base_ry" => Site::Base(Axis6::Ry),
                "base_rx" => Site::Base(Axis6::Rx),
                "alpha" => Site::mdh(joint, MdhEntry::Alpha),
                "a" => Site::mdh(joint, MdhEntry::A),
                "d" => Site::mdh(joint, MdhEntry::D),
                "theta" => Site::mdh(joint, MdhEntry::Theta),
                "beta" => Site::mdh(joint, MdhEntry::Beta),
                _ => {
                    compliance[joint] = deviation;
                    continue;
                }
            };
            deviations[sites.of(site)] = deviation;
        }
        let robot = Robot { name: "golden".into(), links, ..Robot::default() };
        Arm {
            robot,
            base: frame(&model["base_nominal"]),
            tool: frame(&model["tool"]),
            payload,
            gravity: vector(&model["gravity_world_m_s2"]),
            deviations,
            compliance,
            ball: Vector3::zeros(),
            q: Vec::new(),
        }
    }

    /// The ball's centre in the true tool frame, m.
    fn ball_in_tool(&self) -> Vector3<f64> {
        let sites = SiteIndex::new(6);
        let (mut posture, mut loads) = (Posture::new(&self.robot), Loads::new(6));
        posture.set(&self.robot, &self.base, &self.tool, &self.q, &vec![0.0; sites.len()]);
        loads.compute(&self.robot, &posture, &self.payload, &self.gravity, &Vector3::zeros());
        let mut deviations = self.deviations.clone();
        for joint in 0..6 {
            // The program's torque is the one that holds the load, the opposite of the load's own.
            deviations[sites.of(Site::mdh(joint, MdhEntry::Theta))] -= self.compliance[joint] * loads.tau[joint];
        }
        posture.set(&self.robot, &self.base, &self.tool, &self.q, &deviations);
        let world_from_tool = posture.world_from_tool(&self.tool);
        world_from_tool.inverse_transform_point(&self.ball.into()).coords
    }

    /// RelTool as the program does it: two Newton steps on the nominal arm, orientation kept.
    fn rel_tool(&mut self, offset: &Vector3<f64>) {
        let nominal = |q: &[f64]| world_from_tool(&self.robot, &self.base, &self.tool, q);
        let target: Pose = nominal(&self.q) * nalgebra::Translation3::from(*offset);
        for _ in 0..2 {
            let here = nominal(&self.q);
            let mut jacobian = Matrix6::zeros();
            let mut frame = self.base.pose();
            for (j, link) in self.robot.links.iter().enumerate() {
                frame *= link.mdh.transform(self.q[j]);
                let axis = frame.rotation * Vector3::z();
                let arm = here.translation.vector - frame.translation.vector;
                jacobian.fixed_view_mut::<3, 1>(0, j).copy_from(&axis.cross(&arm));
                jacobian.fixed_view_mut::<3, 1>(3, j).copy_from(&axis);
            }
            let turn = (target.rotation * here.rotation.inverse()).into_inner();
            let turn = (turn - turn.transpose()) * 0.5;
            let shift = target.translation.vector - here.translation.vector;
            let error = Vector6::new(shift.x, shift.y, shift.z, turn[(2, 1)], turn[(0, 2)], turn[(1, 0)]);
            let dq = jacobian.lu().solve(&error).expect("no golden pose is singular");
            self.q.iter_mut().zip(dq.iter()).for_each(|(q, d)| *q += d);
        }
    }
}

struct NominalController(Rc<RefCell<Arm>>);
struct Ideal(Rc<RefCell<Arm>>, usize);

impl Manipulator for NominalController {
    fn joints(&mut self) -> Result<Vec<f64>, ManipulatorError> {
        Ok(self.0.borrow().q.clone())
    }

    fn move_joints(&mut self, target: &[f64]) -> Result<(), ManipulatorError> {
        self.0.borrow_mut().q = target.to_vec();
        Ok(())
    }

    fn move_in_tool(&mut self, offset: &Vector3<f64>) -> Result<(), ManipulatorError> {
        self.0.borrow_mut().rel_tool(offset);
        Ok(())
    }

    fn clock_s(&mut self) -> f64 {
        0.0
    }
}

impl Indicator for Ideal {
    fn read(&mut self) -> Result<f64, IndicatorError> {
        Ok(self.0.borrow().ball_in_tool()[self.1])
    }

    fn preset(&mut self, _: f64) -> Result<(), IndicatorError> {
        Ok(())
    }
}

#[test]
fn eighty_times() {
    let (model, golden) = (golden::read("model.json"), golden::read("centring_80.json"));
    let trical = TriCal::default();
    let arm = Rc::new(RefCell::new(Arm::read(&model)));
    let indicators = std::array::from_fn(|axis| Ideal(Rc::clone(&arm), axis));
    let settings = CentringSettings::default();
    let mut controller =
        CenteringController::new(NominalController(Rc::clone(&arm)), indicators, trical, [trical.free_reading(); 3], settings);
    for k in 0..80 {
        let ball = golden["ball"][k].as_u64().expect("a ball") as usize;
        arm.borrow_mut().ball = vector(&model["balls_world_mm"][ball]) * MM;
        arm.borrow_mut().q = numbers(&golden["q_start"][k]);
        let mut readings = Vec::new();
        let centred = controller.centre(&mut |stop| readings.extend(stop.reading)).expect("a sound cell");
        assert_eq!(readings.len(), golden["iterations"][k].as_u64().expect("a count") as usize, "centring {k}");
        for (reading, expected) in readings.iter().zip(golden["readings_m"][k].as_array().expect("readings")) {
            assert!((reading - vector(expected)).amax() < READING, "centring {k}: {reading} {expected}");
        }
        let q_final = numbers(&golden["q_final"][k]);
        // A nanometre at a metre.
        assert!(centred.joints.iter().zip(&q_final).all(|(a, b)| (a - b).abs() < 1e-9), "centring {k}");
    }
}
