//! The table of a study: one row per trial, point and method.

use calibench_sim::run::Methods;

/// Columns before those of the axes.
const BEFORE: [&str; 4] = ["study", METHODS, "points", "point"];
/// Columns after those of the axes.
const AFTER: [&str; 18] = [
    "trial",
    "seed",
    "method",
    "outcome",
    "mean_mm",
    "max_mm",
    "std_mm",
    "rms_mm",
    "p95_mm",
    "before_mean_mm",
    "before_max_mm",
    "residual_mm",
    "chi2_per_dof",
    "dof",
    "rank",
    "measured",
    "failed",
    "readings_mean",
];
const CELL_TIME: &str = "cell_s";
/// Before `method` in a study of rare robots: the share of robots that it asks for, and the weight of the trial.
const WEIGHTED: [&str; 2] = [RARE, WEIGHT];
pub(super) const RARE: &str = "rare";
pub(super) const WEIGHT: &str = "weight";
/// The methods of which every trial has a row.
pub(super) const METHODS: &str = "methods";
const DIAGNOSIS: [&str; 2] = ["verdict", "finding"];
/// Prefix of the columns that hold a parameter's error over its sigma.
pub(super) const ERROR: &str = "z_";
/// Outcome of a completed trial.
pub const DONE: &str = "done";

/// True if every study has a column of this name, or some study may have it.
pub(super) fn is_of_every_study(name: &str) -> bool {
    let fixed = BEFORE.iter().chain(&AFTER).chain(&DIAGNOSIS).chain(&WEIGHTED).chain([&CELL_TIME]);
    name.starts_with(ERROR) || fixed.into_iter().any(|column| *column == name)
}

/// The columns of one study.
#[derive(Debug, Clone, PartialEq)]
pub struct Columns {
    names: Vec<String>,
    methods: Methods,
    diagnosed: bool,
    parameters: Vec<String>,
    /// The share of robots requested, in a study of rare ones.
    rare: Option<f64>,
}

/// A row before it is written.
pub(super) struct Row {
    pub method: &'static str,
    /// The numbers, or the reason for having none.
    pub outcome: Result<Numbers, String>,
}

/// Results of one trial by one method.
pub(super) struct Numbers {
    /// Position errors on the validation poses: mean, maximum, standard deviation, root mean square, 95 % quantile.
    pub errors_mm: [f64; 5],
    /// Position errors of the nominal robot on the validation poses: mean, maximum.
    pub before_mm: [f64; 2],
    /// Root mean square of the residuals.
    pub residual_mm: f64,
    pub chi2_per_dof: f64,
    pub dof: usize,
    pub rank: usize,
    /// Numbers of fitted samples and of failed probings.
    pub measured: usize,
    pub failed: usize,
    pub readings_mean: Option<f64>,
    pub cell_s: Option<f64>,
    pub finding: Option<Finding>,
    /// Error over sigma by parameter.
    pub z: Vec<(String, f64)>,
}

/// Result of the diagnosis.
pub(super) struct Finding {
    pub verdict: &'static str,
    pub effect: String,
}

/// Position of a row in the table.
pub(super) struct Place<'a> {
    pub study: &'a str,
    pub points: usize,
    pub point: usize,
    pub at: &'a [String],
    pub trial: u64,
    pub seed: u64,
    /// Weight of the trial, in a study of rare robots.
    pub weight: Option<f64>,
}

impl Columns {
    /// Columns for these axes, methods and parameters, with or without the diagnosis.
    pub fn new(axes: &[String], methods: Methods, diagnosed: bool, parameters: &[String]) -> Self {
        let plain = |names: &[&str]| names.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>();
        let diagnosis = if diagnosed { plain(&DIAGNOSIS) } else { Vec::new() };
        let errors = parameters.iter().map(|p| format!("{ERROR}{p}")).collect();
        let names = [plain(&BEFORE), axes.to_vec(), plain(&AFTER), plain(&[CELL_TIME]), diagnosis, errors].concat();
        Columns { names, methods, diagnosed, parameters: parameters.to_vec(), rare: None }
    }

    /// The same columns for a study of rare robots, and this share of all.
    #[must_use]
    pub(super) fn weighted(mut self, share: f64) -> Self {
        let place = self.names.iter().position(|name| name == "method").unwrap_or(self.names.len());
        self.names.splice(place..place, WEIGHTED.map(str::to_owned));
        self.rare = Some(share);
        self
    }

    /// The header line of the table.
    pub fn header(&self) -> Vec<u8> {
        line(self.names.iter().map(String::as_str))
    }

