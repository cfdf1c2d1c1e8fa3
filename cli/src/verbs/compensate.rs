//! `compensate CALIBRATION [TARGETS.csv -o FAKE.csv | PROGRAM... -o OUT]`.

mod arguments;
mod options;
mod programs;
mod telling;

use std::path::Path;

use calibench::compensate::flange::flange_frame;
use calibench::compensate::krl::{KrlProgram, Motion};
use calibench::compensate::mjcf::mjcf;
use calibench::compensate::rigid::RigidRobot;
use calibench::compensate::targets_file::{Expected, fake_csv, read_targets};
use calibench::compensate::urdf::urdf;
use calibench::compensate::{Compensated, Compensator, Fake, Target, Task, Uncertainty};
use calibench::effects::Needs;
use calibench::effects::registry::Registry;
use calibench::files::FileError;
use calibench::files::disk::write_whole;
use calibench::identify::calibration::{Calibration, read_calibration};
use calibench::prediction::Extrapolation;
use calibench::robot::robot_file::{RobotReference, to_toml};
use calibench::robot::statics::Payload;
use calibench::robot::urdf::{JointOrigin, calibrated_urdf, joint_origins};
use calibench::robot::{FramePose, JointKind, Robot};
use calibench::units::MM;
use calibench_report::documents::{
    self, CompensatedTarget, CompensatedTargets, Compensation, OutsideRange, RigidPart, TargetOutcome,
};
use calibench_report::{HERE, extrapolation_sentence, plain_table};
use nalgebra::{Point3, Vector3};

use crate::terminal::failure::{Failure, Outcome};
use crate::terminal::output::{check_outputs, print, print_answer, print_json, print_written, warn};
pub use arguments::Arguments;
use telling::{MOST_TOLD, stretches, tell_setting};

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let programs = programs::Programs::of(arguments)?;
    let table = arguments.out.iter().filter(|_| programs.is_none());
    check_outputs(table.chain(&arguments.urdf).chain(&arguments.mdh).chain(&arguments.mjcf).chain(&arguments.ur_kinematics))?;
    let as_links = [&arguments.urdf, &arguments.mdh, &arguments.mjcf].into_iter().any(Option::is_some);
    if arguments.targets.is_empty() && !as_links {
        return Err("there is nothing to do; give TARGETS.csv and -o FAKE.csv, --urdf FILE, --mjcf FILE or --mdh FILE".into());
    }
    let calibration = converged(&arguments.calibration)?;
    let task = Task {
        setup: arguments.session.clone(),
        frame: arguments.base.unwrap_or(Task::default().frame),
        tool: arguments.tool,
        payload: arguments.load.map(|load| payload(&calibration, load)),
    };
    let locate = |e: &dyn std::fmt::Display| format!("{}: {e}", arguments.calibration.display());
    let mut compensator = Compensator::new(&calibration, &task).map_err(|e| locate(&e))?;
    let mut document = Compensation::of_robot(&calibration.robot.name);
    let mut outcome = Outcome::Done;
    if let Some(programs) = &programs {
        (document.programs, outcome) = programs.compensate(arguments, &mut compensator)?;
    } else if let ([path], Some(out)) = (&arguments.targets[..], &arguments.out) {
        let targets = read(path, &compensator, &task)?;
        let results: Vec<Compensated> = targets.iter().map(|target| compensator.compensate(target)).collect();
        let beyond = write_fakes(arguments, out, &compensator, &targets, &results)?;
        if results.iter().any(|r| r.outcome.is_err()) {
            outcome = Outcome::ExpectationFailed;
        }
        if arguments.json {
            document.targets = Some(CompensatedTargets {
                outside_range: OutsideRange::of(&beyond),
                ..compensated(&compensator, &targets, &results)
            });
        } else {
            tell(&compensator, &targets, &results)?;
        }
    }
    if as_links {
        document.rigid = write_rigid(arguments, &calibration.robot, &compensator.rigid())?;
    }
    if arguments.json {
        print_json(&document)?;
    }
    Ok(outcome)
}

