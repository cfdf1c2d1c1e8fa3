//! The centring in three charts: the readings falling into their band, the path of the ball to the centre of the gauge, and how every
//! ball converged. Lengths are in decades, see [`crate::decades`].

use std::f64::consts::{FRAC_PI_2, TAU};

use calibench::units::UM;
use nalgebra::Vector3;
use rerun::{Boxes2D, LineStrips2D, Points2D, RecordingStream, Scalars, SeriesLines};

use crate::ViewError;
use crate::decades::{LINES, OUTERMOST, TOLERANCE, decades, signed};
use crate::journal::Journal;
use crate::paint::{self, faint, solid};
use crate::scene::entity;
use crate::subject::Subject;

/// Width of a chart over its height of two times five decades.
const WIDTH: f64 = 9.0;
/// Beyond the outermost line a free plunger reads 6 mm.
const EDGE: f64 = OUTERMOST + 0.5;
/// Width of a ball's panel, and the way to the next.
const PANEL: f64 = 5.0;
const NEXT_PANEL: f64 = 6.0;
/// Opacity of what happened at other times.
const OTHERS: u8 = 60;

/// What the viewer shows of the chart of readings: x, then y, which points down.
pub const READINGS: [[f64; 2]; 2] = [[-2.0, WIDTH + 0.5], [-EDGE - 0.8, EDGE + 1.0]];
/// Of the chart of paths.
pub const PATH: [[f64; 2]; 2] = [[-EDGE - 0.3, EDGE + 0.3], [-EDGE - 0.3, EDGE + 0.3]];

/// Of the chart of so many balls.
pub fn balls(count: usize) -> [[f64; 2]; 2] {
    [[-1.5, NEXT_PANEL * count as f64], [-EDGE - 1.0, 0.4]]
}

/// A point of a chart: the viewer's second axis points down.
fn at(x: f64, y: f64) -> [f32; 2] {
    [x as f32, -y as f32]
}

/// The centring as charts.
pub struct Charts<'a> {
    subject: &'a Subject,
    /// Readings on the ball of every try, m.
    tries: Vec<Vec<Vector3<f64>>>,
    /// Most of them.
    most: usize,
}

impl<'a> Charts<'a> {
    /// The charts of a campaign.
    pub fn new(subject: &'a Subject) -> Self {
        let journal = &subject.journal;
        let mut tries = vec![Vec::new(); journal.tries.len()];
        for stop in journal.stops.iter().filter(|s| s.on_ball) {
            tries[stop.probing].extend(stop.reading);
        }
        let most = tries.iter().map(Vec::len).max().unwrap_or(0).max(2);
        Charts { subject, tries, most }
    }

    fn x(&self, place: usize, width: f64) -> f64 {
        width * place as f64 / (self.most - 1) as f64
    }

    /// Draws what does not change: frames, bands, and every try faintly.
    pub fn frames(&self, rec: &RecordingStream) -> Result<(), ViewError> {
        self.reading_frame(rec)?;
        self.path_frame(rec)?;
        self.ball_frames(rec)?;
        for (k, colour) in paint::AXES.into_iter().enumerate() {
            let line = SeriesLines::new().with_colors([solid(colour)]).with_names([format!("axis {} um", k + 1)]);
            rec.log_static(series_path(k), &line)?;
        }
        for (name, level) in [("upper", 3.0), ("lower", -3.0)] {
            let path = format!("readings/band {name} um");
            rec.log_static(
                path.clone(),
                &SeriesLines::new().with_colors([solid(paint::NOW)]).with_names([format!("{level:+.0} um")]),
            )?;
            rec.log_static(path, &Scalars::single(level))?;
        }
        Ok(())
    }

