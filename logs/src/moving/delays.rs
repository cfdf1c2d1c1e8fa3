//! The delays between joints and instrument as unknowns of the arm's calibration.
//!
//! To what the calibrated arm leaves, columns are fitted that are free of what its parameters explain: where a joint would be a moment
//! later (its delay), where it would be if it had play (lost motion, which looks like a delay to one who does not ask for it), and half
//! of the acceleration of the measured point (the smoothing of an instrument's filter: `p + s²/2 p''`, of a filter of variance `s²`).

use calibench::identify::Model;
use calibench::identify::fit::fit;
use calibench::identify::problem::{Problem, Use};
use calibench::measure::dataset::{Dataset, NamedDataset, Sample};
use nalgebra::{DMatrix, DVector, Vector3};

/// Time by which joints are moved to see what a delay does, s.
const TIME: f64 = 1e-3;
/// Angle or length by which a joint is moved to see what its play does, rad or m.
const PLAY: f64 = 1e-4;
/// Half of the time over which the acceleration of the measured point is taken, s.
const DIFFERENCE: f64 = 0.02;
/// Relative size of a singular value that counts as zero.
const NONE: f64 = 1e-9;
/// Blocks of rows by which uncertainties are judged.
const BLOCKS: usize = 16;
/// A smoothing is told if it exceeds this multiple of its standard uncertainty.
const SEEN: f64 = 4.0;
/// Delays of joints differ if one is off from their mean by more than this, s.
const DIFFERENT: f64 = 1e-4;

/// Where an arm is, and how it moves.
#[derive(Debug, Clone, Default)]
pub(super) struct Motion {
    pub posture: Vec<f64>,
    /// Each a second.
    pub speeds: Vec<f64>,
    /// Each a second squared.
    pub accelerations: Vec<f64>,
}

impl Motion {
    /// Where it is so many seconds later.
    pub fn after(&self, t: f64) -> Vec<f64> {
        let of = self.posture.iter().zip(&self.speeds).zip(&self.accelerations);
        of.map(|((q, v), a)| q + t * (v + 0.5 * t * a)).collect()
    }
}

/// Delays, beside the shift that was found first.
#[derive(Debug, Clone)]
pub(super) struct Delays {
    /// Of each joint, s.
    pub seconds: Vec<f64>,
    /// Their mean, s.
    pub common: f64,
    /// Standard uncertainty of that, s.
    pub sigma: f64,
    /// True if the joints have delays of their own.
    pub are_different: bool,
    /// One-sigma of the instrument's filter in time, s.
    pub smoothing: f64,
}

impl Delays {
    pub fn none(joints: usize) -> Self {
        Delays { seconds: vec![0.0; joints], common: 0.0, sigma: 0.0, are_different: false, smoothing: 0.0 }
    }

    /// How far the delay of any joint is from that of another set, s.
    pub fn farthest(&self, other: &Delays) -> f64 {
        let joints = self.seconds.iter().zip(&other.seconds).map(|(a, b)| (a - b).abs());
        joints.fold((self.smoothing - other.smoothing).abs() / 100.0, f64::max)
    }

    /// What is said of them, beside the shift that was found first, of instruments with the clock of the joints or with one of their own.
    pub fn in_words(&self, track: &str, joints: &[String], has_one_clock: bool, shift: f64) -> Vec<String> {
        let sigma = format!("{:.2} ms", self.sigma * 1e3);
        let mut said = Vec::new();
        let total = shift + self.common;
        said.push(match has_one_clock {
            true => {
                let side = if total > 0.0 { "before" } else { "after" };
                format!(
                    "{track} comes {:.2} ms {side} the joints, give or take {sigma}, which is allowed for",
                    total.abs() * 1e3
                )
            }
            false => format!("clocks matched: {total:.5} s are added to the times of {track}, give or take {sigma}"),
        });
        if self.are_different {
            let of = |(name, seconds): (&String, &f64)| format!("{name} {:+.2}", (seconds - self.common) * 1e3);
            let each: Vec<String> = joints.iter().zip(&self.seconds).map(of).collect();
            said.push(format!("the joints do not follow alike: from the mean, in ms, {}; allowed for", each.join(", ")));
        }
        if self.smoothing > 0.0 {
            said.push(format!("{track} smooths over {:.1} ms (one sigma), which is allowed for", self.smoothing * 1e3));
        }
        said
    }
}

/// Residuals and columns, each three numbers a row.
struct Columns {
    left: DVector<f64>,
    columns: Vec<DVector<f64>>,
}

