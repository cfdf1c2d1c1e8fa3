//! What was measured while the arm moved: joints and instrument at the same moments, by the delay between them.
//!
//! The delay is found twice. First to milliseconds, as the one at which the measured point is a point of a tool on this arm; then,
//! with the rows imported, as an unknown of the arm's own calibration ([`Moving::refine`]): what a wrong delay does to a position is
//! the speed of the arm, which no error of its geometry resembles.

mod coarse;
mod delays;
mod local;

use calibench::measure::dataset::Dataset;
use calibench::robot::Robot;
use calibench::units::MM;

use self::coarse::coarse;
use self::delays::{Delays, Motion};
use self::local::local;
use crate::clocks::Clock;
use crate::error::LogError;
use crate::geometry::{Seen, features};
use crate::joints::{Joints, joints_of};
use crate::log::{JointTrack, Log, Track};
use crate::middle::{FEWEST_READINGS, Middle, unsteady};
use crate::poses::{Excluded, MeasuredPoses, reasons};
use crate::series::{Series, period as usual_period};
use crate::still_poses::{LogOptions, flange_at, measured};
use crate::table::{Arm, TableRow, fields};
use crate::windows::{Rest, intervals};

/// Time before and after a moment from which its parabola is taken, s.
const HALF: f64 = 0.04;
/// The same in periods of the joints, if these are stated more seldom.
const HALF_IN_PERIODS: f64 = 2.6;
/// Longest period of the joints, s: over a longer one an arm that starts or stops is elsewhere than between its readings.
const SLOWEST: f64 = 0.05;
/// Time before and after a moment from which the acceleration of the arm is taken, s: encoders have steps.
const WIDE: f64 = 0.1;
/// Largest acceleration of the flange, m/s²: a tenth of gravity, so that what loads the arm is its weight.
const FASTEST: f64 = 1.0;
/// Shortest time from one row to the next, s: what is nearer is the same measurement once more.
const APART: f64 = 0.1;
/// Most rows: more say little that is new, and cost time.
const MOST_ROWS: usize = 400;
/// Fewest rows from which an arm and a delay can be found.
const FEWEST_ROWS: usize = 40;
/// Half of the time over which a second difference of the flange's place is taken, s.
const DIFFERENCE: f64 = 0.02;
/// A joint that is slower moves too little to say from which side it comes, rad/s or m/s.
const STANDS: f64 = 3e-3;
/// A delay that changes by less is found, s.
const SETTLED: f64 = 1e-5;
/// Most steps to a delay: the third has changed nothing yet.
const MOST_STEPS: usize = 6;

/// A moment at which something was measured.
struct Pick {
    /// By the clock of the instrument, s.
    at: f64,
    middles: Vec<Option<Middle>>,
}

/// Measurements of an arm in motion.
pub struct Moving<'a> {
    robot: &'a Robot,
    joints: JointTrack,
    positions: Series,
    /// Names and titles of what was measured, in metres.
    tracks: Vec<Track>,
    picks: Vec<Pick>,
    half: f64,
    tolerance: Vec<f64>,
    noise: Option<f64>,
    excluded: Vec<Excluded>,
    said: Vec<String>,
    has_one_clock: bool,
    /// Time to be added to those of the instrument, as found first, s.
    shift: f64,
    delays: Delays,
    steps: usize,
}

