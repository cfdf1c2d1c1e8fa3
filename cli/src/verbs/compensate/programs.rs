//! Robot programs, rewritten.

use std::fs;
use std::path::{Path, PathBuf};

use calibench::compensate::{Compensator, Target};
use calibench::effects::Needs;
use calibench::files::FileError;
use calibench::files::disk::write_whole;
use calibench::prediction::Extrapolation;
use calibench::units::MM;
use calibench_programs::{
    Dialect, NamedFrames, Permissions, Program, Remark, Rewritten, RewrittenProgram, read_frames, read_program,
    rewrite_programs,
};
use calibench_report::documents::{CompensatedProgram, CompensatedPrograms, NotRewritten, OutsideRange, PositionShift};
use calibench_report::{extrapolation_sentence, plain_table};

use super::arguments::Arguments;
use super::telling::{MOST_TOLD, tell_setting};
use crate::terminal::failure::{Failure, Outcome};
use crate::terminal::output::{check_outputs, print, print_answer, print_written, warn};

/// The programs given, and where they go.
pub struct Programs {
    programs: Vec<Program>,
    outs: Vec<PathBuf>,
}

impl Programs {
    /// Reads the programs; `None` if targets are given, or nothing.
    pub fn of(arguments: &Arguments) -> Result<Option<Self>, Failure> {
        let given = &arguments.targets;
        if !given.iter().any(|path| Dialect::of(path).is_some()) {
            if let [_, second, ..] = &given[..] {
                return Err(FileError::whole(second, "is a second file of targets", "give one file of targets").into());
            }
            if arguments.partly
                || arguments.joints_as_in_robot_file
                || arguments.external_axes_apart
                || !arguments.frames.is_empty()
            {
                let options = "--partly, --joints-as-in-robot-file, --external-axes-apart and --frames";
                return Err(format!("{options} are for robot programs, and no program is given").into());
            }
            return Ok(None);
        }
        if arguments.krl.is_some() {
            return Err("--krl writes a program over targets, and a program is given; leave it out".into());
        }
        let programs: Vec<Program> = given.iter().map(|path| read_program(path)).collect::<Result<_, _>>()?;
        if let Some(other) = programs.iter().find(|p| p.dialect != programs[0].dialect) {
            let problem = "is a program of another controller than the first one";
            return Err(FileError::whole(&other.path, problem, "compensate it by a call of its own").into());
        }
        let outs = destinations(&programs, arguments.out.as_deref())?;
        check_outputs(&outs)?;
        Ok(Some(Programs { programs, outs }))
    }