/// The delays at which a calibration of the rows leaves least, by one step from those by which they were made; `None` if the rows do
/// not determine an arm.
pub(super) fn step(dataset: &Dataset, motions: &[Motion], now: &Delays) -> Option<Delays> {
    let joints = now.seconds.len();
    let named = [NamedDataset::new("", dataset)];
    let model = Model::default_for(dataset);
    let mut problem = Problem::new(&named, &model, Use::All).ok()?;
    let fitted = fit(&problem).ok()?;
    let flat = |residuals: Vec<Vector3<f64>>| {
        DVector::from_iterator(3 * residuals.len(), residuals.iter().flat_map(|r| [r.x, r.y, r.z]))
    };
    let left = flat(problem.residuals(&fitted.values));
    let count = left.len();
    let of_arm = problem.plain_jacobian(&fitted.values, &fitted.kept).rows(0, count).into_owned();
    let mut moved = |postures: &dyn Fn(&Motion) -> Vec<f64>| -> Option<DVector<f64>> {
        let samples: Vec<Sample> = dataset
            .samples
            .iter()
            .zip(motions)
            .map(|(sample, motion)| Sample { q: postures(motion), ..sample.clone() })
            .collect();
        problem.renew(&[&samples]).ok()?;
        Some(flat(problem.residuals(&fitted.values)))
    };
    let one = |motion: &Motion, j: usize, by: f64| {
        let mut posture = motion.posture.clone();
        posture[j] += by;
        posture
    };
    let mut late = Vec::new();
    let mut loose = Vec::new();
    for j in 0..joints {
        late.push((&left - moved(&|m| one(m, j, TIME * m.speeds[j]))?) / TIME);
        loose.push((&left - moved(&|m| one(m, j, PLAY * m.speeds[j].signum()))?) / PLAY);
    }
    let curved =
        (&left * 2.0 - moved(&|m| m.after(DIFFERENCE))? - moved(&|m| m.after(-DIFFERENCE))?) / (DIFFERENCE * DIFFERENCE);
    // Free of what the arm's parameters explain.
    let scaled =
        DMatrix::from_fn(count, of_arm.ncols(), |r, c| of_arm[(r, c)] / of_arm.column(c).norm().max(f64::MIN_POSITIVE));
    let base = scaled.svd(true, false);
    let u = base.u?;
    let rank = base.singular_values.iter().filter(|s| **s > NONE * base.singular_values.max()).count();
    let u = u.columns(0, rank).into_owned();
    let free = |column: &DVector<f64>| column - &u * (u.transpose() * column);
    let together = late.iter().fold(DVector::zeros(count), |sum, column| sum + column);
    let smoothed = now.smoothing.powi(2);
    // As if the joints had no delays of their own.
    let own = late.iter().zip(&now.seconds).map(|(column, seconds)| column * (seconds - now.common));
    let alike = own.fold(left.clone(), |sum, column| sum + column);
    let all = Columns {
        left: free(&alike),
        columns: std::iter::once(&together).chain(&loose).chain(std::iter::once(&(curved * 0.5))).map(&free).collect(),
    };
    let alone = solved(&all, rank)?;
    let each = Columns { columns: late.iter().map(&free).chain(all.columns[1..].iter().cloned()).collect(), left: free(&left) };
    let apart = solved(&each, rank)?;
    let rows = motions.len() as f64;
    let gained = rows * (alone.squares / apart.squares.max(f64::MIN_POSITIVE)).ln() - (joints - 1) as f64 * rows.ln();
    let mean = apart.values[..joints].iter().sum::<f64>() / joints as f64;
    let spread = (0..joints).map(|j| (now.seconds[j] + apart.values[j] - now.common - mean).abs()).fold(0.0, f64::max);
    let are_different = gained > 0.0 && spread > DIFFERENT;
    let chosen = if are_different { &apart } else { &alone };
    let last = chosen.values.len() - 1;
    let variance = smoothed + chosen.values[last];
    let smoothing = if variance > SEEN * chosen.sigmas[last] { variance.sqrt() } else { 0.0 };
    let seconds: Vec<f64> = match are_different {
        true => (0..joints).map(|j| now.seconds[j] + apart.values[j]).collect(),
        false => vec![now.common + alone.values[0]; joints],
    };
    let common = seconds.iter().sum::<f64>() / joints as f64;
    Some(Delays {
        seconds,
        common,
        sigma: (0..joints.min(if are_different { joints } else { 1 })).map(|j| chosen.sigmas[j]).fold(0.0, f64::max),
        are_different,
        smoothing,
    })
}

/// A least-squares solution.
struct Solved {
    values: Vec<f64>,
    sigmas: Vec<f64>,
    /// Sum of the squares that it leaves.
    squares: f64,
}

fn solved(columns: &Columns, of_arm: usize) -> Option<Solved> {
    let matrix = DMatrix::from_columns(&columns.columns);
    let scales: Vec<f64> = matrix.column_iter().map(|c| c.norm().max(f64::MIN_POSITIVE)).collect();
    let scaled = DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |r, c| matrix[(r, c)] / scales[c]);
    let inverse = scaled.clone().pseudo_inverse(NONE).ok()?;
    let x = &inverse * &columns.left;
    let left = &columns.left - &scaled * &x;
    let (count, squares) = (left.len(), left.norm_squared());
    let freedoms = count.saturating_sub(of_arm + x.len()).max(1) as f64;
    // What a model lacks is alike in neighbouring rows: the uncertainty is that of their blocks, if it is larger.
    let length = count.div_ceil(BLOCKS).max(1);
    let of_blocks = (0..count).step_by(length).map(|from| {
        let of = length.min(count - from);
        (inverse.columns(from, of) * left.rows(from, of)).map(|v| v * v)
    });
    let of_blocks = of_blocks.fold(DVector::zeros(x.len()), |sum, squares| sum + squares);
    let lost = BLOCKS as f64 / (BLOCKS as f64 - x.len() as f64).max(1.0);
    let sigma = |k: usize| (inverse.row(k).norm_squared() * squares / freedoms).max(of_blocks[k] * lost).sqrt() / scales[k];
    let values = x.iter().zip(&scales).map(|(x, scale)| x / scale).collect();
    Some(Solved { values, sigmas: (0..x.len()).map(sigma).collect(), squares })
}
