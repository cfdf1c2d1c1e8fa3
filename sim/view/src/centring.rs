//! The centring in three charts: the readings converging to their band, the path of the ball to the centre of the gauge, and
//! the convergence of every ball. Lengths are in decades, see [`crate::decades`].

use std::f64::consts::{FRAC_PI_2, TAU};

use calibench::units::UM;
use nalgebra::Vector3;
use rerun::{RecordingStream, Scalars, SeriesLines};

use crate::ViewError;
use crate::chart::{Point, at, axis, band, disc, labels, now, others, scale};
use crate::decades::{LINES, OUTERMOST, TOLERANCE, decades, signed};
use crate::journal::Journal;
use crate::paint::{self, solid};
use crate::scene::entity;
use crate::subject::Subject;

/// Width of the chart of readings, in the unit of its height, decades.
const WIDTH: f64 = 9.0;
/// Edge beyond the outermost line: a free plunger reads 6 mm.
const EDGE: f64 = OUTERMOST + 0.4;
/// Width of a ball's panel, in the unit of the charts.
const PANEL: f64 = 5.5;
/// Distance from one panel to the next, in the unit of the charts: a gap of one unit.
const NEXT_PANEL: f64 = 6.5;

/// Visible range of the chart of readings: x, then y, which points down.
pub const READINGS: [[f64; 2]; 2] = [[-2.2, WIDTH + 0.5], [-EDGE - 0.6, EDGE + 1.4]];
/// Visible range of the chart of paths.
pub const PATH: [[f64; 2]; 2] = [[-EDGE - 0.3, EDGE + 0.3], [-EDGE - 0.3, EDGE + 0.3]];

/// Visible range of the chart of this number of balls.
pub fn balls(count: usize) -> [[f64; 2]; 2] {
    [[-2.2, NEXT_PANEL * count as f64 - 0.5], [-EDGE - 1.3, 0.5]]
}

/// The centring as charts.
pub struct Charts<'a> {
    subject: &'a Subject,
    /// Readings on the ball, for every attempt, m.
    tries: Vec<Vec<Vector3<f64>>>,
    /// Largest number of readings of an attempt.
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

    /// Draws the static parts: scales, bands, and all attempts.
    pub fn frames(&self, rec: &RecordingStream) -> Result<(), ViewError> {
        self.reading_frame(rec)?;
        path_frame(rec)?;
        self.ball_frames(rec)?;
        let axes = paint::AXES.into_iter().enumerate().map(|(k, colour)| (series(k), colour, format!("axis {} µm", k + 1)));
        let limits = LIMITS_UM.map(|limit| (limit_series(limit), paint::NOW, format!("{limit:+} µm")));
        for (path, colour, name) in axes.chain(limits) {
            rec.log_static(path, &SeriesLines::new().with_colors([solid(colour)]).with_names([name]))?;
        }
        Ok(())
    }

    fn reading_frame(&self, rec: &RecordingStream) -> Result<(), ViewError> {
        band(rec, "centring/readings/band 3 um", [0.0, WIDTH], 0.0, TOLERANCE)?;
        let levels = || LINES.iter().flat_map(|&(y, name)| [(y, format!("+{name}")), (-y, format!("-{name}"))]);
        scale(rec, "centring/readings/grid", levels().map(|(y, _)| vec![at(0.0, y), at(WIDTH, y)]))?;
        labels(rec, "centring/readings/scale", levels().map(|(y, name)| (at(-1.1, y + 0.45), name)))?;
        let counted = (0..self.most).map(|k| (at(self.x(k, WIDTH), -EDGE), format!("{}", k + 1)));
        labels(rec, "centring/readings/number", counted)?;
        for (k, colour) in paint::AXES.into_iter().enumerate() {
            let strips = self.tries.iter().map(|readings| self.reading_strip(readings, k));
            others(rec, &format!("centring/readings/all/axis {}", k + 1), strips, colour)?;
        }
        Ok(())
    }

    fn ball_frames(&self, rec: &RecordingStream) -> Result<(), ViewError> {
        for (ball, known) in self.subject.dataset.balls.iter().enumerate() {
            let (path, left) = (format!("centring/balls/{}", entity(&known.id)), NEXT_PANEL * ball as f64);
            let middle = TOLERANCE / 2.0;
            band(rec, &format!("{path}/band 3 um"), [left, left + PANEL], middle, middle)?;
            scale(rec, &format!("{path}/grid"), LINES.iter().map(|&(y, _)| vec![at(left, y), at(left + PANEL, y)]))?;
            let tries = &self.subject.journal.tries;
            let of_it: Vec<usize> = (0..tries.len()).filter(|&k| tries[k].ball == known.id).collect();
            others(rec, &format!("{path}/all"), of_it.iter().map(|&k| self.ball_strip(&self.tries[k], ball)), paint::AFTER)?;
            let centred = of_it.iter().filter(|&&k| tries[k].outcome == "centred").count();
            let title = format!("ball {}: {centred} of {} centred", known.id, of_it.len());
            labels(rec, &format!("{path}/title"), [(at(left + PANEL / 2.0, EDGE + 0.8), title)])?;
        }
        labels(rec, "centring/balls/scale", LINES.iter().map(|&(y, name)| (at(-1.1, y + 0.4), name.to_owned())))
    }

    /// Moves the charts to a stop: its attempt so far is highlighted.
    pub fn show(&self, rec: &RecordingStream, stop: usize) -> Result<(), ViewError> {
        let Journal { tries, stops, .. } = &self.subject.journal;
        let here = &stops[stop];
        let first = stops[..=stop].iter().rposition(|s| s.probing != here.probing).map_or(0, |k| k + 1);
        let so_far: Vec<Vector3<f64>> = stops[first..=stop].iter().filter(|s| s.on_ball).filter_map(|s| s.reading).collect();
        for (k, colour) in paint::AXES.into_iter().enumerate() {
            now(rec, &format!("centring/readings/now/axis {}", k + 1), self.reading_strip(&so_far, k), colour)?;
            if let Some(reading) = here.reading {
                rec.log(series(k), &Scalars::single(reading[k] / UM))?;
            }
        }
        if let Some(clearance) = tries[here.probing].clearance_mm {
            rec.log(CLEARANCE, &Scalars::single(clearance))?;
        }
        for limit in LIMITS_UM {
            rec.log(limit_series(limit), &Scalars::single(f64::from(limit)))?;
        }
        now(rec, "centring/path/now", path_strip(&so_far), paint::NOW)?;
        let ball = self.subject.dataset.balls.iter().position(|b| b.id == tries[here.probing].ball);
        let strip = ball.map_or_else(Vec::new, |ball| self.ball_strip(&so_far, ball));
        now(rec, "centring/balls/now", strip, paint::NOW)
    }

    fn x(&self, place: usize, width: f64) -> f64 {
        width * place as f64 / (self.most - 1) as f64
    }

    fn reading_strip(&self, readings: &[Vector3<f64>], axis: usize) -> Vec<Point> {
        readings.iter().enumerate().map(|(k, r)| at(self.x(k, WIDTH), signed(r[axis]))).collect()
    }

    /// The largest of the three readings, which decides on convergence.
    fn ball_strip(&self, readings: &[Vector3<f64>], ball: usize) -> Vec<Point> {
        let left = NEXT_PANEL * ball as f64;
        readings.iter().enumerate().map(|(k, r)| at(left + self.x(k, PANEL), decades(r.amax()))).collect()
    }
}

