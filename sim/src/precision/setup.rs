//! The set-up of a precision test: how large everything is that can go wrong in it.

use calibench::measure::CentringSettings;
use calibench::units::{MM, MRAD, UM};

use super::{Source, Sources};
use crate::cmm::SimulatedCmm;
use crate::plunger::PlungerSpec;
use crate::scenario::Scenario;

/// A step leaves a hundredth of its way at most, here of 3 um: after two of them 0.3 nm.
const FURTHER_STEPS: usize = 2;

/// How well the small arm that carries the datum ball does what it is told.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmSpec {
    /// One-sigma of where a large motion ends, per axis, m.
    pub repeatability: f64,
    /// Step of its position along each of its axes, m; 0 for none.
    pub step: f64,
    /// One-sigma of what a small motion misses besides, per axis, m.
    pub small_move: f64,
    /// One-sigma of the turn of its axes against those of the gauge, about each axis, rad.
    pub misalignment: f64,
    /// One-sigma of its creep at rest, per axis, m/s.
    pub drift: f64,
}

/// Everything that a precision test depends on, besides the draws.
#[derive(Debug, Clone, PartialEq)]
pub struct Setup {
    /// How often the datum ball is centred and measured.
    pub repetitions: usize,
    /// Flaws of the indicators.
    pub plungers: PlungerSpec,
    /// One-sigma of a ball's radius, m.
    pub radius_sigma: f64,
    /// One-sigma per axis of what a ball's form adds where it is touched, m.
    pub form_sigma: f64,
    /// A ball is centred when every reading is smaller, m.
    pub tolerance: f64,
    /// Steps that follow when the ball counts as centred. 0 as the paper does it; 2 leave nothing that a step can take away.
    pub further_steps: usize,
    /// The datum ball is brought to within this of zero along each axis, m.
    pub start: f64,
    /// The small arm.
    pub arm: ArmSpec,
    /// The measuring machine.
    pub cmm: SimulatedCmm,
    /// Time that it takes for a ball, s.
    pub cmm_s: f64,
    /// One-sigma of the room's drift, K/s.
    pub room_drift: f64,
    /// How far the gauge's centre moves against the machine, along each axis, m/K.
    pub growth: f64,
}

impl Setup {
    /// That of a scenario: indicators and balls as in its cell, the rest from its `[precision]`.
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

    /// The same with these sources of deviation alone; every draw stays what it was.
    ///
    /// What is left over within the tolerance is what the first step missed of its way, along axes of arm and gauge that are not quite
    /// parallel, and what the loop did not take away any more. Without that source the arm goes along the gauge's axes, and two
    /// steps more are taken than the tolerance asks for: each of the other sources then shows what it does to a ball at zero.
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

    /// How the real controller is to centre here: as everywhere, to this tolerance.
    pub fn centring(&self) -> CentringSettings {
        CentringSettings { tolerance: self.tolerance, ..CentringSettings::default() }
    }
}
