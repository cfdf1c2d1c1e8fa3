//! The arm at a stop: its best known posture solid, those of its models translucent, with the difference exaggerated.

use calibench::identify::calibration::IdentifyError;
use calibench::identify::problem::Use;
use calibench::measure::dataset::{Dataset, NamedDataset, Sample};
use calibench::robot::kinematics::Posture;
use calibench::robot::sites::SiteIndex;
use calibench::robot::solids::{Shape, Solid};
use calibench::robot::{Pose, Robot};
use nalgebra::{Rotation3, Translation3, Vector3};
use rerun::{FillMode, Points3D, RecordingStream};

use crate::ViewError;
use crate::at_rest::Arm;
use crate::journal::Stop;
use crate::magnification::magnification;
use crate::paint::{self, solid};
use crate::scene::{Looks, body, entity, transform};
use crate::subject::Subject;

/// Radius of the line that represents a link without bodies, m.
const LINE: f64 = 0.015;

/// Displayed displacement of a model's arm where it deviates most, m: beside the other arm, but close to it.
const BESIDE: f64 = 0.2;

/// The arm at one stop.
pub struct Stand {
    /// True posture; known only for a simulated cell.
    pub truth: Option<Arm>,
    /// Posture by the identified model.
    pub identified: Arm,
    /// Posture by the nominal model, at the same joints.
    pub drawn: Arm,
}

impl Stand {
    /// The best known posture.
    pub fn best(&self) -> &Arm {
        self.truth.as_ref().unwrap_or(&self.identified)
    }
}

/// A model's arm, shown beside the actual one.
pub struct Ghost {
    /// Name in the path of its entities.
    name: &'static str,
    /// Title displayed.
    pub title: &'static str,
    /// Factor by which its deviation is exaggerated.
    pub factor: f64,
    colour: [u8; 3],
    /// Name of that colour.
    pub colour_name: &'static str,
    of: fn(&Stand) -> &Arm,
}

/// The arms of a recording.
pub struct Arms {
    /// The arm at every stop.
    pub stands: Vec<Stand>,
    /// Translucent arms: nominal and, if the truth is known, identified.
    pub ghosts: Vec<Ghost>,
    /// Name in the path of the solid arm.
    name: &'static str,
}

impl Arms {
    /// The arm at every stop; deviations of the models are exaggerated by the given factor, or else enough to be visible.
    ///
    /// Other quantities needed by the model at a stop (payload, direction of approach, temperature) are taken from the sample
    /// of its attempt, or, if that gave none, of another.
    ///
    /// # Errors
    /// When the stops do not match the calibration.
    pub fn of(subject: &Subject, exaggerate: Option<f64>) -> Result<Self, IdentifyError> {
        let stands = stands(subject)?;
        let ghost = |name, title, (colour, colour_name), of: fn(&Stand) -> &Arm| {
            let most = stands.iter().map(|stand| stand.best().off(of(stand))).fold(0.0, f64::max);
            Ghost { name, title, factor: exaggerate.unwrap_or_else(|| magnification(most, BESIDE)), colour, colour_name, of }
        };
        let mut ghosts = vec![ghost("drawn", "nominal", (paint::DRAWN, "purple"), |stand| &stand.drawn)];
        let simulated = stands.iter().any(|stand| stand.truth.is_some());
        if simulated {
            ghosts.push(ghost("identified", "identified", (paint::AFTER, "sky blue"), |stand| &stand.identified));
        }
        Ok(Arms { stands, ghosts, name: if simulated { "true" } else { "identified" } })
    }

