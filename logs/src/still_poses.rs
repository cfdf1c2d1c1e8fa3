//! The table of a log: one row for each interval in which the arm stood still and something was measured.

use calibench::robot::kinematics::world_from_tool;
use calibench::robot::{FramePose, Robot};

use crate::clocks::{Clock, DELAY, RIVAL, delay, shifts, shows_motion};
use crate::error::LogError;
use crate::geometry::{AtRests, Seen, misfit, together};
use crate::joints::{JointChoice, Joints, joints_of, named};
use crate::log::{JointTrack, Log, Track};
use crate::middle::{Middle, Row, middle, unsteady};
use crate::poses::{Excluded, MeasuredPoses, reasons};
use crate::series::Series;
use crate::table::{Arm, TableRow, fields, mean_posture};
use crate::windows::{Intervals, Rest, Still, intervals};

/// A track that is off by less than this share of how far it spreads follows the arm: the nominal arm is a hundredth off, and at a wrong
/// shift it is half.
pub(crate) const FOLLOWS: f64 = 0.15;

/// A rest whose first quarter is longer than any delay, s.
const LONG: f64 = 4.5 * DELAY;
/// Fewest times at which something was measured.
const FEWEST_TIMES: usize = 4;

/// Frames that descriptions of arms have, beside those that end in `_link`.
const OWN: [&str; 8] = ["base", "base_link_inertia", "flange", "tool0", "tool0_controller", "ft_frame", "hand_tcp", "world"];

/// What makes a row.
#[derive(Debug, Clone)]
pub struct LogOptions {
    /// The joints of the log.
    pub joints: JointChoice,
    /// Topics of what was measured, by their names; all if there is one.
    pub measured: Vec<String>,
    /// Shortest rest, after settling, s.
    pub shortest: f64,
    /// Time after a motion in which nothing is taken, s.
    pub settling: f64,
    /// Time to be added to those of the instrument, s; found from the motions if it is not given.
    pub shift: Option<f64>,
    /// Frames that move with the robot's own links, and are computed from its joints.
    pub own_frames: Vec<String>,
    /// One-sigma of the instrument for each coordinate, m: that of a row is this and the scatter of its mean.
    pub noise: Option<f64>,
    /// True if what was measured while the arm moved is meant, and not its rests.
    pub moving: bool,
}

impl Default for LogOptions {
    /// Rests of half a second, three tenths after the motion.
    fn default() -> Self {
        LogOptions {
            joints: JointChoice::default(),
            measured: Vec::new(),
            shortest: 0.5,
            settling: 0.3,
            shift: None,
            own_frames: Vec::new(),
            noise: None,
            moving: false,
        }
    }
}

