//! The verdict of a diagnosis.

/// The verdict of a diagnosis.
///
/// ```
/// use calibench::diagnosis::Verdict;
///
/// assert!(Verdict::Indistinguishable.names_effects() && !Verdict::Unexplained.names_effects());
/// assert!(Verdict::NoiseLargerThanStated.is_noise());
/// assert_eq!(Verdict::NothingLeft.in_words(), "nothing left");
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Verdict {
    /// The data are not from this robot, or not of this kind; nothing is diagnosed.
    DataDoNotFit,
    /// The residual is noise, but larger than the data state.
    NoiseLargerThanStated,
    /// Single samples disagree with all others; the rest of the diagnosis excludes them.
    SuspectSamples,
    /// The residual is noise.
    NothingLeft,
    /// The credible set names one effect, and with it the residual is noise.
    Identified,
    /// The named effects explain a part; more is missing.
    Partly,
    /// The credible set names several effects that these data cannot distinguish.
    Indistinguishable,
    /// The residual exceeds the noise, and no effect of the catalogue explains it.
    Unexplained,
}

impl Verdict {
    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Verdict::DataDoNotFit => "data_do_not_fit",
            Verdict::NoiseLargerThanStated => "noise_larger_than_stated",
            Verdict::SuspectSamples => "suspect_samples",
            Verdict::NothingLeft => "nothing_left",
            Verdict::Identified => "identified",
            Verdict::Partly => "partly",
            Verdict::Indistinguishable => "indistinguishable",
            Verdict::Unexplained => "unexplained",
        }
    }

    /// The verdict for people, as the glossary has it.
    pub fn in_words(self) -> String {
        self.name().replace('_', " ")
    }

    /// True if the verdict names effects of the catalogue.
    pub fn names_effects(self) -> bool {
        matches!(self, Verdict::Identified | Verdict::Partly | Verdict::Indistinguishable)
    }

    /// True if the residual is only noise, so that nothing need be added to the model.
    pub fn is_noise(self) -> bool {
        matches!(self, Verdict::NothingLeft | Verdict::NoiseLargerThanStated)
    }
}
