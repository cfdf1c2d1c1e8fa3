//! A comparison for a terminal: the findings in words, then each view with its origin.

use nalgebra::Vector3;

use super::figures::{NOT_FITTED, RESIDUAL};
use super::printout::Printout;
use super::tables::{Table, column, optional, orientation_words, plain_table};
use super::workspace::{Forecast, NoForecast};
use calibench::residuals::comparison::{Comparison, SIGNIFICANCE};
use calibench::residuals::views::{JointBin, ViewTest};
use calibench::units::{MM, UM, URAD};

/// Number of curves shown; the others are in the JSON document.
const MOST_CURVES: usize = 8;

/// A p-value in short form.
fn chance(p: f64) -> String {
    if p >= 0.9995 {
        "1".into()
    } else if p >= 1e-3 {
        format!("{p:.3}")
    } else if p >= 1e-15 {
        format!("{p:.0e}")
    } else {
        "0".into()
    }
}

/// Formats to three significant digits, with at most two decimals and none for whole numbers.
fn number(x: f64) -> String {
    if x.fract() == 0.0 && x.abs() < 1e6 {
        return format!("{x:.0}");
    }
    let before = if x == 0.0 || !x.is_finite() { 1 } else { x.abs().log10().floor() as i32 + 1 };
    format!("{x:.*}", (3 - before).clamp(0, 2) as usize)
}

/// `+12.3 ± 0.4`, three axes.
fn with_sigma(mean: &Vector3<f64>, sigma: &Vector3<f64>, unit: f64) -> [String; 3] {
    std::array::from_fn(|i| format!("{:+.1} ± {:.1}", mean[i] / unit, sigma[i] / unit))
}

/// Formats chi-square, degrees of freedom and p-value.
fn test(t: &ViewTest) -> [String; 3] {
    match t.dof {
        0 => ["-".into(), "0".into(), "-".into()],
        _ => [number(t.chi2), t.dof.to_string(), chance(t.p_family)],
    }
}

/// Replaces the cells by dashes if the fit absorbs the view: zeros would look like a result.
fn unless_absorbed(t: &ViewTest, cells: [String; 3]) -> [String; 3] {
    if t.dof == 0 { cells.map(|_| "-".to_owned()) } else { cells }
}

/// A curve as a row of bars, lowest bin to highest.
fn bars(bins: &[JointBin]) -> String {
    const BARS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
    let (low, high) = bins.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), b| (l.min(b.mean), h.max(b.mean)));
    let height = |b: &JointBin| if high > low { ((b.mean - low) / (high - low) * 7.0).round() as usize } else { 0 };
    bins.iter().map(|b| BARS[height(b).min(7)]).collect()
}

/// The subject of a comparison, and its residual.
#[must_use]
pub fn comparison_headline(c: &Comparison) -> String {
    format!(
        "{} against {} sample{}: {} {:.4} mm rms (3-D){}",
        c.robot,
        c.samples,
        if c.samples == 1 { "" } else { "s" },
        if c.fit_relation.fitted { RESIDUAL.name } else { NOT_FITTED.name },
        c.rms / MM,
        orientation_words(c.rms_orientation)
    )
}

/// The error expected over the workspace, or the reason why it cannot be predicted, and the findings; one line each.
#[must_use]
pub fn comparison_sentences(c: &Comparison, forecast: &Result<Forecast, NoForecast>) -> Vec<String> {
    let number_that_matters = forecast.as_ref().map_or_else(NoForecast::to_string, Forecast::sentence);
    std::iter::once(number_that_matters).chain(c.sentences()).map(|sentence| format!("* {sentence}")).collect()
}

