//! Which track holds the joints of the robot, and in which order its names stand for them.

use calibench::import::joint_names;
use calibench::robot::Robot;

use crate::error::LogError;
use crate::log::{JointTrack, Log};

/// Words in the names of topics that state what is wanted, not what is.
const WANTED: [&str; 6] = ["command", "desired", "target", "goal", "reference", "cmd"];

/// How a topic that is not read says in which encoding it is.
pub(crate) const WRITTEN: &str = ", written as ";

/// What the user says of the joints of a log.
#[derive(Debug, Clone, Default)]
pub struct JointChoice {
    /// Names of the joints from the base on: of the URDF, or as given.
    pub names: Vec<String>,
    /// The topic, if it is given.
    pub topic: Option<String>,
}

/// The joints of the robot over time.
#[derive(Debug, Clone, Default)]
pub(crate) struct Joints {
    pub track: JointTrack,
    /// How they were recognised.
    pub said: String,
}

/// Finds the joints of the robot in a log.
pub(crate) fn joints_of(log: &Log, robot: &Robot, choice: &JointChoice) -> Result<Joints, LogError> {
    let refuse = |problem: String, remedy: String| LogError::Content { files: log.files.clone(), problem, remedy };
    if log.joints.is_empty() {
        let cut: String = log.remarks.iter().map(|remark| format!("; {remark}")).collect();
        let there = if log.other.is_empty() { String::new() } else { format!("; its topics are {}", named(&log.other)) };
        let remedy = if log.other.iter().any(|topic| topic.contains(WRITTEN)) {
            "record messages in CDR, as ROS 2 does: others are not read"
        } else {
            "record the topic of the joint states (sensor_msgs/JointState), or give a table with a time and the joints in each row"
        };
        return Err(refuse(format!("holds no joints{there}{cut}"), remedy.into()));
    }
    let is_chosen = |track: &&JointTrack| choice.topic.as_ref().is_none_or(|topic| *topic == track.name);
    let mut chosen: Vec<&JointTrack> = log.joints.iter().filter(is_chosen).collect();
    if chosen.is_empty() {
        let topics: Vec<String> = log.joints.iter().map(|track| track.name.clone()).collect();
        let topic = choice.topic.clone().unwrap_or_default();
        return Err(refuse(format!("has no joints under '{topic}'"), format!("name one of {}", named(&topics))));
    }
    // What is wanted comes last, and more rows come first.
    let is_wanted = |track: &JointTrack| WANTED.iter().any(|word| track.name.to_lowercase().contains(word));
    chosen.sort_by_key(|track| (is_wanted(track), std::cmp::Reverse(track.times.len())));
    // Messages of one topic may name its joints in several orders.
    let first = chosen[0].name.clone();
    let of_first: Vec<&JointTrack> = chosen.iter().copied().filter(|track| track.name == first).collect();
    if of_first.len() > 1
        && let Some(track) = merged(&of_first, robot, &choice.names)
    {
        let said = format!("joints: {first} ({}), {} times", track.joints.join(", "), track.times.len());
        return Ok(Joints { track, said });
    }
    let orders = chosen.iter().filter_map(|track| order(&track.joints, robot, &choice.names).map(|order| (*track, order)));
    if let Some((track, order)) = orders.into_iter().next() {
        let names: Vec<&str> = order.iter().map(|&k| track.joints[k].as_str()).collect();
        let said = format!("joints: {} ({}), {} times", track.name, names.join(", "), track.times.len());
        return Ok(Joints { track: reordered(track, &order), said });
    }
    if let Some(track) = merged(&chosen, robot, &choice.names) {
        let said = format!("joints: {}, {} times", named(&topics_of(&chosen)), track.times.len());
        return Ok(Joints { track, said });
    }
    let mut there: Vec<String> = chosen.iter().flat_map(|track| track.joints.clone()).collect();
    there.sort();
    there.dedup();
    let wanted = if choice.names.is_empty() {
        format!("{} joints of '{}' cannot be told from their names", robot.joints(), robot.name)
    } else {
        format!("the robot's joints are {}", choice.names.join(", "))
    };
    Err(refuse(
        format!("has the joints {}, and {wanted}", named(&there)),
        "name those of the robot from its base on: --joints NAME,NAME,...".into(),
    ))
}

fn topics_of(tracks: &[&JointTrack]) -> Vec<String> {
    let mut topics: Vec<String> = tracks.iter().map(|track| track.name.clone()).collect();
    topics.dedup();
    topics
}

/// Most names that an error or a remark lists.
const MOST_NAMED: usize = 24;

/// The first names of a list.
pub(crate) fn named(names: &[String]) -> String {
    let first = names.iter().take(MOST_NAMED).cloned().collect::<Vec<_>>().join(", ");
    if names.len() > MOST_NAMED { format!("{first} and {} more", names.len() - MOST_NAMED) } else { first }
}

