//! The rows that a calibration was fitted to, by their digests: rows that come back under the name of another dataset are recognised.
//!
//! Of many rows the smallest digests are kept, which are a random sample of them (A. Z. Broder, *On the resemblance and containment of
//! documents*, 1997): a row whose digest is not larger than the largest kept was fitted if, and only if, its digest is kept.

use std::collections::HashSet;

use super::problem::Use;
use crate::measure::dataset::{Measured, NamedDataset, Sample};

/// Largest number of digests kept: a random sample of the rows.
const KEPT: usize = 2048;

/// Hexadecimal digits of a digest in a file.
const DIGITS: usize = 10;

/// Bits of a digest.
const MASK: u64 = (1 << (4 * DIGITS)) - 1;

/// Numbers are rounded to this, m and rad, before they are digested: files are rounded too.
const GRAIN: f64 = 1e-9;

/// Fewest rows by which a share is estimated where not all digests are kept.
const ENOUGH: usize = 10;

/// Fewest equal rows that are not a coincidence: an instrument of coarse steps reads the same again now and then.
const NO_COINCIDENCE: usize = 3;

/// The smallest digests of the rows that were fitted, ascending.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct FittedRows(Vec<u64>);

impl FittedRows {
    /// The sketch of the rows of set `fit`.
    pub fn of(datasets: &[NamedDataset<'_>]) -> Self {
        let rows = datasets.iter().flat_map(|d| d.dataset.samples.iter().filter(|s| Use::Fit.takes(s)));
        let mut digests: Vec<u64> = rows.filter_map(digest).collect();
        if digests.len() > KEPT {
            digests.select_nth_unstable(KEPT - 1);
            digests.truncate(KEPT);
        }
        digests.sort_unstable();
        FittedRows(digests)
    }

    /// Share of the rows of `which` that are the same as rows that were fitted; an estimate where more were fitted than are kept,
    /// `None` where it cannot be determined: no rows are kept, or too few to estimate it by.
    ///
    /// ```
    /// use calibench::identify::FittedRows;
    /// use calibench::identify::problem::Use;
    /// use calibench::measure::dataset::{Dataset, Measured, NamedDataset, Sample};
    /// use calibench::nalgebra::Vector3;
    ///
    /// let point = |k: usize| Measured::Point(Vector3::new(0.5, 0.0, 0.01 * k as f64));
    /// let row = |k: usize| Sample::new(format!("p{k}"), vec![0.1 * k as f64; 6], point(k));
    /// let fitted = Dataset { samples: (0..20).map(row).collect(), ..Dataset::default() };
    /// let judged = Dataset { samples: (15..20).chain(30..45).map(row).collect(), ..Dataset::default() };
    /// let rows = FittedRows::of(&[NamedDataset::new("fitted", &fitted)]);
    /// assert_eq!(rows.share(&[NamedDataset::new("judged", &judged)], Use::All), Some(0.25));
    /// ```
    pub fn share(&self, datasets: &[NamedDataset<'_>], which: Use) -> Option<f64> {
        let is_whole = self.0.len() < KEPT;
        let last = if is_whole { MASK } else { self.0[KEPT - 1] };
        let rows = datasets.iter().flat_map(|d| d.dataset.samples.iter().filter(|s| which.takes(s)));
        let (mut seen, mut fitted) = (0, 0);
        for digest in rows.filter_map(digest).filter(|digest| *digest <= last) {
            seen += 1;
            fitted += usize::from(self.0.binary_search(&digest).is_ok());
        }
        let is_told = seen >= if is_whole { 1 } else { ENOUGH };
        (is_told && !self.0.is_empty()).then(|| fitted as f64 / seen as f64)
    }

    /// True if several of the rows kept are also kept of another calibration.
    pub fn meets(&self, other: &FittedRows) -> bool {
        self.0.iter().filter(|digest| other.0.binary_search(digest).is_ok()).count() >= NO_COINCIDENCE
    }

    /// As a text for files.
    pub(super) fn to_text(&self) -> String {
        self.0.iter().map(|digest| format!("{digest:0DIGITS$x}")).collect()
    }

    /// From the text of a file; `None` if it is another text.
    pub(super) fn from_text(text: &str) -> Option<Self> {
        let is_text =
            text.len().is_multiple_of(DIGITS) && text.len() <= KEPT * DIGITS && text.bytes().all(|b| b.is_ascii_hexdigit());
        let digests =
            text.as_bytes().chunks(DIGITS).map(|digits| u64::from_str_radix(std::str::from_utf8(digits).ok()?, 16).ok());
        let digests: Vec<u64> = digests.collect::<Option<_>>().filter(|_| is_text)?;
        digests.is_sorted().then_some(FittedRows(digests))
    }
}

/// True if most of some rows, and several of them, are also among others: the same joints with the same readings.
pub fn are_copied<'a>(rows: impl Iterator<Item = &'a Sample>, from: impl Iterator<Item = &'a Sample>) -> bool {
    let from: HashSet<u64> = from.filter_map(digest).collect();
    let (mut all, mut copied) = (0, 0);
    for row in rows {
        all += 1;
        copied += usize::from(digest(row).is_some_and(|digest| from.contains(&digest)));
    }
    copied >= NO_COINCIDENCE && 2 * copied > all
}

/// Digest of the joints, and of what was read there; `None` if nothing was read, as of a ball that was centred to zero.
fn digest(sample: &Sample) -> Option<u64> {
    if matches!(sample.measured, Measured::Ball { reading: None, .. }) {
        return None;
    }
    let digest = sample.numbers().fold(0u64, |digest, number| {
        // The finalizer of SplitMix64 (Steele, Lea, Flood 2014).
        let digest = (digest ^ ((number / GRAIN).round() as i64) as u64).wrapping_add(0x9e37_79b9_7f4a_7c15);
        let digest = (digest ^ (digest >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let digest = (digest ^ (digest >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        digest ^ (digest >> 31)
    });
    Some(digest & MASK)
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::measure::dataset::{Dataset, SampleSet};

    fn rows(from: usize, to: usize, set: SampleSet) -> Dataset {
        let row = |k: usize| {
            let q = (0..6).map(|j| (k * 7 + j) as f64 * 0.01).collect();
            Sample { set, ..Sample::new(format!("row {k}"), q, Measured::Point(Vector3::new(0.1, 0.2, k as f64 * 1e-4))) }
        };
        Dataset { samples: (from..to).map(row).collect(), ..Dataset::default() }
    }

    #[test]
    fn rows_are_recognised_under_another_name() {
        for count in [20, KEPT - 1, KEPT, KEPT + 1, 12_000] {
            let fitted = FittedRows::of(&[NamedDataset::new("a", &rows(0, count, SampleSet::Fit))]);
            let share = |from: usize, to: usize| {
                fitted.share(&[NamedDataset::new("b", &rows(from, to, SampleSet::Validation))], Use::Validation)
            };
            assert_eq!((share(0, count), share(count, 3 * count)), (Some(1.0), Some(0.0)), "{count}");
            let half = share(count / 2, count / 2 + count).expect("told");
            assert!((half - 0.5).abs() < 0.05, "{count}: {half}");
            let others = |from: usize, to: usize| FittedRows::of(&[NamedDataset::new("b", &rows(from, to, SampleSet::Fit))]);
            assert!(fitted.meets(&others(0, count / 2)) && !fitted.meets(&others(count, 2 * count)));
            assert_eq!(FittedRows::from_text(&fitted.to_text()), Some(fitted.clone()), "{count}");
        }
        for text in ["12", "zzzzzzzzzz", "00000000020000000001", "é23456789"] {
            assert_eq!(FittedRows::from_text(text), None, "{text}");
        }
        assert_eq!(FittedRows::from_text(""), Some(FittedRows::default()));
    }

    /// Of 12,000 rows a sixth are kept: three rows say nothing, and none are said of a calibration that knows no rows.
    #[test]
    fn what_cannot_be_told_is_not_told() {
        let fitted = FittedRows::of(&[NamedDataset::new("a", &rows(0, 12_000, SampleSet::Fit))]);
        assert_eq!(fitted.share(&[NamedDataset::new("b", &rows(0, 3, SampleSet::Fit))], Use::All), None);
        assert_eq!(FittedRows::default().share(&[NamedDataset::new("b", &rows(0, 9, SampleSet::Fit))], Use::All), None);
        assert_eq!(fitted.share(&[], Use::All), None);
    }

    #[test]
    fn a_coincidence_is_no_copy() {
        let copied = |rows: &Dataset, from: &Dataset| are_copied(rows.samples.iter(), from.samples.iter());
        let whole = rows(0, 20, SampleSet::Validation);
        assert!(copied(&whole, &whole) && copied(&rows(0, 5, SampleSet::Fit), &whole));
        assert!(!copied(&rows(18, 23, SampleSet::Fit), &whole), "two of five");
        assert!(!copied(&rows(14, 34, SampleSet::Fit), &whole), "six of twenty");
        let centred = |k: usize| Sample::new(format!("b{k}"), vec![0.1; 6], Measured::Ball { ball: 0, reading: None });
        let centred = Dataset { samples: (0..5).map(centred).collect(), ..Dataset::default() };
        assert!(!copied(&centred, &centred), "centred to zero at the same rounded joints");
    }
}
