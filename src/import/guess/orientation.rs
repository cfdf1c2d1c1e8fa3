//! Orientations beside the positions of an unknown table: which columns they are, and the form and unit in which they fit the arm.

use std::path::Path;

use nalgebra::{Matrix3, Rotation3};

use super::proposal::{Proposal, Tried, Turned, units};
use crate::import::initial_setup::flanges;
use crate::import::rotation::RotationForm;
use crate::import::unknown_table::{TARGETS, Table};
use crate::math::nearest_rank;
use crate::math::nearest_rotation;
use crate::measure::dataset::Dataset;
use crate::robot::angle_between;
use crate::units::DEG;

/// Median angle, rad, between orientations as read and those of the nominal arm up to which they fit: an arm after a crash is a few
/// degrees off, and another form or unit some tens.
const FITS: f64 = 5.0 * DEG;

/// The same in parts of how far the flange turns: where it hardly turns, every form fits.
const FITS_OF_TURNING: f64 = 1.0 / 3.0;

/// A form that fits this much better than a likelier one is the right one.
const BETTER: f64 = 0.9;

/// Name by itself of a part of an orientation, shorter than which it may be the end of another word (`laserx`).
const A_WORD: usize = 4;

/// Names of the numbers of an orientation, without separators, and the forms that they may be in, the likeliest first.
const NAMES: [(&[&str], &[RotationForm]); 19] = [
    (&["qx", "qy", "qz", "qw"], &[RotationForm::QuaternionXyzw]),
    (&["quatx", "quaty", "quatz", "quatw"], &[RotationForm::QuaternionXyzw]),
    (&["orientationx", "orientationy", "orientationz", "orientationw"], &[RotationForm::QuaternionXyzw]),
    (&["ox", "oy", "oz", "ow"], &[RotationForm::QuaternionXyzw]),
    (&["quat1", "quat2", "quat3", "quat4"], &[RotationForm::QuaternionWxyz, RotationForm::QuaternionXyzw]),
    (&["quat0", "quat1", "quat2", "quat3"], &[RotationForm::QuaternionWxyz, RotationForm::QuaternionXyzw]),
    (&["r11", "r12", "r13", "r21", "r22", "r23", "r31", "r32", "r33"], &[RotationForm::Matrix]),
    (&["r00", "r01", "r02", "r10", "r11", "r12", "r20", "r21", "r22"], &[RotationForm::Matrix]),
    (&["roll", "pitch", "yaw"], &OF_THREE),
    (&["rx", "ry", "rz"], &[RotationForm::Vector, RotationForm::Rpy, RotationForm::Xyz, RotationForm::Abc, RotationForm::Zyz]),
    (&["rotx", "roty", "rotz"], &[RotationForm::Vector, RotationForm::Rpy, RotationForm::Xyz, RotationForm::Abc]),
    (&["rotvecx", "rotvecy", "rotvecz"], &[RotationForm::Vector]),
    (&["rvecx", "rvecy", "rvecz"], &[RotationForm::Vector]),
    (&["rvec0", "rvec1", "rvec2"], &[RotationForm::Vector]),
    (&["rvec1", "rvec2", "rvec3"], &[RotationForm::Vector]),
    (&["eulerx", "eulery", "eulerz"], &OF_THREE),
    (&["a", "b", "c"], &[RotationForm::Abc, RotationForm::Rpy, RotationForm::Xyz]),
    (&["w", "p", "r"], &[RotationForm::Rpy, RotationForm::Xyz]),
    (&["o", "a", "t"], &[RotationForm::Zyz]),
];

/// Forms of three angles without a name of their own.
const OF_THREE: [RotationForm; 5] =
    [RotationForm::Rpy, RotationForm::Xyz, RotationForm::Abc, RotationForm::Zyz, RotationForm::Vector];

/// Words of columns that are about an orientation, and not the orientation.
const ABOUT: [&str; 9] = ["std", "sigma", "err", "error", "dif", "dev", "delta", "vel", "acc"];

/// Columns that may be an orientation, and the forms that they may be in.
struct Named {
    columns: Vec<usize>,
    forms: &'static [RotationForm],
}

