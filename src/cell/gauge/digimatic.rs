//! Mitutoyo's Digimatic word: the 52 bits sent by the instrument's own connector, which interfaces convert to text.
//!
//! Thirteen digits of four bits, each sent least significant bit first: F F F F, sign (0 or 8), six digits from the most
//! significant, the number of decimals, the unit (0 mm, 1 inch; 2 to 7 the same with a verdict). Source: Mitutoyo 99MAF600B.

use thiserror::Error;

use super::{DisplayUnit, GaugeReading, Tolerance};

/// The thirteen digits, in the order sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DigimaticWord(pub [u8; 13]);

/// Reason why bits are not a word.
#[derive(Debug, Error, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum DigimaticError {
    /// A digit is not allowed in its place.
    #[error("digit {place} of the Digimatic word is {digit:X}")]
    Digit {
        /// Counted from 1.
        place: usize,
        /// The digit.
        digit: u8,
    },
}

impl DigimaticWord {
    /// Creates a word from its bits in the order sent, the first being the most significant of 52.
    pub fn from_bits(bits: u64) -> Self {
        DigimaticWord(std::array::from_fn(|k| {
            let sent = (bits >> (4 * (12 - k))) & 0xf;
            (sent as u8).reverse_bits() >> 4
        }))
    }

    /// The bits in the order sent, the first being the most significant of 52.
    pub fn bits(&self) -> u64 {
        self.0.iter().fold(0, |bits, digit| (bits << 4) | u64::from((digit & 0xf).reverse_bits() >> 4))
    }

    /// Encodes `value` of `unit` with this many decimals (at most 5); `None` if six digits cannot hold it, or the unit is
    /// neither of the two.
    ///
    /// ```
    /// use calibench::cell::gauge::{DigimaticWord, DisplayUnit};
    ///
    /// // -1.234 mm: four F, the sign, six digits, three decimals, millimetres.
    /// let word = DigimaticWord::encode(-1.234, 3, DisplayUnit::Millimetre).ok_or("six digits")?;
    /// assert_eq!(word.0, [15, 15, 15, 15, 8, 0, 0, 1, 2, 3, 4, 3, 0]);
    /// assert_eq!(word.decode().map(|reading| reading.value), Ok(-1.234));
    /// # Ok::<(), &str>(())
    /// ```
    pub fn encode(value: f64, decimals: usize, unit: DisplayUnit) -> Option<Self> {
        let unit = match unit {
            DisplayUnit::Millimetre => 0,
            DisplayUnit::Inch => 1,
            DisplayUnit::Micrometre => return None,
        };
        if decimals > 5 || !value.is_finite() || value.abs() >= 1e6 {
            return None;
        }
        let shown = format!("{:.decimals$}", value.abs()).replace('.', "");
        let digits = format!("{shown:0>6}");
        let digits: [u8; 6] = digits.as_bytes().try_into().ok()?;
        let mut word = [0xf; 13];
        word[4] = if value < 0.0 && digits != *b"000000" { 8 } else { 0 };
        for (place, digit) in word[5..11].iter_mut().zip(digits) {
            *place = digit - b'0';
        }
        word[11] = decimals as u8;
        word[12] = unit;
        Some(DigimaticWord(word))
    }

    /// Decodes the displayed value.
    ///
    /// # Errors
    /// [`DigimaticError::Digit`]: the first digit that is not allowed.
    pub fn decode(&self) -> Result<GaugeReading, DigimaticError> {
        let allowed = |place: usize, digit: u8| match place {
            0..=3 => digit == 0xf,
            4 => digit == 0 || digit == 8,
            5..=10 => digit < 10,
            11 => digit < 6,
            _ => digit < 8,
        };
        if let Some((k, &digit)) = self.0.iter().enumerate().find(|(k, digit)| !allowed(*k, **digit)) {
            return Err(DigimaticError::Digit { place: k + 1, digit });
        }
        let digits = self.0[5..11].iter().fold(0_u32, |number, &digit| 10 * number + u32::from(digit));
        let decimals = usize::from(self.0[11]);
        // Division by an exact power of ten gives the nearest double, as parsing text does.
        let size = f64::from(digits) / 10_f64.powi(i32::from(self.0[11]));
        let (unit, tolerance) = match self.0[12] {
            0 => (DisplayUnit::Millimetre, None),
            1 => (DisplayUnit::Inch, None),
            2 => (DisplayUnit::Millimetre, Some(Tolerance::Above)),
            3 => (DisplayUnit::Millimetre, Some(Tolerance::Within)),
            4 => (DisplayUnit::Millimetre, Some(Tolerance::Below)),
            5 => (DisplayUnit::Inch, Some(Tolerance::Above)),
            6 => (DisplayUnit::Inch, Some(Tolerance::Within)),
            _ => (DisplayUnit::Inch, Some(Tolerance::Below)),
        };
        Ok(GaugeReading { value: if self.0[4] == 8 { -size } else { size }, decimals, unit: Some(unit), tolerance })
    }
}
