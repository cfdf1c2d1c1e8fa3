//! Faults of a served cell: the effect of each on the wire or on the floor, and when it occurs.

use std::str::FromStr;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use thiserror::Error;

/// Kinds of faults.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// An indicator does not answer.
    Silent,
    /// It answers with meaningless bytes.
    Garbage,
    /// It answers with its parity bit although the client expects eight data bits.
    Parity,
    /// Its answer arrives in two pieces.
    Split,
    /// Its answer arrives twice in one piece: the second is left for the next request.
    Merge,
    /// It answers ERR0: its sensor failed.
    Err0,
    /// It answers ERR1: it does not know the command.
    Err1,
    /// It answers ERR3: out of its range.
    Err3,
    /// A plunger sticks.
    Stuck,
    /// Indicators 1 and 2 are exchanged.
    Swapped,
    /// An indicator counts in reverse.
    Reversed,
    /// A plunger is pushed in to its stop.
    AtStop,
    /// A ball is missing from the artifact.
    BallMissing,
    /// A ball is 6 mm off its place along the world's x.
    BallOff,
    /// The robot does not accept a motion.
    Refuse,
    /// A joint reaches its limit during a motion.
    JointLimit,
    /// Somebody presses the emergency stop half-way through a motion.
    Estop,
    /// The controller stops a motion half-way as if the arm had hit something; a Universal Robot's protective stop.
    ProtectiveStop,
    /// The arm's power is switched off half-way through a motion.
    PowerOff,
    /// Somebody takes the arm in freedrive half-way through a motion.
    Freedrive,
    /// The connections to the robot break when a motion has started.
    DropLink,
    /// A connection to the robot stays open but is never answered again.
    HalfOpen,
    /// A motion takes ten times as long.
    Slow,
    /// The tracker's beam is broken: it does not answer.
    Beam,
}

/// The subjects of faults.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Victim {
    /// Requests to indicators.
    Indicator,
    /// Balls, from the beginning.
    Ball,
    /// Motions of the robot.
    Motion,
    /// Requests to the robot.
    Robot,
    /// Requests to the tracker.
    Tracker,
}

const NAMES: [(&str, Fault, Victim); 24] = [
    ("silent", Fault::Silent, Victim::Indicator),
    ("garbage", Fault::Garbage, Victim::Indicator),
    ("parity", Fault::Parity, Victim::Indicator),
    ("split", Fault::Split, Victim::Indicator),
    ("merge", Fault::Merge, Victim::Indicator),
    ("err0", Fault::Err0, Victim::Indicator),
    ("err1", Fault::Err1, Victim::Indicator),
    ("err3", Fault::Err3, Victim::Indicator),
    ("stuck", Fault::Stuck, Victim::Indicator),
    ("swapped", Fault::Swapped, Victim::Indicator),
    ("reversed", Fault::Reversed, Victim::Indicator),
    ("at_stop", Fault::AtStop, Victim::Indicator),
    ("ball_missing", Fault::BallMissing, Victim::Ball),
    ("ball_off", Fault::BallOff, Victim::Ball),
    ("refuse", Fault::Refuse, Victim::Motion),
    ("joint_limit", Fault::JointLimit, Victim::Motion),
    ("estop", Fault::Estop, Victim::Motion),
    ("protective_stop", Fault::ProtectiveStop, Victim::Motion),
    ("power_off", Fault::PowerOff, Victim::Motion),
    ("freedrive", Fault::Freedrive, Victim::Motion),
    ("drop_link", Fault::DropLink, Victim::Motion),
    ("slow", Fault::Slow, Victim::Motion),
    ("half_open", Fault::HalfOpen, Victim::Robot),
    ("beam", Fault::Beam, Victim::Tracker),
];

/// The occasions on which a fault strikes, counted from 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum When {
    /// Once.
    At(u64),
    /// From this occasion on.
    From(u64),
    /// At random, on this share of the occasions.
    Share(f64),
}

/// A fault to inject: `NAME[:PART][@WHEN]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Injection {
    /// The fault.
    pub fault: Fault,
    /// Number of the indicator or ball, counted from 1; all of them if not given.
    pub part: Option<usize>,
    /// Occasions on which it strikes.
    pub when: When,
}

/// Text that is not a valid fault.
#[derive(Debug, Error, Clone, PartialEq, Eq)]
pub enum InjectionError {
    /// There is no such fault.
    #[error("there is no fault '{name}'; known: {}", NAMES.map(|(name, ..)| name).join(", "))]
    Unknown {
        /// As given.
        name: String,
    },
    /// The fault does not apply to this part.
    #[error(
        "'{part}' is not a part to which '{name}' applies: give an indicator as 1, 2 or 3, a ball by its place from 1, nothing else"
    )]
    Part {
        /// The fault.
        name: String,
        /// As given.
        part: String,
    },
    /// The text after `@` is not a valid occasion.
    #[error("'{when}' does not say when: give N for the Nth occasion, N+ for all from it on, or a share like 0.05")]
    When {
        /// As given.
        when: String,
    },
}

impl FromStr for Injection {
    type Err = InjectionError;