/// Averages the rests of a log to the rows of a table.
///
/// # Errors
/// If joints or measurements are missing or ambiguous, if the arm never rests, or if nothing was measured while it did.
pub fn still_poses(log: &Log, robot: &Robot, options: &LogOptions) -> Result<MeasuredPoses, LogError> {
    let refuse = |problem: String, remedy: &str| LogError::Content { files: log.files.clone(), problem, remedy: remedy.into() };
    let Joints { track: joints, said } = joints_of(log, robot, &options.joints)?;
    let mut said = vec![said];
    let tracks = measured(log, &joints, options)?;
    let clock = Clock::of(&joints.times, &tracks[0].times, joints.recording == tracks[0].recording);
    let Series { times: joint_times, values: positions, .. } =
        Series::sorted(clock.times(&joints.times), &joints.positions, joints.joints.len());
    let joints = JointTrack { positions, ..joints };
    let found = intervals(&joint_times, &joints, robot, Rest { shortest: options.shortest, settling: options.settling });
    if found.still.is_empty() {
        return Err(refuse(
            never_still(&found, &joint_times),
            "let the arm stand for a second at each pose, ask for less with --still and --settle, or use what was measured in motion: --moving",
        ));
    }
    let series: Vec<Series> =
        tracks.iter().map(|track| Series::sorted(clock.times(&track.times), &track.values, track.titles.len())).collect();
    let rests = Rests { robot, joints: &joints, times: &joint_times, still: &found.still };
    let seconds = match options.shift {
        Some(seconds) => seconds,
        None => {
            let (seconds, how) = rests.shift(tracks[0], &series[0], clock).ok_or_else(|| {
                let problem = format!(
                    "the clock of {} cannot be matched with that of {}: no shift, or more than one, makes both move at the same times; or it does not move with the arm",
                    tracks[0].name, joints.name
                );
                refuse(problem, "state the time to be added to that of the instrument: --shift TIME, such as -0.12s")
            })?;
            said.extend(how);
            seconds
        }
    };
    let (used, not_used) = rests.used(&tracks, &series, seconds);
    said.extend(not_used);
    let tracks: Vec<&Track> = used.iter().map(|&n| tracks[n]).collect();
    let series: Vec<&Series> = used.iter().map(|&n| &series[n]).collect();
    let begin = joint_times.first().copied().unwrap_or(0.0);
    let exclude = |still: [f64; 2], why| Excluded { from_s: still[0] - begin, to_s: still[1] - begin, why };
    let mut excluded: Vec<Excluded> = found.short.iter().map(|&s| exclude(s, "too short after settling")).collect();
    excluded.extend(found.creeping.iter().map(|&s| exclude(s, "a joint creeps")));
    let mut kept: Vec<Row> = Vec::new();
    for still in &found.still {
        let interval = [still.begin - seconds, still.end - seconds];
        let middles: Vec<Option<Middle>> =
            tracks.iter().zip(&series).map(|(track, series)| middle(track, series, interval)).collect();
        if middles.first().is_some_and(Option::is_some) {
            kept.push(Row { still: *still, middles });
        } else {
            excluded.push(exclude([still.begin, still.end], "nothing was measured"));
        }
    }
    if kept.is_empty() {
        let problem = format!("the arm rests {} times, and {} measured nothing then", found.still.len(), tracks[0].name);
        return Err(refuse(
            problem,
            "check the clocks; state the time to be added to that of the instrument: --shift TIME, such as -0.12s",
        ));
    }
    let unsteady = unsteady(kept.iter().map(|row| row.middles.as_slice()), &series[0].ranges);
    let (moved, kept): (Vec<_>, Vec<_>) = kept.iter().zip(unsteady).partition(|(_, is_unsteady)| *is_unsteady);
    let of_moved =
        moved.iter().map(|(Row { still, .. }, _)| exclude([still.begin, still.end], "the measurement does not rest"));
    excluded.extend(of_moved);
    let kept: Vec<&Row> = kept.into_iter().map(|(row, _)| row).collect();
    excluded.sort_by(|a, b| a.from_s.total_cmp(&b.from_s));
    said.push(in_words(&found, kept.len(), &excluded, &tracks));
    let arm = Arm { robot, joints: &joints, times: &joint_times, tolerance: &found.tolerance };
    let kept: Vec<TableRow<'_>> = kept.into_iter().map(|row| TableRow::of_rest(&arm, row)).collect();
    let fields = fields(&arm, &tracks, &kept, options.noise);
    let measured = tracks.iter().map(|track| track.name.clone()).collect();
    Ok(MeasuredPoses { fields, measured, rows: kept.len(), excluded, said, shift_s: seconds })
}

/// The rests, by which shifts between clocks are judged.
struct Rests<'a> {
    robot: &'a Robot,
    joints: &'a JointTrack,
    /// Times of the joints.
    times: &'a [f64],
    still: &'a [Still],
}

/// A shift, and what is said of it.
type Told = (f64, Option<String>);

