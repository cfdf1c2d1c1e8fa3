//! A set of poses and the inverse of its information, changed by one pose at a time.

use nalgebra::DMatrix;

use super::candidates::{Best, Candidates, Field, LANES, Lanes, Symmetric, Turn};
use crate::math::linalg::{Cholesky, LinalgError, normal_matrix};

/// Information of an imaginary first measurement, as a fraction of that of one pose. It keeps an intermediate design with too
/// few poses invertible (DuMouchel & Jones 1994), and is far below the contribution of any useful pose. Results are evaluated
/// without it.
const PRIOR: f64 = 1e-8;

/// Lower bound on the remainder of a pose's directions when it is removed, against rounding.
const LEAST_PIVOT: f64 = 1e-12;

/// A pose of the design and its `G = A M^-1 A^T`.
#[derive(Debug, Clone, Copy)]
struct Member {
    candidate: usize,
    variance: Symmetric<f64>,
}

/// A design: its poses, the inverse of its information, and the logarithm of its determinant.
#[derive(Debug, Clone)]
pub(super) struct Design<'a> {
    candidates: &'a Candidates,
    /// Group of each candidate.
    groups: &'a [usize],
    members: Vec<Member>,
    /// Poses of each group.
    counts: Vec<usize>,
    /// `M^-1`, m x m.
    inverse: Vec<f64>,
    log_det: f64,
    /// Updates not yet applied to the field of the pool.
    pending: Vec<Turn>,
}

impl<'a> Design<'a> {
    /// Creates the design of these poses, and its `field`.
    pub(super) fn new(
        candidates: &'a Candidates,
        groups: &'a [usize],
        quotas: &[usize],
        poses: &[usize],
        field: &mut Field,
    ) -> Result<Self, LinalgError> {
        let mut design = Design {
            candidates,
            groups,
            members: poses.iter().map(|&candidate| Member { candidate, variance: [0.0; 6] }).collect(),
            counts: vec![0; quotas.len()],
            inverse: Vec::new(),
            log_det: 0.0,
            pending: Vec::new(),
        };
        for &pose in poses {
            design.counts[groups[pose]] += 1;
        }
        design.refresh(field)?;
        Ok(design)
    }

    pub(super) fn len(&self) -> usize {
        self.members.len()
    }

    pub(super) fn log_det(&self) -> f64 {
        self.log_det
    }

    pub(super) fn counts(&self) -> &[usize] {
        &self.counts
    }

    pub(super) fn poses(&self) -> impl Iterator<Item = usize> {
        self.members.iter().map(|member| member.candidate)
    }

    /// The stacked scaled rows of the poses, one in each column (m x 3 k).
    pub(super) fn transposed_jacobian(&self) -> DMatrix<f64> {
        let rows: Vec<f64> = self.poses().flat_map(|pose| self.candidates.rows(pose)).copied().collect();
        DMatrix::from_vec(self.candidates.parameters(), 3 * self.members.len(), rows)
    }

    /// Recomputes everything from the poses alone, so that rounding errors of many moves do not accumulate.
    pub(super) fn refresh(&mut self, field: &mut Field) -> Result<(), LinalgError> {
        let m = self.candidates.parameters();
        let mut information = DMatrix::zeros(m, m);
        normal_matrix(&self.transposed_jacobian(), &mut information);
        (0..m).for_each(|p| information[(p, p)] += PRIOR);
        let mut cholesky = Cholesky::new(m);
        cholesky.factor(&information)?;
        self.log_det = cholesky.log_determinant();
        let mut inverse = DMatrix::zeros(m, m);
        cholesky.inverse(&mut inverse);
        self.inverse = inverse.as_slice().to_vec();
        for k in 0..self.members.len() {
            self.members[k].variance = self.directions(self.members[k].candidate).1;
        }
        // M^-1 = S S^T: three columns of S at a time are updates from zero, like any other.
        let mut root = DMatrix::zeros(m, m);
        cholesky.inverse_root(&mut root);
        field.clear();
        self.pending = (0..m)
            .step_by(3)
            .map(|first| {
                let entry = |p: usize, s: usize| if first + s < m { root[(p, first + s)] } else { 0.0 };
                Turn { sign: -1.0, factor: (0..m).map(|p| [entry(p, 0), entry(p, 1), entry(p, 2)]).collect() }
            })
            .collect();
        Ok(())
    }

    /// `A M^-1` (3 x m, row-major) and `A M^-1 A^T` of a candidate.
    fn directions(&self, candidate: usize) -> (Vec<f64>, Symmetric<f64>) {
        let m = self.candidates.parameters();
        let rows = self.candidates.rows(candidate);
        let mut w = vec![0.0; 3 * m];
        for (w, row) in w.chunks_exact_mut(m).zip(rows.chunks_exact(m)) {
            for (x, inverse) in row.iter().zip(self.inverse.chunks_exact(m)) {
                w.iter_mut().zip(inverse).for_each(|(w, i)| *w += x * i);
            }
        }
        let dot = |r: usize, s: usize| w[r * m..][..m].iter().zip(&rows[s * m..][..m]).map(|(a, b)| a * b).sum();
        let variance = [dot(0, 0), dot(0, 1), dot(0, 2), dot(1, 1), dot(1, 2), dot(2, 2)];
        (w, variance)
    }

