//! Response of the readings to a step, and the fault of the set-up that it indicates.
//!
//! A correct gauge on a correct tool frame obeys `change = -step`. Every fault of the set-up obeys `change = -H step` with
//! another matrix `H`, as far as the plungers reach; the one with the smallest unexplained remainder is reported.

use nalgebra::{Matrix3, Vector3};

use super::Suspicion;
use crate::cell::TriCal;

/// Classification of a step that did not bring the ball closer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Response {
    /// Right direction, too far.
    Overshoots,
    /// One reading does not change.
    Stuck {
        /// Tool axis, counted from 0.
        axis: usize,
    },
    /// Wrong direction.
    Suspect(Suspicion),
}

/// Fraction of the step that a hypothesis may leave unexplained: an uncalibrated robot is off by a few per cent in direction
/// and length, a rim contact by some more; the hypotheses differ from each other by 1 or more. One step shows only one column
/// of `H`, so a rotated tool frame can look like a sign or an exchange: the answer is a suspicion, to be checked by a person.
const UNEXPLAINED: f64 = 0.2;

/// Readings before and after a step, m, tool axes.
pub(super) struct StepResponse<'a> {
    pub trical: &'a TriCal,
    /// Reading of each indicator without contact, m.
    pub free_reading: &'a [f64; 3],
    pub before: &'a Vector3<f64>,
    pub step: &'a Vector3<f64>,
    /// For a plunger at an end of its travel, that end.
    pub after: &'a Vector3<f64>,
}

impl StepResponse<'_> {
    /// The likeliest cause.
    pub fn response(&self) -> Response {
        let (step, change) = (self.step, self.after - self.before);
        let length = step.norm();
        if change.norm() < 0.1 * length {
            return Response::Stuck { axis: step.iamax() };
        }
        if -change.dot(step) > 0.9 * change.norm() * length && change.norm() > length {
            return Response::Overshoots;
        }
        let mut best = (UNEXPLAINED * length, Response::Suspect(Suspicion::WrongToolFrame));
        for (answer, response) in hypotheses() {
            let unexplained = (self.after - self.shown(&(self.before - answer * step))).norm();
            if unexplained < best.0 {
                best = (unexplained, response);
            }
        }
        best.1
    }

    /// Readings for a ball whose centre is at `ball`, with the limits of the plungers' travel and the rims of the tips. Signs
    /// and exchanges only mirror and permute the axes, so that the distances from them are the same.
    fn shown(&self, ball: &Vector3<f64>) -> Vector3<f64> {
        let TriCal { datum_radius, tip_radius, travel, .. } = *self.trical;
        Vector3::from_fn(|k, _| {
            let mut lateral = *ball;
            lateral[k] = 0.0;
            let beyond = (lateral.norm() - tip_radius).max(0.0);
            let free = self.free_reading[k];
            if beyond >= datum_radius {
                return free;
            }
            // The rim touches the ball lower down than the flat does.
            let lower = datum_radius - (datum_radius.powi(2) - beyond.powi(2)).sqrt();
            (ball[k] - lower).clamp(free, free + travel)
        })
    }
}

/// Every single fault of a set-up, with its `H`.
fn hypotheses() -> Vec<(Matrix3<f64>, Response)> {
    let mut all = Vec::with_capacity(11);
    for axis in 0..3 {
        let mut answer = Matrix3::identity();
        answer[(axis, axis)] = 0.0;
        all.push((answer, Response::Stuck { axis }));
        answer[(axis, axis)] = -1.0;
        all.push((answer, Response::Suspect(Suspicion::WrongSign { axis })));
    }
    for (a, b) in [(0, 1), (0, 2), (1, 2)] {
        let mut answer = Matrix3::identity();
        answer.swap_rows(a, b);
        all.push((answer, Response::Suspect(Suspicion::SwappedAxes { a, b })));
    }
    for channels in [[1, 2, 0], [2, 0, 1]] {
        let mut answer = Matrix3::zeros();
        channels.into_iter().enumerate().for_each(|(indicator, channel)| answer[(indicator, channel)] = 1.0);
        all.push((answer, Response::Suspect(Suspicion::RotatedAxes { channels })));
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::MM;

    /// The response of a set-up with that matrix to a step with three unequal components, the first `mm` long.
    fn answered(h: Matrix3<f64>, mm: f64) -> Response {
        let (trical, free_reading) = (TriCal::PAPER, [TriCal::PAPER.free_reading(); 3]);
        let step = Vector3::new(1.0, -2.0, 0.7) * mm * MM;
        let answer = |after| StepResponse { trical: &trical, free_reading: &free_reading, before: &step, step: &step, after };
        let after = answer(&step).shown(&(step - h * step));
        answer(&after).response()
    }

    #[test]
    fn each_fault_of_the_set_up_is_told_from_the_others() {
        // A short step, and one so long that exchanged plungers reach their ends.
        for mm in [0.1, 2.4] {
            for (h, response) in hypotheses() {
                assert_eq!(answered(h, mm), response, "{mm} mm");
            }
        }
        let turned = nalgebra::Rotation3::new(Vector3::new(1.0, 1.0, 0.3)).into_inner();
        assert_eq!(answered(turned, 0.1), Response::Suspect(Suspicion::WrongToolFrame));
        assert_eq!(answered(Matrix3::identity() * 2.1, 0.1), Response::Overshoots);
    }
}