    fn from_str(text: &str) -> Result<Self, InjectionError> {
        let (what, when) = text.split_once('@').map_or((text, None), |(what, when)| (what, Some(when)));
        let (name, part) = what.split_once(':').map_or((what, None), |(name, part)| (name, Some(part)));
        let known = NAMES.iter().find(|(n, ..)| *n == name);
        let &(_, fault, victim) = known.ok_or_else(|| InjectionError::Unknown { name: name.into() })?;
        let part = part.map(|part| {
            let wrong = || InjectionError::Part { name: name.into(), part: part.into() };
            let most = match victim {
                Victim::Indicator => 3,
                Victim::Ball => usize::MAX,
                Victim::Motion | Victim::Robot | Victim::Tracker => 0,
            };
            part.parse().ok().filter(|k| (1..=most).contains(k)).ok_or_else(wrong)
        });
        let when = match when {
            None => Ok(When::From(1)),
            Some(when) => {
                let wrong = || InjectionError::When { when: when.into() };
                let counted = |text: &str| text.parse().ok().filter(|n| *n > 0);
                let number = |when: &str| match when.strip_suffix('+') {
                    Some(first) => counted(first).map(When::From),
                    None if when.contains('.') => {
                        when.parse().ok().filter(|share| (0.0..=1.0).contains(share)).map(When::Share)
                    }
                    None => counted(when).map(When::At),
                };
                number(when).ok_or_else(wrong)
            }
        };
        Ok(Injection { fault, part: part.transpose()?, when: when? })
    }
}

/// The faults of a cell, each with the number of its occasions so far.
pub struct Faults {
    injected: Vec<(Injection, u64)>,
    random: ChaCha8Rng,
}

impl Faults {
    /// These faults; those with a share draw from `random`.
    pub fn new(injected: &[Injection], random: ChaCha8Rng) -> Self {
        Faults { injected: injected.iter().map(|injection| (injection.clone(), 0)).collect(), random }
    }

    /// Returns true if the fault strikes `part` (counted from 0) on this occasion.
    pub fn strikes(&mut self, fault: Fault, part: usize) -> bool {
        self.occasion(fault, part, false)
    }

    /// Returns true if the fault strikes `part` (counted from 0) on this occasion; one injected for a single occasion
    /// persists from then on.
    pub fn has_struck(&mut self, fault: Fault, part: usize) -> bool {
        self.occasion(fault, part, true)
    }

    /// The first of these faults that strikes `part` (counted from 0) on this occasion; the occasion counts for each of them.
    pub fn which(&mut self, faults: &[Fault], part: usize) -> Option<Fault> {
        let struck = faults.iter().map(|&fault| (fault, self.strikes(fault, part))).collect::<Vec<_>>();
        struck.into_iter().find_map(|(fault, strikes)| strikes.then_some(fault))
    }

    /// A line of meaningless bytes.
    pub fn garbage(&mut self) -> Vec<u8> {
        let mut line: Vec<u8> = (0..10).map(|_| self.random.random()).collect();
        line.push(b'\r');
        line
    }

    fn occasion(&mut self, fault: Fault, part: usize, stays: bool) -> bool {
        let Faults { injected, random } = self;
        let mut strikes = false;
        for (injection, count) in injected.iter_mut().filter(|(i, _)| i.fault == fault && i.part.is_none_or(|p| p == part + 1))
        {
            *count += 1;
            strikes |= match injection.when {
                When::At(n) if stays => *count >= n,
                When::At(n) => *count == n,
                When::From(n) => *count >= n,
                When::Share(share) => random.random::<f64>() < share,
            };
        }
        strikes
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    #[test]
    fn a_fault_says_what_happens_to_what_and_when() {
        let read = |text: &str| text.parse::<Injection>();
        assert_eq!(read("silent:2@7"), Ok(Injection { fault: Fault::Silent, part: Some(2), when: When::At(7) }));
        assert_eq!(read("split"), Ok(Injection { fault: Fault::Split, part: None, when: When::From(1) }));
        assert_eq!(read("garbage@0.05"), Ok(Injection { fault: Fault::Garbage, part: None, when: When::Share(0.05) }));
        assert_eq!(read("slow@3+"), Ok(Injection { fault: Fault::Slow, part: None, when: When::From(3) }));
        for wrong in ["", "silence", "silent:4", "silent:0", "slow:1", "split@0", "split@1.5", "split@-1", "split@", "silent:"]
        {
            assert!(read(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn faults_strike_on_their_occasions_only() {
        let injections = ["silent:2@2", "stuck:1@2", "slow@2+"].map(|text| text.parse().expect("a fault"));
        let mut faults = Faults::new(&injections, ChaCha8Rng::seed_from_u64(1));
        let silent: Vec<bool> = (0..3).map(|_| faults.strikes(Fault::Silent, 1)).collect();
        assert_eq!(silent, [false, true, false]);
        assert!(!faults.strikes(Fault::Silent, 0));
        let stuck: Vec<bool> = (0..3).map(|_| faults.has_struck(Fault::Stuck, 0)).collect();
        assert_eq!(stuck, [false, true, true]);
        let slow: Vec<bool> = (0..3).map(|_| faults.strikes(Fault::Slow, 0)).collect();
        assert_eq!(slow, [false, true, true]);
    }
}