    fn reading_frame(&self, rec: &RecordingStream) -> Result<(), ViewError> {
        let band = Boxes2D::from_centers_and_half_sizes([at(WIDTH / 2.0, 0.0)], [[WIDTH as f32 / 2.0, TOLERANCE as f32]]);
        rec.log_static("centring/readings/band 3 um", &band.with_colors([solid(paint::BAND)]).with_draw_order(-2.0))?;
        let levels: Vec<(f64, String)> =
            LINES.iter().flat_map(|&(y, name)| [(y, format!("+{name}")), (-y, format!("-{name}"))]).collect();
        let lines = levels.iter().map(|&(y, _)| [at(0.0, y), at(WIDTH, y)]);
        rec.log_static(
            "centring/readings/grid",
            &LineStrips2D::new(lines).with_colors([faint(paint::GRID, 120)]).with_draw_order(-1.0),
        )?;
        labels(rec, "centring/readings/scale", levels.iter().map(|(y, name)| (at(-0.9, *y), name.clone())))?;
        let counted = (0..self.most).map(|k| (at(self.x(k, WIDTH), -EDGE - 0.5), format!("{}", k + 1)));
        labels(rec, "centring/readings/number of the reading", counted)?;
        for axis in 0..3 {
            let strips = self.tries.iter().map(|t| self.reading_strip(t, axis));
            let strips = LineStrips2D::new(strips).with_colors([faint(paint::AXES[axis], OTHERS)]);
            rec.log_static(format!("centring/readings/all/axis {}", axis + 1), &strips)?;
        }
        Ok(())
    }

    fn reading_strip(&self, readings: &[Vector3<f64>], axis: usize) -> Vec<[f32; 2]> {
        readings.iter().enumerate().map(|(k, r)| at(self.x(k, WIDTH), signed(r[axis]))).collect()
    }

    fn path_frame(&self, rec: &RecordingStream) -> Result<(), ViewError> {
        let ring = |radius: f64| (0..=72).map(move |k| on_ring(radius, TAU * f64::from(k) / 72.0)).collect::<Vec<_>>();
        let rings = LINES.iter().map(|&(radius, _)| ring(radius));
        let colours = LINES.map(|(radius, _)| if radius == TOLERANCE { solid(paint::AFTER) } else { faint(paint::GRID, 160) });
        rec.log_static("centring/path/rings", &LineStrips2D::new(rings).with_colors(colours).with_draw_order(-1.0))?;
        labels(rec, "centring/path/scale", LINES.iter().map(|&(radius, name)| (on_ring(radius, -FRAC_PI_2), name.to_owned())))?;
        for axis in 0..3 {
            let spoke = LineStrips2D::new([[at(0.0, 0.0), on_ring(EDGE, spoke(axis))]]);
            rec.log_static(
                format!("centring/path/axis {}", axis + 1),
                &spoke.with_colors([solid(paint::AXES[axis])]).with_draw_order(-1.0),
            )?;
        }
        let strips = LineStrips2D::new(self.tries.iter().map(|t| path_strip(t)));
        rec.log_static("centring/path/all", &strips.with_colors([faint(paint::BALL, 25)]))?;
        Ok(())
    }

    fn ball_frames(&self, rec: &RecordingStream) -> Result<(), ViewError> {
        for (ball, known) in self.subject.dataset.balls.iter().enumerate() {
            let (path, left) = (format!("centring/balls/{}", entity(&known.id)), NEXT_PANEL * ball as f64);
            let band = Boxes2D::from_centers_and_half_sizes(
                [at(left + PANEL / 2.0, TOLERANCE / 2.0)],
                [[PANEL as f32 / 2.0, TOLERANCE as f32 / 2.0]],
            );
            rec.log_static(format!("{path}/band 3 um"), &band.with_colors([solid(paint::BAND)]).with_draw_order(-2.0))?;
            let lines = LINES.iter().map(|&(y, _)| [at(left, y), at(left + PANEL, y)]);
            rec.log_static(
                format!("{path}/grid"),
                &LineStrips2D::new(lines).with_colors([faint(paint::GRID, 120)]).with_draw_order(-1.0),
            )?;
            let mine = |k: &usize| self.subject.journal.tries[*k].ball == known.id;
            let of_it: Vec<usize> = (0..self.tries.len()).filter(mine).collect();
            let strips = LineStrips2D::new(of_it.iter().map(|&k| self.ball_strip(k, ball)));
            rec.log_static(format!("{path}/all"), &strips.with_colors([faint(paint::AFTER, OTHERS)]))?;
            let centred = of_it.iter().filter(|&&k| self.subject.journal.tries[k].outcome == "centred").count();
            let title = format!("ball {}: {centred} of {} centred", known.id, of_it.len());
            labels(rec, &format!("{path}/title"), [(at(left + PANEL / 2.0, EDGE + 0.4), title)])?;
        }
        labels(rec, "centring/balls/scale", LINES.iter().map(|&(y, name)| (at(-0.7, y), name.to_owned())))?;
        Ok(())
    }

