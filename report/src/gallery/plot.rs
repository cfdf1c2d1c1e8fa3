//! A picture: the residual of the fit, and the part of it that an effect explains.

/// Points of the residual, and the curve of the effect through them.
#[derive(Debug, Clone, PartialEq)]
pub struct Plot {
    /// Heading.
    pub title: String,
    /// Quantity and unit of the abscissa.
    pub x: String,
    /// True if the abscissa is an angle in degrees, which has ticks at parts of a turn.
    pub degrees: bool,
    /// Quantity and unit of the ordinate.
    pub y: String,
    /// Residuals of the fit.
    pub points: Vec<[f64; 2]>,
    /// Indices of points that are emphasised.
    pub marked: Vec<usize>,
    /// The curve of the effect: pieces of a polyline. Empty if what is drawn is not a function of the abscissa.
    pub curve: Vec<Vec<[f64; 2]>>,
    /// Part of each residual that the effect explains, in the order of the points, where there is no curve.
    pub taken: Vec<f64>,
    /// Names of the places 0, 1, ... of the abscissa; empty if it is a number.
    pub names: Vec<String>,
    /// Share of the squares of the ordinates that the curve (or what is drawn in its place) takes, at most 1.
    pub explained: f64,
}

impl Plot {
    /// Share of the squares of the points' ordinates that `predicted` takes away.
    pub(super) fn share(points: &[[f64; 2]], predicted: impl Iterator<Item = f64>) -> f64 {
        let whole: f64 = points.iter().map(|p| p[1] * p[1]).sum();
        let left: f64 = points.iter().zip(predicted).map(|(p, y)| (p[1] - y) * (p[1] - y)).sum();
        if whole > 0.0 { 1.0 - left / whole } else { 0.0 }
    }

    /// The smallest and largest value of a coordinate, curve included; both directions of the ordinate from zero.
    pub(super) fn range(&self, axis: usize) -> [f64; 2] {
        let taken = self.taken.iter().filter(|_| axis == 1).copied();
        let all = self.points.iter().chain(self.curve.iter().flatten()).map(|p| p[axis]).chain(taken);
        let [low, high] = all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)]);
        match axis {
            0 if !self.names.is_empty() => [-0.5, self.names.len() as f64 - 0.5],
            0 => [low, high],
            _ if low >= 0.0 => [0.0, high],
            _ => {
                let most = low.abs().max(high.abs());
                [-most, most]
            }
        }
    }
}
