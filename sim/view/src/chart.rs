//! Elements of the charts: background lines, the current line, bands, labels.

use rerun::{LineStrips2D, Points2D, Radius, RecordingStream};

use crate::ViewError;
use crate::paint::{self, dim, solid};

/// Half the width of background lines, points of the screen.
const FINE: f32 = 0.5;
/// Half the width of current lines, points of the screen.
const BOLD: f32 = 1.75;
/// Radius of the stops of current lines, points of the screen.
const DOT: f32 = 4.0;

/// Brightness of scales, 0 to 1.
const SCALE: f32 = 0.35;
/// Brightness of data of other times, 0 to 1.
const OTHERS: f32 = 0.45;

/// Drawing order of the tolerance band, dimensionless: higher values are in front.
const BAND: f32 = -3.0;
/// Drawing order of grid lines.
const GRID: f32 = -2.0;
/// Drawing order of data of other times.
const BACK: f32 = -1.0;
/// Drawing order of current data.
const FRONT: f32 = 1.0;

/// A point of a chart; the viewer's second axis points down.
pub type Point = [f32; 2];

/// The point at `x` to the right and `y` up.
pub fn at(x: f64, y: f64) -> Point {
    [x as f32, -y as f32]
}

/// Lines of a scale.
pub fn scale(rec: &RecordingStream, path: &str, strips: impl IntoIterator<Item = Vec<Point>>) -> Result<(), ViewError> {
    lines(rec, path, strips, dim(paint::GRID, SCALE), GRID)
}

/// Draws data of other times.
pub fn others(
    rec: &RecordingStream,
    path: &str,
    strips: impl IntoIterator<Item = Vec<Point>>,
    colour: [u8; 3],
) -> Result<(), ViewError> {
    lines(rec, path, strips, dim(colour, OTHERS), BACK)
}

/// An axis of a scale, in its colour.
pub fn axis(rec: &RecordingStream, path: &str, strip: Vec<Point>, colour: [u8; 3]) -> Result<(), ViewError> {
    lines(rec, path, [strip], solid(colour), GRID)
}

fn lines(
    rec: &RecordingStream,
    path: &str,
    strips: impl IntoIterator<Item = Vec<Point>>,
    colour: rerun::Color,
    order: f32,
) -> Result<(), ViewError> {
    let strips = LineStrips2D::new(strips).with_radii([Radius::new_ui_points(FINE)]);
    rec.log_static(path, &strips.with_colors([colour]).with_draw_order(order))?;
    Ok(())
}

/// The band in which a ball counts as centred, from one place to another at the height `y`, extending by `half` up and down.
pub fn band(rec: &RecordingStream, path: &str, [from, to]: [f64; 2], y: f64, half: f64) -> Result<(), ViewError> {
    // A thick line: boxes of the viewer cannot be filled. Its ends are round and extend by half its width.
    let band = LineStrips2D::new([[at(from + half, y), at(to - half, y)]]).with_radii([Radius::new_scene_units(half as f32)]);
    rec.log_static(path, &band.with_colors([solid(paint::BAND)]).with_draw_order(BAND))?;
    Ok(())
}

/// The band in which a ball counts as centred, as a disc about the origin.
pub fn disc(rec: &RecordingStream, path: &str, radius: f64) -> Result<(), ViewError> {
    let disc = Points2D::new([at(0.0, 0.0)]).with_radii([Radius::new_scene_units(radius as f32)]);
    rec.log_static(path, &disc.with_colors([solid(paint::BAND)]).with_draw_order(BAND))?;
    Ok(())
}

/// Labels.
pub fn labels(rec: &RecordingStream, path: &str, words: impl IntoIterator<Item = (Point, String)>) -> Result<(), ViewError> {
    let (places, words): (Vec<Point>, Vec<String>) = words.into_iter().unzip();
    let points = Points2D::new(places).with_labels(words).with_show_labels(true).with_radii([Radius::new_ui_points(0.0)]);
    rec.log_static(path, &points.with_colors([solid(paint::GRID)]).with_draw_order(GRID))?;
    Ok(())
}

/// The current line, with its stops.
pub fn now(rec: &RecordingStream, path: &str, strip: Vec<Point>, colour: [u8; 3]) -> Result<(), ViewError> {
    let stops = Points2D::new(strip.clone()).with_radii([Radius::new_ui_points(DOT)]);
    rec.log(format!("{path}/stops"), &stops.with_colors([solid(colour)]).with_draw_order(FRONT))?;
    let line = LineStrips2D::new([strip]).with_radii([Radius::new_ui_points(BOLD)]);
    rec.log(format!("{path}/line"), &line.with_colors([solid(colour)]).with_draw_order(FRONT))?;
    Ok(())
}
