//! Polylines of joint angles: their lengths and parts.

/// Sum over the legs of a polyline of the largest joint motion, rad.
pub(super) fn length(path: &[Vec<f64>]) -> f64 {
    path.windows(2).map(|leg| turn(&leg[0], &leg[1])).sum()
}

/// The largest joint motion between two postures, rad: all joints move together, so it determines the time.
///
/// ```
/// use calibench::measure::poses::ways::turn;
///
/// assert_eq!(turn(&[0.0, 1.0], &[0.25, 0.5]), 0.5);
/// ```
pub fn turn(from: &[f64], to: &[f64]) -> f64 {
    from.iter().zip(to).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// The first part of a polyline, by a fraction of its length; only its start for 0.
pub(super) fn part(path: &[Vec<f64>], share: f64) -> Vec<Vec<f64>> {
    let mut left = share * length(path);
    let mut taken = vec![path[0].clone()];
    for leg in path.windows(2) {
        let whole = turn(&leg[0], &leg[1]);
        if left <= 0.0 {
            break;
        }
        let share = if whole > 0.0 { (left / whole).min(1.0) } else { 1.0 };
        taken.push(leg[0].iter().zip(&leg[1]).map(|(a, b)| a + share * (b - a)).collect());
        left -= whole;
    }
    taken
}