/// Reads a calibration; refuses one whose fit did not converge, and warns of an undetermined set-up.
fn converged(path: &Path) -> Result<Calibration, Failure> {
    let calibration = read_calibration(path, Registry::catalogue())?;
    if let Some(outcome) = calibration.unconverged() {
        let why = "a robot must not be sent anywhere by it; identify it again from more postures, or with fewer effects";
        return Err(format!("{}: the fit {}: {why}", path.display(), outcome.in_words()).into());
    }
    let open = calibration.undetermined_set_up();
    if !open.is_empty() {
        warn(&format!(
            "WARNING: {} kept at their nominal values, because the data of this calibration do not determine them: targets in the world are \
             missed by as much as these are off.",
            open.join(", ")
        ));
    }
    Ok(calibration)
}

/// Writes the fake targets and the KRL module, and warns of what lies outside the range of the data, which is returned.
fn write_fakes(
    arguments: &Arguments,
    out: &Path,
    compensator: &Compensator<'_>,
    targets: &[Target],
    results: &[Compensated],
) -> Result<Extrapolation, Failure> {
    let calibration = compensator.calibration();
    let krl = arguments.krl.as_deref().map(|name| program(name, arguments.lin, compensator, targets, results)).transpose()?;
    write_whole(out, fake_csv(&calibration.robot, targets, results).as_bytes())?;
    print_written(out);
    if let (Some(name), Some(Some([src, dat]))) = (&arguments.krl, &krl) {
        for (extension, text) in [("src", src), ("dat", dat)] {
            write_whole(&out.with_file_name(format!("{name}.{extension}")), text.as_bytes())?;
        }
    }
    let reached = results.iter().filter_map(|r| r.outcome.as_ref().ok()).map(|fake| fake.q.as_slice());
    let beyond = Extrapolation::of(&calibration.robot, &calibration.joint_ranges, &calibration.model, reached);
    if let Some(warning) = extrapolation_sentence(&beyond) {
        warn(&warning);
    }
    if matches!(krl, Some(None)) {
        warn(
            "warning: no KRL module was written: a program with a gap is another program; remove the targets that are refused",
        );
    }
    Ok(beyond)
}

/// Joints of ur_description and the names under which its kinematics file has them.
const UR_JOINTS: [(&str, &str); 6] = [
    ("shoulder_pan_joint", "shoulder"),
    ("shoulder_lift_joint", "upper_arm"),
    ("elbow_joint", "forearm"),
    ("wrist_1_joint", "wrist_1"),
    ("wrist_2_joint", "wrist_2"),
    ("wrist_3_joint", "wrist_3"),
];

/// Joint origins as the kinematics file of ur_description.
fn ur_kinematics(origins: &[JointOrigin]) -> Result<String, Failure> {
    let mut text = String::from("kinematics:\n");
    // FNV-1a over the numbers: the driver asks for some checksum, and compares it with that of the controller's own.
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    for (k, (joint, name)) in UR_JOINTS.into_iter().enumerate() {
        let found = origins.get(k).filter(|o| o.joint.ends_with(joint));
        let origin = found.ok_or_else(|| format!("joint {} of the URDF file is not `{joint}`: it is not a UR", k + 1))?.origin;
        let FramePose { xyz: [x, y, z], rz_ry_rx: [yaw, pitch, roll] } = origin;
        text.push_str(&format!("  {name}:\n"));
        for (key, value) in [("x", x), ("y", y), ("z", z), ("roll", roll), ("pitch", pitch), ("yaw", yaw)] {
            text.push_str(&format!("    {key}: {value:?}\n"));
            hash = (hash ^ value.to_bits()).wrapping_mul(0x0100_0000_01b3);
        }
    }
    text.push_str(&format!("  hash: calib_{hash}\n"));
    Ok(text)
}

