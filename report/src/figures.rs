//! The figures by which a calibration is judged: the name of each, the same on all screens, and the one function that computes it.

use std::fmt::Write;

use calibench::prediction::PoseSource;

/// A figure, as `docs/glossary.md` lists it.
#[derive(Debug, Clone, Copy)]
pub struct Figure {
    /// Its name on all screens.
    pub name: &'static str,
    /// Its meaning.
    pub meaning: &'static str,
    /// The verbs that print it.
    pub verbs: &'static [&'static str],
    /// Its names in JSON documents; a later document may have it under the same name only.
    pub keys: &'static [&'static str],
    /// The function that computes it, as a path.
    pub function: &'static str,
}

/// The path of a function as text; what names no function does not compile.
macro_rules! path {
    ($path:path) => {{
        let _ = $path;
        stringify!($path)
    }};
}

/// Half of the 95 % interval of a normal distribution, in standard deviations.
pub(crate) const COVERS_95: f64 = 1.96;

/// Residual of the fitted rows, rms, 3-D.
pub const RESIDUAL: Figure = Figure {
    name: "residual of the fit",
    meaning: "measured minus predicted on the rows that were fitted, rms of the 3-D length",
    verbs: &["identify", "compare", "diagnose", "add", "ladder", "effects prove"],
    keys: &["residual_mm"],
    function: path!(calibench::math::rms),
};

/// Cross-validated error, rms, 3-D.
pub const CROSS_VALIDATED: Figure = Figure {
    name: "cross-validated",
    meaning: "the same for rows that were each left out of one fit in turn, neighbours together",
    verbs: &["add", "ladder", "compare"],
    keys: &["cross_validated_mm"],
    function: path!(calibench::selection::ladder::ladder_step),
};

/// Position error on rows of set `validation`, or of campaigns that were not fitted.
pub const NOT_FITTED: Figure = Figure {
    name: "measured, held out",
    meaning: "measured minus predicted on rows kept for validation, or of a campaign that was not fitted; the instrument's noise is part of it",
    verbs: &["validate", "compare", "add", "ladder", "run"],
    keys: &["validation", "checks"],
    function: path!(calibench::residuals::Validation::of),
};

/// Position error to expect at the poses that are held out.
pub const EXPECTED_HELD_OUT: Figure = Figure {
    name: "expected at the held-out poses",
    meaning: "the position error to expect at the poses of set `validation`, sampled from everything that the fitted rows leave possible; without the instrument's noise",
    verbs: &["validate", "compare", "diagnose", "add", "ladder"],
    keys: &["workspace"],
    function: path!(calibench::prediction::WorkspaceError::predict),
};

/// Position error to expect where every joint is in the range in which it was measured.
pub const EXPECTED_INSIDE: Figure = Figure {
    name: "expected inside the measured ranges",
    meaning: "the same at poses all over the ranges in which the joints were measured",
    verbs: &["calibrate", "run"],
    keys: &["inside"],
    function: path!(calibench::prediction::WorkspaceError::predict),
};

/// Position error to expect over the limits of the joints.
pub const EXPECTED_OVER: Figure = Figure {
    name: "expected over the joint limits",
    meaning: "the same at poses all over the limits of the joints; of data without held-out poses also the figure of the verbs that judge a model",
    verbs: &["calibrate", "run", "compare", "diagnose", "add", "ladder", "plan next", "measure"],
    keys: &["over_limits", "workspace"],
    function: path!(calibench::prediction::WorkspaceError::predict),
};

/// The expected error at these poses.
#[must_use]
pub const fn expected(at: PoseSource) -> Figure {
    match at {
        PoseSource::Validation => EXPECTED_HELD_OUT,
        PoseSource::Ranges => EXPECTED_INSIDE,
        PoseSource::Limits => EXPECTED_OVER,
    }
}

/// Position error to expect at one target.
pub const HERE: Figure = Figure {
    name: "expected here",
    meaning: "one sigma of the position error to expect at one target: that of the parameters, and what is unexplained",
    verbs: &["compensate"],
    keys: &["sigma_3d_mm", "sigma_worst_mm"],
    function: path!(calibench::compensate::Compensator::compensate),
};

/// Noise of the instrument.
pub const NOISE: Figure = Figure {
    name: "instrument noise",
    meaning: "the scatter of repeated measurements at one posture, or as stated where nothing was repeated",
    verbs: &["diagnose", "compare"],
    keys: &["instrument_noise_um", "noise_um_per_axis"],
    function: path!(calibench::residuals::noise_floor::NoiseFloor::of),
};

/// Noise left in the residual of the fit.
pub const NOISE_LEFT: Figure = Figure {
    name: "noise left",
    meaning: "the part of that noise which the fit leaves in its residual, rms of the 3-D length; its parameters absorb the rest",
    verbs: &["compare", "diagnose", "add", "ladder"],
    keys: &["noise_left_mm"],
    function: path!(calibench::residuals::noise_left),
};

/// Residual beyond the noise.
pub const UNEXPLAINED: Figure = Figure {
    name: "unexplained",
    meaning: "the residual of the fit beyond the noise left in it",
    verbs: &["diagnose", "compare"],
    keys: &["unexplained_mm"],
    function: path!(calibench::residuals::unexplained),
};

/// All figures, in the order in which a calibration is judged.
pub const FIGURES: [Figure; 10] = [
    RESIDUAL,
    NOISE,
    NOISE_LEFT,
    UNEXPLAINED,
    CROSS_VALIDATED,
    NOT_FITTED,
    EXPECTED_HELD_OUT,
    EXPECTED_INSIDE,
    EXPECTED_OVER,
    HERE,
];

/// The figures as a table in Markdown.
#[must_use]
pub fn figures_table() -> String {
    let mut out = "| figure | meaning | from | in JSON | computed by |\n|---|---|---|---|---|\n".to_owned();
    let code = |names: &[&str]| names.iter().map(|n| format!("`{n}`")).collect::<Vec<_>>().join(", ");
    for f in FIGURES {
        let (verbs, keys) = (code(f.verbs), code(f.keys));
        let _ = writeln!(out, "| {} | {} | {verbs} | {keys} | `{}` |", f.name, f.meaning, f.function);
    }
    out
}

/// The names for a page whose expected error is at these poses, by key.
pub(crate) fn names(at: PoseSource) -> serde_json::Value {
    serde_json::json!({
        "residual": RESIDUAL.name, "cross_validated": CROSS_VALIDATED.name, "not_fitted": NOT_FITTED.name, "workspace": expected(at).name,
        "inside": EXPECTED_INSIDE.name, "over_limits": EXPECTED_OVER.name,
        "noise": NOISE.name, "noise_left": NOISE_LEFT.name, "unexplained": UNEXPLAINED.name,
    })
}
