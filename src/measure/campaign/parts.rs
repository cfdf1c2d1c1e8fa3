//! A campaign in parts: the payload on the flange is changed by hand, so every payload has its own part of the plan.

use super::CampaignRecord;
use crate::measure::poses::PlannedPose;

/// The poses of one payload.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// Payload of the dataset, by index.
    pub payload: usize,
    /// Its poses, in the order of the plan.
    pub poses: Vec<PlannedPose>,
    /// Indices of the poses in the plan.
    places: Vec<usize>,
}

/// The parts of a plan, in the order in which their payloads first appear.
pub fn parts_by_payload(plan: &[PlannedPose]) -> Vec<Part> {
    let mut parts: Vec<Part> = Vec::new();
    for (place, pose) in plan.iter().enumerate() {
        let k = parts.iter().position(|part| part.payload == pose.payload).unwrap_or_else(|| {
            parts.push(Part { payload: pose.payload, poses: Vec::new(), places: Vec::new() });
            parts.len() - 1
        });
        parts[k].poses.push(pose.clone());
        parts[k].places.push(place);
    }
    parts
}

impl CampaignRecord {
    /// Adds the record of a part of the plan. Returns true if the campaign may continue.
    pub fn add(&mut self, part: &Part, record: CampaignRecord) -> bool {
        self.samples.extend(record.samples);
        self.probings.extend(record.probings.into_iter().map(|mut probing| {
            probing.pose = part.places[probing.pose];
            probing
        }));
        self.aborted = record.aborted;
        self.aborted.is_none()
    }
}