/// Writes the URDF and the robot file; returns their part of the document, or prints it without `--json`.
fn write_rigid(arguments: &Arguments, nominal: &Robot, rigid: &RigidRobot) -> Result<Option<RigidPart>, Failure> {
    if let Some(path) = &arguments.urdf {
        let text = match &arguments.urdf_of {
            None => urdf(rigid),
            Some(of) => {
                let RobotReference { name, ends } = RobotReference::parse(of);
                let [nominal, identified] = [nominal, &rigid.robot];
                if let Some(path) = &arguments.ur_kinematics {
                    let origins = joint_origins(Path::new(name), &ends, nominal, identified)?;
                    write_whole(path, ur_kinematics(&origins)?.as_bytes())?;
                }
                calibrated_urdf(Path::new(name), &ends, nominal, identified)?
            }
        };
        write_whole(path, text.as_bytes())?;
    }
    if let Some(path) = &arguments.mjcf {
        write_whole(path, mjcf(rigid).as_bytes())?;
    }
    if let Some(path) = &arguments.mdh {
        write_whole(path, to_toml(&rigid.robot).as_bytes())?;
    }
    let [mean, max] = [rigid.left_out.mean, rigid.left_out.max].map(|e| e / MM);
    if arguments.json {
        let effects = rigid.effects.clone();
        return Ok(Some(RigidPart { left_out_effects: effects, left_out_mean_mm: mean, left_out_max_mm: max }));
    }
    if rigid.effects.is_empty() {
        print("The calibration consists of links alone: a URDF, a model of MuJoCo or a robot file holds all of it.")?;
    } else {
        print(format!(
            "A URDF, a model of MuJoCo or a robot file holds the links alone; what it cannot hold ({}) moves the TCP by {mean:.3} mm in the mean, {max:.3} mm at most.",
            rigid.effects.join(", ")
        ))?;
    }
    Ok(None)
}

fn read(path: &Path, compensator: &Compensator<'_>, task: &Task) -> Result<Vec<Target>, FileError> {
    let calibration = compensator.calibration();
    let by_temperature = compensator.arm().needs().find(|(_, needs)| needs.contains(&Needs::Temperature)).map(|(id, _)| id);
    // A load given on the command line applies to every target.
    let payloads = if task.payload.is_some() { &[][..] } else { compensator.payloads() };
    let targets = read_targets(path, &Expected { robot: &calibration.robot, payloads, by_temperature })?;
    if compensator.all_in_the_foot(&targets) {
        let problem = "every target lies in the foot of the robot, as if it were given in metres";
        return Err(FileError { field: "x_mm".into(), ..FileError::whole(path, problem, "give the targets in mm") });
    }
    Ok(targets)
}

/// The KRL module, or `None` if a target was refused.
fn program(
    name: &str,
    lin: bool,
    compensator: &Compensator<'_>,
    targets: &[Target],
    results: &[Compensated],
) -> Result<Option<[String; 2]>, Failure> {
    let fakes = results.iter().zip(targets).filter_map(|(r, t)| Some((t.id.as_str(), r.outcome.as_ref().ok()?)));
    let fakes: Vec<(&str, &Fake)> = fakes.collect();
    let whole = fakes.len() == targets.len();
    let motion = if lin { Motion::Lin } else { Motion::Ptp };
    let program = KrlProgram::new(name, motion, &compensator.base_link_from_work(), &compensator.flange_from_tool(), fakes)?;
    Ok(whole.then(|| [program.src(), program.dat()]))
}

