//! Mean and variation from robot to robot of one parameter.

/// Expected value of a parameter for the next robot, and its uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Between {
    pub mean: f64,
    /// One sigma of the next robot about the mean, the uncertainty of both included.
    pub sigma: f64,
    /// Standard deviation from robot to robot.
    pub between: f64,
}

/// One sigma of the logarithm of the variation about the plausible size of the catalogue: a factor of three (docs/fleets.md).
const LOG_SIGMA: f64 = 1.0986;

/// One sigma of the mean before any robot, in plausible sizes.
const MEAN: f64 = 1.0;

/// Smallest variation tried, in plausible sizes.
const LOWEST: f64 = 1e-3;
/// Number of variations tried per decade.
const A_DECADE: f64 = 24.0;
/// Number of variations tried: from a thousandth to thirty plausible sizes.
const STEPS: usize = 108;

/// A variation from robot to robot, and what would follow from it.
struct Tried {
    /// Log likelihood, with the belief in the catalogue.
    ln: f64,
    variation: f64,
    mean: f64,
    /// Variance of the mean.
    variance: f64,
}

/// From deviations with their standard uncertainties, and the plausible size of the catalogue.
///
/// A deviation so uncertain that its square overflows is left out: it carries no information.
pub(super) fn between(seen: &[[f64; 2]], plausible: f64) -> Between {
    let seen: Vec<&[f64; 2]> = seen.iter().filter(|s| s.iter().all(|v| (v * v).is_finite())).collect();
    let of = |step: usize| {
        let tau = plausible * LOWEST * 10f64.powf(step as f64 / A_DECADE);
        // The mean has a wide prior of its own, so that the restricted likelihood is that of one robot more at nominal.
        let (mut information, mut pull, mut squares, mut volume) = ((MEAN * plausible).powi(-2), 0.0, 0.0, 0.0);
        for &&[x, sigma] in &seen {
            let variance = tau * tau + sigma * sigma;
            information += 1.0 / variance;
            pull += x / variance;
            squares += x * x / variance;
            volume += variance.ln();
        }
        let mean = pull / information;
        let belief = ((tau / plausible).ln() / LOG_SIGMA).powi(2);
        let ln = -0.5 * (volume + information.ln() + squares - mean * pull + belief);
        Tried { ln, variation: tau, mean, variance: 1.0 / information }
    };
    let all: Vec<Tried> = (0..STEPS).map(of).collect();
    let most = all.iter().map(|a| a.ln).fold(f64::NEG_INFINITY, f64::max);
    let weights: Vec<f64> = all.iter().map(|a| (a.ln - most).exp()).collect();
    let whole: f64 = weights.iter().sum();
    let average = |of: &dyn Fn(&Tried) -> f64| all.iter().zip(&weights).map(|(a, w)| w * of(a)).sum::<f64>() / whole;
    let mean = average(&|a| a.mean);
    let between = average(&|a| a.variation * a.variation);
    let sigma = between + average(&|a| a.variance + (a.mean - mean).powi(2));
    Between { mean, sigma: sigma.sqrt(), between: between.sqrt() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_good_estimates_give_their_own_mean_and_spread() {
        let seen: Vec<[f64; 2]> = (0..200).map(|k| [3.0 + 0.2 * f64::from(k % 11 - 5), 1e-3]).collect();
        let found = between(&seen, 1.0);
        let spread = 0.2 * f64::sqrt(10.0);
        assert!((found.mean - 3.0).abs() < 0.05 && (found.between - spread).abs() < 0.03, "{found:?}");
        assert!((found.sigma - spread).abs() < 0.04, "{found:?}");
    }

    #[test]
    fn noise_is_no_variation() {
        // Ten estimates that scatter as their uncertainty says: the robots vary by little.
        let seen: Vec<[f64; 2]> = [-1.2, 0.4, 0.9, -0.3, 1.5, -0.8, 0.1, -1.4, 0.6, 0.2].map(|x| [x, 1.0]).to_vec();
        let found = between(&seen, 1.0);
        assert!(found.between < 0.7 && found.mean.abs() < 0.3, "{found:?}");
    }

    #[test]
    fn what_is_not_determined_changes_nothing() {
        let known = [[0.001, 1e-4], [-0.001, 1e-4]];
        assert_eq!(between(&[known[0], known[1], [0.0, 1e160]], 1.0), between(&known, 1.0));
    }

    #[test]
    fn two_robots_leave_much_to_the_catalogue() {
        let found = between(&[[0.001, 1e-4], [-0.001, 1e-4]], 1.0);
        assert!(found.between > 0.3 && found.between < 1.0, "{found:?}");
    }
}