    /// Compensates and writes them; returns their part of the document with `--json`, and prints it otherwise.
    pub fn compensate(
        &self,
        arguments: &Arguments,
        compensator: &mut Compensator<'_>,
    ) -> Result<(Option<CompensatedPrograms>, Outcome), Failure> {
        if let Some(joint) = compensator.calibration().robot.first_prismatic() {
            let problem =
                format!("cannot be rewritten: joint {} is prismatic, and programs are read for arms that turn", joint + 1);
            return Err(FileError::whole(&self.programs[0].path, problem, "compensate a table of targets").into());
        }
        let mut frames = NamedFrames::default();
        for path in &arguments.frames {
            frames.extend(read_frames(path)?);
        }
        let permissions = Permissions {
            joints_as_in_robot_file: arguments.joints_as_in_robot_file,
            external_axes_apart: arguments.external_axes_apart,
            tool_given: arguments.tool.is_some(),
            base_given: arguments.base.is_some(),
            frames,
        };
        let results = rewrite_programs(&self.programs, compensator, &permissions);
        if results.iter().all(|r| r.positions == 0 && r.is_whole()) {
            let problem = "contains no position that is written out";
            let remedy = "give the file in which the positions are taught (with a KUKA the .dat too)";
            return Err(FileError::whole(&self.programs[0].path, problem, remedy).into());
        }
        let whole = results.iter().all(RewrittenProgram::is_whole);
        let written = whole || arguments.partly;
        if written {
            for (out, result) in self.outs.iter().zip(&results) {
                write_whole(out, &result.bytes)?;
                print_written(out);
            }
        }
        let calibration = compensator.calibration();
        let reached = results.iter().flat_map(|r| r.rewritten.iter().map(|one| one.fake.q.as_slice()));
        let beyond = Extrapolation::of(&calibration.robot, &calibration.joint_ranges, &calibration.model, reached);
        if let Some(warning) = extrapolation_sentence(&beyond) {
            warn(&warning);
        }
        let outcome = if whole { Outcome::Done } else { Outcome::ExpectationFailed };
        let assumed = assumptions(compensator, &results);
        if arguments.json {
            let files = self.programs.iter().zip(&self.outs).zip(&results);
            let document = CompensatedPrograms {
                base: (&compensator.base_link_from_work()).into(),
                tool: (&compensator.flange_from_tool()).into(),
                assumed,
                files: files.map(|((program, out), result)| of(program, written.then_some(out), result)).collect(),
                outside_range: OutsideRange::of(&beyond),
            };
            return Ok((Some(document), outcome));
        }
        for (program, result) in self.programs.iter().zip(&results) {
            tell(&program.path, result)?;
        }
        tell_shifts(&self.programs, &results)?;
        tell_setting(compensator, &assumed)?;
        if !written {
            warn(
                "no program was written, because some positions would stay as they are; correct them, or write the rest with --partly",
            );
        }
        Ok((None, outcome))
    }
}

/// Output path of each program: the file that was named, or its own name in the folder.
fn destinations(programs: &[Program], out: Option<&Path>) -> Result<Vec<PathBuf>, FileError> {
    let Some(out) = out else { return Ok(Vec::new()) };
    let into_folder = programs.len() > 1 || out.is_dir();
    if programs.len() > 1 && out.is_file() {
        return Err(FileError::whole(out, "is a file, and several programs are given", "name a folder"));
    }
    let mut outs: Vec<PathBuf> = Vec::new();
    for program in programs {
        let name = program.path.file_name().unwrap_or_default();
        let to = if into_folder { out.join(name) } else { out.to_owned() };
        let real = |path: &Path| fs::canonicalize(path).ok();
        if programs.iter().any(|p| real(&p.path).is_some_and(|input| real(&to) == Some(input))) {
            return Err(FileError::whole(&to, "is one of the programs themselves", "name another file or folder with -o"));
        }
        if outs.contains(&to) {
            return Err(FileError::whole(
                &program.path,
                "has the name of another program",
                "compensate it by a call of its own",
            ));
        }
        outs.push(to);
    }
    Ok(outs)
}

fn assumptions(compensator: &Compensator<'_>, results: &[RewrittenProgram]) -> Vec<String> {
    let targets: Vec<Target> = results.iter().flat_map(|r| r.rewritten.iter().map(|one| one.target.clone())).collect();
    let mut assumed = compensator.assumptions(&targets);
    let by_temperature: Vec<&str> =
        compensator.arm().needs().filter(|(_, needs)| needs.contains(&Needs::Temperature)).map(|(id, _)| id).collect();
    if !by_temperature.is_empty() {
        assumed.push(format!("the robot is at 20 °C ({})", by_temperature.join(", ")));
    }
    for sentence in results.iter().flat_map(|r| &r.assumed) {
        if !assumed.contains(sentence) {
            assumed.push(sentence.clone());
        }
    }
    assumed
}

fn largest_shift_mm(result: &RewrittenProgram) -> Option<f64> {
    result.rewritten.iter().map(|one| one.fake.shift / MM).reduce(f64::max)
}

