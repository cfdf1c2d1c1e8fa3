//! Detection of reset clocks: sessions of one campaign years apart, or in the wrong order, and implausible times within a
//! session.

use std::fmt;

use jiff::{SignedDuration, Timestamp};

use super::Dataset;

/// Longest plausible duration of one session, s: 31 days. A campaign takes an hour, and after a pause of over a month the robot
/// is no longer the same.
const LONGEST_S: f64 = 31.0 * DAY_S;

/// Largest correction of a running clock, s: network time and a leap second take less.
const CORRECTION_S: f64 = 60.0;

/// One day, s.
const DAY_S: f64 = 86_400.0;

/// A reset of the wall clock, or a pause of over a month, between the interruption of a campaign and its resumption.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClockJump {
    /// End of the measurements before, seconds since 1970 (UTC), by the wall clock.
    pub before_s: f64,
    /// Present time by the wall clock, seconds since 1970 (UTC).
    pub now_s: f64,
}

impl ClockJump {
    /// The jump between these times, if they show one.
    pub(crate) fn between(before_s: f64, now_s: f64) -> Option<Self> {
        let credible = (-CORRECTION_S..=LONGEST_S).contains(&(now_s - before_s));
        (!credible).then_some(ClockJump { before_s, now_s })
    }
}

impl fmt::Display for ClockJump {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [before, now] = [self.before_s, self.now_s].map(date);
        write!(f, "the campaign was interrupted at {before}, and the system's clock says {now} now: ")?;
        if self.now_s < self.before_s {
            write!(f, "it was set back, and time_s of what follows goes on from the end of what was measured before")
        } else {
            let days = (self.now_s - self.before_s) / DAY_S;
            write!(f, "time_s of what follows is {days:.0} days later; if that clock was set, effects of time will be wrong")
        }
    }
}

/// Formats a time as ISO 8601, UTC; in seconds if it has no date.
fn date(since_1970_s: f64) -> String {
    let moment = SignedDuration::try_from_secs_f64(since_1970_s.round()).and_then(Timestamp::from_duration);
    moment.map_or_else(|_| format!("{since_1970_s} s after 1970"), |moment| moment.to_string())
}

/// A session whose times span more than is plausible.
#[derive(Debug, Clone, PartialEq)]
pub struct LongSession {
    /// Name of the session; `None` if unnamed.
    pub session: Option<String>,
    /// Its earliest time, s since it began.
    pub first_s: f64,
    /// Its latest time, s since it began.
    pub last_s: f64,
}

impl fmt::Display for LongSession {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let LongSession { session, first_s, last_s } = self;
        let which = session.as_ref().map_or_else(String::new, |name| format!(" of session '{name}'"));
        write!(
            f,
            "the times{which} span {:.0} days, from time_s = {first_s} to {last_s}: if a clock was set meanwhile, effects of time are \
             wrong; correct time_s, or give the rows sessions of their own",
            (last_s - first_s) / DAY_S
        )
    }
}

impl Dataset {
    /// Returns the sessions whose times span more than 31 days, in the order of their first rows.
    ///
    /// ```
    /// use calibench::measure::dataset::{Dataset, Measured, Sample};
    /// use calibench::nalgebra::Vector3;
    ///
    /// // Two samples forty days apart: the clock was set in between, if they are of one session.
    /// let sample = Sample::new("p", vec![0.0; 6], Measured::Point(Vector3::zeros()));
    /// let at = |days: f64| Sample { time_s: Some(days * 86_400.0), ..sample.clone() };
    /// let data = Dataset { samples: vec![at(0.0), at(40.0)], ..Dataset::default() };
    /// assert_eq!(data.long_sessions()[0].last_s, 40.0 * 86_400.0);
    /// ```
    pub fn long_sessions(&self) -> Vec<LongSession> {
        let mut sessions: Vec<LongSession> = Vec::new();
        for sample in &self.samples {
            let Some(time_s) = sample.time_s else { continue };
            match sessions.iter_mut().find(|known| known.session == sample.session) {
                Some(known) => {
                    known.first_s = known.first_s.min(time_s);
                    known.last_s = known.last_s.max(time_s);
                }
                None => sessions.push(LongSession { session: sample.session.clone(), first_s: time_s, last_s: time_s }),
            }
        }
        sessions.retain(|session| session.last_s - session.first_s > LONGEST_S);
        sessions
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_is_doubted_when_it_went_back_or_on_by_more_than_a_month() {
        // 2026-11-22T18:30:00Z
        let before = 1_795_372_200.0;
        for credible in [before - 30.0, before, before + 3600.0, before + 30.0 * DAY_S] {
            assert_eq!(ClockJump::between(before, credible), None);
        }
        let back = ClockJump::between(before, 0.0).map(|jump| jump.to_string()).unwrap_or_default();
        assert!(
            back.contains("2026-11-22T18:30:00Z") && back.contains("1970-01-01T00:00:00Z") && back.contains("set back"),
            "{back}"
        );
        let on = ClockJump::between(0.0, before).map(|jump| jump.to_string()).unwrap_or_default();
        assert!(on.contains("1970-01-01T00:00:00Z") && on.contains("20780 days later"), "{on}");
        let far = ClockJump::between(0.0, 1e300).map(|jump| jump.to_string()).unwrap_or_default();
        assert!(far.contains("s after 1970"), "{far}");
    }
}
