//! Samples posed several at once, in the lanes of the processor's registers: each as it would be alone, only sooner.

use nalgebra::Vector3;

use super::Setup;
use super::moves::Moves;
use super::sample_row::SampleRow;
use super::weighing::RowTerms;
use crate::robot::{Postures, Robot, Site, SiteIndex, Stances, Vectors};

/// Samples posed at once: two registers of four numbers, or one of eight.
pub(super) const ABREAST: usize = 8;

/// How far the parameters move the arm of some rows.
#[derive(Clone, Copy)]
pub(super) struct Deviating<'a> {
    /// Values of the parameters, SI.
    pub values: &'a [f64],
    pub patterns: &'a [Vec<Moves>],
    /// Of each of the rows, and perhaps of more.
    pub terms: &'a [RowTerms],
}

/// Room for that many samples.
pub(super) struct Abreast {
    sites: SiteIndex,
    base: [[f64; ABREAST]; 6],
    tool: [[f64; ABREAST]; 3],
    q: Vec<[f64; ABREAST]>,
    deviations: Vec<[f64; ABREAST]>,
    postures: Postures<ABREAST>,
    columns: Vec<Vectors<ABREAST>>,
}

impl Abreast {
    pub fn new(robot: &Robot) -> Self {
        let sites = SiteIndex::new(robot.joints());
        Abreast {
            sites,
            base: [[0.0; ABREAST]; 6],
            tool: [[0.0; ABREAST]; 3],
            q: vec![[0.0; ABREAST]; robot.joints()],
            deviations: vec![[0.0; ABREAST]; sites.len()],
            postures: Postures::new(robot),
            columns: vec![Vectors::ZERO; sites.len()],
        }
    }

    /// Poses the arm for these samples, no more than [`ABREAST`], as the parameters move it; the nominal arm without them. Lanes left
    /// over stand anywhere.
    pub fn pose(&mut self, robot: &Robot, setups: &[Setup], rows: &[SampleRow], deviating: Option<Deviating<'_>>) {
        let Abreast { base, tool, q, deviations, postures, .. } = self;
        deviations.fill([0.0; ABREAST]);
        for (lane, row) in rows.iter().enumerate() {
            row.lay_in(lane, &setups[row.setup], base, tool, q);
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
        postures.set_all(robot, &Stances { base, tool, q, deviations });
    }

    /// All of them.
    pub fn postures(&self) -> &Postures<ABREAST> {
        &self.postures
    }

    /// World position of the TCP of one of them, m.
    pub fn tcp(&self, lane: usize) -> Vector3<f64> {
        self.postures.tcps().at(lane)
    }

    /// How far its ball, or measured point, is displaced, world, m.
    pub fn target_moved(&self, lane: usize) -> Vector3<f64> {
        let at = self.sites.target();
        Vector3::new(self.deviations[at][lane], self.deviations[at + 1][lane], self.deviations[at + 2][lane])
    }

    /// Finds the columns of all sites for those samples.
    pub fn find_columns(&mut self) {
        self.postures.columns(&mut self.columns);
    }

    /// Columns of all sites by their places, once they are found; not those of flex displacements.
    #[inline]
    pub fn columns(&self) -> &[Vectors<ABREAST>] {
        &self.columns
    }

    /// Column of a flex displacement, of one of them.
    #[cold]
    pub fn flex_column(&self, lane: usize, site: Site) -> Vector3<f64> {
        self.postures.column_at(lane, site)
    }
}

/// What [`RowTerms::deviate`] adds for each of some rows that are moved by the same terms.
fn deviate_alike(pattern: &[Moves], rows: &[RowTerms], values: &[f64], deviations: &mut [[f64; ABREAST]]) {
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
