//! Postures of the true arm over the cell's time: for display, never for a calibration.

use std::fmt::Write;
use std::path::Path;

use calibench::files::FileError;
use calibench::files::disk::write_whole;
use calibench::measure::campaign::CampaignRecord;
use calibench::robot::{Pose, rotation_vector};
use calibench::units::{DEG, MM};

/// The true arm at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct TruePosture {
    /// `world_from_frame` of the base and of every link, the base first (N + 1).
    pub frames: Vec<Pose>,
    /// `world_from_tool`.
    pub tool: Pose,
}

/// All rest postures of the true arm, in order.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TrueArm {
    rests: Vec<(f64, TruePosture)>,
}

impl TrueArm {
    /// Records that the arm rests in this posture from `time_s` on; times do not decrease.
    pub fn rests(&mut self, time_s: f64, posture: TruePosture) {
        self.rests.push((time_s, posture));
    }

    /// Its posture at this time; `None` before the first rest.
    pub fn at(&self, time_s: f64) -> Option<&TruePosture> {
        let begun = self.rests.partition_point(|(since, _)| *since <= time_s);
        begun.checked_sub(1).map(|last| &self.rests[last].1)
    }

    /// Writes the posture at every stop of a campaign.
    ///
    /// | column | meaning |
    /// |---|---|
    /// | `stop` | row of `iterations.csv`, counted from 1 |
    /// | `frame` | `0` is the base, `1` to `N` are the links, `tool` is the TCP with the axes of the gauge |
    /// | `x_mm` `y_mm` `z_mm` | origin, world |
    /// | `rx_deg` `ry_deg` `rz_deg` | orientation, world: rotation axis times angle |
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn write(&self, campaign: &CampaignRecord, path: &Path) -> Result<(), FileError> {
        let mut table = String::from("stop,frame,x_mm,y_mm,z_mm,rx_deg,ry_deg,rz_deg\n");
        let stops = campaign.probings.iter().flat_map(|record| &record.probing.iterations);
        for (k, stop) in stops.enumerate() {
            let Some(posture) = self.at(stop.time_s) else { continue };
            let links = posture.frames.iter().enumerate().map(|(link, frame)| (link.to_string(), frame));
            for (name, pose) in links.chain([("tool".into(), &posture.tool)]) {
                let [x, y, z] = (pose.translation.vector / MM).into();
                let [rx, ry, rz]: [f64; 3] = (rotation_vector(&pose.rotation) / DEG).into();
                // Resolves a nanometre, and the angles less than that at the end of an arm of a metre.
                _ = writeln!(table, "{},{name},{x:.6},{y:.6},{z:.6},{rx:.8},{ry:.8},{rz:.8}", k + 1);
            }
        }
        write_whole(path, table.as_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_arm_stands_where_it_came_to_rest_last() {
        let at = |x: f64| TruePosture { frames: vec![Pose::translation(x, 0.0, 0.0)], tool: Pose::identity() };
        let mut arm = TrueArm::default();
        arm.rests(1.0, at(0.1));
        arm.rests(2.0, at(0.2));
        assert_eq!(arm.at(0.9), None);
        assert_eq!([arm.at(1.0), arm.at(1.9), arm.at(2.0), arm.at(9.0)], [0.1, 0.1, 0.2, 0.2].map(at).each_ref().map(Some));
    }
}
