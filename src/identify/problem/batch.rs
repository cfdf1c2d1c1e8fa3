//! Batches of samples, posed together in the lanes of the processor's registers, with the same results as one by one.

use nalgebra::Vector3;

use super::Setup;
use super::jacobian_pattern::JacobianPattern;
use super::load_state::{Deviating, RowTerms};
use super::orientation::SeenOrientation;
use super::sample_row::SampleRow;
use crate::robot::kinematics::{BatchInput, LanePosture, PostureView, Postures};
use crate::robot::sites::{Site, SiteIndex};
use crate::robot::{Robot, Vectors};

/// Number of samples in a batch: two registers of four numbers, or one of eight.
pub(super) const BATCH: usize = 8;

/// Number of samples that one thread takes at once: a plan of ordinary size does not justify two threads.
pub(super) const STRETCH: usize = 512;

/// Workspace for one batch.
pub(super) struct Batch {
    sites: SiteIndex,
    base: [[f64; BATCH]; 6],
    tool: [[f64; BATCH]; 3],
    q: Vec<[f64; BATCH]>,
    deviations: Vec<[f64; BATCH]>,
    postures: Postures<BATCH>,
    columns: Vec<Vectors<BATCH>>,
}

impl Batch {
    pub fn new(robot: &Robot) -> Self {
        let sites = SiteIndex::new(robot.joints());
        Batch {
            sites,
            base: [[0.0; BATCH]; 6],
            tool: [[0.0; BATCH]; 3],
            q: vec![[0.0; BATCH]; robot.joints()],
            deviations: vec![[0.0; BATCH]; sites.len()],
            postures: Postures::new(robot),
            columns: vec![Vectors::ZERO; sites.len()],
        }
    }

    /// Poses the arm for these samples, no more than [`BATCH`], as moved by the parameters, or the nominal arm if there
    /// are none. Unused lanes hold arbitrary postures.
    pub fn pose(&mut self, robot: &Robot, setups: &[Setup], rows: &[SampleRow], deviating: Option<Deviating<'_>>) {
        let Batch { base, tool, q, deviations, postures, .. } = self;
        deviations.fill([0.0; BATCH]);
        for (lane, row) in rows.iter().enumerate() {
            row.put(lane, &setups[row.setup], base, tool, q);
        }
        if let Some(Deviating { values, patterns, terms }) = deviating {
            let terms = &terms[..rows.len()];
            let pattern = |terms: &RowTerms| patterns[terms.pattern].as_slice();
            match (rows, terms) {
                ([row, rows @ ..], [first, others @ ..])
                    if rows.iter().all(|r| r.is_set_up_as(row)) && others.iter().all(|t| t.pattern == first.pattern) =>
                {
                    deviate_alike(pattern(first), terms, values, deviations);
                }
                _ => {
                    for (lane, terms) in terms.iter().enumerate() {
                        terms.deviate(pattern(terms), values, |place, by| deviations[place][lane] += by);
                    }
                }
            }
        }
        postures.set_all(robot, &BatchInput { base, tool, q, deviations });
    }

    /// Postures of the batch.
    pub fn postures(&self) -> &Postures<BATCH> {
        &self.postures
    }

    /// World position of the TCP of one sample, m.
    pub fn tcp(&self, lane: usize) -> Vector3<f64> {
        self.postures.tcps().at(lane)
    }

    /// Displacement of its ball or measured point, world, m.
    pub fn target_moved(&self, lane: usize) -> Vector3<f64> {
        let at = self.sites.target();
        Vector3::new(self.deviations[at][lane], self.deviations[at + 1][lane], self.deviations[at + 2][lane])
    }

    /// Orientation of one sample beside that measured, if it was.
    pub fn seen_orientation(&self, lane: usize, row: &SampleRow, setup: &Setup) -> Option<SeenOrientation> {
        row.orientation.as_ref()?;
        let at = self.sites.probe();
        let turned = Vector3::from_fn(|k, _| self.deviations[at + k][lane]);
        row.seen_orientation(setup, &LanePosture { postures: &self.postures, lane }.flange(), &turned)
    }

    /// Axis about which a site turns the flange, for one sample.
    pub fn turning(&self, lane: usize, site: Site) -> Vector3<f64> {
        self.postures.turning_at(lane, site)
    }

    /// Computes the columns of all sites for these samples.
    pub fn find_columns(&mut self) {
        self.postures.columns(&mut self.columns);
    }

    /// Columns of all sites by index, once computed; flex displacements are not included.
    #[inline]
    pub fn columns(&self) -> &[Vectors<BATCH>] {
        &self.columns
    }

    /// Column of a flex displacement, for one sample.
    #[cold]
    pub fn flex_column(&self, lane: usize, site: Site) -> Vector3<f64> {
        self.postures.column_at(lane, site)
    }
}

/// The deviations of [`RowTerms::deviate`] for several rows that share a pattern.
fn deviate_alike(pattern: &[JacobianPattern], rows: &[RowTerms], values: &[f64], deviations: &mut [[f64; BATCH]]) {
    for (term, moves) in pattern.iter().enumerate() {
        let (value, deviations) = (values[moves.parameter], &mut deviations[moves.place]);
        if value == 0.0 {
            continue;
        }
        if moves.constant {
            let by = rows[0].weights[term] * value;
            deviations.iter_mut().for_each(|deviation| *deviation += by);
        } else {
            for (deviation, row) in deviations.iter_mut().zip(rows) {
                *deviation += row.weights[term] * value;
            }
        }
    }
}