impl<'a> Moving<'a> {
    /// Finds the moments at which an arm and an instrument can be compared.
    ///
    /// # Errors
    /// If joints or measurements are missing, ambiguous or too seldom, if their clocks cannot be matched, or if the arm moves so fast
    /// that too few moments are left.
    pub fn of(log: &'a Log, robot: &'a Robot, options: &LogOptions) -> Result<Self, LogError> {
        let refuse =
            |problem: String, remedy: &str| LogError::Content { files: log.files.clone(), problem, remedy: remedy.into() };
        let Joints { track: joints, said } = joints_of(log, robot, &options.joints)?;
        let mut said = vec![said];
        let tracks = measured(log, &joints, options)?;
        let clock = Clock::of(&joints.times, &tracks[0].times, joints.recording == tracks[0].recording);
        let positions = Series::sorted(clock.times(&joints.times), &joints.positions, joints.joints.len());
        let period = usual_period(&positions.times).unwrap_or(f64::INFINITY);
        if period > SLOWEST {
            let problem =
                format!("{} states the joints every {period:.2} s, too seldom to know where a moving arm is", joints.name);
            return Err(refuse(
                problem,
                "record them fifty times a second or more, or let the arm stand and leave --moving out",
            ));
        }
        let half = HALF.max(HALF_IN_PERIODS * period);
        let joints = JointTrack { positions: positions.values.clone(), ..joints };
        let rest = Rest { shortest: options.shortest, settling: options.settling };
        let tolerance = intervals(&positions.times, &joints, robot, rest).tolerance;
        let has_one_clock = clock != Clock::None;
        let (tracks, seen): (Vec<Track>, Vec<Series>) =
            tracks.into_iter().map(|track| in_metres(track, clock.times(&track.times))).unzip();
        let found = match options.shift {
            Some(shift) => Some(shift),
            None => coarse(robot, &positions, &seen[0], has_one_clock),
        };
        let name = tracks[0].name.clone();
        let shift = found.ok_or_else(|| {
            let problem = format!(
                "the clock of {name} cannot be matched with that of {}: at no shift, or at more than one, is it seen to be a point of the arm's tool",
                joints.name
            );
            refuse(problem, "check that it is this robot (--robot, --joints); state the time to be added to that of the instrument: --shift TIME, such as -0.12s")
        })?;
        let begin = positions.times.first().copied().unwrap_or(0.0);
        let mut excluded = Vec::new();
        let mut picks: Vec<Pick> = Vec::new();
        let times = &seen[0].times;
        let length = times.last().zip(times.first()).map_or(0.0, |(last, first)| last - first);
        let apart = APART.max(length / MOST_ROWS as f64);
        let is_dense =
            seen.iter().all(|series| usual_period(&series.times).is_some_and(|period| HALF_IN_PERIODS * period <= half));
        let mut next = f64::NEG_INFINITY;
        for &at in times {
            if at < next {
                continue;
            }
            next = at + apart;
            let middles: Vec<Option<Middle>> = seen.iter().map(|series| read(series, at, is_dense.then_some(half))).collect();
            let why = match arm_at(robot, &positions, at + shift, half) {
                None => Some("the joints are not stated"),
                Some(acceleration) if acceleration > FASTEST => Some("the arm accelerates by more than 1 m/s2"),
                Some(_) if middles.first().is_none_or(Option::is_none) => Some("a reading is missing"),
                Some(_) => None,
            };
            match why {
                None => picks.push(Pick { at, middles }),
                Some(why) => excluded.push(Excluded { from_s: at + shift - begin, to_s: at + shift - begin + apart, why }),
            }
        }
        let wrong = unsteady(picks.iter().map(|pick| pick.middles.as_slice()), &seen[0].ranges);
        let (jumping, kept): (Vec<_>, Vec<_>) = picks.into_iter().zip(wrong).partition(|(_, is_wrong)| *is_wrong);
        excluded.extend(jumping.iter().map(|(Pick { at, .. }, _)| {
            let from_s = at + shift - begin;
            Excluded { from_s, to_s: from_s + apart, why: "the measurement jumps" }
        }));
        excluded.sort_by(|a, b| a.from_s.total_cmp(&b.from_s));
        let picks: Vec<Pick> = kept.into_iter().map(|(pick, _)| pick).collect();
        let not = reasons(&excluded);
        if picks.len() < FEWEST_ROWS {
            let problem =
                format!("only {} moments of {length:.0} s can be used, and {FEWEST_ROWS} are needed{not}", picks.len());
            return Err(refuse(
                problem,
                "move the arm for a minute, slowly and all over its work, or let it stand at each pose",
            ));
        }
        said.push(format!(
            "moving: {} moments of {length:.0} s, {apart:.2} s apart, with a measurement by {name}{not}",
            picks.len()
        ));
        let delays = Delays::none(joints.joints.len());
        let noise = options.noise;
        Ok(Moving {
            robot,
            joints,
            positions,
            tracks,
            picks,
            half,
            tolerance,
            noise,
            excluded,
            said,
            has_one_clock,
            shift,
            delays,
            steps: 0,
        })
    }

    /// The joints at a moment, as far as their delay is known now: where they are, and how fast.
    fn motion(&self, pick: &Pick) -> Motion {
        let mut motion = Motion::default();
        for (j, delay) in self.delays.seconds.iter().enumerate() {
            let at = pick.at + self.shift + delay;
            // A delay that grew past a pause leaves the joint where it was.
            let near =
                local(&self.positions, at, self.half).or_else(|| local(&self.positions, pick.at + self.shift, self.half));
            let of = |values: fn(&local::Local) -> &Vec<f64>| near.as_ref().map_or(0.0, |near| values(near)[j]);
            motion.posture.push(of(|near| &near.values));
            motion.speeds.push(of(|near| &near.speeds));
            motion.accelerations.push(of(|near| &near.accelerations));
        }
        motion
    }

