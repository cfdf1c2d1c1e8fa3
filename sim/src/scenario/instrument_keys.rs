//! The keys under `[instrument]` as in the file: the instrument that measures balls or distances. Meanings, defaults and
//! sources are in docs/scenarios.md.

use calibench::files::FileError;
use serde::Deserialize;

use super::sources::Sources;

/// Largest number of postures of one campaign.
const MOST_POSES: usize = 2_000;
/// Largest number of anchors of the wires or the bar.
const MOST_ANCHORS: usize = 20;

/// An instrument for calibrating a robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema, serde::Serialize))]
#[serde(rename_all = "snake_case")]
pub enum InstrumentKind {
    /// Three plungers that the robot centres on the balls.
    #[default]
    Trical,
    /// Three plungers read off centre: their readings are the measurement.
    Offset,
    /// A telescoping bar between a ball on the table and one on the tool.
    Ballbar,
    /// Wires drawn from fixed drums to the tool, all read at every posture.
    WireSensor,
    /// A socket on the tool that is closed over the balls by hand or by force.
    Seat,
}

impl InstrumentKind {
    /// Name used in files.
    pub fn name(self) -> &'static str {
        match self {
            InstrumentKind::Trical => "trical",
            InstrumentKind::Offset => "offset",
            InstrumentKind::Ballbar => "ballbar",
            InstrumentKind::WireSensor => "wire_sensor",
            InstrumentKind::Seat => "seat",
        }
    }

    /// True if it measures distances from anchors; the others measure balls.
    pub fn measures_distances(self) -> bool {
        matches!(self, InstrumentKind::Ballbar | InstrumentKind::WireSensor)
    }
}

/// The keys under `[instrument]`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct InstrumentToml {
    /// `"trical"`, `"offset"`, `"ballbar"`, `"wire_sensor"` or `"seat"`.
    pub kind: InstrumentKind,
    /// Postures at which distances are measured, 1 to 2000, chosen by observability; balls are probed according to `[plan]`.
    pub poses: usize,
    /// Largest distance from the centre at which a ball may be read; for a ballbar, the largest deviation from its length,
    /// mm.
    pub range_mm: f64,
    /// Length of the ballbar between its two balls, mm.
    pub length_mm: f64,
    /// List of positions (world) from which distances are measured, up to 20; with fewer than three the base cannot be
    /// determined, mm.
    pub anchors_mm: Vec<[f64; 3]>,
    /// One-sigma per axis of the true positions of the anchors relative to `anchors_mm`, um.
    pub anchor_sigma_um: f64,
    /// One-sigma of a distance; for a seat, one-sigma per axis of the position of the ball, um.
    pub noise_um: f64,
    /// Amplitude of a periodic error of the distance, with a phase sampled for each anchor, um.
    pub linearity_um: f64,
    /// Period of that error, such as the circumference of a drum, mm.
    pub period_mm: f64,
    /// Residual force of a closed seat, in a direction sampled at each pose; it bends the arm through the compliances of the
    /// ground truth, which the encoders do not see, N.
    pub force_n: f64,
    /// Time that the operator needs at each posture in addition to the robot's motion, s.
    pub pose_s: f64,
    /// Set-up time, once; for a ballbar, at each anchor, s.
    pub set_up_s: f64,
}

impl Default for InstrumentToml {
    fn default() -> Self {
        InstrumentToml {
            kind: InstrumentKind::Trical,
            poses: 80,
            range_mm: 10.0,
            length_mm: 300.0,
            anchors_mm: Vec::new(),
            anchor_sigma_um: 0.0,
            noise_um: 1.0,
            linearity_um: 0.0,
            period_mm: 100.0,
            force_n: 0.0,
            pose_s: 0.0,
            set_up_s: 0.0,
        }
    }
}

impl InstrumentToml {
    /// Checks that its numbers describe a usable instrument.
    pub(super) fn check(&self, sources: &Sources) -> Result<(), FileError> {
        let wrong =
            |key: &str, problem: String, remedy: &str| Err(sources.wrong(&format!("instrument.{key}"), problem, remedy));
        if !(1..=MOST_POSES).contains(&self.poses) {
            return wrong("poses", format!("is {}", self.poses), "give a number from 1 to 2000");
        }
        let anchors = self.anchors_mm.len();
        if self.kind.measures_distances() && !(1..=MOST_ANCHORS).contains(&anchors) {
            let name = self.kind.name();
            return wrong(
                "anchors_mm",
                format!("has {anchors} anchors"),
                &format!("a {name} wants 1 to {MOST_ANCHORS}, three to know the base"),
            );
        }
        for (key, value) in [("range_mm", self.range_mm), ("length_mm", self.length_mm), ("period_mm", self.period_mm)] {
            if value.is_nan() || value <= 0.0 {
                return wrong(key, format!("is {value}"), "give a positive number");
            }
        }
        // Measurements without noise could not be weighted.
        if self.kind.measures_distances() && self.noise_um <= 0.0 {
            return wrong("noise_um", format!("is {}", self.noise_um), "give a positive number");
        }
        for (key, value) in [
            ("anchor_sigma_um", self.anchor_sigma_um),
            ("noise_um", self.noise_um),
            ("linearity_um", self.linearity_um),
            ("force_n", self.force_n),
            ("pose_s", self.pose_s),
            ("set_up_s", self.set_up_s),
        ] {
            if !value.is_finite() || value < 0.0 {
                return wrong(key, format!("is {value}"), "give zero or a positive number");
            }
        }
        Ok(())
    }
}
