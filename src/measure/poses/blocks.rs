//! Blocks of postures close to each other in joint space: with a block left out, a model is tested on postures far from those
//! fitted.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::Postures;

/// Iterations of Lloyd's algorithm.
const ROUNDS: usize = 20;

impl Postures {
    /// Assigns a block, below `count`, to each posture by k-means on joint angles, all joints weighted equally, starting from
    /// centres far apart. `joints` are the angles of each sample, rad; the first of a posture represents it. The same seed
    /// gives the same blocks; a block may be empty.
    pub fn blocks(&self, joints: &[&[f64]], count: usize, seed: u64) -> Vec<usize> {
        let points: Vec<&[f64]> = self.members().iter().map(|samples| joints[samples[0]]).collect();
        if points.is_empty() {
            return Vec::new();
        }
        let mut centres = far_apart(&points, count, seed);
        let mut of = vec![0; points.len()];
        for _ in 0..ROUNDS {
            of = points.iter().map(|p| closest(p, &centres)).collect();
            for (k, centre) in centres.iter_mut().enumerate() {
                let own: Vec<&&[f64]> = points.iter().zip(&of).filter(|(_, o)| **o == k).map(|(p, _)| p).collect();
                if !own.is_empty() {
                    (0..centre.len()).for_each(|j| centre[j] = own.iter().map(|p| p[j]).sum::<f64>() / own.len() as f64);
                }
            }
        }
        of
    }
}

/// Draws points one after the other, each with a probability proportional to its squared distance from those drawn before
/// (k-means++).
fn far_apart(points: &[&[f64]], count: usize, seed: u64) -> Vec<Vec<f64>> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut centres: Vec<Vec<f64>> = vec![points[random.random_range(0..points.len())].to_vec()];
    let mut nearest: Vec<f64> = points.iter().map(|p| distance(p, &centres[0])).collect();
    while centres.len() < count {
        let mut left = random.random::<f64>() * nearest.iter().sum::<f64>();
        let chosen = nearest.iter().position(|d| {
            left -= d;
            left <= 0.0
        });
        let centre = points[chosen.unwrap_or(points.len() - 1)].to_vec();
        nearest.iter_mut().zip(points).for_each(|(d, p)| *d = d.min(distance(p, &centre)));
        centres.push(centre);
    }
    centres
}

fn closest(point: &[f64], centres: &[Vec<f64>]) -> usize {
    let nearer = |a: &usize, b: &usize| distance(point, &centres[*a]).total_cmp(&distance(point, &centres[*b]));
    (0..centres.len()).min_by(nearer).unwrap_or(0)
}

/// Squared distance.
fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clouds_are_blocks_repeats_stay_together_and_nothing_is_no_block() {
        let cloud = |centre: f64| (0..10).map(move |k| [centre + 0.01 * f64::from(k), -centre]);
        let angles: Vec<[f64; 2]> = [0.0, 2.0, -3.0].into_iter().flat_map(cloud).flat_map(|q| [q, q]).collect();
        let joints: Vec<&[f64]> = angles.iter().map(|q| q.as_slice()).collect();
        let postures = Postures::of_joints(&joints, &vec![0; joints.len()]);
        let blocks = postures.blocks(&joints, 3, 1);
        assert_eq!((postures.count(), blocks.len()), (30, 30));
        let firsts = [blocks[0], blocks[10], blocks[20]];
        assert_eq!(std::collections::BTreeSet::from(firsts).len(), 3, "{blocks:?}");
        for (k, block) in blocks.iter().enumerate() {
            assert_eq!(*block, firsts[k / 10], "posture {k}");
        }
        assert_eq!(blocks, postures.blocks(&joints, 3, 1), "the same seed");
        // More blocks than distinct points: some are empty.
        let one: Vec<&[f64]> = vec![&[1.0, 1.0]];
        assert_eq!(Postures::of_joints(&one, &[0]).blocks(&one, 4, 1), [0]);
        assert_eq!(Postures::default().blocks(&[], 4, 1), [0; 0]);
    }
}