    /// Draws the bodies of all arms, each in its link's frame.
    pub fn bodies(&self, rec: &RecordingStream, subject: &Subject) -> Result<(), ViewError> {
        let robot = &subject.dataset.robot;
        let lines = lines(robot);
        let parts = if robot.solids.is_empty() { &lines } else { &robot.solids };
        let last = robot.joints();
        for part in parts {
            body(rec, &link(self.name, part.frame), part, Looks::solid(paint::ARM))?;
            for ghost in &self.ghosts {
                let looks = Looks { colour: solid(ghost.colour), fill: FillMode::TransparentFillMajorWireframe };
                body(rec, &link(ghost.name, part.frame), part, looks)?;
            }
        }
        for part in subject.scene.iter().flat_map(|s| &s.carried) {
            body(rec, &link(self.name, last), part, Looks::solid(paint::GAUGE))?;
        }
        for ghost in &self.ghosts {
            let words = Points3D::new([[0.0; 3]]).with_radii([0.0]).with_colors([solid(ghost.colour)]);
            let words = words.with_labels([format!("{}, x{}", ghost.title, ghost.factor)]).with_show_labels(true);
            rec.log_static(format!("{}/name", link(ghost.name, last)), &words)?;
        }
        Ok(())
    }

    /// Moves all arms to a stop.
    pub fn show(&self, rec: &RecordingStream, stand: &Stand) -> Result<(), ViewError> {
        let best = &stand.best().frames;
        for (k, frame) in best.iter().enumerate() {
            rec.log(link(self.name, k), &transform(frame))?;
        }
        for ghost in &self.ghosts {
            for (k, (from, to)) in best.iter().zip(&(ghost.of)(stand).frames).enumerate() {
                rec.log(link(ghost.name, k), &transform(&exaggerated(from, to, ghost.factor)))?;
            }
        }
        Ok(())
    }
}

fn stands(subject: &Subject) -> Result<Vec<Stand>, IdentifyError> {
    let Subject { dataset, calibration, journal, .. } = subject;
    let Some(any) = dataset.samples.first() else { return Ok(Vec::new()) };
    let like = |stop: &Stop| {
        let id = &journal.tries[stop.probing].id;
        let sample = dataset.samples.iter().find(|s| s.id == *id).unwrap_or(any);
        Sample { q: stop.joints.clone(), time_s: stop.time_s.or(sample.time_s), ..sample.clone() }
    };
    let stops = Dataset { samples: journal.stops.iter().map(like).collect(), ball_distances: Vec::new(), ..dataset.clone() };
    let mut applied = calibration.apply(&[NamedDataset::new(&subject.name, &stops)], Use::All)?;
    let values = std::mem::take(&mut applied.values);
    let mut stands = Vec::with_capacity(stops.samples.len());
    let mut drawn = Posture::new(&dataset.robot);
    let none = vec![0.0; SiteIndex::new(dataset.robot.joints()).len()];
    let arm = |posture: &Posture| Arm {
        frames: (0..=dataset.robot.joints()).map(|k| posture.frame(k).pose()).collect(),
        tool: posture.world_from_tool(&dataset.tool),
    };
    applied.problem.for_each_sample(&values, &mut |posed| {
        let (stop, sample) = (&journal.stops[posed.place], &stops.samples[posed.place]);
        drawn.set(&dataset.robot, &dataset.base, &dataset.tool, &sample.q, &none);
        let truth = subject.true_arm.as_ref().map(|rows| rows[stop.row].clone());
        stands.push(Stand { truth, identified: arm(posed.posture), drawn: arm(&drawn) });
    });
    Ok(stands)
}

/// A line along every link, for an arm without known bodies.
fn lines(robot: &Robot) -> Vec<Solid> {
    let next = |k: usize| robot.links[k].mdh.transform(0.0).translation.vector;
    let line = |frame: usize| {
        let shape = Shape::Capsule { ends: [Vector3::zeros(), next(frame)], radius: LINE };
        Solid { name: "line".into(), frame, shape }
    };
    (0..robot.joints()).filter(|&k| next(k) != Vector3::zeros()).map(line).collect()
}

fn link(arm: &str, frame: usize) -> String {
    let name = if frame == 0 { "base".into() } else { format!("link {frame}") };
    format!("world/arm {arm}/{}", entity(&name))
}

/// Extrapolates a frame beyond `to`, to `factor` times its displacement from `from`; the rotation likewise.
fn exaggerated(from: &Pose, to: &Pose, factor: f64) -> Pose {
    let shift = (to.translation.vector - from.translation.vector) * factor;
    let turn = (to.rotation * from.rotation.inverse()).scaled_axis() * factor;
    Pose::from_parts(Translation3::from(from.translation.vector + shift), Rotation3::new(turn) * from.rotation)
}