/// The views of a comparison, each as a table.
#[must_use]
pub fn comparison_text(c: &Comparison, forecast: &Result<Forecast, NoForecast>) -> Printout {
    let mut out = Printout::from(
        "A mean is followed by what chance makes of it, one-sigma. dof counts the directions that the fit could not absorb (0: it absorbed all).\n\
         p is the chance that a right model shows as much in any row of the table, against the noise and against the other residual.\n",
    );
    if !c.balls.is_empty() {
        out.push(section("BY BALL (artifact): residual, ball minus TCP, world axes", balls(c)));
    }
    out.push(section("IN THE TOOL'S AXES (gauge): mean residual", tool(c)));
    out.push(section("IN THE WORLD (base): the motion of the base that would best remove the residuals", world(c)));
    out.push(section(
        "PROJECTED TO THE JOINTS (arm): apparent angle error, actual minus reported; is the curve flat?",
        curves(c),
    ));
    if !c.fit_relation.fitted {
        out.push(section("MEANS OF THE JOINTS (arm): apparent angle error, mean over all angles", offsets(c)));
    }
    out.push(section("WORST SAMPLES", worst(c)));
    if let Ok(forecast) = forecast {
        out.push(section(
            "OVER THE WORKSPACE: position error expected, mm, by distance from axis 1 and height over the base",
            forecast.map_table(),
        ));
    }
    out
}

/// A table or more under its heading.
fn section(heading: &str, view: impl Into<Printout>) -> Printout {
    Printout::from(format!("\n{heading}\n")) + view + "\n"
}

fn setup_name(c: &Comparison, k: usize) -> String {
    match c.setups.get(k) {
        Some(s) if s.session.is_empty() => s.dataset.clone(),
        Some(s) if c.several_datasets() => format!("{}, {}", s.dataset, s.session),
        Some(s) => s.session.clone(),
        None => String::new(),
    }
}

fn balls(c: &Comparison) -> Table {
    let header = [
        column("ball"),
        column("samples"),
        column("rms µm"),
        column("mean x µm"),
        column("mean y µm"),
        column("mean z µm"),
        optional(3, "chi2"),
        optional(3, "dof"),
        column("p"),
        optional(1, "a displacement by, µm, would leave it"),
    ];
    let rows: Vec<[String; 10]> = c
        .balls
        .iter()
        .map(|b| {
            let [x, y, z] = with_sigma(&b.mean, &b.sigma, UM);
            let [chi2, dof, p] = test(&b.test);
            let name = if c.several_datasets() { format!("{} of {}", b.ball, b.dataset) } else { b.ball.clone() };
            let moved = b
                .displacement
                .filter(|_| b.test.p_family < SIGNIFICANCE)
                .map_or_else(String::new, |[d, s]| with_sigma(&d, &s, UM).join("  "));
            [name, b.samples.to_string(), number(b.rms / UM), x, y, z, chi2, dof, p, moved]
        })
        .collect();
    plain_table(header, rows)
}

fn tool(c: &Comparison) -> Table {
    let header = [
        column("set-up"),
        column("samples"),
        column("rms mm"),
        column("axis 1 µm"),
        column("axis 2 µm"),
        column("axis 3 µm"),
        optional(3, "chi2"),
        optional(3, "dof"),
        column("p"),
    ];
    let mut rows: Vec<[String; 9]> = Vec::new();
    let mut row = |name: String, samples: usize, rms: f64, view: &calibench::residuals::views::ToolView| {
        let [x, y, z] = unless_absorbed(&view.test, with_sigma(&view.mean, &view.sigma, UM));
        let [chi2, dof, p] = test(&view.test);
        rows.push([name, samples.to_string(), format!("{:.4}", rms / MM), x, y, z, chi2, dof, p]);
    };
    c.setups.iter().enumerate().for_each(|(k, s)| row(setup_name(c, k), s.samples, s.rms, &s.tool));
    if c.setups.len() > 1 {
        row("all".into(), c.samples, c.rms, &c.tool);
    }
    plain_table(header, rows)
}