    /// Joints and measurements as rows, by the delays that are known now.
    pub fn poses(&self) -> MeasuredPoses {
        let motions: Vec<Motion> = self.picks.iter().map(|pick| self.motion(pick)).collect();
        let sharp: Vec<Vec<Option<Middle>>> = self.sharpened(&motions);
        let scatter = self.scatter(&motions);
        let tracks: Vec<&Track> = self.tracks.iter().collect();
        let arm = Arm { robot: self.robot, joints: &self.joints, times: &self.positions.times, tolerance: &self.tolerance };
        let begin = self.positions.times.first().copied().unwrap_or(0.0);
        let row = |(k, motion): (usize, &Motion)| {
            let at = self.picks[k].at + self.shift;
            let before = self.positions.times.partition_point(|&t| t < at);
            let approach = |(j, &q): (usize, &f64)| match motion.speeds[j] {
                speed if speed.abs() > STANDS => speed.signum() as i8,
                _ => arm.approach(before, j, q),
            };
            let approach = motion.posture.iter().enumerate().map(approach).collect();
            let of_mean = Some(scatter.of_mean(self.flange_speed(motion)));
            TableRow { posture: motion.posture.clone(), time: at - begin, approach, middles: &sharp[k], of_mean }
        };
        let rows: Vec<TableRow<'_>> = motions.iter().enumerate().map(row).collect();
        let mut said = self.said.clone();
        said.extend(self.delays.in_words(&self.tracks[0].name, &self.joints.joints, self.has_one_clock, self.shift));
        MeasuredPoses {
            fields: fields(&arm, &tracks, &rows, self.noise),
            measured: self.tracks.iter().map(|track| track.name.clone()).collect(),
            rows: rows.len(),
            excluded: self.excluded.clone(),
            said,
            shift_s: self.shift + self.delays.common,
        }
    }

    /// Speed of the nominal flange, m/s.
    fn flange_speed(&self, motion: &Motion) -> f64 {
        let [before, after] = [-DIFFERENCE, DIFFERENCE].map(|t| flange_at(self.robot, &motion.after(t)));
        (0..3).map(|c| (after[c] - before[c]).powi(2)).sum::<f64>().sqrt() / (2.0 * DIFFERENCE)
    }

    /// How readings scatter: by themselves, and the more the faster the arm, as stamps are uncertain.
    fn scatter(&self, motions: &[Motion]) -> Scatter {
        let near = |(pick, motion): (&Pick, &Motion)| {
            let middle = pick.middles.first()?.as_ref().filter(|m| m.readings >= FEWEST_READINGS && m.scatter.len() >= 3)?;
            let square = middle.scatter[..3].iter().map(|s| s * s).sum::<f64>() / 3.0;
            Some([self.flange_speed(motion).powi(2), square, middle.readings as f64])
        };
        let known: Vec<[f64; 3]> = self.picks.iter().zip(motions).filter_map(near).collect();
        let count = known.len().max(1) as f64;
        let mean = |c: usize| known.iter().map(|k| k[c]).sum::<f64>() / count;
        let [speed, square, readings] = [mean(0), mean(1), mean(2)];
        let together: f64 = known.iter().map(|k| (k[0] - speed) * (k[1] - square)).sum();
        let spread: f64 = known.iter().map(|k| (k[0] - speed).powi(2)).sum();
        let slope = if spread > 0.0 { (together / spread).clamp(0.0, square / speed) } else { 0.0 };
        // The stamps of the joints are as uncertain as the joints scatter about their own way.
        let stamp = |pick: &Pick| {
            let near = local(&self.positions, pick.at + self.shift, self.half)?;
            let fastest = (0..near.speeds.len()).max_by(|&a, &b| near.speeds[a].abs().total_cmp(&near.speeds[b].abs()))?;
            let speed = near.speeds[fastest].abs();
            (speed > STANDS).then(|| (near.scatter[fastest] / speed).powi(2) / near.readings as f64)
        };
        let mut stamps: Vec<f64> = self.picks.iter().filter_map(stamp).collect();
        stamps.sort_unstable_by(f64::total_cmp);
        let of_joints = stamps.get(stamps.len() / 2).copied().unwrap_or(0.0) / 3.0;
        let readings = readings.max(1.0);
        Scatter { still: (square - slope * speed).max(0.0) / readings, moving: slope / readings + of_joints }
    }

