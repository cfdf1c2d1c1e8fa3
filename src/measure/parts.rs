//! A campaign in parts: what the flange carries is changed by hand, so every payload has its part of the plan.

use super::{CampaignRecord, PlannedPose};

/// The poses of one payload.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// Which payload of the dataset.
    pub payload: usize,
    /// Its poses, in the order of the plan.
    pub poses: Vec<PlannedPose>,
    /// Places of the poses in the plan.
    places: Vec<usize>,
}

/// The parts of a plan: with the payload that it names first, then with the next.
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
    /// And what came of a part of the plan; whether the campaign may go on.
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
