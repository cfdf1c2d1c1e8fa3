//! The rows that a calibration was fitted to, in a sketch that fits a line: rows that come back under the name of another dataset are
//! recognised, and not taken for rows that were left out.
//!
//! The smallest digests of all rows are a random sample of them (A. Z. Broder, *On the resemblance and containment of documents*, 1997):
//! of other rows, those with digests as small are among them or were not fitted.

use crate::identify::Use;
use crate::measure::{Dataset, Measured, Sample};

/// Digests kept: of 12,000 rows one in a hundred.
const KEPT: usize = 128;

/// Hexadecimal digits of a digest in a file.
const DIGITS: usize = 12;

/// Bits of a digest.
const MASK: u64 = (1 << (4 * DIGITS)) - 1;

/// Readings are equal if they are to a nanometre and a nanoradian: files are rounded.
const GRAIN: f64 = 1e-9;

/// The smallest digests of the rows that were fitted, ascending.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct FittedRows(Vec<u64>);

impl FittedRows {
    /// The sketch of the rows of set `fit`.
    pub fn of(datasets: &[(&str, &Dataset)]) -> Self {
        let rows = datasets.iter().flat_map(|(_, d)| d.samples.iter().filter(|s| Use::Fit.takes(s)));
        let mut digests: Vec<u64> = rows.map(digest).collect();
        if digests.len() > KEPT {
            digests.select_nth_unstable(KEPT - 1);
            digests.truncate(KEPT);
        }
        digests.sort_unstable();
        FittedRows(digests)
    }

    /// Share of the rows of `which` that were fitted; an estimate where more rows were fitted than digests are kept.
    pub fn share(&self, datasets: &[(&str, &Dataset)], which: Use) -> f64 {
        let last = if self.0.len() < KEPT { MASK } else { self.0[KEPT - 1] };
        let rows = datasets.iter().flat_map(|(_, d)| d.samples.iter().filter(|s| which.takes(s)));
        let (mut as_small, mut fitted) = (0.0, 0.0);
        for digest in rows.map(digest).filter(|digest| *digest <= last) {
            as_small += 1.0;
            fitted += f64::from(u8::from(self.0.binary_search(&digest).is_ok()));
        }
        if as_small > 0.0 { fitted / as_small } else { 0.0 }
    }

    /// True if another calibration was fitted to some of the same rows.
    pub fn meets(&self, other: &FittedRows) -> bool {
        self.0.iter().any(|digest| other.0.binary_search(digest).is_ok())
    }

    /// As a text for files.
    pub(super) fn to_text(&self) -> String {
        self.0.iter().map(|digest| format!("{digest:0DIGITS$x}")).collect()
    }

    /// From the text of a file; `None` if it is no such text.
    pub(super) fn from_text(text: &str) -> Option<Self> {
        let is_text =
            text.len().is_multiple_of(DIGITS) && text.len() <= KEPT * DIGITS && text.bytes().all(|b| b.is_ascii_hexdigit());
        let digests =
            text.as_bytes().chunks(DIGITS).map(|digits| u64::from_str_radix(std::str::from_utf8(digits).ok()?, 16).ok());
        let digests: Vec<u64> = digests.collect::<Option<_>>().filter(|_| is_text)?;
        digests.is_sorted().then_some(FittedRows(digests))
    }
}

/// Digest of what was measured at which joints, whatever the row is called.
fn digest(sample: &Sample) -> u64 {
    let mut digest = 0;
    // The finalizer of SplitMix64 (Steele, Lea, Flood 2014).
    let mut take = |number: f64| {
        digest ^= ((number / GRAIN).round() as i64) as u64;
        digest = u64::wrapping_add(digest, 0x9e37_79b9_7f4a_7c15);
        digest = (digest ^ (digest >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        digest = (digest ^ (digest >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        digest ^= digest >> 31;
    };
    sample.q.iter().for_each(|q| take(*q));
    match &sample.measured {
        Measured::Ball { ball, reading } => {
            take(*ball as f64);
            reading.iter().flat_map(|reading| reading.iter()).for_each(|r| take(*r));
        }
        Measured::Point(point) => point.iter().for_each(|x| take(*x)),
        Measured::Distance { anchor, distance } => {
            take(*anchor as f64);
            take(*distance);
        }
    }
    digest & MASK
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::measure::SampleSet;

    fn rows(from: usize, to: usize, set: SampleSet) -> Dataset {
        let row = |k: usize| {
            let q = (0..6).map(|j| (k * 7 + j) as f64 * 0.01).collect();
            Sample { set, ..Sample::new(format!("row {k}"), q, Measured::Point(Vector3::new(0.1, 0.2, k as f64 * 1e-4))) }
        };
        Dataset { samples: (from..to).map(row).collect(), ..Dataset::default() }
    }

    #[test]
    fn rows_are_recognised_under_another_name() {
        for count in [20, 127, 128, 129, 5_000] {
            let fitted = FittedRows::of(&[("a", &rows(0, count, SampleSet::Fit))]);
            let share =
                |from: usize, to: usize| fitted.share(&[("b", &rows(from, to, SampleSet::Validation))], Use::Validation);
            assert_eq!((share(0, count), share(count, 3 * count)), (1.0, 0.0), "{count}");
            let half = share(count / 2, count / 2 + count);
            assert!((half - 0.5).abs() < 0.15, "{count}: {half}");
            let others = |from: usize, to: usize| FittedRows::of(&[("b", &rows(from, to, SampleSet::Fit))]);
            assert!(fitted.meets(&others(0, count / 2)) && !fitted.meets(&others(count, 2 * count)));
            assert_eq!(fitted.share(&[], Use::All), 0.0);
            assert_eq!(FittedRows::from_text(&fitted.to_text()), Some(fitted.clone()), "{count}");
        }
        for text in ["12", "zzzzzzzzzzzz", "00000000000200000000000100", "é2345678901"] {
            assert_eq!(FittedRows::from_text(text), None, "{text}");
        }
        assert_eq!(FittedRows::from_text(""), Some(FittedRows::default()));
    }

    /// A calibration that was written before, or by others, knows no rows.
    #[test]
    fn a_sketch_of_nothing_recognises_nothing() {
        assert_eq!(FittedRows::default().share(&[("b", &rows(0, 9, SampleSet::Fit))], Use::All), 0.0);
    }
}