    /// The largest of the three readings, which decides, of a try.
    fn ball_strip(&self, probing: usize, ball: usize) -> Vec<[f32; 2]> {
        let left = NEXT_PANEL * ball as f64;
        let readings = self.tries[probing].iter().enumerate();
        readings.map(|(k, r)| at(left + self.x(k, PANEL), decades(r.amax()))).collect()
    }

    /// Moves the charts to a stop: its try so far, bright.
    pub fn show(&self, rec: &RecordingStream, stop: usize) -> Result<(), ViewError> {
        let Journal { tries, stops } = &self.subject.journal;
        let now = &stops[stop];
        let first = stops[..=stop].iter().rposition(|s| s.probing != now.probing).map_or(0, |k| k + 1);
        let so_far: Vec<Vector3<f64>> = stops[first..=stop].iter().filter(|s| s.on_ball).filter_map(|s| s.reading).collect();
        for axis in 0..3 {
            let strip = self.reading_strip(&so_far, axis);
            let path = format!("centring/readings/now/axis {}", axis + 1);
            let colour = solid(paint::AXES[axis]);
            rec.log(
                format!("{path}/line"),
                &LineStrips2D::new([strip.clone()]).with_colors([colour]).with_radii([rerun::Radius::new_ui_points(2.0)]),
            )?;
            rec.log(
                format!("{path}/stops"),
                &Points2D::new(strip).with_colors([colour]).with_radii([rerun::Radius::new_ui_points(4.0)]),
            )?;
            if let Some(reading) = now.reading {
                rec.log(series_path(axis), &Scalars::single(reading[axis] / UM))?;
            }
        }
        let strip = path_strip(&so_far);
        rec.log(
            "centring/path/now/line",
            &LineStrips2D::new([strip.clone()])
                .with_colors([solid(paint::NOW)])
                .with_radii([rerun::Radius::new_ui_points(1.5)]),
        )?;
        rec.log(
            "centring/path/now/stops",
            &Points2D::new(strip).with_colors([solid(paint::NOW)]).with_radii([rerun::Radius::new_ui_points(4.0)]),
        )?;
        let ball = self.subject.dataset.balls.iter().position(|b| b.id == tries[now.probing].ball);
        let strip: Vec<_> =
            ball.map_or_else(Vec::new, |ball| self.ball_strip(now.probing, ball).into_iter().take(so_far.len()).collect());
        rec.log(
            "centring/balls/now/line",
            &LineStrips2D::new([strip.clone()])
                .with_colors([solid(paint::NOW)])
                .with_radii([rerun::Radius::new_ui_points(2.0)]),
        )?;
        rec.log(
            "centring/balls/now/stops",
            &Points2D::new(strip).with_colors([solid(paint::NOW)]).with_radii([rerun::Radius::new_ui_points(4.0)]),
        )?;
        Ok(())
    }
}

fn series_path(axis: usize) -> String {
    format!("readings/axis {} um", axis + 1)
}

/// Direction of a channel of the gauge, seen along its diagonal (1, 1, 1): three spokes a third of a turn apart.
fn spoke(axis: usize) -> f64 {
    FRAC_PI_2 + TAU * axis as f64 / 3.0
}

fn on_ring(radius: f64, angle: f64) -> [f32; 2] {
    at(radius * angle.cos(), radius * angle.sin())
}

/// The ball's way through the gauge, seen along the diagonal: direction as it is, distance in decades.
fn path_strip(readings: &[Vector3<f64>]) -> Vec<[f32; 2]> {
    let point = |r: &Vector3<f64>| {
        let (x, y) = (0..3).fold((0.0, 0.0), |(x, y), k| (x + r[k] * spoke(k).cos(), y + r[k] * spoke(k).sin()));
        on_ring(decades(r.norm()), y.atan2(x))
    };
    readings.iter().map(point).collect()
}

/// Words in a chart.
fn labels(rec: &RecordingStream, path: &str, words: impl IntoIterator<Item = ([f32; 2], String)>) -> Result<(), ViewError> {
    let (places, words): (Vec<[f32; 2]>, Vec<String>) = words.into_iter().unzip();
    let points = Points2D::new(places).with_labels(words).with_show_labels(true).with_radii([0.0]);
    rec.log_static(path, &points.with_colors([solid(paint::GRID)]))?;
    Ok(())
}