impl Rests<'_> {
    /// The time to be added to those of a track; `None` if none can be found.
    fn shift(&self, track: &Track, seen: &Series, clock: Clock) -> Option<Told> {
        // Where the nominal flange is says better than the joints how fast a point of the tool moves.
        let postures = self.joints.positions.chunks_exact(self.joints.joints.len());
        let arm = Series::new(self.times.to_vec(), postures.flat_map(|q| flange_at(self.robot, q)).collect(), 3);
        let known = if clock == Clock::None { None } else { delay(&arm, seen) };
        let follows = |seconds: f64| self.misfit(track, seen, seconds).is_none_or(|off| off < FOLLOWS);
        let name = &track.name;
        let delayed = |seconds: f64| {
            let told = if !shows_motion(&arm, seen) {
                Some(format!("{name} is read too seldom to show its delay: none is supposed"))
            } else {
                (seconds != 0.0).then(|| format!("{name} comes {:.2} s after the joints, which is allowed for", -seconds))
            };
            (seconds, told)
        };
        if let Some(seconds) = known.filter(|seconds| follows(*seconds)) {
            return Some(delayed(seconds));
        }
        // Of one recording the clock is one; in long rests the middle half of the readings knows of no delay.
        if clock != Clock::None && known.is_none() && self.are_long() && follows(0.0) {
            return Some((0.0, Some(format!("{name} moves too seldom to show its delay: none is supposed"))));
        }
        // Two clocks that begin at zero have times in common, and nothing else.
        let matched = self.shift_of(track, &arm, seen);
        let told = |seconds: f64| format!("clocks matched by the motions: {seconds:.2} s are added to the times of {name}");
        matched.map(|seconds| (seconds, Some(told(seconds)))).or(known.map(delayed))
    }

    /// True if a delay is less than the quarter of a rest that is not averaged, in most rests.
    fn are_long(&self) -> bool {
        let long = self.still.iter().filter(|still| still.end - still.begin >= LONG).count();
        2 * long >= self.still.len()
    }

    /// Which tracks a row may hold together, by their places, and what is said of the others.
    fn used(&self, tracks: &[&Track], series: &[Series], shift: f64) -> (Vec<usize>, Vec<String>) {
        let has_pose = tracks.iter().any(|track| track.titles.iter().any(|title| title == "qx"));
        if tracks.len() < 2 || !has_pose {
            return ((0..tracks.len()).collect(), Vec::new());
        }
        let at_rests = |(track, seen): (&&Track, &Series)| self.at_rests(track, seen, shift);
        let all: Vec<AtRests> = tracks.iter().zip(series).map(at_rests).collect();
        let names: Vec<&str> = tracks.iter().map(|track| track.name.as_str()).collect();
        together(self.robot, &names, &all)
    }

    /// How far a track is off, at a shift, from a point of the tool; `None` of too few rests.
    fn misfit(&self, track: &Track, seen: &Series, shift: f64) -> Option<f64> {
        misfit(self.robot, &self.at_rests(track, seen, shift), Seen::Tool)
    }

    /// The postures of the rests in which a track states something at a shift, and what it states.
    fn at_rests(&self, track: &Track, seen: &Series, shift: f64) -> AtRests {
        let mut found = AtRests::default();
        for still in self.still {
            let interval = [still.begin - shift, still.end - shift];
            if let Some(middle) = middle(track, seen, interval) {
                found.postures.push(mean_posture(self.joints, still));
                found.rows.push(middle.values);
            }
        }
        found
    }

    /// The shift at which a track moves with the arm and states a point of its tool while it rests; `None` if no one is likelier than all others.
    fn shift_of(&self, track: &Track, arm: &Series, seen: &Series) -> Option<f64> {
        let likely = shifts(arm, seen);
        // The likeliest comes first; its neighbours still find most rests.
        let mut is_judged = false;
        for shift in &likely {
            match self.misfit(track, seen, shift.seconds) {
                Some(off) if off < FOLLOWS => return Some(shift.seconds),
                off => is_judged |= off.is_some(),
            }
        }
        match likely.as_slice() {
            // Too few rests: the motions alone must tell.
            [first, rest @ ..] if !is_judged && rest.iter().all(|other| other.alike < RIVAL * first.alike) => {
                Some(first.seconds)
            }
            _ => None,
        }
    }
}