fn of(program: &Program, written: Option<&PathBuf>, result: &RewrittenProgram) -> CompensatedProgram {
    let not_rewritten = result.remarks.iter().map(|remark| NotRewritten {
        line: remark.line,
        what: remark.what.clone(),
        blocks: remark.blocks,
        reason: remark.reason.clone(),
        remedy: remark.remedy.clone(),
    });
    CompensatedProgram {
        file: program.path.display().to_string(),
        written: written.map(|path| path.display().to_string()),
        positions: result.positions,
        rewritten: result.rewritten.len(),
        not_rewritten: not_rewritten.collect(),
        largest_shift_mm: largest_shift_mm(result),
        shifts: result.rewritten.iter().map(shift_of).collect(),
    }
}

/// The numbers of a position in the document and in the table.
fn shift_of(one: &Rewritten) -> PositionShift {
    let in_mm = |xyz: [f64; 3]| xyz.map(|v| v / MM);
    PositionShift {
        line: one.line,
        what: one.name.clone(),
        xyz_mm: one.target_xyz().map(in_mm),
        shift_xyz_mm: one.shift().map(in_mm),
        shift_mm: one.fake.shift / MM,
        outside_range: one.warnings.out_of_range,
        near_singular: one.warnings.near_singular,
    }
}

/// Before and after: how far each position was shifted, and which lie outside what was measured; those farthest off first
/// where there are many.
fn tell_shifts(programs: &[Program], results: &[RewrittenProgram]) -> Result<(), Failure> {
    let of = |(program, result): (&Program, &RewrittenProgram)| {
        let name = program.path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let rows = result.rewritten.iter().map(move |one| (name.clone(), one.clone()));
        rows.collect::<Vec<_>>()
    };
    let mut all: Vec<(String, Rewritten)> = programs.iter().zip(results).flat_map(of).collect();
    if all.is_empty() {
        return Ok(());
    }
    let more = all.len().saturating_sub(MOST_TOLD);
    if more > 0 {
        all.sort_by(|(_, a), (_, b)| b.fake.shift.total_cmp(&a.fake.shift));
        all.truncate(MOST_TOLD);
    }
    let rows = all.into_iter().map(|(file, one)| {
        let PositionShift { line, what, xyz_mm, shift_xyz_mm, shift_mm, outside_range, .. } = shift_of(&one);
        let xyz = xyz_mm.map_or_else(|| "joints".to_owned(), |xyz| xyz.map(|v| format!("{v:.1}")).join(" "));
        let shift = shift_xyz_mm.map_or_else(String::new, |v| v.map(|v| format!("{v:+.3}")).join(" "));
        let outside = if outside_range { "outside" } else { "" };
        [format!("{file}:{line}"), what, xyz, shift, format!("{shift_mm:.3}"), outside.to_owned()]
    });
    let rows: Vec<[String; 6]> = rows.collect();
    print(plain_table(["line", "position", "x y z, mm", "shift, mm", "in all", "measured range"], rows))?;
    if more > 0 {
        print(format!("and {more} positions more, which were shifted less"))?;
    }
    Ok(())
}

fn tell(path: &Path, result: &RewrittenProgram) -> Result<(), Failure> {
    let shift = largest_shift_mm(result).map_or_else(String::new, |mm| format!(", shifted by up to {mm:.3} mm"));
    print_answer(format!("{}: {} of {} positions rewritten{shift}", path.display(), result.rewritten.len(), result.positions))?;
    for (mark, blocks) in [("not rewritten", true), ("check", false)] {
        let remarks: Vec<&Remark> = result.remarks.iter().filter(|remark| remark.blocks == blocks).collect();
        for remark in remarks.iter().take(MOST_TOLD) {
            let Remark { line, what, reason, remedy, .. } = remark;
            print_answer(format!("{mark}: {}:{line}: {what}: {reason}; {remedy}", path.display()))?;
        }
        if remarks.len() > MOST_TOLD {
            print(format!("and {} more; --json lists all", remarks.len() - MOST_TOLD))?;
        }
    }
    Ok(())
}