fn world(c: &Comparison) -> Table {
    let header = [
        column("set-up"),
        column("x µm"),
        column("y µm"),
        column("z µm"),
        column("about x µrad"),
        column("about y µrad"),
        column("about z µrad"),
        column("rms mm"),
        column("after mm"),
        optional(3, "chi2"),
        optional(3, "dof"),
        column("p"),
    ];
    let mut rows: Vec<[String; 12]> = Vec::new();
    let mut row = |name: String, rms: f64, view: &calibench::residuals::views::WorldView| {
        let [x, y, z] = unless_absorbed(&view.test, with_sigma(&view.translation, &view.translation_sigma, UM));
        let [rx, ry, rz] = unless_absorbed(&view.test, with_sigma(&view.rotation, &view.rotation_sigma, URAD));
        let [chi2, dof, p] = test(&view.test);
        let mm = |x: f64| format!("{:.4}", x / MM);
        rows.push([name, x, y, z, rx, ry, rz, mm(rms), mm(view.rms_after), chi2, dof, p]);
    };
    c.setups.iter().enumerate().for_each(|(k, s)| row(setup_name(c, k), s.rms, &s.world));
    if c.setups.len() > 1 {
        row("all".into(), c.rms, &c.world);
    }
    plain_table(header, rows)
}

fn curves(c: &Comparison) -> Printout {
    let header = [
        column("joint"),
        column("against"),
        optional(2, "from"),
        optional(2, "to"),
        optional(2, "unit"),
        column("curve"),
        column("swing µrad"),
        optional(1, "sigma µrad"),
        column("explains %"),
        optional(3, "chi2"),
        optional(3, "dof"),
        column("p"),
    ];
    let rows: Vec<[String; 12]> = c
        .joints
        .iter()
        .take(MOST_CURVES)
        .map(|j| {
            let [chi2, dof, p] = test(&j.test);
            let sigma = j.bins.iter().map(|b| b.sigma).fold(0.0, f64::max);
            let end = |x: Option<f64>| x.map_or_else(String::new, number);
            [
                j.joint.to_string(),
                j.against.name(),
                end(j.bins.first().map(|b| b.from)),
                end(j.bins.last().map(|b| b.to)),
                j.against.unit().0.into(),
                bars(&j.bins),
                number(j.swing() / URAD),
                number(sigma / URAD),
                format!("{:.1}", 100.0 * j.test.explains),
                chi2,
                dof,
                p,
            ]
        })
        .collect();
    let more = c.joints.len().saturating_sub(MOST_CURVES);
    let rest = if more > 0 { format!("\n{more} curves that explain less are in --json and --plots") } else { String::new() };
    Printout::from(plain_table(header, rows)) + rest
}

fn offsets(c: &Comparison) -> Table {
    let rows: Vec<[String; 5]> = c
        .offsets
        .iter()
        .map(|o| {
            let [chi2, dof, p] = test(&o.test);
            [o.joint.to_string(), format!("{:+.1} ± {:.1}", o.mean / URAD, o.sigma / URAD), chi2, dof, p]
        })
        .collect();
    plain_table([column("joint"), column("mean µrad"), optional(3, "chi2"), optional(3, "dof"), column("p")], rows)
}

fn worst(c: &Comparison) -> Table {
    let rows: Vec<[String; 8]> = c
        .worst
        .iter()
        .map(|w| {
            let [x, y, z] = std::array::from_fn(|i| format!("{:+.1}", w.residual[i] / UM));
            let name = if c.setups.len() > 1 { format!("{} of {}", w.id, setup_name(c, w.setup)) } else { w.id.clone() };
            let p = chance(w.test.p_family);
            [name, number(w.residual.norm() / UM), x, y, z, number(w.normalised), p, w.remarks.join("; ")]
        })
        .collect();
    let unit = if c.noise.level.is_some() && !c.lack_of_fit.noise_overstated { "times the noise" } else { "times the mean" };
    plain_table(
        [
            column("sample"),
            column("off µm"),
            optional(1, "x µm"),
            optional(1, "y µm"),
            optional(1, "z µm"),
            column(unit),
            column("p"),
            column("special"),
        ],
        rows,
    )
}