/// Adds the orientation beside the positions of a proposal, if one fits the arm; what is found in words.
pub(super) fn add(proposal: &mut Proposal<'_>, path: &Path) -> Vec<String> {
    let table = proposal.table;
    let mut left_out = Vec::new();
    for named in candidates(table, proposal.joints, &proposal.points) {
        let mut best: Option<(f64, Turned)> = None;
        for turned in named.readings(table, false) {
            let tried = Proposal { rotation: Some(turned.clone()), ..proposal.clone() };
            let Some(angle) = tried.read(path).ok().and_then(|dataset| fits(&dataset)) else { continue };
            if best.as_ref().is_none_or(|(least, _)| angle < BETTER * least) {
                best = Some((angle, turned));
            }
        }
        if let Some((angle, turned)) = best {
            let said = in_words(&turned, table, angle);
            proposal.rotation = Some(turned);
            return vec![said];
        }
        left_out.push(format!(
            "an orientation, which {} seem to be, is not used: in no usual form does it fit the arm",
            table.titles(&named.columns)
        ));
    }
    // Columns that have no name are no orientation unless they fit as one.
    if table.header { left_out } else { Vec::new() }
}

/// An orientation in words, and how well it fits.
fn in_words(turned: &Turned, table: &Table, angle: f64) -> String {
    let unit = if turned.form.has_angles() { format!(" in {}", turned.unit) } else { String::new() };
    let sense = if turned.inverse { ", the world seen from the tool" } else { "" };
    format!(
        "orientations: {} as `{}`{unit}{sense}, from which the nominal arm is {:.2} deg (median)",
        table.titles(&turned.columns),
        turned.form.name(),
        angle / DEG
    )
}

/// Columns beside these joints that are named as an orientation.
pub(super) fn columns(table: &Table, joints: &[usize]) -> Vec<usize> {
    if !table.header {
        return Vec::new();
    }
    candidates(table, joints, &[]).into_iter().flat_map(|named| named.columns).collect()
}

/// The proposal that fits best if the rows state the world as seen from the tool; `None` without an orientation. Its residual is
/// that of most rows: an orientation that is wrong displaces the tool by as much as the world was away.
pub(super) fn seen_from_the_tool<'a>(plain: &Proposal<'a>, path: &Path) -> Option<Tried<'a>> {
    let table = plain.table;
    let mut best: Option<Tried<'a>> = None;
    for named in candidates(table, plain.joints, &plain.points) {
        for turned in named.readings(table, true) {
            let Some(tried) = (Proposal { rotation: Some(turned), ..plain.clone() }).best(path) else { continue };
            let tried = tried.of_most_rows();
            if best.as_ref().is_none_or(|least| tried.share < BETTER * least.share) {
                best = Some(tried);
            }
        }
    }
    best
}

/// What is said of an orientation in which the world was seen from the tool.
pub(super) fn seen_in_words(tried: &Tried<'_>) -> Option<String> {
    let turned = tried.proposal.rotation.as_ref()?;
    let [angle, _] = off_and_turning(&tried.dataset)?;
    Some(in_words(turned, tried.proposal.table, angle))
}

/// Median angle between the orientations of a dataset and those of its nominal arm, rad, the axes of the tool fitted; `None` if it
/// is too large for them to be orientations of the tool.
fn fits(dataset: &Dataset) -> Option<f64> {
    let [off, turning] = off_and_turning(dataset)?;
    (off <= FITS.min(FITS_OF_TURNING * turning)).then_some(off)
}

/// Median angles, rad, between the orientations and those of the nominal arm, the axes of the tool fitted, and of the flange about
/// its mean.
fn off_and_turning(dataset: &Dataset) -> Option<[f64; 2]> {
    let base = dataset.base.pose().rotation;
    let turned: Vec<(Rotation3<f64>, Rotation3<f64>)> = dataset
        .samples
        .iter()
        .zip(flanges(dataset))
        .filter_map(|(s, flange)| s.orientation.map(|seen| (base * flange.rotation, Rotation3::new(seen.rotation))))
        .collect();
    let off = about_mean(&turned.iter().map(|(flange, seen)| flange.inverse() * seen).collect::<Vec<_>>())?;
    let turning = about_mean(&turned.iter().map(|(flange, _)| *flange).collect::<Vec<_>>()).unwrap_or(f64::INFINITY);
    Some([off, turning])
}

