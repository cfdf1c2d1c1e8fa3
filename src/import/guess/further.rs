//! Further points of the tool in the rows of an unknown table: columns that are called like those of the first, but for a number or
//! a letter, and that fit the arm as well.

use std::path::Path;

use nalgebra::Vector3;

use super::proposal::Proposal;
use crate::measure::dataset::Dataset;
use crate::units::MM;

/// A further point fits the arm if it leaves at most this multiple of what the first leaves: both share the errors of the arm.
const AS_WELL: f64 = 3.0;
/// Residual, m, up to which a further point fits in any case.
const FITS_ANYWAY: f64 = 1.0 * MM;
/// Points of a tool are at least this far apart, m: what is nearer is the same point, measured again.
const APART: f64 = 1.0 * MM;

/// Adds the further points to a proposal; what is found in words.
pub(super) fn add_targets(
    proposal: &mut Proposal<'_>,
    triples: &[[usize; 3]],
    first: &Dataset,
    residual: f64,
    path: &Path,
) -> Vec<String> {
    let table = proposal.table;
    let title = |k: usize| table.columns[k].stem.as_str();
    let mut reasons = Vec::new();
    let mut places = vec![Vector3::from(first.tool.xyz)];
    let other = triples.iter().filter(|t| !t.iter().any(|k| proposal.points.contains(k))).copied();
    for triple in other.collect::<Vec<_>>() {
        let Some(name) = distinction(title(proposal.points[0]), title(triple[0])) else { continue };
        if proposal.commanded == Some(triple) || proposal.targets.iter().any(|(known, _)| *known == name) {
            continue;
        }
        let alone = Proposal { points: triple, commanded: None, targets: Vec::new(), ..proposal.clone() };
        let Some(tried) = alone.tried(path).filter(|t| t.residual <= FITS_ANYWAY.max(AS_WELL * residual)) else { continue };
        let at = Vector3::from(tried.dataset.tool.xyz);
        if places.iter().any(|known| (known - at).norm() < APART) {
            reasons
                .push(format!("{} are where another point of the tool is: it is the same, or a copy", table.titles(&triple)));
            continue;
        }
        places.push(at);
        reasons.push(format!("a further point of the tool, `{name}`: {}", table.titles(&triple)));
        proposal.targets.push((name, triple));
    }
    reasons
}

/// What one title has where the other has something else, if that is one letter or a number in both.
fn distinction(first: &str, other: &str) -> Option<String> {
    let [a, b]: [Vec<char>; 2] = [first, other].map(|t| t.chars().collect());
    let same = a.iter().zip(&b).take_while(|(x, y)| x == y).count();
    let end = a.iter().rev().zip(b.iter().rev()).take_while(|(x, y)| x == y).count().min(a.len().min(b.len()) - same);
    let [of_first, of_other] = [&a[same..a.len() - end], &b[same..b.len() - end]];
    let is_short = |part: &[char]| {
        part.is_empty() || part.iter().all(char::is_ascii_digit) || part.len() == 1 && part[0].is_alphanumeric()
    };
    if of_other.is_empty() || !is_short(of_first) || !is_short(of_other) {
        return None;
    }
    let name: String = of_other.iter().collect();
    Some(if name.starts_with(|c: char| c.is_ascii_digit()) { format!("m{name}") } else { name })
}

#[cfg(test)]
mod tests {
    use super::distinction;

    #[test]
    fn titles_of_points_differ_in_a_number_or_a_letter() {
        let differ = |a, b| distinction(a, b);
        assert_eq!(differ("x1", "x2"), Some("m2".into()));
        assert_eq!(differ("x9", "x10"), Some("m10".into()));
        assert_eq!(differ("ax", "bx"), Some("b".into()));
        assert_eq!(differ("x", "x2"), Some("m2".into()));
        assert_eq!(differ("x", "x_meas"), None);
        assert_eq!(differ("goal_x", "miss_x"), None);
        assert_eq!(differ("x", "x"), None);
    }
}