/// The tracks that are used: those asked for, or the only one.
pub(crate) fn measured<'a>(log: &'a Log, joints: &JointTrack, options: &LogOptions) -> Result<Vec<&'a Track>, LogError> {
    let refuse = |problem: String, remedy: String| LogError::Content { files: log.files.clone(), problem, remedy };
    // A frame of the robot's own links is its joints once more.
    let is_own = |track: &Track| {
        track.name.rsplit_once('>').is_some_and(|(_, child)| {
            let child = child.trim_start_matches('/');
            match options.own_frames.as_slice() {
                [] => OWN.contains(&child) || child.ends_with("_link"),
                own => own.iter().any(|own| own == child || child.ends_with(&format!("/{own}"))),
            }
        })
    };
    let names = |tracks: &[&Track]| {
        let all: Vec<String> = tracks.iter().map(|track| format!("{} ({} times)", track.name, track.times.len())).collect();
        named(&all)
    };
    let all: Vec<&Track> = log.tracks.iter().collect();
    if !options.measured.is_empty() {
        let find = |wanted: &String| {
            all.iter()
                .copied()
                .find(|track| track.name == *wanted)
                .ok_or_else(|| refuse(format!("has no '{wanted}'"), format!("name one of {}", names(&all))))
        };
        return options.measured.iter().map(find).collect();
    }
    // What was stated once or twice, such as where a camera is mounted, was not measured all the while.
    let is_seen = |track: &Track| track.times.len() >= FEWEST_TIMES;
    let mut seen: Vec<&Track> = all.iter().copied().filter(|track| !is_own(track) && is_seen(track)).collect();
    // Beside a file of measurements, the other columns of the table of joints are the controller's.
    if seen.len() > 1 {
        seen.retain(|track| track.name != joints.name);
    }
    match seen.as_slice() {
        [] => {
            let own = if all.is_empty() { String::new() } else { format!(" but frames of the robot itself: {}", names(&all)) };
            let other = if log.other.is_empty() { String::new() } else { format!("; other topics are {}", named(&log.other)) };
            Err(refuse(
                format!("holds no measured points or poses{own}{other}"),
                "record what a tracker or a camera saw (a point, pose, transform or marker), or give its table as a further file".into(),
            ))
        }
        [one] => Ok(vec![*one]),
        several => Err(refuse(
            format!("holds several things that may have been measured: {}", names(several)),
            "say which: --measured 'NAME'; repeat it for several points of one tool".into(),
        )),
    }
}

fn never_still(found: &Intervals, times: &[f64]) -> String {
    let length = times.last().unwrap_or(&0.0) - times.first().unwrap_or(&0.0);
    let shorter = found.short.iter().map(|[a, b]| b - a).fold(0.0, f64::max);
    let most = if shorter > 0.0 { format!("; its longest rest is {shorter:.2} s") } else { String::new() };
    let creeping =
        if found.creeping.is_empty() { String::new() } else { format!("; {} times a joint creeps", found.creeping.len()) };
    format!("the arm never stands still in {length:.0} s{most}{creeping}")
}

/// The nominal flange in the base, m.
pub(crate) fn flange_at(robot: &Robot, q: &[f64]) -> [f64; 3] {
    world_from_tool(robot, &FramePose::default(), &FramePose::default(), q).translation.vector.into()
}

fn in_words(found: &Intervals, rows: usize, excluded: &[Excluded], tracks: &[&Track]) -> String {
    let rests = found.still.len() + found.short.len() + found.creeping.len();
    let names: Vec<String> = tracks.iter().map(|track| track.name.clone()).collect();
    format!("rests: {rests}, of which {rows} with a measurement by {}{}", names.join(", "), reasons(excluded))
}
