//! What the deviation is made of, source by source.

use calibench::units::{MM, MRAD, UM};

use super::Setup;

/// One source of the deviation between datum ball and master ball.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// Error of the indicators' scales: 6.35 mm lie between the two balls.
    Scale,
    /// Last digit of their displays.
    Resolution,
    /// Noise of their readings, at the preset and at every reading.
    Repeatability,
    /// Their hysteresis: the master ball pushes in, the last step may come out.
    Hysteresis,
    /// Tilted disks, channels that are not square or do not meet: what they do to a ball at zero.
    Geometry,
    /// Diameters of the two balls.
    Diameter,
    /// Their form, where the disks touch.
    Form,
    /// What the first step misses of its way and no other takes away, because all readings are within the tolerance.
    Tolerance,
    /// Steps of the small arm, and what its small motions miss.
    ArmStep,
    /// Creep of the small arm between the last reading and the measurement.
    ArmDrift,
    /// What the machine finds for the centre of a ball.
    Cmm,
    /// Growth of the gauge in a room that gets warmer or colder.
    Thermal,
}

impl Source {
    /// All of them, in the order in which they are printed.
    pub const ALL: [Source; 12] = [
        Source::Scale,
        Source::Resolution,
        Source::Repeatability,
        Source::Hysteresis,
        Source::Geometry,
        Source::Diameter,
        Source::Form,
        Source::Tolerance,
        Source::ArmStep,
        Source::ArmDrift,
        Source::Cmm,
        Source::Thermal,
    ];

    /// As in documents.
    pub fn name(self) -> &'static str {
        match self {
            Source::Scale => "indicator_scale",
            Source::Resolution => "indicator_resolution",
            Source::Repeatability => "indicator_repeatability",
            Source::Hysteresis => "indicator_hysteresis",
            Source::Geometry => "gauge_geometry",
            Source::Diameter => "ball_diameter",
            Source::Form => "ball_form",
            Source::Tolerance => "stop_tolerance",
            Source::ArmStep => "arm_step",
            Source::ArmDrift => "arm_drift",
            Source::Cmm => "cmm",
            Source::Thermal => "thermal",
        }
    }

    /// As in tables.
    pub fn words(self) -> &'static str {
        match self {
            Source::Scale => "indicators: scale",
            Source::Resolution => "indicators: resolution",
            Source::Repeatability => "indicators: repeatability",
            Source::Hysteresis => "indicators: hysteresis",
            Source::Geometry => "gauge: tilt, squareness, concurrency",
            Source::Diameter => "balls: diameter",
            Source::Form => "balls: form",
            Source::Tolerance => "left over within the stop tolerance",
            Source::ArmStep => "small arm: step, small motions",
            Source::ArmDrift => "small arm: drift",
            Source::Cmm => "CMM: centre of a ball",
            Source::Thermal => "thermal",
        }
    }

    /// How large it is in `setup`, in words.
    pub fn size(self, setup: &Setup) -> String {
        let um = |v: f64| format!("{:.3}", v / UM).trim_end_matches('0').trim_end_matches('.').to_owned();
        let (plungers, arm) = (&setup.plungers, &setup.arm);
        match self {
            Source::Scale => format!("amplitude up to {} um", um(plungers.scale_amplitude)),
            Source::Resolution => format!("{} um", um(plungers.resolution)),
            Source::Repeatability => format!("{} um, 1 sigma", um(plungers.noise[1])),
            Source::Hysteresis => format!("{} um", um(plungers.hysteresis[1])),
            Source::Geometry => format!(
                "{} mrad, {} mrad, {} um, 1 sigma",
                plungers.disk_tilt / MRAD,
                plungers.orthogonality / MRAD,
                um(plungers.concurrency)
            ),
            Source::Diameter => format!("{} um each, 1 sigma", um(2.0 * setup.radius_sigma)),
            Source::Form => format!("{} um each, 1 sigma", um(setup.form_sigma)),
            Source::Tolerance => {
                let way = format!("{} mrad from {} mm", arm.misalignment / MRAD, setup.start / MM);
                format!("below {} um, {way}", um(setup.tolerance))
            }
            Source::ArmStep => format!("{} um, {} um 1 sigma", um(arm.step), um(arm.small_move)),
            Source::ArmDrift => format!("{} um/min, 1 sigma", um(arm.drift * 60.0)),
            Source::Cmm => format!("{} um each, 1 sigma", um(setup.cmm.centre)),
            Source::Thermal => format!("{} um/K, {} K/h 1 sigma", um(setup.growth), setup.room_drift * 3600.0),
        }
    }
}

/// A set of sources.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sources(u16);

impl Sources {
    /// All of them.
    pub const ALL: Sources = Sources((1 << Source::ALL.len()) - 1);
    /// None.
    pub const NONE: Sources = Sources(0);

    /// That one alone.
    pub fn only(source: Source) -> Self {
        Sources(1 << source as u16)
    }

    /// All but that one.
    pub fn without(source: Source) -> Self {
        Sources(Sources::ALL.0 & !(1 << source as u16))
    }

    /// Whether it is among them.
    pub fn has(self, source: Source) -> bool {
        self.0 & (1 << source as u16) != 0
    }
}
