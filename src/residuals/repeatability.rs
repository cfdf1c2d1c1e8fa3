//! Pose repeatability according to ISO 9283 (1998), 7.2.2, with its confidence interval.
//!
//! For positions x_j attained at one target: `l_j = |x_j - mean(x)|`, `RP = mean(l) + 3 s`, where s is the standard
//! deviation of l.
//!
//! The interval is for the RP of infinitely many returns with the same scatter, which is assumed to be Gaussian with
//! any covariance. The ratio of the RP of finitely many returns to it depends only on the shape of the covariance, not
//! on its size. Its distribution is simulated with the observed shape (parametric bootstrap of a pivot; Davison,
//! Hinkley, Bootstrap Methods and their Application, 1997, 5.2).

use nalgebra::{Matrix3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::lost_motion::{Arrivals, LostMotion};
use crate::measure::campaign::repeatability::{Return, Reversal, StationRecord};

/// Number of draws of the ratio: the coverage at its 2.5 and 97.5 % points is then accurate to about half a percent.
const DRAWS: usize = 1000;
/// Fixed seed ("RP" in ASCII): the same returns give the same interval.
const SEED: u64 = 0x5250;
/// Probability in each tail of the confidence interval (intervals of 95 %, docs/repeatability.md).
const TAIL: f64 = 0.025;

/// Repeatability of positions attained at one target.
///
/// ```
/// use calibench::nalgebra::Vector3;
/// use calibench::residuals::PoseRepeatability;
/// use calibench::units::UM;
///
/// // Four returns, all 10 µm from their barycentre: no scatter of the distances, so RP = 10 µm.
/// let positions = [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)].map(|(x, y)| Vector3::new(x, y, 0.0) * 10.0 * UM);
/// let attained = PoseRepeatability::of(&positions).ok_or("two positions or more")?;
/// assert!((attained.rp - 10.0 * UM).abs() < 1e-10);
/// # Ok::<(), &str>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseRepeatability {
    /// Number of positions.
    pub count: usize,
    /// Mean distance from their barycentre, m.
    pub mean: f64,
    /// Standard deviation of the distances, m.
    pub deviation: f64,
    /// RP, m.
    pub rp: f64,
    /// 95 % confidence interval of the RP of infinitely many positions, m.
    pub interval: [f64; 2],
}

impl PoseRepeatability {
    /// Computes the repeatability of positions (m); `None` for fewer than two.
    pub fn of(positions: &[Vector3<f64>]) -> Option<Self> {
        let n = positions.len();
        if n < 2 {
            return None;
        }
        let (mean, deviation) = distances(positions);
        let rp = mean + 3.0 * deviation;
        let [low, high] = ratios(&spreads(positions), n);
        Some(PoseRepeatability { count: n, mean, deviation, rp, interval: [rp / high, rp / low] })
    }
}

/// Mean and standard deviation of the distances from the barycentre.
fn distances(positions: &[Vector3<f64>]) -> (f64, f64) {
    let n = positions.len() as f64;
    let barycentre = positions.iter().sum::<Vector3<f64>>() / n;
    let (mut sum, mut squares) = (0.0, 0.0);
    for x in positions {
        let square = (x - barycentre).norm_squared();
        sum += square.sqrt();
        squares += square;
    }
    let mean = sum / n;
    (mean, ((squares - n * mean * mean).max(0.0) / (n - 1.0)).sqrt())
}

/// Standard deviations along the principal axes, m.
fn spreads(positions: &[Vector3<f64>]) -> [f64; 3] {
    let n = positions.len() as f64;
    let barycentre = positions.iter().sum::<Vector3<f64>>() / n;
    let off = positions.iter().map(|x| x - barycentre);
    let covariance = off.fold(Matrix3::zeros(), |sum, d| sum + d * d.transpose()) / (n - 1.0);
    covariance.symmetric_eigenvalues().map(|v| v.max(0.0).sqrt()).into()
}

/// 2.5 and 97.5 % points of the ratio of the RP of `count` positions to that of infinitely many, for this shape of
/// scatter; ones if there is no scatter.
fn ratios(spreads: &[f64; 3], count: usize) -> [f64; 2] {
    let largest = spreads.iter().fold(0.0, |a: f64, &b| a.max(b));
    if largest <= 0.0 {
        return [1.0; 2];
    }
    let shape = spreads.map(|s| s / largest);
    let mut random = ChaCha8Rng::seed_from_u64(SEED);
    let mut positions = vec![Vector3::zeros(); count];
    let (mut sum, mut squares) = (0.0, 0.0);
    let mut found: Vec<f64> = (0..DRAWS)
        .map(|_| {
            for x in &mut positions {
                *x = Vector3::from_fn(|k, _| shape[k] * random.sample::<f64, _>(StandardNormal));
                sum += x.norm();
                squares += x.norm_squared();
            }
            let (mean, deviation) = distances(&positions);
            mean + 3.0 * deviation
        })
        .collect();
    let drawn = (DRAWS * count) as f64;
    let mean = sum / drawn;
    let endless = mean + 3.0 * (squares / drawn - mean * mean).max(0.0).sqrt();
    found.sort_by(f64::total_cmp);
    [TAIL, 1.0 - TAIL].map(|p| found[((DRAWS - 1) as f64 * p).round() as usize] / endless)
}

