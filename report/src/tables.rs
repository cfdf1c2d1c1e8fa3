//! Tables for a terminal.

use std::fmt;

use comfy_table::{CellAlignment, ContentArrangement, presets::UTF8_FULL_CONDENSED};

use calibench::effects::EffectId;
use calibench::identify::calibration::{Calibration, Estimate};
use calibench::measure::dataset::NamedDataset;
use calibench::residuals::{OrientationErrors, Validation};
use calibench::units::{DEG, MM};

/// A column of a table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Column {
    /// Its name, in the header.
    pub name: String,
    /// 0 for a column that is always shown; of the others, a narrow terminal leaves out those of higher rank first.
    pub rank: u8,
}

/// A column that is always shown.
pub fn column(name: impl Into<String>) -> Column {
    optional(0, name)
}

/// A column that a narrow terminal may leave out; those of higher rank are left out first.
pub fn optional(rank: u8, name: impl Into<String>) -> Column {
    Column { name: name.into(), rank }
}

impl From<&str> for Column {
    fn from(name: &str) -> Self {
        column(name)
    }
}

impl From<String> for Column {
    fn from(name: String) -> Self {
        column(name)
    }
}

/// A table that is not drawn yet. As a string, it is drawn as wide as its cells.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Table {
    /// The columns.
    pub header: Vec<Column>,
    /// The cells, row by row.
    pub rows: Vec<Vec<String>>,
    /// True if every column but the first is right-aligned where the table is drawn as wide as its cells, words included.
    right_aligned: bool,
}

impl Table {
    /// True if a column holds nothing but numbers, which are right-aligned; the first column names the rows.
    #[must_use]
    pub fn is_numeric(&self, column: usize) -> bool {
        let is_number = |cell: &String| cell.is_empty() || cell.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c));
        column > 0 && self.rows.iter().all(|row| row.get(column).is_none_or(is_number))
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut drawn = comfy_table::Table::new();
        drawn.load_preset(UTF8_FULL_CONDENSED).set_content_arrangement(ContentArrangement::Disabled);
        drawn.set_header(self.header.iter().map(|column| &column.name)).add_rows(&self.rows);
        for (k, column) in drawn.column_iter_mut().enumerate() {
            let right = if self.right_aligned { k > 0 } else { self.is_numeric(k) };
            column.set_cell_alignment(if right { CellAlignment::Right } else { CellAlignment::Left });
        }
        drawn.fmt(f)
    }
}

/// A table of plain rows: columns of numbers right-aligned, columns of words left-aligned.
pub fn plain_table<const N: usize>(header: [impl Into<Column>; N], rows: Vec<[String; N]>) -> Table {
    plain_rows(header, rows.into_iter().map(Vec::from).collect())
}

/// A table of plain rows with any number of columns, aligned as in [`plain_table`].
pub fn plain_rows(header: impl IntoIterator<Item = impl Into<Column>>, rows: Vec<Vec<String>>) -> Table {
    Table { header: header.into_iter().map(Into::into).collect(), rows, right_aligned: false }
}

/// A table of plain rows, whose columns are right-aligned except the first.
fn right_aligned<const N: usize>(header: [&str; N], rows: impl IntoIterator<Item = [String; N]>) -> Table {
    Table { right_aligned: true, ..plain_table(header, rows.into_iter().collect()) }
}

/// Number of decimals that show a value to a tenth of its one-sigma, between 3 (as the paper prints) and 6.
fn decimals(sigma: f64) -> usize {
    if sigma > 0.0 { (1.0 - sigma.log10().floor()).clamp(3.0, 6.0) as usize } else { 3 }
}

/// Parameters in the layout of the paper's Table 8, with one-sigma and correction.
pub fn parameter_table(c: &Calibration) -> Table {
    let row = |e: &Estimate| {
        let unit = |x: f64| e.unit.from_si(x);
        let d = decimals(unit(e.sigma));
        let flag = if e.effect.family() == EffectId::JOINT_COMPLIANCE && e.value < -3.0 * e.sigma {
            "  (negative: not physical)"
        } else {
            ""
        };
        [
            e.name.clone(),
            format!("{:.3}", unit(e.nominal)),
            format!("{:.d$}", unit(e.value)),
            format!("{:.d$}", unit(e.sigma)),
            format!("{:+.d$}", unit(e.value - e.nominal)),
            format!("{}{flag}", e.unit.printed()),
        ]
    };
    let rows = c.estimates.iter().filter(|e| e.stated_sigma.is_none()).map(row);
    right_aligned(["parameter", "nominal", "identified", "1 sigma", "correction", "unit"], rows)
}

/// States that the uncertainties include the model's deficiencies, if that widens them; otherwise empty.
pub fn wider_sentence(c: &Calibration) -> String {
    let mut ratios: Vec<f64> = c.estimates.iter().filter(|e| e.sigma_noise > 0.0).map(|e| e.sigma / e.sigma_noise).collect();
    ratios.sort_by(f64::total_cmp);
    match ratios.get(ratios.len() / 2) {
        Some(&median) if median > WIDER => format!(
            "The model lacks something: 1 sigma covers noise and what is missing, and is {median:.1} times (median) that of noise alone.\n"
        ),
        _ => String::new(),
    }
}

/// Ratio to the noise-only uncertainty above which the widening is reported.
const WIDER: f64 = 1.05;

/// Parameters of some effects, with one-sigma.
pub fn parameter_rows(c: &Calibration, effects: &[EffectId]) -> Table {
    let row = |e: &Estimate| {
        let d = decimals(e.unit.from_si(e.sigma));
        let number = |x: f64| format!("{:.d$}", e.unit.from_si(x));
        [e.name.clone(), number(e.value), number(e.sigma), e.unit.printed().into_owned()]
    };
    let rows = c.estimates.iter().filter(|e| effects.contains(&e.effect)).map(row);
    right_aligned(["parameter", "value", "1 sigma", "unit"], rows)
}

