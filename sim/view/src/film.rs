//! The recording: all animated entities, stop by stop, on the timelines `iteration`, `probing` and `time`.

use std::fs::File;
use std::path::Path;

use calibench::files::FileError;
use rerun::log::ChunkBatcherConfig;
use rerun::{MediaType, RecordingStream, RecordingStreamBuilder, TextDocument};

use crate::arm::Arms;
use crate::blueprint::{Layout, send};
use crate::centring::Charts;
use crate::judgement::Judgement;
use crate::steps::steps;
use crate::subject::Subject;
use crate::{ViewError, gauge, residuals, scene, story};

/// Options of a recording.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RecordOptions {
    /// Factor by which deviations of a model's arm are exaggerated; chosen to make the difference visible if not given.
    pub exaggerate: Option<f64>,
    /// Run the ladder of missing effects.
    pub ladder: bool,
}

/// Writes the recording of a calibration; the file appears complete or not at all.
///
/// # Errors
/// When the data do not match, the recorder fails, or the file cannot be written.
pub fn record(subject: &Subject, wishes: &RecordOptions, output: &Path) -> Result<(), ViewError> {
    let arms = Arms::of(subject, wishes.exaggerate).map_err(|e| subject.locate(e))?;
    let steps = steps(subject, wishes.ladder).map_err(|e| subject.locate(e))?;
    let judgement = Judgement::of(subject).map_err(|e| subject.locate(e))?;
    let fail = |e: std::io::Error| {
        FileError::whole(output, format!("cannot be written: {e}"), "check the folder, its permissions and free space")
    };
    // Moving the finished file onto a folder or a device would replace it.
    if output.exists() && !output.is_file() {
        return Err(FileError::whole(output, "is not a file", "name a file").into());
    }
    let folder = output.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    std::fs::create_dir_all(folder).map_err(fail)?;
    let unfinished = tempfile::Builder::new().prefix(".calibench-view.").suffix(".rrd").tempfile_in(folder).map_err(fail)?;
    {
        let rec = recorder().save(unfinished.path())?;
        rec.set_log_time_enabled(false);
        rec.set_log_tick_enabled(false);
        let shown = residuals::arrows(&rec, &steps)?;
        send(&rec, &Layout::of(subject, &arms, &shown))?;
        rec.log_static(
            "story",
            &TextDocument::new(story::story(subject, &arms, &steps, judgement.as_ref())).with_media_type(MediaType::markdown()),
        )?;
        play(&rec, subject, &arms)?;
    }
    File::open(unfinished.path()).and_then(|f| f.sync_all()).map_err(fail)?;
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        std::fs::set_permissions(unfinished.path(), std::fs::Permissions::from_mode(0o644)).map_err(fail)?;
    }
    unfinished.persist(output).map_err(|e| fail(e.error))?;
    Ok(())
}

/// A recorder that writes identical content for the same subject: fixed name, no clock, chunks by entity rather than by time.
fn recorder() -> RecordingStreamBuilder {
    RecordingStreamBuilder::new("calibench")
        .recording_id("calibench-run")
        .send_properties(false)
        .enabled(true)
        .batcher_config(ChunkBatcherConfig::NEVER)
}

/// Records all animated entities. The timeline `probing` has one picture per attempt, settled on the ball.
///
/// The recording is flushed part by part: the parts of an entity keep their order, and two recordings are identical.
fn play(rec: &RecordingStream, subject: &Subject, arms: &Arms) -> Result<(), ViewError> {
    let charts = Charts::new(subject);
    let journal = &subject.journal;
    let with_gauge = subject.has_gauge();
    scene::standing(rec, subject)?;
    arms.bodies(rec, subject)?;
    if with_gauge {
        gauge::plungers(rec)?;
    }
    if subject.is_campaign {
        charts.frames(rec)?;
    }
    rec.flush_blocking()?;
    let show = |k: usize| {
        let Some(stand) = arms.stands.get(k) else { return Ok(()) };
        arms.show(rec, stand)?;
        if with_gauge {
            gauge::show(rec, &stand.best().tool, journal.stops[k].reading.as_ref())?;
        }
        if subject.is_campaign { charts.show(rec, k) } else { Ok(()) }
    };
    for (k, stop) in journal.stops.iter().enumerate() {
        rec.set_time_sequence("iteration", k as i64 + 1);
        match stop.time_s {
            Some(time) => rec.set_duration_secs("time", time),
            None => rec.disable_timeline("time"),
        }
        show(k)?;
    }
    rec.flush_blocking()?;
    rec.reset_time();
    for probing in 0..journal.tries.len() {
        if let Some(k) = journal.settled(probing) {
            rec.set_time_sequence("probing", probing as i64 + 1);
            show(k)?;
        }
    }
    rec.flush_blocking()?;
    Ok(())
}