/// Median angle of rotations about their mean, rad; `None` if they have none.
fn about_mean(all: &[Rotation3<f64>]) -> Option<f64> {
    let mean = nearest_rotation(&all.iter().map(|r| *r.matrix()).sum::<Matrix3<f64>>())?;
    Some(nearest_rank(all.iter().map(|r| angle_between(&mean, r)).collect(), 0.5))
}

impl Named {
    /// The forms and units in which the columns may state an orientation.
    fn readings<'a>(&'a self, table: &'a Table, inverse: bool) -> impl Iterator<Item = Turned> + 'a {
        self.forms.iter().flat_map(move |&form| {
            let of_angles = if form.has_angles() { units(table, &self.columns, &["deg", "rad"]) } else { vec!["deg"] };
            of_angles.into_iter().map(move |unit| Turned { form, columns: self.columns.clone(), unit, inverse })
        })
    }
}

/// Columns beside joints and positions that may be an orientation: those that are named so, or in a table without titles those that
/// follow the positions.
fn candidates(table: &Table, joints: &[usize], points: &[usize]) -> Vec<Named> {
    let is_free = |k: usize| table.columns[k].largest.is_some() && !joints.contains(&k) && !points.contains(&k);
    if !table.header {
        let next = points.last().map_or(0, |last| last + 1);
        let follow = |count: usize| (next..next + count).all(|k| k < table.columns.len() && is_free(k));
        let of: [(usize, &'static [RotationForm]); 3] =
            [(9, &[RotationForm::Matrix]), (4, &[RotationForm::QuaternionXyzw, RotationForm::QuaternionWxyz]), (3, &OF_THREE)];
        return of
            .into_iter()
            .filter(|(count, _)| follow(*count))
            .map(|(count, forms)| Named { columns: (next..next + count).collect(), forms })
            .collect();
    }
    let words: Vec<Vec<String>> = table.columns.iter().map(|c| words(&c.stem)).collect();
    let mut found = Vec::new();
    for (names, forms) in NAMES {
        for k in (0..words.len()).filter(|&k| is_free(k)) {
            let Some(rest) = without(&words[k], names[0]) else { continue };
            if rest.iter().any(|word| ABOUT.contains(&word.as_str())) || TARGETS.iter().any(|t| rest.concat().contains(t)) {
                continue;
            }
            let of = |name: &&str| {
                (0..words.len()).find(|&c| is_free(c) && without(&words[c], name).is_some_and(|other| other == rest))
            };
            if let Some(columns) = names.iter().map(of).collect::<Option<Vec<usize>>>() {
                found.push(Named { columns, forms });
            }
        }
    }
    found
}

/// The words of a title.
fn words(stem: &str) -> Vec<String> {
    stem.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty()).map(str::to_owned).collect()
}

/// The words of a title without the name of a part of an orientation, which is one word or two; `None` if they do not hold it.
fn without(words: &[String], name: &str) -> Option<Vec<String>> {
    for at in 0..words.len() {
        for count in [1, 2] {
            if words.get(at..at + count).is_some_and(|of| of.concat() == name) {
                return Some([&words[..at], &words[at + count..]].concat());
            }
        }
    }
    let whole = words.concat();
    let rest = whole.strip_suffix(name).or_else(|| whole.strip_prefix(name)).filter(|_| name.len() >= A_WORD)?;
    Some(vec![rest.to_owned()])
}

#[cfg(test)]
mod tests {
    use super::{without, words};

    #[test]
    fn a_part_of_an_orientation_is_known_by_its_words() {
        let rest = |title: &str, name: &str| without(&words(title), name).map(|rest| rest.join(" "));
        assert_eq!(rest("rx", "rx").as_deref(), Some(""));
        assert_eq!(rest("measurement_rx", "rx").as_deref(), Some("measurement"));
        assert_eq!(rest("pose r x", "rx").as_deref(), Some("pose"));
        assert_eq!(rest("tcpquatw", "quatw").as_deref(), Some("tcp"));
        assert_eq!(rest("laserx", "rx"), None);
        assert_eq!(rest("q.w", "qw").as_deref(), Some(""));
        assert_eq!(rest("a", "a").as_deref(), Some(""));
        assert_eq!(rest("alpha", "a"), None);
    }
}
