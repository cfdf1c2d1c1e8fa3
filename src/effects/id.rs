//! Effect ids, parsed in one place into the family's name and its arguments.

use std::borrow::Borrow;
use std::cmp::Ordering;
use std::fmt;
use std::hash::{Hash, Hasher};
use std::ops::Deref;
use std::sync::Arc;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::{EffectError, Subject};
use crate::robot::JointKind;

/// An effect id, `FAMILY`, `FAMILY:ARGUMENT` or `FAMILY:ARGUMENT:...`, split at its first colon.
///
/// It reads and compares as its text. The arguments are not checked here but when the effect is built for a robot and an
/// artifact.
///
/// ```
/// use calibench::effects::EffectId;
///
/// let id = EffectId::new("harmonic:2:17");
/// assert_eq!((id.family(), id.number(0), id.last_argument()), ("harmonic", Some(2), Some("17")));
/// ```
#[derive(Clone)]
pub struct EffectId {
    whole: Arc<str>,
    /// Length of the family's name.
    family: usize,
}

impl EffectId {
    /// Splits an id.
    pub fn new(whole: &str) -> Self {
        EffectId { family: whole.find(':').unwrap_or(whole.len()), whole: whole.into() }
    }

    /// The member of a family with these arguments.
    pub fn member(family: &str, arguments: impl fmt::Display) -> Self {
        EffectId { whole: format!("{family}:{arguments}").into(), family: family.len() }
    }

    /// The whole id, as given.
    pub fn whole(&self) -> &str {
        &self.whole
    }

    /// The part before the first colon.
    pub fn family(&self) -> &str {
        &self.whole[..self.family]
    }

    /// The part after the first colon. Names of balls and samples may contain colons.
    pub fn rest(&self) -> Option<&str> {
        self.whole.get(self.family + 1..)
    }

    /// Argument `k`, counted from 0.
    pub fn argument(&self, k: usize) -> Option<&str> {
        self.rest()?.split(':').nth(k)
    }

    /// The part after the last colon: the argument varied by a scan.
    pub fn last_argument(&self) -> Option<&str> {
        self.rest()?.rsplit(':').next()
    }

    /// Argument `k` as a number counted from 1: a joint or an indicator.
    pub fn number(&self, k: usize) -> Option<usize> {
        self.argument(k)?.parse().ok().filter(|n| *n > 0)
    }

    /// An error about the arguments.
    pub fn wrong(&self, problem: impl Into<String>) -> EffectError {
        EffectError::Argument { id: self.whole().into(), problem: problem.into() }
    }

    /// Requires no more than `most` arguments.
    ///
    /// # Errors
    /// If there are more.
    pub fn at_most(&self, most: usize) -> Result<(), EffectError> {
        if self.rest().map_or(0, |rest| rest.split(':').count()) > most {
            return Err(self.wrong(format!("takes at most {most} argument(s)")));
        }
        Ok(())
    }

    /// The revolute joints named: the one of the only argument, or all of them if there is none. Counted from 0.
    ///
    /// # Errors
    /// If the robot has no such joint, if it is prismatic, or if there is more than one argument.
    pub fn joints(&self, subject: &Subject<'_>) -> Result<Vec<usize>, EffectError> {
        self.at_most(1)?;
        let turning = || (0..subject.robot.joints()).filter(|&j| subject.robot.kind(j) == JointKind::Revolute);
        if self.rest().is_none() { Ok(turning().collect()) } else { Ok(vec![self.joint(0, subject)?]) }
    }

    /// The revolute joint named by argument `k`. Counted from 0.
    ///
    /// # Errors
    /// If the robot has no such joint, or if it is prismatic.
    pub fn joint(&self, k: usize, subject: &Subject<'_>) -> Result<usize, EffectError> {
        let j = self.any_joint(k, subject)?;
        match subject.robot.kind(j) {
            JointKind::Revolute => Ok(j),
            JointKind::Prismatic => {
                Err(self.wrong(format!("joint {} is prismatic, and {} is of joints that turn", j + 1, self.family())))
            }
        }
    }

    /// The joints named, prismatic ones included: the one of the only argument, or all of them if there is none. Counted from 0.
    ///
    /// # Errors
    /// If the robot has no such joint, or if there is more than one argument.
    pub fn any_joints(&self, subject: &Subject<'_>) -> Result<Vec<usize>, EffectError> {
        self.at_most(1)?;
        if self.rest().is_none() { Ok((0..subject.robot.joints()).collect()) } else { Ok(vec![self.any_joint(0, subject)?]) }
    }

    /// The joint named by argument `k`, which may be prismatic. Counted from 0.
    ///
    /// # Errors
    /// If the robot has no such joint.
    pub fn any_joint(&self, k: usize, subject: &Subject<'_>) -> Result<usize, EffectError> {
        let n = subject.robot.joints();
        match self.number(k) {
            Some(j) if j <= n => Ok(j - 1),
            _ => Err(self.wrong(format!("names a joint from 1 to {n} after the colon"))),
        }
    }

    /// The indicator named by the only argument. Counted from 0.
    ///
    /// # Errors
    /// If it is not 1, 2 or 3.
    pub fn indicator(&self) -> Result<usize, EffectError> {
        match self.rest() {
            Some("1") => Ok(0),
            Some("2") => Ok(1),
            Some("3") => Ok(2),
            _ => Err(self.wrong("names an indicator from 1 to 3 after the colon")),
        }
    }

