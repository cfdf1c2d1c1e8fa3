//! Observability of parameters from a set of measurements: five indices from the Jacobian's singular values.
//!
//! Sun & Hollerbach, "Observability index selection for robot calibration", ICRA 2008, where each index is traced to the
//! optimality criterion it serves: O1 to D (volume of the confidence ellipsoid), O3 to E, O5 close to A.

/// Observability of m parameters from n poses, of the SI Jacobian; larger is better for all five.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observability {
    /// `(prod sigma)^(1/m) / sqrt(n)` (Borm & Menq 1991): the geometric mean, per pose.
    pub o1: f64,
    /// `sigma_min / sigma_max` (Driels & Pathre 1990): the inverse condition number.
    pub o2: f64,
    /// `sigma_min` (Nahvi, Hollerbach & Hayward 1994): the worst determined combination.
    pub o3: f64,
    /// `sigma_min^2 / sigma_max` (Nahvi & Hollerbach 1996): the noise amplification index.
    pub o4: f64,
    /// `1 / sum(1 / sigma)` (Sun & Hollerbach 2008).
    pub o5: f64,
}

impl Observability {
    /// Not computed: NaN all five.
    pub const UNKNOWN: Observability = Observability { o1: f64::NAN, o2: f64::NAN, o3: f64::NAN, o4: f64::NAN, o5: f64::NAN };

    /// Computes the indices from the singular values, in any order, of the stacked Jacobian of `poses` poses; all zero if
    /// there is no parameter.
    ///
    /// ```
    /// use calibench::math::Observability;
    ///
    /// // Singular values 2 and 8 from four poses, by hand.
    /// let o = Observability::new(&[2.0, 8.0], 4);
    /// assert!((o.o1 - 2.0).abs() < 1e-15);
    /// assert_eq!((o.o2, o.o3, o.o4, o.o5), (0.25, 2.0, 0.5, 1.6));
    /// assert_eq!(o.condition(), 4.0);
    /// ```
    pub fn new(singular_values: &[f64], poses: usize) -> Self {
        if singular_values.is_empty() || poses == 0 {
            return Observability { o1: 0.0, o2: 0.0, o3: 0.0, o4: 0.0, o5: 0.0 };
        }
        let m = singular_values.len() as f64;
        let max = singular_values.iter().copied().fold(0.0, f64::max);
        let min = singular_values.iter().copied().fold(f64::INFINITY, f64::min);
        // Logarithms: the product itself leaves the range of f64 from about a hundred parameters on.
        let mean_log = singular_values.iter().map(|s| s.ln()).sum::<f64>() / m;
        let ratio = if max > 0.0 { min / max } else { 0.0 };
        Observability {
            o1: mean_log.exp() / (poses as f64).sqrt(),
            o2: ratio,
            o3: min,
            o4: min * ratio,
            o5: 1.0 / singular_values.iter().map(|s| 1.0 / s).sum::<f64>(),
        }
    }

    /// Condition number `sigma_max / sigma_min`; infinite if a combination is not observable at all.
    pub fn condition(&self) -> f64 {
        1.0 / self.o2
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_singular_values_by_hand() {
        let o = Observability::new(&[2.0, 2.0, 2.0], 4);
        assert!((o.o1 - 1.0).abs() < 1e-15 && o.o2 == 1.0 && o.o3 == 2.0 && o.o4 == 2.0);
        assert!((o.o5 - 2.0 / 3.0).abs() < 1e-15 && o.condition() == 1.0);
    }

    #[test]
    fn an_unseen_combination_makes_all_five_zero() {
        let o = Observability::new(&[3.0, 1.0, 0.0], 2);
        assert_eq!([o.o1, o.o2, o.o3, o.o4, o.o5], [0.0; 5]);
        assert_eq!(o.condition(), f64::INFINITY);
        assert_eq!(Observability::new(&[], 80).o1, 0.0);
    }
}
