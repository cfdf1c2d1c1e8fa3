//! The pool of candidate poses, laid out so that one pass over it costs no more than reading it.

use super::error::SelectionError;

/// Candidates interleaved in a batch. Nine running sums of four numbers are what the registers of a processor with 256-bit
/// vectors hold; batches of eight made the pass four times slower.
pub(super) const LANES: usize = 4;

/// One number of each of [`LANES`] candidates.
pub(super) type Lanes = [f64; LANES];

/// Upper triangle of a symmetric 3 x 3 matrix: xx, xy, xz, yy, yz, zz.
pub(super) type Symmetric<T> = [T; 6];

/// The candidate poses, their groups and their rows of the Jacobian.
#[derive(Debug, Clone)]
pub struct Candidates {
    parameters: usize,
    groups: Vec<usize>,
    /// Three rows of `parameters` per candidate, columns scaled.
    rows: Vec<f64>,
    /// The same, in batches of [`LANES`] candidates: block, parameter, row, lane.
    blocks: Vec<Block>,
    /// Sum of the natural logarithms of the column scales removed.
    log_scale: f64,
}

impl Candidates {
    /// Creates the pool from `rows`: for each candidate three rows of the Jacobian (SI, row-major 3 x `parameters`), one
    /// candidate after the other; and from the group of each candidate, for instance its ball.
    ///
    /// # Errors
    /// When the sizes do not fit, a number is not finite, or a column is zero in the whole pool.
    pub fn new(rows: &[f64], parameters: usize, groups: Vec<usize>) -> Result<Self, SelectionError> {
        if parameters == 0 || rows.len() != groups.len() * 3 * parameters {
            return Err(SelectionError::Shape { numbers: rows.len(), candidates: groups.len(), parameters });
        }
        if let Some(place) = rows.iter().position(|x| !x.is_finite()) {
            return Err(SelectionError::NotFinite { candidate: place / (3 * parameters), column: place % parameters });
        }
        // Scaling makes the average candidate's entry one in every column; the maximum of the determinant is unchanged.
        let mut scale = vec![0.0; parameters];
        for row in rows.chunks_exact(parameters) {
            scale.iter_mut().zip(row).for_each(|(s, x)| *s += x * x);
        }
        scale.iter_mut().for_each(|s| *s = (*s / groups.len() as f64).sqrt());
        if let Some(column) = scale.iter().position(|&s| s <= 0.0) {
            return Err(SelectionError::Unseen { column });
        }
        let scaled: Vec<f64> =
            rows.chunks_exact(parameters).flat_map(|row| row.iter().zip(&scale).map(|(x, s)| x / s)).collect();
        let mut blocks = vec![Block([[0.0; LANES]; 3]); groups.len().div_ceil(LANES) * parameters];
        for (candidate, rows) in scaled.chunks_exact(3 * parameters).enumerate() {
            let block = &mut blocks[candidate / LANES * parameters..][..parameters];
            for (row, numbers) in rows.chunks_exact(parameters).enumerate() {
                block.iter_mut().zip(numbers).for_each(|(b, x)| b.0[row][candidate % LANES] = *x);
            }
        }
        let log_scale = scale.iter().map(|s| s.ln()).sum();
        Ok(Candidates { parameters, groups, rows: scaled, blocks, log_scale })
    }

    /// Number of candidates.
    pub fn len(&self) -> usize {
        self.groups.len()
    }

    /// True if there is none.
    pub fn is_empty(&self) -> bool {
        self.groups.is_empty()
    }

    /// Number of parameters, m.
    pub fn parameters(&self) -> usize {
        self.parameters
    }

    /// Group of each candidate.
    pub fn groups(&self) -> &[usize] {
        &self.groups
    }

    pub(super) fn log_scale(&self) -> f64 {
        self.log_scale
    }

    /// The three scaled rows of a candidate, row-major 3 x m.
    pub(super) fn rows(&self, candidate: usize) -> &[f64] {
        &self.rows[candidate * 3 * self.parameters..][..3 * self.parameters]
    }

    fn blocks(&self) -> std::slice::ChunksExact<'_, Block> {
        self.blocks.chunks_exact(self.parameters)
    }
}

/// One number per row and lane, aligned so that no register is filled from two cache lines.
#[derive(Debug, Clone, Copy)]
#[repr(align(32))]
struct Block([Lanes; 3]);

