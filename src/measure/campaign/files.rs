//! The files of a campaign: `iterations.csv` and `probings.csv`.

use std::path::Path;

use super::{CampaignRecord, ProbingRecord};
use crate::files::FileError;
use crate::files::disk::write_whole;
use crate::measure::centring::Iteration;
use crate::measure::poses::PlannedPose;
use crate::units::{DEG, MM, UM};

impl CampaignRecord {
    /// Writes `iterations.csv` and `probings.csv` into `folder`; `poses` is the plan, `balls` are the names of the artifact's
    /// balls.
    ///
    /// `iterations.csv`, one row for every stop of the arm; the campaign can be replayed from it ([`crate::cell::replay::Recording`]):
    ///
    /// | column | meaning |
    /// |---|---|
    /// | `probing` | row of `probings.csv`, counted from 1 |
    /// | `phase` | `approach`, `centring` or `retreat` |
    /// | `time_s` | since the session began |
    /// | `q1_deg` ... `qN_deg` | joints read back; the commanded ones if the arm did not arrive or did not report them |
    /// | `r1_um` `r2_um` `r3_um` | readings; empty if there are none |
    /// | `step1_um` `step2_um` `step3_um` | step commanded next along the tool axes; empty if there is none |
    /// | `retries` | repeated queries of indicators |
    /// | `fault` | failure that ended the probing, as in `outcome`; after a colon indicator or joint: `silent_indicator:2` |
    ///
    /// `probings.csv`, one row for every attempt at a pose:
    ///
    /// | column | meaning |
    /// |---|---|
    /// | `probing` | counted from 1 |
    /// | `id`, `ball` | of the planned pose |
    /// | `attempt` | counted from 1 |
    /// | `outcome` | `centred`, or the name of the failure |
    /// | `why` | the failure in words |
    /// | `steps` | steps commanded on the ball |
    /// | `retries` | repeated queries of indicators |
    /// | `backed_off` | 1 when the arm ended clear of the ball |
    /// | `started_s`, `duration_s` | on the cell's clock |
    /// | `clearance_mm` | least gap on the planned way to the pose and on its approach; empty if unknown |
    ///
    /// # Errors
    /// When the folder cannot be written.
    pub fn write(&self, folder: &Path, poses: &[PlannedPose], balls: &[String]) -> Result<(), FileError> {
        let joints = poses.first().map_or(0, |pose| pose.contact.len());
        let mut header: Vec<String> = ["probing", "phase", "time_s"].map(String::from).to_vec();
        header.extend((1..=joints).map(|j| format!("q{j}_deg")));
        header.extend(["r1_um", "r2_um", "r3_um", "step1_um", "step2_um", "step3_um", "retries", "fault"].map(String::from));
        let stops = self.probings.iter().enumerate();
        let stops = stops.flat_map(|(k, record)| record.probing.iterations.iter().map(move |i| stop_row(k, i, joints)));
        write_table(&folder.join("iterations.csv"), header, stops)?;

        let header = [
            "probing",
            "id",
            "ball",
            "attempt",
            "outcome",
            "why",
            "steps",
            "retries",
            "backed_off",
            "started_s",
            "duration_s",
            "clearance_mm",
        ];
        let rows = self.probings.iter().enumerate().map(|(k, record)| probing_row(k, record, poses, balls));
        write_table(&folder.join("probings.csv"), header.map(String::from).to_vec(), rows)
    }
}

fn stop_row(probing: usize, stop: &Iteration, joints: usize) -> Vec<String> {
    let mut row = vec![(probing + 1).to_string(), stop.phase.name().into(), stop.time_s.to_string()];
    row.extend((0..joints).map(|j| stop.joints.get(j).map_or_else(String::new, |q| (q / DEG).to_string())));
    for vector in [&stop.reading, &stop.step] {
        row.extend((0..3).map(|k| vector.map_or_else(String::new, |v| (v[k] / UM).to_string())));
    }
    row.push(stop.retries.to_string());
    row.push(stop.fault.as_ref().map_or_else(String::new, |fault| fault.token()));
    row
}

fn probing_row(k: usize, record: &ProbingRecord, poses: &[PlannedPose], balls: &[String]) -> Vec<String> {
    let (pose, probing) = (poses.get(record.pose), &record.probing);
    let ball = pose.and_then(|p| balls.get(p.ball?)).cloned().unwrap_or_default();
    let (outcome, why, backed_off) = match &probing.outcome {
        Ok(_) => ("centred".to_owned(), String::new(), true),
        Err(failure) => (failure.reason.token(), failure.reason.to_string(), failure.backed_off),
    };
    let steps = probing.iterations.iter().filter(|i| i.step.is_some()).count();
    let retries: usize = probing.iterations.iter().map(|i| i.retries).sum();
    vec![
        (k + 1).to_string(),
        pose.map(|p| p.id.clone()).unwrap_or_default(),
        ball,
        record.attempt.to_string(),
        outcome,
        why,
        steps.to_string(),
        retries.to_string(),
        u8::from(backed_off).to_string(),
        probing.started_s.to_string(),
        probing.duration_s.to_string(),
        pose.and_then(|p| p.clearance).map_or_else(String::new, |gap| format!("{:.3}", gap / MM)),
    ]
}

fn write_table(path: &Path, header: Vec<String>, rows: impl Iterator<Item = Vec<String>>) -> Result<(), FileError> {
    let fail = |e: csv::Error| FileError::whole(path, format!("cannot be written: {e}"), "check the names in the plan");
    let mut table = csv::Writer::from_writer(Vec::new());
    table.write_record(&header).map_err(fail)?;
    for row in rows {
        table.write_record(&row).map_err(fail)?;
    }
    let content = table.into_inner().map_err(|e| fail(e.into_error().into()))?;
    write_whole(path, &content)
}
