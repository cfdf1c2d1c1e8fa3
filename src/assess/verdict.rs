//! What a diagnosis comes to.

/// What a diagnosis comes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Verdict {
    /// The data are not of this robot, or not of this kind: nothing is diagnosed.
    DataDoNotFit,
    /// What remains is noise, but more of it than the data state.
    NoiseLargerThanStated,
    /// Single samples disagree with all others; the rest of the diagnosis is without them.
    SuspectSamples,
    /// What remains is noise.
    NothingLeft,
    /// The credible set names one effect, and what is left beside it is noise.
    Identified,
    /// Effects are named that explain a part; more is missing.
    Partly,
    /// The set names several that these data cannot separate.
    Indistinguishable,
    /// Something is left, and no effect of the catalogue explains it.
    Unexplained,
}

impl Verdict {
    /// As in files.
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

    /// Whether it names effects of the catalogue.
    pub fn names_effects(self) -> bool {
        matches!(self, Verdict::Identified | Verdict::Partly | Verdict::Indistinguishable)
    }

    /// Whether nothing but noise is left: there is nothing to add to the model.
    pub fn is_noise(self) -> bool {
        matches!(self, Verdict::NothingLeft | Verdict::NoiseLargerThanStated)
    }
}
