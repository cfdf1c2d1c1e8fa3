//! The keys of a scenario's `[precision]`.

use serde::Deserialize;

/// The keys under `[precision]`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct PrecisionToml {
    /// Number of times that the datum ball is centred and measured; `--repetitions` overrides it.
    pub repetitions: usize,
    /// The small arm brings the datum ball to within this distance of the gauge's centre along each axis, at most 4, mm.
    pub start_mm: f64,
    /// One-sigma per axis of the end position of a large motion of the small arm; the centring removes it, um.
    pub arm_repeatability_um: f64,
    /// Resolution of the small arm's position; 0 for none, um.
    pub arm_step_um: f64,
    /// One-sigma per axis of the additional error of a small motion, um.
    pub arm_small_move_um: f64,
    /// One-sigma of the rotation of the arm's axes relative to the gauge's, about each axis, mrad.
    pub arm_misalignment_mrad: f64,
    /// One-sigma per axis of the arm's creep at rest, um/min.
    pub arm_drift_um_per_min: f64,
    /// One-sigma per axis of the centre of a ball as measured by the measuring machine, um.
    pub cmm_um: f64,
    /// Time that the machine needs for a ball, s.
    pub cmm_s: f64,
    /// One-sigma of the rate of temperature change of the room, K/h.
    pub room_drift_c_per_h: f64,
    /// Displacement of the gauge's centre relative to the machine, along each axis, um/K.
    pub gauge_growth_um_per_c: f64,
}

impl Default for PrecisionToml {
    fn default() -> Self {
        PrecisionToml {
            repetitions: 3,
            start_mm: 0.2,
            arm_repeatability_um: 5.0,
            arm_step_um: 0.5,
            arm_small_move_um: 0.3,
            arm_misalignment_mrad: 1.0,
            arm_drift_um_per_min: 0.2,
            cmm_um: 0.4,
            cmm_s: 60.0,
            room_drift_c_per_h: 0.5,
            gauge_growth_um_per_c: 2.3,
        }
    }
}

/// Most repetitions of one test.
pub const MOST_REPETITIONS: usize = 1000;

impl PrecisionToml {
    /// Every size with its name and upper limit; the lower limit is zero.
    ///
    /// The ball must lie on the flats of the tips, and an arm that loses a millimetre or is misaligned by a tenth
    /// cannot bring it there.
    pub fn bounds(&self) -> [(&'static str, f64, f64); 10] {
        [
            ("precision.start_mm", self.start_mm, 4.0),
            ("precision.arm_repeatability_um", self.arm_repeatability_um, 100.0),
            ("precision.arm_step_um", self.arm_step_um, 100.0),
            ("precision.arm_small_move_um", self.arm_small_move_um, 100.0),
            ("precision.arm_misalignment_mrad", self.arm_misalignment_mrad, 100.0),
            ("precision.arm_drift_um_per_min", self.arm_drift_um_per_min, 100.0),
            ("precision.cmm_um", self.cmm_um, 1000.0),
            ("precision.cmm_s", self.cmm_s, 3600.0),
            ("precision.room_drift_c_per_h", self.room_drift_c_per_h, 10.0),
            ("precision.gauge_growth_um_per_c", self.gauge_growth_um_per_c, 100.0),
        ]
    }
}