fn tell(compensator: &Compensator<'_>, targets: &[Target], results: &[Compensated]) -> Result<(), Failure> {
    let fakes: Vec<&Fake> = results.iter().filter_map(|r| r.outcome.as_ref().ok()).collect();
    print_answer(format!("{} of {} targets compensated", fakes.len(), targets.len()))?;
    let ids = || targets.iter().map(|target| target.id.as_str());
    let mut refused = stretches(ids(), results.iter().map(|r| r.outcome.as_ref().err()));
    if !refused.is_empty() {
        let more: usize = refused.split_off(refused.len().min(MOST_TOLD)).iter().map(|told| told.count).sum();
        let rows = refused.into_iter().map(|told| [told.targets(), told.what.name().into(), told.what.to_string()]);
        let rows: Vec<[String; 3]> = rows.collect();
        print_answer(plain_table(["refused", "status", ""], rows))?;
        if more > 0 {
            print(format!("and {more} more, each with its status in the file"))?;
        }
    }
    let near = stretches(ids(), results.iter().map(|r| r.warnings.near_singular.then_some(())));
    if !near.is_empty() {
        let count: usize = near.iter().map(|told| told.count).sum();
        let mut words: Vec<String> = near.iter().take(MOST_TOLD).map(|told| told.targets()).collect();
        if near.len() > MOST_TOLD {
            words.push("and others".into());
        }
        print(format!(
            "{count} near a singularity: the arm reaches it, but small motions of the tool are large ones of its joints: {}",
            words.join(", ")
        ))?;
    }
    if !fakes.is_empty() {
        let row = |name: &str, all: &[f64]| {
            let (mean, max) = (all.iter().sum::<f64>() / all.len() as f64, all.iter().copied().fold(0.0, f64::max));
            [name.to_owned(), format!("{:.3}", mean / MM), format!("{:.3}", max / MM)]
        };
        let shifts: Vec<f64> = fakes.iter().map(|f| f.shift).collect();
        let mut rows = vec![row("shift of the target", &shifts)];
        let known: Vec<_> = results.iter().filter_map(Compensated::uncertainty).collect();
        let (inside, outside) = (known.len(), fakes.len() - known.len());
        if inside > 0 {
            let of = if outside > 0 { format!(", of the {inside} in the measured ranges") } else { String::new() };
            let [worst, whole]: [Vec<f64>; 2] =
                [known.iter().map(|u| u.worst_axis).collect(), known.iter().map(|u| u.three_d).collect()];
            rows.push(row(&format!("{}, 1 sigma, worst axis{of}", HERE.name), &worst));
            rows.push(row(&format!("{}, 1 sigma, 3-D{of}", HERE.name), &whole));
        }
        print(plain_table(["mm", "mean", "max"], rows))?;
        if outside > 0 {
            print("No error can be predicted for targets beyond the joint ranges that were measured.")?;
        }
        if inside > 0 {
            print(
                "The prediction holds where samples were taken; `calibench compare` shows how much larger the error may be elsewhere in these ranges.",
            )?;
        }
    }
    tell_setting(compensator, &compensator.assumptions(targets))
}

fn compensated(compensator: &Compensator<'_>, targets: &[Target], results: &[Compensated]) -> CompensatedTargets {
    let robot = &compensator.calibration().robot;
    let of_kind = |q: &[f64], kind: JointKind| -> Vec<Option<f64>> {
        q.iter().zip(robot.kinds()).map(|(q, of)| (of == kind).then(|| q / kind.unit().si)).collect()
    };
    let fake = |fake: &Fake, known: Option<&Uncertainty>| documents::Fake {
        fake: (&fake.pose).into(),
        q_deg: of_kind(&fake.q, JointKind::Revolute),
        q_mm: robot.first_prismatic().map(|_| of_kind(&fake.q, JointKind::Prismatic)),
        s: fake.status_turn.map(|s| s.status),
        t: fake.status_turn.map(|s| s.turn),
        sigma_worst_mm: known.map(|u| u.worst_axis / MM),
        sigma_3d_mm: known.map(|u| u.three_d / MM),
        shift_mm: fake.shift / MM,
    };
    let of = |(target, result): (&Target, &Compensated)| {
        let (status, outcome) = match &result.outcome {
            Ok(pose) => ("ok", TargetOutcome::Ok(fake(pose, result.uncertainty()))),
            Err(refusal) => (refusal.name(), TargetOutcome::Refused { why: refusal.to_string() }),
        };
        CompensatedTarget {
            id: target.id.clone(),
            status: status.into(),
            warnings: result.warnings.names().map(Into::into).collect(),
            target: (&result.desired).into(),
            outcome,
        }
    };
    CompensatedTargets {
        compensated: results.iter().filter(|r| r.outcome.is_ok()).count(),
        base: (&compensator.base_link_from_work()).into(),
        tool: (&compensator.flange_from_tool()).into(),
        assumed: compensator.assumptions(targets),
        targets: targets.iter().zip(results).map(of).collect(),
        outside_range: None,
    }
}

/// A load as given: its centre of mass relative to the maker's flange.
fn payload(calibration: &Calibration, [mass, x, y, z]: [f64; 4]) -> Payload {
    let on_flange = Point3::from(Vector3::new(x, y, z) * MM);
    Payload { name: "--load".into(), mass, com: (flange_frame(&calibration.robot).pose() * on_flange).coords }
}