    /// The time named by argument `k`, the last, s.
    ///
    /// # Errors
    /// If it is not a time, or not the last argument.
    pub fn time(&self, k: usize) -> Result<f64, EffectError> {
        self.at_most(k + 1)?;
        match self.argument(k).and_then(|a| a.parse::<f64>().ok()) {
            Some(t) if t.is_finite() && t >= 0.0 => Ok(t),
            _ => Err(self.wrong("ends in seconds since the session began, zero or more")),
        }
    }

    /// Index in the artifact of the ball named by everything after the first colon.
    ///
    /// # Errors
    /// If the artifact has no such ball.
    pub fn ball(&self, subject: &Subject<'_>) -> Result<usize, EffectError> {
        let name = self.rest().unwrap_or_default();
        let unknown = || self.wrong(format!("names a ball after the colon, one of: {}", subject.balls.join(", ")));
        subject.balls.iter().position(|b| b == name).ok_or_else(unknown)
    }

    /// The sample named by everything after the first colon.
    ///
    /// # Errors
    /// If none is named, or if the samples are known and this is not one of them.
    pub fn sample(&self, subject: &Subject<'_>) -> Result<&str, EffectError> {
        let sample = self.rest().filter(|s| !s.is_empty()).ok_or_else(|| self.wrong("names a sample after the colon"))?;
        if subject.samples.is_some_and(|known| !known.iter().any(|s| s == sample)) {
            return Err(self.wrong(format!("there is no sample '{sample}' among the rows that are fitted")));
        }
        Ok(sample)
    }
}

impl Deref for EffectId {
    type Target = str;

    fn deref(&self) -> &str {
        self.whole()
    }
}

impl Borrow<str> for EffectId {
    fn borrow(&self) -> &str {
        self.whole()
    }
}

impl AsRef<str> for EffectId {
    fn as_ref(&self) -> &str {
        self.whole()
    }
}

impl fmt::Display for EffectId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.whole())
    }
}

impl fmt::Debug for EffectId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(self.whole(), f)
    }
}

impl From<&str> for EffectId {
    fn from(whole: &str) -> Self {
        EffectId::new(whole)
    }
}

impl From<String> for EffectId {
    fn from(whole: String) -> Self {
        EffectId::new(&whole)
    }
}

impl From<&String> for EffectId {
    fn from(whole: &String) -> Self {
        EffectId::new(whole)
    }
}

impl From<EffectId> for String {
    fn from(id: EffectId) -> Self {
        id.whole().to_owned()
    }
}

impl PartialEq for EffectId {
    fn eq(&self, other: &Self) -> bool {
        self.whole() == other.whole()
    }
}

impl Eq for EffectId {}

impl PartialEq<str> for EffectId {
    fn eq(&self, other: &str) -> bool {
        self.whole() == other
    }
}

impl PartialEq<&str> for EffectId {
    fn eq(&self, other: &&str) -> bool {
        self.whole() == *other
    }
}

impl PartialEq<String> for EffectId {
    fn eq(&self, other: &String) -> bool {
        self.whole() == other
    }
}

impl PartialEq<EffectId> for str {
    fn eq(&self, other: &EffectId) -> bool {
        self == other.whole()
    }
}

impl PartialEq<EffectId> for String {
    fn eq(&self, other: &EffectId) -> bool {
        self == other.whole()
    }
}

impl Hash for EffectId {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.whole().hash(state);
    }
}

impl Ord for EffectId {
    fn cmp(&self, other: &Self) -> Ordering {
        self.whole().cmp(other.whole())
    }
}

impl PartialOrd for EffectId {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Serialize for EffectId {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.whole())
    }
}

impl<'de> Deserialize<'de> for EffectId {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer).map(EffectId::from)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_id_is_taken_apart_at_its_colons() {
        let id = EffectId::new("harmonic:2:17");
        assert_eq!((id.whole(), id.family(), id.rest()), ("harmonic:2:17", "harmonic", Some("2:17")));
        assert_eq!(
            (id.argument(0), id.argument(1), id.argument(2), id.last_argument()),
            (Some("2"), Some("17"), None, Some("17"))
        );
        let id = EffectId::new("mdh");
        assert_eq!((id.family(), id.rest(), id.argument(0), id.last_argument()), ("mdh", None, None, None));
        assert_eq!(EffectId::new("outlier:").rest(), Some(""));
        assert_eq!(EffectId::new("harmonic1:0").number(0), None);
    }

    #[test]
    fn names_keep_their_colons() {
        let robot = crate::robot::built_in("kr6_r700").expect("built in");
        let (balls, samples) = (["a:1".to_owned()], ["day2:p7".to_owned()]);
        let subject = Subject { samples: Some(&samples), ..Subject::new(&robot, &balls) };
        assert_eq!(EffectId::new("ball:a:1").ball(&subject), Ok(0));
        assert_eq!(EffectId::new("outlier:day2:p7").sample(&subject), Ok("day2:p7"));
        let refused = EffectId::new("outlier:p7").sample(&subject).expect_err("there is none");
        assert!(refused.to_string().contains("'p7'"), "{refused}");
    }
}
