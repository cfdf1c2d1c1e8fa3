//! How the readings answered a step, and what that says about the set-up.
//!
//! A sound gauge on a sound tool frame obeys `change = -step`. Every fault of the set-up obeys `change = -H step` with another
//! matrix `H`; the one that leaves the least unexplained is named.

use nalgebra::{Matrix3, Vector3};

use super::Suspicion;

/// What a step that did not bring the ball closer looks like.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Response {
    /// In the right direction, too far.
    Overshoots,
    /// One reading stands still.
    Stuck {
        /// Tool axis, counted from 0.
        axis: usize,
    },
    /// In a wrong direction.
    Suspect(Suspicion),
}

/// Part of the step that a hypothesis may leave unexplained: an uncalibrated robot is off by a few per cent in direction and length,
/// a rim contact by some more; the hypotheses differ among each other by 1 or more. One step shows one column of `H` only, so a turned
/// tool frame can look like a sign or an exchange: the answer is a suspicion, for a person to check.
const UNEXPLAINED: f64 = 0.2;

/// Names the likeliest cause for readings that changed by `change` after a step by `step` (m, tool axes).
pub(super) fn explain(step: &Vector3<f64>, change: &Vector3<f64>) -> Response {
    let length = step.norm();
    if change.norm() < 0.1 * length {
        return Response::Stuck { axis: step.iamax() };
    }
    if -change.dot(step) > 0.9 * change.norm() * length && change.norm() > length {
        return Response::Overshoots;
    }
    let mut best = (UNEXPLAINED * length, Response::Suspect(Suspicion::WrongToolFrame));
    let mut consider = |answer: Matrix3<f64>, response: Response| {
        let unexplained = (change + answer * step).norm();
        if unexplained < best.0 {
            best = (unexplained, response);
        }
    };
    for axis in 0..3 {
        let mut answer = Matrix3::identity();
        answer[(axis, axis)] = 0.0;
        consider(answer, Response::Stuck { axis });
        answer[(axis, axis)] = -1.0;
        consider(answer, Response::Suspect(Suspicion::WrongSign { axis }));
    }
    for (a, b) in [(0, 1), (0, 2), (1, 2)] {
        let mut answer = Matrix3::identity();
        answer.swap_rows(a, b);
        consider(answer, Response::Suspect(Suspicion::SwappedAxes { a, b }));
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Answers of a set-up with that matrix to a step with three unlike components.
    fn answered(h: Matrix3<f64>) -> Response {
        let step = Vector3::new(1.0, -2.0, 0.7);
        explain(&step, &(-h * step))
    }

    #[test]
    fn each_fault_of_the_set_up_is_told_from_the_others() {
        for k in 0..3 {
            let mut h = Matrix3::identity();
            h[(k, k)] = -1.0;
            assert_eq!(answered(h), Response::Suspect(Suspicion::WrongSign { axis: k }));
            h[(k, k)] = 0.0;
            assert_eq!(answered(h), Response::Stuck { axis: k });
        }
        for (a, b) in [(0, 1), (0, 2), (1, 2)] {
            let mut h = Matrix3::identity();
            h.swap_rows(a, b);
            assert_eq!(answered(h), Response::Suspect(Suspicion::SwappedAxes { a, b }));
        }
        let turned = nalgebra::Rotation3::new(Vector3::new(1.0, 1.0, 0.3)).into_inner();
        assert_eq!(answered(turned), Response::Suspect(Suspicion::WrongToolFrame));
        assert_eq!(answered(Matrix3::identity() * 2.1), Response::Overshoots);
    }
}
