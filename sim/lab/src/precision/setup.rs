//! The set-up of a precision test: sizes of all its error sources.

use calibench::measure::centring::CentringSettings;
use calibench::units::{MM, MRAD, UM};

use super::{Source, Sources};
use calibench_sim::cmm::SimulatedCmm;
use calibench_sim::plunger::PlungerSpec;
use calibench_sim::scenario::Scenario;

/// Each step leaves at most a hundredth of its length, here of 3 um; two of them leave 0.3 nm.
const FURTHER_STEPS: usize = 2;

/// Accuracy of the small arm that carries the datum ball.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmSpec {
    /// One-sigma of the end position of a large motion, per axis, m.
    pub repeatability: f64,
    /// Position step along each of its axes, m; 0 for none.
    pub step: f64,
    /// One-sigma of the additional error of a small motion, per axis, m.
    pub small_move: f64,
    /// One-sigma of the misalignment of its axes with those of the gauge, about each axis, rad.
    pub misalignment: f64,
    /// One-sigma of its creep at rest, per axis, m/s.
    pub drift: f64,
}

/// All settings of a precision test; only the random draws are separate.
#[derive(Debug, Clone, PartialEq)]
pub struct Setup {
    /// Number of times the datum ball is centred and measured.
    pub repetitions: usize,
    /// Errors of the indicators.
    pub plungers: PlungerSpec,
    /// One-sigma of a ball's radius, m.
    pub radius_sigma: f64,
    /// One-sigma per axis of a ball's form error at the contacts, m.
    pub form_sigma: f64,
    /// Bound of every reading at which a ball counts as centred, m.
    pub tolerance: f64,
    /// Number of steps after the ball counts as centred: 0 in the paper; with 2, no error remains that a step could remove.
    pub further_steps: usize,
    /// Greatest initial offset of the datum ball along each axis, m.
    pub start: f64,
    /// The small arm.
    pub arm: ArmSpec,
    /// The measuring machine.
    pub cmm: SimulatedCmm,
    /// Duration of measuring a ball, s.
    pub cmm_s: f64,
    /// One-sigma of the room's drift, K/s.
    pub room_drift: f64,
    /// Thermal displacement of the gauge's centre relative to the machine, along each axis, m/K.
    pub growth: f64,
}

impl Setup {
    /// The set-up of a scenario: indicators and balls as in its cell, the rest from its `[precision]`.
    pub fn of(scenario: &Scenario) -> Self {
        let (indicators, keys) = (&scenario.truth().keys().indicators, &scenario.precision);
        Setup {
            repetitions: keys.repetitions,
            plungers: indicators.plungers(),
            radius_sigma: indicators.radius_sigma(),
            form_sigma: indicators.ball_form_um * UM,
            tolerance: scenario.centring.tolerance_um * UM,
            further_steps: 0,
            start: keys.start_mm * MM,
            arm: ArmSpec {
                repeatability: keys.arm_repeatability_um * UM,
                step: keys.arm_step_um * UM,
                small_move: keys.arm_small_move_um * UM,
                misalignment: keys.arm_misalignment_mrad * MRAD,
                drift: keys.arm_drift_um_per_min * UM / 60.0,
            },
            cmm: SimulatedCmm { centre: keys.cmm_um * UM },
            cmm_s: keys.cmm_s,
            room_drift: keys.room_drift_c_per_h / 3600.0,
            growth: keys.gauge_growth_um_per_c * UM,
        }
    }

    /// The same set-up with only these sources of deviation; all random draws remain the same.
    ///
    /// The residual within the tolerance consists of the error of the first step, because the axes of arm and gauge are not
    /// quite parallel, and of what the loop no longer removed. Without that source the arm moves along the gauge's axes and
    /// takes two steps more than the tolerance requires, so that each of the other sources shows its effect on a ball at zero.
    pub fn with(&self, sources: Sources) -> Self {
        let size = |source, value: f64| if sources.has(source) { value } else { 0.0 };
        let (plungers, arm) = (&self.plungers, &self.arm);
        let left_over = sources.has(Source::Tolerance);
        let geometry = |value: f64| if left_over { value } else { size(Source::Geometry, value) };
        Setup {
            plungers: PlungerSpec {
                scale_amplitude: size(Source::Scale, plungers.scale_amplitude),
                resolution: size(Source::Resolution, plungers.resolution),
                noise: plungers.noise.map(|v| size(Source::Repeatability, v)),
                hysteresis: plungers.hysteresis.map(|v| size(Source::Hysteresis, v)),
                disk_tilt: geometry(plungers.disk_tilt),
                orthogonality: geometry(plungers.orthogonality),
                concurrency: geometry(plungers.concurrency),
                ..plungers.clone()
            },
            radius_sigma: size(Source::Diameter, self.radius_sigma),
            form_sigma: size(Source::Form, self.form_sigma),
            further_steps: if left_over { self.further_steps } else { FURTHER_STEPS },
            arm: ArmSpec {
                step: size(Source::ArmStep, arm.step),
                small_move: size(Source::ArmStep, arm.small_move),
                misalignment: size(Source::Tolerance, arm.misalignment),
                drift: size(Source::ArmDrift, arm.drift),
                repeatability: arm.repeatability,
            },
            cmm: SimulatedCmm { centre: size(Source::Cmm, self.cmm.centre) },
            growth: size(Source::Thermal, self.growth),
            ..self.clone()
        }
    }

    /// Describes the size of a source in words.
    pub fn size_of(&self, source: Source) -> String {
        let um = |v: f64| format!("{:.3}", v / UM).trim_end_matches('0').trim_end_matches('.').to_owned();
        let (plungers, arm) = (&self.plungers, &self.arm);
        match source {
            Source::Scale => format!("amplitude up to {} µm", um(plungers.scale_amplitude)),
            Source::Resolution => format!("{} µm", um(plungers.resolution)),
            Source::Repeatability => format!("{} µm, 1 sigma", um(plungers.noise[1])),
            Source::Hysteresis => format!("{} µm", um(plungers.hysteresis[1])),
            Source::Geometry => format!(
                "{} mrad, {} mrad, {} µm, 1 sigma",
                plungers.disk_tilt / MRAD,
                plungers.orthogonality / MRAD,
                um(plungers.concurrency)
            ),
            Source::Diameter => format!("{} µm each, 1 sigma", um(2.0 * self.radius_sigma)),
            Source::Form => format!("{} µm each, 1 sigma", um(self.form_sigma)),
            Source::Tolerance => {
                let way = format!("{} mrad from {} mm", arm.misalignment / MRAD, self.start / MM);
                format!("below {} µm, {way}", um(self.tolerance))
            }
            Source::ArmStep => format!("{} µm, {} µm 1 sigma", um(arm.step), um(arm.small_move)),
            Source::ArmDrift => format!("{} µm/min, 1 sigma", um(arm.drift * 60.0)),
            Source::Cmm => format!("{} µm each, 1 sigma", um(self.cmm.centre)),
            Source::Thermal => format!("{} µm/K, {} K/h 1 sigma", um(self.growth), self.room_drift * 3600.0),
        }
    }

    /// Settings of the real controller for this set-up: the usual ones, with this tolerance.
    pub fn centring(&self) -> CentringSettings {
        CentringSettings { tolerance: self.tolerance, ..CentringSettings::default() }
    }
}
