//! The sources of the deviation.

/// One source of the deviation between datum ball and master ball.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// Scale error of the indicators: the two balls are 6.35 mm apart.
    Scale,
    /// Resolution of their displays.
    Resolution,
    /// Noise of their readings, at the preset and at every reading.
    Repeatability,
    /// Hysteresis of the indicators: the master ball pushes in, the last step may come out.
    Hysteresis,
    /// Effect on a ball at zero of tilted disks and of channels that are not square or do not meet.
    Geometry,
    /// Diameters of the two balls.
    Diameter,
    /// Form of the balls at the contacts.
    Form,
    /// Remaining error of the first step, which no other removes because all readings are within the tolerance.
    Tolerance,
    /// Step size of the small arm, and the errors of its small motions.
    ArmStep,
    /// Creep of the small arm between the last reading and the measurement.
    ArmDrift,
    /// Error of the machine's measurement of a ball's centre.
    Cmm,
    /// Thermal growth of the gauge as the room temperature changes.
    Thermal,
}

impl Source {
    /// All sources, in the order in which they are printed.
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

    /// Name in documents.
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

    /// Name in tables.
    pub fn words(self) -> &'static str {
        match self {
            Source::Scale => "indicators: scale",
            Source::Resolution => "indicators: resolution",
            Source::Repeatability => "indicators: repeatability",
            Source::Hysteresis => "indicators: hysteresis",
            Source::Geometry => "gauge: tilt, squareness, concurrency",
            Source::Diameter => "balls: diameter",
            Source::Form => "balls: form",
            Source::Tolerance => "remainder within the stop tolerance",
            Source::ArmStep => "small arm: step, small motions",
            Source::ArmDrift => "small arm: drift",
            Source::Cmm => "CMM: centre of a ball",
            Source::Thermal => "thermal",
        }
    }
}

/// A set of sources.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sources(u16);

impl Sources {
    /// All sources.
    pub const ALL: Sources = Sources((1 << Source::ALL.len()) - 1);
    /// No sources.
    pub const NONE: Sources = Sources(0);

    /// One source alone.
    pub fn only(source: Source) -> Self {
        Sources(1 << source as u16)
    }

    /// All sources except one.
    pub fn without(source: Source) -> Self {
        Sources(Sources::ALL.0 & !(1 << source as u16))
    }

    /// True if the set contains the source.
    pub fn has(self, source: Source) -> bool {
        self.0 & (1 << source as u16) != 0
    }
}
