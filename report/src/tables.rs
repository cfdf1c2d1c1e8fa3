//! Tables for a terminal.

use comfy_table::{CellAlignment, ContentArrangement, Table, presets::UTF8_FULL_CONDENSED};

use calibench::effects::EffectId;
use calibench::identify::calibration::Calibration;
use calibench::measure::dataset::NamedDataset;
use calibench::residuals::{OrientationErrors, Validation};
use calibench::units::{DEG, MM};

/// The mark of a column that a narrow terminal may leave out: of no width, so that it moves nothing. Columns with more marks are
/// left out first.
pub const MARK: char = '\u{2060}';

/// The header of a column that a narrow terminal may leave out; those of higher rank are left out first.
#[macro_export]
macro_rules! optional {
    (1, $header:literal) => {
        concat!("\u{2060}", $header)
    };
    (2, $header:literal) => {
        concat!("\u{2060}\u{2060}", $header)
    };
    (3, $header:literal) => {
        concat!("\u{2060}\u{2060}\u{2060}", $header)
    };
}

/// As [`optional!`], for a name that is not a literal.
pub(super) fn marked(rank: usize, header: &str) -> String {
    format!("{}{header}", MARK.to_string().repeat(rank))
}

/// The text of tables without the marks of their columns.
#[must_use]
pub fn without_marks(text: &str) -> String {
    text.replace(MARK, "")
}

/// A table with text in the first column and numbers in the others.
fn table(header: &[&str]) -> Table {
    let mut table = Table::new();
    table.load_preset(UTF8_FULL_CONDENSED).set_content_arrangement(ContentArrangement::Disabled).set_header(header);
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

/// A table of plain rows: columns of numbers right-aligned, columns of words left-aligned.
pub fn plain_table<const N: usize>(header: &[&str; N], rows: &[[String; N]]) -> String {
    laid_out(header, rows.iter().map(|row| row.as_slice()).collect())
}

/// A table of plain rows with any number of columns, aligned as in [`plain_table`].
pub fn plain_rows(header: &[String], rows: &[Vec<String>]) -> String {
    let header: Vec<&str> = header.iter().map(String::as_str).collect();
    laid_out(&header, rows.iter().map(Vec::as_slice).collect())
}

fn laid_out(header: &[&str], rows: Vec<&[String]>) -> String {
    let mut out = table(header);
    for (k, column) in out.column_iter_mut().enumerate() {
        let is_number = |cell: &str| cell.is_empty() || cell.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c));
        let numbers = k > 0 && rows.iter().all(|row| row.get(k).is_none_or(|cell| is_number(cell)));
        column.set_cell_alignment(if numbers { CellAlignment::Right } else { CellAlignment::Left });
    }
    for row in rows {
        out.add_row(row);
    }
    out.to_string()
}

/// Number of decimals that show a value to a tenth of its one-sigma, between 3 (as the paper prints) and 6.
fn decimals(sigma: f64) -> usize {
    if sigma > 0.0 { (1.0 - sigma.log10().floor()).clamp(3.0, 6.0) as usize } else { 3 }
}

/// Parameters in the layout of the paper's Table 8, with one-sigma and correction.
pub fn parameter_table(c: &Calibration) -> String {
    let mut out = table(&["parameter", "nominal", "identified", "1 sigma", "correction", "unit"]);
    for e in c.estimates.iter().filter(|e| e.stated_sigma.is_none()) {
        let unit = |x: f64| e.unit.from_si(x);
        let d = decimals(unit(e.sigma));
        let flag = if e.effect.family() == EffectId::JOINT_COMPLIANCE && e.value < -3.0 * e.sigma {
            "  (negative: not physical)"
        } else {
            ""
        };
        out.add_row([
            e.name.clone(),
            format!("{:.3}", unit(e.nominal)),
            format!("{:.d$}", unit(e.value)),
            format!("{:.d$}", unit(e.sigma)),
            format!("{:+.d$}", unit(e.value - e.nominal)),
            format!("{}{flag}", e.unit.printed()),
        ]);
    }
    out.to_string()
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
pub fn parameter_rows(c: &Calibration, effects: &[String]) -> String {
    let mut out = table(&["parameter", "value", "1 sigma", "unit"]);
    for e in c.estimates.iter().filter(|e| effects.iter().any(|effect| e.effect == *effect)) {
        let d = decimals(e.unit.from_si(e.sigma));
        let number = |x: f64| format!("{:.d$}", e.unit.from_si(x));
        out.add_row([e.name.clone(), number(e.value), number(e.sigma), e.unit.printed().into_owned()]);
    }
    out.to_string()
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

/// A table of orientation errors.
pub fn orientation_table(errors: &OrientationErrors) -> String {
    let mut out = table(&["orientation error, deg", "mean", "max", "std", "rms"]);
    let numbers = [errors.mean, errors.max, errors.std, errors.rms].map(|x| format!("{:.4}", x / DEG));
    out.add_row(std::iter::once(format!("{} samples", errors.samples)).chain(numbers));
    out.to_string()
}

/// A table of validation results, in the layout of the paper's Table 9.
pub fn validation_table(rows: &[[String; 7]]) -> String {
    let mut out = table(&["position error, mm", "mean", "max", "std", "rms", "median", "95 %"]);
    for row in rows {
        out.add_row(row);
    }
    out.to_string()
}

/// A bar histogram of position errors.
pub fn histogram(v: &Validation, bins: usize) -> String {
    /// Length of the longest bar, columns: with its figures, a line has fewer than 80.
    const WIDEST: usize = 50;
    let bars = v.histogram(bins);
    let most = bars.iter().map(|b| b.count).max().unwrap_or(1).max(1);
    bars.iter()
        .map(|b| {
            let length = (b.count * WIDEST).div_ceil(most);
            format!("{:6.3} - {:6.3} mm {:4} {}\n", b.from / MM, b.to / MM, b.count, "█".repeat(length))
        })
        .collect()
}