/// Results at one station.
#[derive(Debug, Clone, PartialEq)]
pub struct StationRepeatability {
    /// Name of the planned pose.
    pub id: String,
    /// The ball, by its index.
    pub ball: usize,
    /// Repeatability of the attained position: the gauge's readings on return to the same joints.
    pub attained: PoseRepeatability,
    /// Repeatability of the attained position less the motion that the encoders saw.
    pub unseen: PoseRepeatability,
    /// Repeatability of the ball's position from encoders and readings after centring, as for one probing of a
    /// campaign.
    pub probing: PoseRepeatability,
    /// Repeatability of readings without a motion: the noise of the gauge, which is contained in all three.
    pub gauge: PoseRepeatability,
}

/// Repeatability at every station and lost motion of every joint.
#[derive(Debug, Clone, PartialEq)]
pub struct Repeatability {
    /// Stations, in the order in which they were visited.
    pub stations: Vec<StationRepeatability>,
    /// Lost motion by joint; empty if no joint was reversed twice at a station.
    pub lost_motion: Vec<LostMotion>,
}

impl Repeatability {
    /// Evaluates the records of all stations; `None` if a station has fewer than two returns, centrings or readings at
    /// rest.
    pub fn of(records: &[StationRecord]) -> Option<Self> {
        let stations = records.iter().map(station).collect::<Option<Vec<_>>>()?;
        let joints = records.iter().map(|r| r.station.levers.len()).min().unwrap_or(0);
        let lost_motion = (0..joints).filter_map(|joint| {
            let arrivals: Vec<Arrivals> = records.iter().map(|record| arrivals(record, joint)).collect();
            LostMotion::of(joint, &arrivals)
        });
        Some(Repeatability { lost_motion: lost_motion.collect(), stations })
    }
}

/// Displacement of the TCP from the target according to the encoders, tool axes, m.
fn seen(record: &StationRecord, joints: &[f64]) -> Vector3<f64> {
    let moved = joints.iter().zip(&record.target).map(|(q, target)| q - target);
    record.station.levers.iter().zip(moved).map(|(lever, by)| lever * by).sum()
}

/// Displacement of the TCP from the target, less the part that the encoders saw, tool axes, m.
fn unseen(record: &StationRecord, back: &Return) -> Vector3<f64> {
    -back.reading - seen(record, &back.joints)
}

fn station(record: &StationRecord) -> Option<StationRepeatability> {
    let pose = &record.station.pose;
    let of = |positions: Vec<Vector3<f64>>| PoseRepeatability::of(&positions);
    Some(StationRepeatability {
        id: pose.id.clone(),
        ball: pose.ball?,
        attained: of(record.returns.iter().map(|back| -back.reading).collect())?,
        unseen: of(record.returns.iter().map(|back| unseen(record, back)).collect())?,
        probing: of(record.centred.iter().map(|c| c.reading + seen(record, &c.joints)).collect())?,
        gauge: of(record.at_rest.clone())?,
    })
}

/// For each reversal, the joint's angle after moving up minus that after moving down, rad.
fn arrivals(record: &StationRecord, joint: usize) -> Arrivals {
    let lever = record.station.levers[joint];
    let higher = |r: &Reversal| {
        let apart = unseen(record, &r.upwards) - unseen(record, &r.downwards);
        lever.dot(&apart) / lever.norm_squared().max(f64::MIN_POSITIVE)
    };
    let of_joint = record.reversals.iter().filter(|r| r.joint == joint);
    Arrivals { lever: lever.norm(), reversals: of_joint.map(higher).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rp_is_that_of_the_standard() {
        let positions = [1.0, -1.0, 3.0, -3.0].map(|x| Vector3::new(10.0 + x, 5.0, 0.0));
        let found = PoseRepeatability::of(&positions).expect("four positions");
        // Distances 1, 1, 3, 3: mean 2, variance 4/3.
        assert!((found.mean - 2.0).abs() < 1e-12 && (found.rp - 2.0 - 3.0 * (4f64 / 3.0).sqrt()).abs() < 1e-12);
        assert!(found.interval[0] < found.rp && found.rp < found.interval[1]);
    }

    #[test]
    fn what_does_not_scatter_has_no_width_and_one_position_no_rp() {
        let found = PoseRepeatability::of(&[Vector3::x(); 5]).expect("five positions");
        assert_eq!((found.rp, found.interval), (0.0, [0.0; 2]));
        assert!(PoseRepeatability::of(&[Vector3::x()]).is_none());
    }
}
