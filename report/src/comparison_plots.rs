//! A comparison as tables for plotting: one tidy CSV file per view, with units in the column names.

use std::path::Path;

use nalgebra::Vector3;

use super::workspace::Forecast;
use calibench::files::FileError;
use calibench::files::disk::replace_folder;
use calibench::files::disk::write_whole;
use calibench::residuals::comparison::Comparison;
use calibench::units::{MM, UM, URAD};

/// The file that marks a folder of such tables.
pub const PLOTS_MARK: &str = "residuals.csv";

/// The files of such a folder; the first marks it.
const FILES: &[&str] = &[PLOTS_MARK, "balls.csv", "setups.csv", "joints.csv", "worst.csv", "workspace.csv"];

/// Writes the views into a folder, all or none; other files in it are kept.
///
/// # Errors
/// If the folder holds something else or cannot be written.
pub fn write_comparison_plots(c: &Comparison, forecast: Option<&Forecast>, folder: &Path) -> Result<(), FileError> {
    replace_folder(folder, "comparison", FILES, |inside| {
        let contents = [residuals(c), balls(c), setups(c), joints(c), worst(c), workspace(forecast)];
        FILES.iter().zip(contents).try_for_each(|(name, rows)| {
            let path = inside.join(name);
            let whole = text(&rows).map_err(|e| {
                FileError::whole(&path, format!("cannot be written: {e}"), "check the folder, its permissions and free space")
            })?;
            write_whole(&path, &whole)
        })
    })
}

fn text(rows: &[Vec<String>]) -> Result<Vec<u8>, std::io::Error> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    rows.iter().try_for_each(|row| writer.write_record(row))?;
    writer.into_inner().map_err(csv::IntoInnerError::into_error)
}

fn header(names: &[&str]) -> Vec<String> {
    names.iter().map(|n| (*n).to_owned()).collect()
}

fn vector(v: &Vector3<f64>, unit: f64) -> [String; 3] {
    std::array::from_fn(|i| (v[i] / unit).to_string())
}

fn residuals(c: &Comparison) -> Vec<Vec<String>> {
    let mut rows =
        vec![header(&["id", "dataset", "session", "x_um", "y_um", "z_um", "tool1_um", "tool2_um", "tool3_um", "normalised"])];
    rows.extend(c.residuals.iter().map(|r| {
        let at = &c.setups[r.setup];
        let mut row = vec![r.id.clone(), at.dataset.clone(), at.session.clone()];
        row.extend(vector(&r.world, UM));
        row.extend(vector(&r.tool, UM));
        row.push(r.normalised.to_string());
        row
    }));
    rows
}

fn balls(c: &Comparison) -> Vec<Vec<String>> {
    let mut rows = vec![header(&[
        "dataset",
        "ball",
        "samples",
        "rms_um",
        "x_um",
        "y_um",
        "z_um",
        "sigma_x_um",
        "sigma_y_um",
        "sigma_z_um",
        "chi2",
        "dof",
        "p_family",
    ])];
    rows.extend(c.balls.iter().map(|b| {
        let mut row = vec![b.dataset.clone(), b.ball.clone(), b.samples.to_string(), (b.rms / UM).to_string()];
        row.extend(vector(&b.mean, UM));
        row.extend(vector(&b.sigma, UM));
        row.extend([b.test.chi2.to_string(), b.test.dof.to_string(), b.test.p_family.to_string()]);
        row
    }));
    rows
}

/// Tool and world: one row per estimated number of each set-up.
fn setups(c: &Comparison) -> Vec<Vec<String>> {
    let mut rows = vec![header(&["dataset", "session", "view", "quantity", "unit", "value", "sigma"])];
    for s in &c.setups {
        let mut add = |view: &str, quantity: &str, unit: (&str, f64), value: &Vector3<f64>, sigma: &Vector3<f64>| {
            for ((axis, v), s_) in ["1", "2", "3"].iter().zip(vector(value, unit.1)).zip(vector(sigma, unit.1)) {
                let name = format!("{quantity}{axis}");
                rows.push(vec![s.dataset.clone(), s.session.clone(), view.into(), name, unit.0.into(), v, s_]);
            }
        };
        add("tool", "mean", ("um", UM), &s.tool.mean, &s.tool.sigma);
        add("world", "mean", ("um", UM), &s.world.mean, &s.world.sigma);
        add("world", "translation", ("um", UM), &s.world.translation, &s.world.translation_sigma);
        add("world", "rotation", ("urad", URAD), &s.world.rotation, &s.world.rotation_sigma);
    }
    rows
}

fn joints(c: &Comparison) -> Vec<Vec<String>> {
    let mut rows = vec![header(&[
        "joint",
        "against",
        "unit",
        "x",
        "from",
        "to",
        "mean_urad",
        "sigma_urad",
        "samples",
        "explains",
        "p_family",
    ])];
    for j in &c.joints {
        rows.extend(j.bins.iter().map(|b| {
            let numbers = [b.x, b.from, b.to, b.mean / URAD, b.sigma / URAD].map(|x| x.to_string());
            let mut row = vec![j.joint.to_string(), j.against.name(), j.against.unit().0.into()];
            row.extend(numbers);
            row.extend([b.samples.to_string(), j.test.explains.to_string(), j.test.p_family.to_string()]);
            row
        }));
    }
    rows
}

fn worst(c: &Comparison) -> Vec<Vec<String>> {
    let mut rows = vec![header(&["id", "dataset", "session", "x_um", "y_um", "z_um", "normalised", "p_family", "special"])];
    rows.extend(c.worst.iter().map(|w| {
        let at = &c.setups[w.setup];
        let mut row = vec![w.id.clone(), at.dataset.clone(), at.session.clone()];
        row.extend(vector(&w.residual, UM));
        row.extend([w.normalised.to_string(), w.test.p_family.to_string(), w.remarks.join("; ")]);
        row
    }));
    rows
}

/// The predicted error by radius and height: one row per cell; none if it could not be predicted.
fn workspace(forecast: Option<&Forecast>) -> Vec<Vec<String>> {
    let mut rows = vec![header(&["radius_from_mm", "radius_to_mm", "height_from_mm", "height_to_mm", "mean_mm", "poses"])];
    let Some(map) = forecast.map(|o| o.error.map()) else { return rows };
    for (cells, height) in map.cells.iter().zip(map.height.windows(2)) {
        for (cell, radius) in cells.iter().zip(map.radius.windows(2)) {
            if let Some(cell) = cell {
                let numbers = [radius[0], radius[1], height[0], height[1], cell.error].map(|x| (x / MM).to_string());
                rows.push(numbers.into_iter().chain([cell.poses.to_string()]).collect());
            }
        }
    }
    rows
}