/// An update of the inverse information by `-sign F F^T`, with F of m x 3.
#[derive(Debug, Clone)]
pub(super) struct Turn {
    pub(super) sign: f64,
    pub(super) factor: Vec<[f64; 3]>,
}

/// `G_i = A_i M^-1 A_i^T` of every candidate: the information that a pose would add.
#[derive(Debug, Clone)]
pub(super) struct Field {
    variance: Vec<Symmetric<Lanes>>,
}

/// The candidate that would add most, and its `det(I + G)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Best {
    pub(super) candidate: usize,
    pub(super) determinant: f64,
}

impl Field {
    pub(super) fn new(candidates: &Candidates) -> Self {
        Field { variance: vec![[[0.0; LANES]; 6]; candidates.blocks().len()] }
    }

    pub(super) fn clear(&mut self) {
        self.variance.fill([[0.0; LANES]; 6]);
    }

    pub(super) fn copy_from(&mut self, other: &Field) {
        self.variance.copy_from_slice(&other.variance);
    }

    /// Applies the updates and finds the best candidate among those that are `open` (one, else zero), in one pass over the
    /// pool.
    ///
    /// The pass is compiled for several generations of processors and uses the best available. Multiplications and additions
    /// are not contracted and their order is fixed, so the numbers do not depend on the choice.
    pub(super) fn pass(&mut self, candidates: &Candidates, turns: &[Turn], open: &[Lanes]) -> Option<Best> {
        let pass = Pass { field: self, candidates, turns, open };
        // Registers of eight numbers would be assembled from two blocks, and split again.
        #[cfg(target_arch = "x86_64")]
        if let Some(four) = pulp::x86::V3::try_new() {
            return pulp::Simd::vectorize(four, pass);
        }
        pulp::Arch::new().dispatch(pass)
    }
}

struct Pass<'a> {
    field: &'a mut Field,
    candidates: &'a Candidates,
    turns: &'a [Turn],
    open: &'a [Lanes],
}

impl pulp::WithSimd for Pass<'_> {
    type Output = Option<Best>;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> Option<Best> {
        let mut best = [0.0; LANES];
        let mut place = [0.0; LANES];
        for (number, ((block, variance), open)) in
            self.candidates.blocks().zip(&mut self.field.variance).zip(self.open).enumerate()
        {
            for turn in self.turns {
                update(variance, &product(block, &turn.factor), turn.sign);
            }
            let score = determinant(variance);
            for l in 0..LANES {
                let score = score[l] * open[l];
                let better = score > best[l];
                best[l] = if better { score } else { best[l] };
                place[l] = if better { number as f64 } else { place[l] };
            }
        }
        (0..LANES)
            .filter(|&l| best[l] > 0.0)
            .map(|l| Best { candidate: place[l] as usize * LANES + l, determinant: best[l] })
            .reduce(|a, b| {
                let earlier = b.determinant == a.determinant && b.candidate < a.candidate;
                if b.determinant > a.determinant || earlier { b } else { a }
            })
    }
}

/// `A F` (3 x 3) of every lane.
#[inline(always)]
fn product(block: &[Block], factor: &[[f64; 3]]) -> [[Lanes; 3]; 3] {
    let mut t = [[[0.0; LANES]; 3]; 3];
    for (a, f) in block.iter().zip(factor) {
        for r in 0..3 {
            for s in 0..3 {
                for l in 0..LANES {
                    t[r][s][l] += a.0[r][l] * f[s];
                }
            }
        }
    }
    t
}

/// `G -= sign T T^T` of every lane.
#[inline(always)]
fn update(variance: &mut Symmetric<Lanes>, t: &[[Lanes; 3]; 3], sign: f64) {
    for (g, (r, s)) in variance.iter_mut().zip([(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)]) {
        for l in 0..LANES {
            g[l] -= sign * (t[r][0][l] * t[s][0][l] + t[r][1][l] * t[s][1][l] + t[r][2][l] * t[s][2][l]);
        }
    }
}

/// `det(I + G)` of every lane.
#[inline(always)]
fn determinant(variance: &Symmetric<Lanes>) -> Lanes {
    let [xx, xy, xz, yy, yz, zz] = variance;
    let mut out = [0.0; LANES];
    for l in 0..LANES {
        let (x, y, z) = (1.0 + xx[l], 1.0 + yy[l], 1.0 + zz[l]);
        out[l] = x * (y * z - yz[l] * yz[l]) - xy[l] * (xy[l] * z - yz[l] * xz[l]) + xz[l] * (xy[l] * yz[l] - y * xz[l]);
    }
    out
}
