//! The arm, twice: as identified, solid; and as drawn, see-through, the difference between the two exaggerated.

use calibench::identify::{IdentifyError, Use};
use calibench::measure::{Dataset, Sample};
use calibench::robot::{Pose, Posture, SiteIndex};
use nalgebra::{Rotation3, Translation3};
use rerun::{Capsules3D, FillMode, RecordingStream};

use crate::ViewError;
use crate::journal::Stop;
use crate::paint::{self, solid};
use crate::scene::{Looks, body, entity, single, transform};
use crate::subject::Subject;

/// Radius of the line that stands for a link without bodies, m.
const LINE: f32 = 0.015;

/// The arm at one stop: its frames in the world, the base first.
pub struct Stand {
    /// By the identified model.
    pub identified: Vec<Pose>,
    /// By the drawing, at the same joints.
    pub drawn: Vec<Pose>,
    /// `world_from_tool` by the identified model.
    pub tool: Pose,
}

/// The arm at every stop.
///
/// What the model wants to know of a stop besides its joints (payload, side of approach, temperature) is that of the sample of its try,
/// or, where that gave none, of another.
///
/// # Errors
/// When the stops do not go with the calibration.
pub fn stands(subject: &Subject) -> Result<Vec<Stand>, IdentifyError> {
    let Subject { dataset, calibration, journal, .. } = subject;
    let Some(any) = dataset.samples.first() else { return Ok(Vec::new()) };
    let like = |stop: &Stop| {
        let id = &journal.tries[stop.probing].id;
        let sample = dataset.samples.iter().find(|s| s.id == *id).unwrap_or(any);
        Sample { q: stop.joints.clone(), time_s: stop.time_s.or(sample.time_s), ..sample.clone() }
    };
    let stops = Dataset { samples: journal.stops.iter().map(like).collect(), ball_distances: Vec::new(), ..dataset.clone() };
    let mut applied = calibration.apply(&[(&subject.name, &stops)], Use::All)?;
    let values = std::mem::take(&mut applied.values);
    let mut stands = Vec::with_capacity(stops.samples.len());
    let mut drawn = Posture::new(&dataset.robot);
    let none = vec![0.0; SiteIndex::new(dataset.robot.joints()).len()];
    applied.problem.for_each_sample(&values, &mut |posed| {
        let sample = &stops.samples[posed.place];
        drawn.set(&dataset.robot, &dataset.base, &dataset.tool, &sample.q, &none);
        let frames = |posture: &Posture| (0..=dataset.robot.joints()).map(|k| posture.frame(k).pose()).collect();
        stands.push(Stand {
            identified: frames(posed.posture),
            drawn: frames(&drawn),
            tool: posed.posture.world_from_tool(&dataset.tool),
        });
    });
    Ok(stands)
}

/// Draws the bodies of both arms, each in its link's frame.
pub fn bodies(rec: &RecordingStream, subject: &Subject) -> Result<(), ViewError> {
    let ghost = Looks { colour: solid(paint::DRAWN), fill: FillMode::TransparentFillMajorWireframe };
    for (arm, looks) in [("identified", Looks::solid(paint::ARM)), ("drawn", ghost)] {
        for part in &subject.dataset.robot.solids {
            body(rec, &link(arm, part.frame), part, looks)?;
        }
    }
    let last = subject.dataset.robot.joints();
    for part in subject.scene.iter().flat_map(|s| &s.carried) {
        body(rec, &link("identified", last), part, Looks::solid(paint::GAUGE))?;
    }
    Ok(())
}

fn link(arm: &str, frame: usize) -> String {
    let name = if frame == 0 { "base".into() } else { format!("link {frame}") };
    format!("world/arm {arm}/{}", entity(&name))
}

/// Moves both arms to a stop, the drawn one `exaggerate` times as far off the identified one as it is.
pub fn show(rec: &RecordingStream, subject: &Subject, stand: &Stand, exaggerate: f64) -> Result<(), ViewError> {
    let ghost: Vec<Pose> =
        stand.identified.iter().zip(&stand.drawn).map(|(from, to)| exaggerated(from, to, exaggerate)).collect();
    for (arm, frames) in [("identified", &stand.identified), ("drawn", &ghost)] {
        if subject.dataset.robot.solids.is_empty() {
            sticks(rec, arm, frames)?;
        } else {
            for (k, frame) in frames.iter().enumerate() {
                rec.log(link(arm, k), &transform(frame))?;
            }
        }
    }
    Ok(())
}

/// Lines from frame to frame, where bodies are not known.
fn sticks(rec: &RecordingStream, arm: &str, frames: &[Pose]) -> Result<(), ViewError> {
    let origins: Vec<[f32; 3]> = frames.iter().map(|f| single(&f.translation.vector)).collect();
    let pairs = || origins.windows(2).filter(|pair| pair[0] != pair[1]);
    let colour = if arm == "drawn" { solid(paint::DRAWN) } else { solid(paint::ARM) };
    let sticks = Capsules3D::from_endpoints_and_radii(pairs().map(|p| p[0]), pairs().map(|p| p[1]), pairs().map(|_| LINE));
    rec.log(format!("world/arm {arm}/links"), &sticks.with_colors([colour]))?;
    Ok(())
}

/// A frame moved on, beyond `to`, to `factor` times its displacement from `from`; turned likewise.
fn exaggerated(from: &Pose, to: &Pose, factor: f64) -> Pose {
    let shift = (to.translation.vector - from.translation.vector) * factor;
    let turn = (to.rotation * from.rotation.inverse()).scaled_axis() * factor;
    Pose::from_parts(Translation3::from(from.translation.vector + shift), Rotation3::new(turn) * from.rotation)
}