    /// What was measured, less what the instrument's own smoothing makes of curves.
    fn sharpened(&self, motions: &[Motion]) -> Vec<Vec<Option<Middle>>> {
        let as_read = || self.picks.iter().map(|pick| pick.middles.clone()).collect();
        let half_variance = 0.5 * self.delays.smoothing.powi(2);
        if half_variance == 0.0 {
            return as_read();
        }
        let moved = |sign: f64| -> Vec<Vec<f64>> { motions.iter().map(|m| m.after(sign * DIFFERENCE)).collect() };
        let at = |postures: &[Vec<f64>]| features(self.robot, postures, Seen::Tool);
        let [before, now, after] = [moved(-1.0), moved(0.0), moved(1.0)].map(|postures| at(&postures));
        let second = (&before + &after - &now * 2.0) / (DIFFERENCE * DIFFERENCE);
        let svd = now.clone().svd(true, true);
        let mut sharp: Vec<Vec<Option<Middle>>> = as_read();
        for n in 0..self.tracks.len() {
            for c in 0..3.min(self.tracks[n].titles.len()) {
                let known: Vec<(usize, f64)> = self
                    .picks
                    .iter()
                    .enumerate()
                    .filter_map(|(k, pick)| Some((k, pick.middles[n].as_ref()?.values[c])))
                    .collect();
                if known.len() < self.picks.len() {
                    continue;
                }
                let column = nalgebra::DVector::from_iterator(known.len(), known.iter().map(|(_, value)| *value));
                let Ok(weights) = svd.solve(&column, 1e-9 * svd.singular_values.max()) else { continue };
                let accelerations = &second * weights;
                for (k, row) in sharp.iter_mut().enumerate() {
                    if let Some(middle) = &mut row[n] {
                        middle.values[c] -= half_variance * accelerations[k];
                    }
                }
            }
        }
        sharp
    }

    /// Standard uncertainty of the time that is added to those of the instrument, s.
    pub fn shift_sigma(&self) -> f64 {
        self.delays.sigma
    }

    /// One step to the delays at which a calibration of these rows leaves least; true if there is none to take any more.
    pub fn refine(&mut self, dataset: &Dataset) -> bool {
        let motions: Vec<Motion> = self.picks.iter().map(|pick| self.motion(pick)).collect();
        if dataset.samples.len() != motions.len() || self.steps >= MOST_STEPS {
            return true;
        }
        self.steps += 1;
        let Some(step) = delays::step(dataset, &motions, &self.delays) else { return true };
        let change = step.farthest(&self.delays);
        self.delays = step;
        change < SETTLED
    }
}

/// Variance of the mean of the readings of a moment, for each axis, m².
struct Scatter {
    still: f64,
    /// For each (m/s)² of the arm's speed.
    moving: f64,
}

impl Scatter {
    /// One-sigma of the mean, m.
    fn of_mean(&self, speed: f64) -> f64 {
        (self.still + self.moving * speed * speed).sqrt()
    }
}

/// A track without its rows, and these in metres where its titles say in which unit they are.
fn in_metres(track: &Track, times: &[f64]) -> (Track, Series) {
    let in_mm = |title: &String| title.strip_suffix("_mm").map(|axis| format!("{axis}_m"));
    let mut series = Series::turning(times, track);
    for (c, _) in track.titles.iter().enumerate().filter(|(_, title)| in_mm(title).is_some()) {
        series.values.iter_mut().skip(c).step_by(track.titles.len()).for_each(|v| *v *= MM);
        series.ranges[c] *= MM;
    }
    let titles = track.titles.iter().map(|title| in_mm(title).unwrap_or_else(|| title.clone())).collect();
    (Track { name: track.name.clone(), titles, ..Track::default() }, series)
}

/// What a track states at a moment: by the readings near it, or by the one reading of an instrument that reads seldom.
fn read(series: &Series, at: f64, half: Option<f64>) -> Option<Middle> {
    let Some(half) = half else {
        let width = series.ranges.len();
        let k = series.times.iter().position(|&t| t == at)?;
        let values = series.values[k * width..(k + 1) * width].to_vec();
        return values.iter().all(|v| v.is_finite()).then(|| Middle { scatter: vec![0.0; width], values, readings: 1 });
    };
    let near = local(series, at, half)?;
    Some(Middle { values: near.values, scatter: near.scatter, readings: near.readings })
}

/// The acceleration of the nominal flange, m/s²; `None` if the joints are not known then.
fn arm_at(robot: &Robot, positions: &Series, at: f64, half: f64) -> Option<f64> {
    local(positions, at, half)?;
    let near = local(positions, at, WIDE.max(half))?;
    let motion = Motion { posture: near.values, speeds: near.speeds, accelerations: near.accelerations };
    let [before, now, after] = [-DIFFERENCE, 0.0, DIFFERENCE].map(|t| flange_at(robot, &motion.after(t)));
    let second = |c: usize| (before[c] + after[c] - 2.0 * now[c]) / (DIFFERENCE * DIFFERENCE);
    Some((0..3).map(|c| second(c).powi(2)).sum::<f64>().sqrt())
}