    /// The best candidate to add, not in the design and of an `eligible` group; brings `field` up to date.
    pub(super) fn best_addition(
        &mut self,
        field: &mut Field,
        eligible: impl Fn(usize) -> bool,
        open: &mut [Lanes],
    ) -> Option<Best> {
        let groups: Vec<f64> = (0..self.counts.len()).map(|g| f64::from(u8::from(eligible(g)))).collect();
        for (open, members) in open.iter_mut().zip(self.groups.chunks(LANES)) {
            *open = [0.0; LANES];
            open.iter_mut().zip(members).for_each(|(o, &g)| *o = groups.get(g).copied().unwrap_or(0.0));
        }
        for pose in self.poses() {
            open[pose / LANES][pose % LANES] = 0.0;
        }
        let best = field.pass(self.candidates, &self.pending, open);
        self.pending.clear();
        best
    }

    /// Marks the field as up to date: a copy of this design has applied the updates.
    pub(super) fn mark_up_to_date(&mut self) {
        self.pending.clear();
    }

    /// The pose that contributes least, among those that are `removable`.
    pub(super) fn least_missed(&self, removable: impl Fn(usize) -> bool) -> Option<usize> {
        let left = |member: &Member| {
            let [xx, xy, xz, yy, yz, zz] = member.variance;
            let (x, y, z) = (1.0 - xx, 1.0 - yy, 1.0 - zz);
            x * (y * z - yz * yz) - xy * (xy * z + yz * xz) - xz * (xy * yz + y * xz)
        };
        let candidates = self.members.iter().filter(|member| removable(member.candidate));
        candidates.max_by(|a, b| left(a).total_cmp(&left(b))).map(|member| member.candidate)
    }

    /// Adds a candidate that is not in the design.
    pub(super) fn add(&mut self, candidate: usize) {
        let turn = self.turn(candidate, 1.0);
        self.counts[self.groups[candidate]] += 1;
        self.members.push(Member { candidate, variance: [0.0; 6] });
        let last = self.members.len() - 1;
        self.members[last].variance = self.directions(candidate).1;
        self.pending.push(turn);
    }

    /// Removes a pose; nothing happens if it is not in the design.
    pub(super) fn remove(&mut self, candidate: usize) {
        let Some(place) = self.members.iter().position(|member| member.candidate == candidate) else {
            return;
        };
        self.members.swap_remove(place);
        self.counts[self.groups[candidate]] -= 1;
        let turn = self.turn(candidate, -1.0);
        self.pending.push(turn);
    }

    /// Updates inverse, determinant and the members' variances for `M += sign A^T A` (Woodbury):
    /// `M^-1 -= sign F F^T`, `F = M^-1 A^T C^-T`, `C C^T = I + sign G`.
    fn turn(&mut self, candidate: usize, sign: f64) -> Turn {
        let m = self.candidates.parameters();
        let (w, [xx, xy, xz, yy, yz, zz]) = self.directions(candidate);
        let root = |pivot: f64| pivot.max(LEAST_PIVOT).sqrt();
        let c00 = root(1.0 + sign * xx);
        let (c10, c20) = (sign * xy / c00, sign * xz / c00);
        let c11 = root(1.0 + sign * yy - c10 * c10);
        let c21 = (sign * yz - c20 * c10) / c11;
        let c22 = root(1.0 + sign * zz - c20 * c20 - c21 * c21);
        self.log_det += 2.0 * (c00 * c11 * c22).ln();

        let mut factor = vec![[0.0; 3]; m];
        for (p, f) in factor.iter_mut().enumerate() {
            let x = w[p] / c00;
            let y = (w[m + p] - c10 * x) / c11;
            let z = (w[2 * m + p] - c20 * x - c21 * y) / c22;
            *f = [x, y, z];
        }
        for (row, f) in self.inverse.chunks_exact_mut(m).zip(&factor) {
            row.iter_mut().zip(&factor).for_each(|(i, g)| *i -= sign * (f[0] * g[0] + f[1] * g[1] + f[2] * g[2]));
        }
        for member in &mut self.members {
            let mut t = [[0.0; 3]; 3];
            for (t, row) in t.iter_mut().zip(self.candidates.rows(member.candidate).chunks_exact(m)) {
                for (x, f) in row.iter().zip(&factor) {
                    (0..3).for_each(|s| t[s] += x * f[s]);
                }
            }
            for (g, (r, s)) in member.variance.iter_mut().zip([(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)]) {
                *g -= sign * (t[r][0] * t[s][0] + t[r][1] * t[s][1] + t[r][2] * t[s][2]);
            }
        }
        Turn { sign, factor }
    }
}