    /// One line of the table.
    pub(super) fn line(&self, place: &Place<'_>, row: &Row) -> Vec<u8> {
        let mut fields =
            vec![place.study.to_owned(), self.methods.name().to_owned(), place.points.to_string(), place.point.to_string()];
        fields.extend_from_slice(place.at);
        fields.extend([place.trial.to_string(), place.seed.to_string()]);
        if let Some(share) = self.rare {
            fields.extend([share.to_string(), place.weight.map_or_else(String::new, figure)]);
        }
        fields.push(row.method.to_owned());
        match &row.outcome {
            Ok(n) => {
                fields.push(DONE.into());
                fields.extend(
                    n.errors_mm.iter().chain(&n.before_mm).chain([&n.residual_mm, &n.chi2_per_dof]).map(|v| figure(*v)),
                );
                fields.extend([n.dof, n.rank, n.measured, n.failed].map(|v| v.to_string()));
                fields.extend([n.readings_mean, n.cell_s].map(|v| v.map_or_else(String::new, figure)));
                if let (true, Some(finding)) = (self.diagnosed, &n.finding) {
                    fields.extend([finding.verdict.to_owned(), finding.effect.clone()]);
                }
                let z =
                    |name: &String| n.z.iter().find(|(other, _)| other == name).map_or_else(String::new, |(_, z)| figure(*z));
                fields.extend(self.parameters.iter().map(z));
            }
            Err(reason) => {
                fields.push(calibench::files::one_line(reason));
                fields.resize(self.names.len(), String::new());
            }
        }
        line(fields.iter().map(String::as_str))
    }
}

/// Formats to seven digits: more than is significant in any of these numbers, and few enough to hide the summation order of a
/// processor.
fn figure(value: f64) -> String {
    if !value.is_finite() {
        return String::new();
    }
    format!("{value:.6e}").parse::<f64>().unwrap_or(value).to_string()
}

fn line<'a>(fields: impl IntoIterator<Item = &'a str>) -> Vec<u8> {
    let mut writer = csv::WriterBuilder::new().from_writer(Vec::new());
    // Writing to memory cannot fail.
    drop(writer.write_record(fields));
    writer.into_inner().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_short_and_true_to_seven_digits() {
        for (value, text) in [(0.326_123_449_9, "0.3261234"), (1e-7, "0.0000001"), (209.0, "209"), (-2.0 / 3.0, "-0.6666667")] {
            assert_eq!(figure(value), text);
        }
        assert_eq!(figure(f64::NAN), "");
    }

    #[test]
    fn every_line_has_a_field_for_every_column_and_stays_one_line() {
        let columns = Columns::new(&["plan.poses_per_ball".into()], Methods::Both, true, &["a1".into(), "c2".into()]);
        let place = Place { study: "s", points: 1, point: 0, at: &["5".into()], trial: 7, seed: 1, weight: None };
        let row = Row { method: "trical", outcome: Err("the robot, \"it\"\nfell".into()) };
        let text = [columns.header(), columns.line(&place, &row)].concat();
        assert_eq!(text.iter().filter(|&&b| b == b'\n').count(), 2);
        let mut reader = csv::Reader::from_reader(&text[..]);
        let header = reader.headers().expect("a header").clone();
        // The reader rejects rows of a length other than the header's.
        let record = reader.records().next().expect("a row").expect("as long as the header");
        let at = |name: &str| &record[header.iter().position(|h| h == name).expect("a column")];
        assert_eq!((at("plan.poses_per_ball"), at("trial"), at("z_c2")), ("5", "7", ""));
        assert!(at("outcome").contains("fell"));
    }

    #[test]
    fn a_failed_trial_of_a_rare_study_has_its_weight() {
        let columns = Columns::new(&[], Methods::Trical, false, &["a1".into()]).weighted(0.999);
        let place = Place { study: "s", points: 1, point: 0, at: &[], trial: 7, seed: 1, weight: Some(0.25) };
        let row = Row { method: "trical", outcome: Err("it fell".into()) };
        let text = [columns.header(), columns.line(&place, &row)].concat();
        let mut reader = csv::Reader::from_reader(&text[..]);
        let header = reader.headers().expect("a header").clone();
        let record = reader.records().next().expect("a row").expect("as long as the header");
        let at = |name: &str| &record[header.iter().position(|h| h == name).expect("a column")];
        assert_eq!((at("rare"), at("weight"), at("method"), at("outcome")), ("0.999", "0.25", "trical", "it fell"));
    }
}