fn reordered(track: &JointTrack, order: &[usize]) -> JointTrack {
    let rows = track.positions.chunks_exact(track.joints.len().max(1));
    JointTrack {
        joints: order.iter().map(|&k| track.joints[k].clone()).collect(),
        positions: rows.flat_map(|row| order.iter().map(|&k| row[k])).collect(),
        ..track.clone()
    }
}

/// Joints that several topics, or messages of several sets of names, state: each holds until it is stated again.
fn merged(tracks: &[&JointTrack], robot: &Robot, names: &[String]) -> Option<JointTrack> {
    let mut all: Vec<String> = tracks.iter().flat_map(|track| track.joints.clone()).collect();
    all.sort();
    all.dedup();
    let order = order(&all, robot, names)?;
    let wanted: Vec<&String> = order.iter().map(|&k| &all[k]).collect();
    let mut rows: Vec<(f64, f64, &JointTrack, usize)> = Vec::new();
    for track in tracks {
        let times = track.times.stated.iter().zip(&track.times.recorded).enumerate();
        rows.extend(times.map(|(row, (stated, recorded))| (*stated, *recorded, *track, row)));
    }
    rows.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut merged = JointTrack {
        name: topics_of(tracks).join(", "),
        joints: wanted.iter().map(|&name| name.clone()).collect(),
        is_si: tracks.iter().all(|track| track.is_si),
        recording: tracks.first().map_or(0, |track| track.recording),
        ..JointTrack::default()
    };
    let mut now = vec![f64::NAN; wanted.len()];
    for (stated, recorded, track, row) in rows {
        for (k, name) in track.joints.iter().enumerate() {
            if let Some(place) = wanted.iter().position(|wanted| *wanted == name) {
                now[place] = track.positions[row * track.joints.len() + k];
            }
        }
        if now.iter().all(|v| v.is_finite()) {
            merged.push(stated, recorded, &now);
        }
    }
    (!merged.times.is_empty()).then_some(merged)
}

/// The places of the robot's joints among names; `None` if these do not tell.
pub(crate) fn order(found: &[String], robot: &Robot, names: &[String]) -> Option<Vec<usize>> {
    let by_names = joint_names::order(found, robot, names);
    if names.is_empty() { by_names.or_else(|| by_numbers(found, robot.joints())) } else { by_names }
}

/// The places of names that differ in their last number alone, in the order of these numbers, which begin at 0 or 1.
fn by_numbers(found: &[String], joints: usize) -> Option<Vec<usize>> {
    let split = |name: &String| {
        let name = joint_names::bare(name);
        let stem = name.trim_end_matches(|c: char| c.is_ascii_digit());
        name[stem.len()..].parse::<usize>().ok().map(|number| (stem.to_owned(), number))
    };
    let mut families: Vec<(String, Vec<(usize, usize)>)> = Vec::new();
    for (k, name) in found.iter().enumerate() {
        let Some((stem, number)) = split(name) else { continue };
        match families.iter_mut().find(|(known, _)| *known == stem) {
            Some((_, members)) => members.push((number, k)),
            None => families.push((stem, vec![(number, k)])),
        }
    }
    let mut whole: Vec<Vec<usize>> = Vec::new();
    for (_, mut members) in families {
        members.sort_unstable();
        let begins = members.first().is_some_and(|(number, _)| *number <= 1);
        let consecutive = members.windows(2).all(|pair| pair[1].0 == pair[0].0 + 1);
        if begins && consecutive && members.len() == joints {
            whole.push(members.into_iter().map(|(_, k)| k).collect());
        }
    }
    if whole.len() == 1 { whole.pop() } else { None }
}

#[cfg(test)]
mod tests {
    use calibench::robot::built_in;

    use super::*;

    fn names(text: &str) -> Vec<String> {
        text.split(' ').map(str::to_owned).collect()
    }

    #[test]
    fn names_stand_for_joints_in_any_order() {
        let ur5 = built_in("ur5").expect("built in");
        // As the driver of Universal Robots states them.
        let found = names("elbow_joint shoulder_lift_joint shoulder_pan_joint wrist_1_joint wrist_2_joint wrist_3_joint");
        assert_eq!(order(&found, &ur5, &[]), Some(vec![2, 1, 0, 3, 4, 5]));
        let panda = built_in("panda").expect("built in");
        let found =
            names("finger_joint1 panda_joint2 panda_joint1 panda_joint3 panda_joint4 panda_joint5 panda_joint6 panda_joint7");
        assert_eq!(order(&found, &panda, &[]), Some(vec![2, 1, 3, 4, 5, 6, 7]));
        // A prefix that tells two arms apart.
        let wanted = names("shoulder_pan shoulder_lift");
        assert_eq!(order(&names("left_shoulder_lift left_shoulder_pan gripper"), &ur5, &wanted), Some(vec![1, 0]));
        assert_eq!(order(&names("left_shoulder_pan right_shoulder_pan left_shoulder_lift"), &ur5, &wanted), None);
        assert_eq!(order(&names("a b c d e f"), &ur5, &[]), None);
    }
}