/// The band in which a ball counts as centred, um.
const LIMITS_UM: [i8; 2] = [3, -3];

/// Entity of the least clearance on the path to the displayed pose.
const CLEARANCE: &str = "clearance/mm";

fn series(axis: usize) -> String {
    format!("readings/axis {} um", axis + 1)
}

fn limit_series(limit: i8) -> String {
    format!("readings/band {limit:+} um")
}

fn path_frame(rec: &RecordingStream) -> Result<(), ViewError> {
    let ring = |radius: f64| (0..=72).map(|k| on_ring(radius, TAU * f64::from(k) / 72.0)).collect::<Vec<_>>();
    disc(rec, "centring/path/band 3 um", TOLERANCE)?;
    scale(rec, "centring/path/rings", LINES.iter().map(|&(radius, _)| ring(radius)))?;
    labels(
        rec,
        "centring/path/scale",
        LINES.iter().map(|&(radius, name)| (on_ring(radius, -FRAC_PI_2 * 0.8), name.to_owned())),
    )?;
    for (k, colour) in paint::AXES.into_iter().enumerate() {
        axis(rec, &format!("centring/path/axis {}", k + 1), vec![at(0.0, 0.0), on_ring(EDGE, spoke(k))], colour)?;
    }
    Ok(())
}

/// Direction of a channel of the gauge, seen along its diagonal (1, 1, 1): three spokes 120 degrees apart.
fn spoke(axis: usize) -> f64 {
    FRAC_PI_2 + TAU * axis as f64 / 3.0
}

fn on_ring(radius: f64, angle: f64) -> Point {
    at(radius * angle.cos(), radius * angle.sin())
}

/// The ball's path through the gauge, seen along the diagonal: direction as it is, distance in decades.
fn path_strip(readings: &[Vector3<f64>]) -> Vec<Point> {
    let point = |r: &Vector3<f64>| {
        let (x, y) = (0..3).fold((0.0, 0.0), |(x, y), k| (x + r[k] * spoke(k).cos(), y + r[k] * spoke(k).sin()));
        on_ring(decades(r.norm()), y.atan2(x))
    };
    readings.iter().map(point).collect()
}
