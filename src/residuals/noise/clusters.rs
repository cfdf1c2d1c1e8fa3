//! Postures that stand together in the angle of one joint: what errs there is the arm, and no accident.

/// Probability by chance, of all joints together, below which postures stand together.
const BY_CHANCE: f64 = 0.01;

/// True if the chosen of these postures (rad or m, one entry a joint) lie in so small a part of the angles of one joint that chance
/// is no explanation: of k drawn from n, all are among w that follow each other with a probability of about k (w / n)^(k - 1).
pub(super) fn stand_together(postures: &[&[f64]], chosen: &[usize]) -> bool {
    let joints = postures.first().map_or(0, |q| q.len());
    let (all, count) = (postures.len() as f64, chosen.len() as f64);
    if chosen.len() < 3 {
        return false;
    }
    let is_narrow = |joint: usize| {
        let angles = || chosen.iter().map(|&k| postures[k][joint]);
        let (low, high) = angles().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        let among = postures.iter().filter(|q| (low..=high).contains(&q[joint])).count() as f64;
        count * (among / all).powf(count - 1.0) * (joints as f64) < BY_CHANCE
    };
    (0..joints).any(is_narrow)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_narrow_range_of_one_joint_is_told_from_chance() {
        let postures: Vec<Vec<f64>> = (0..80).map(|k| (1..=6).map(|j| ((k * j) as f64 * 0.618).fract()).collect()).collect();
        let all: Vec<&[f64]> = postures.iter().map(Vec::as_slice).collect();
        let narrow: Vec<usize> = (0..80).filter(|&k| (0.4..0.5).contains(&postures[k][2])).collect();
        assert!(narrow.len() >= 5 && stand_together(&all, &narrow));
        assert!(!stand_together(&all, &[3, 20, 37, 55, 71]) && !stand_together(&all, &[3, 4]));
    }
}