/// Number of a parameter's correlated partners named in a sentence, the strongest first.
const MOST_NAMED: usize = 6;

/// The parameters that the data cannot separate, one line each.
pub fn unresolved_sentences(c: &Calibration) -> Vec<String> {
    c.unresolved
        .iter()
        .map(|group| match group.as_slice() {
            [alone] => format!("{alone}: nothing measured moves with it"),
            [left_out, with] => format!("{left_out}: moves the TCP as {with} can"),
            [left_out, with @ ..] if with.len() > MOST_NAMED => {
                let named = with[..MOST_NAMED].join(", ");
                format!("{left_out}: moves the TCP as {named} and {} more together can", with.len() - MOST_NAMED)
            }
            [left_out, with @ ..] => format!("{left_out}: moves the TCP as {} together can", with.join(", ")),
            [] => String::new(),
        })
        .collect()
}

/// One row of a validation table: method, then mean, maximum, standard deviation, rms, median and 95 % quantile in mm.
pub fn validation_row(method: &str, v: &Validation) -> [String; 7] {
    let mm = |x: f64| format!("{:.3}", x / MM);
    [method.into(), mm(v.mean), mm(v.max), mm(v.std), mm(v.rms), mm(v.quantiles[2]), mm(v.quantiles[4])]
}

/// The residual of measured orientations, to follow that of the positions; empty if none were measured.
pub fn orientation_words(rms: Option<f64>) -> String {
    rms.map_or_else(String::new, |rms| format!(", orientations {:.4}° rms", rms / DEG))
}

/// Ratio of the errors of orientations and positions to that in which they were weighted, beyond which it is reported.
const UNBALANCED: f64 = 1.5;

/// States that positions and orientations were weighted in another ratio than that in which they err, where only the orientations
/// have a stated noise; otherwise empty.
pub fn weighing_sentence(c: &Calibration, datasets: &[NamedDataset<'_>]) -> String {
    let stated = datasets.iter().find(|d| d.dataset.noise.point.is_none()).and_then(|d| d.dataset.noise.orientation);
    let (Some(balanced), Some(stated), false) = (c.balanced_orientation(), stated, c.noise_stated) else {
        return String::new();
    };
    if (balanced / stated).max(stated / balanced) < UNBALANCED {
        return String::new();
    }
    format!(
        "The noise of the positions is not stated, so they were weighted as if it were 0.1 mm, beside {:.3}° of the orientations; their errors are as 0.1 mm to {:.3}°. State `point_um`, or `orientation_deg = {:.3}`.\n",
        stated / DEG,
        balanced / DEG,
        balanced / DEG
    )
}

/// Base and tool as found, in the frames of `dataset.toml`, each above its 1 sigma, where orientations were measured: for a camera,
/// the hand-eye calibration. `None` where only positions were.
pub fn frames_table(c: &Calibration) -> Option<Table> {
    let found = c.found_frames();
    let title = ["found", "x, mm", "y, mm", "z, mm", "a, deg", "b, deg", "c, deg"];
    let numbers = |label: String, v: [f64; 6]| {
        let [x, y, z] = [v[0], v[1], v[2]].map(|x| format!("{:.3}", x / MM));
        let [a, b, c] = [v[3], v[4], v[5]].map(|x| format!("{:.4}", x / DEG));
        [label, x, y, z, a, b, c]
    };
    let rows = found.iter().flat_map(|found| {
        let label = format!("{} {}", found.name(), found.setup).trim().to_owned();
        [numbers(label, found.frame.to_array()), numbers("1 sigma".into(), found.sigma)]
    });
    (!found.is_empty()).then(|| right_aligned(title, rows))
}

/// A table of orientation errors.
pub fn orientation_table(errors: &OrientationErrors) -> Table {
    let [mean, max, std, rms] = [errors.mean, errors.max, errors.std, errors.rms].map(|x| format!("{:.4}", x / DEG));
    let row = [format!("{} samples", errors.samples), mean, max, std, rms];
    right_aligned(["orientation error, deg", "mean", "max", "std", "rms"], [row])
}

/// A table of validation results, in the layout of the paper's Table 9.
pub fn validation_table(rows: Vec<[String; 7]>) -> Table {
    right_aligned(["position error, mm", "mean", "max", "std", "rms", "median", "95 %"], rows)
}

/// A bar histogram of position errors. Its edges are written with as many digits as tell them apart, three at least.
pub fn histogram(v: &Validation, bins: usize) -> String {
    /// Length of the longest bar beside edges of three digits, columns: with its figures, a line has fewer than 80.
    const WIDEST: usize = 50;
    /// Fewest and most digits of an edge after the point, in mm: micrometres, and less than an atom.
    const DIGITS: [usize; 2] = [3, 9];
    let bars = v.histogram(if v.max > 0.0 { bins } else { 1 });
    let most = bars.iter().map(|b| b.count).max().unwrap_or(1).max(1);
    let written = |x: f64, digits: usize| format!("{:1$.digits$}", x / MM, digits + 3);
    let are_distinct = |digits: &usize| bars.iter().all(|b| written(b.from, *digits) != written(b.to, *digits));
    let digits = (DIGITS[0]..=DIGITS[1]).find(are_distinct).unwrap_or(DIGITS[0]);
    let widest = WIDEST - 2 * (digits - DIGITS[0]);
    bars.iter()
        .map(|b| {
            let bar = "█".repeat((b.count * widest).div_ceil(most));
            format!("{} - {} mm {:4} {bar}\n", written(b.from, digits), written(b.to, digits), b.count)
        })
        .collect()
}
