"""W3 in numpy: DETMAX (Mitchell, Technometrics 16 (1974) 203), each move one pass over the pool."""

from copy import copy
from itertools import count

import numpy as np

from arm import columns, frames, torques
from works import NOMINAL, Peer, ball_poses, expect_selection

#: Poses too many, or too few, at the far end of the longest excursion: as the bench's `selection`.
LONGEST = 10
CHOSEN = 80


class Design:
    """Members among the candidates, the inverse of their information, and each candidate's 3 x 3 variance."""

    def __init__(self, rows: np.ndarray, members: np.ndarray) -> None:
        """From rows of the Jacobian (31, 3, candidates), columns scaled, and which candidates are members."""
        self.rows = rows
        self.members = members.copy()
        chosen = rows[:, :, members].reshape(31, -1)
        information = chosen @ chosen.T
        self.log_det = np.linalg.slogdet(information)[1]
        self.inverse = np.linalg.inv(information)
        spread = (np.linalg.inv(np.linalg.cholesky(information)) @ rows.reshape(31, -1)).reshape(rows.shape)
        self.variance = np.einsum("krn,ksn->rsn", spread, spread)

    def copy(self) -> "Design":
        """The same, to be moved on its own."""
        other = copy(self)
        other.members, other.inverse, other.variance = self.members.copy(), self.inverse.copy(), self.variance.copy()
        return other

    def move(self, sign: float) -> None:
        """Adds (1) or takes away (-1) the candidate after which the information's determinant is largest."""
        places = np.flatnonzero(self.members != (sign > 0))
        (a, b, c), (_, d, e), (_, _, f) = np.eye(3)[:, :, None] + sign * self.variance[:, :, places]
        gains = a * (d * f - e * e) - b * (b * f - c * e) + c * (b * e - c * d)
        best = gains.argmax()
        place = places[best]
        block = self.rows[:, :, place]
        # Rank-3 update of the inverse (Woodbury), and of what follows from it.
        moved = self.inverse @ block
        moved = np.linalg.solve(np.linalg.cholesky(np.eye(3) + sign * block.T @ moved), moved.T)
        self.inverse -= sign * moved.T @ moved
        change = (moved @ self.rows.reshape(31, -1)).reshape(3, 3, -1)
        for r in range(3):
            for s in range(r, 3):
                self.variance[r, s] -= sign * (change[:, r] * change[:, s]).sum(axis=0)
        self.log_det += np.log(gains[best])
        self.members[place] = sign > 0


def one_start(rows: np.ndarray, seed: int) -> np.ndarray:
    """Members from a random design to one that no excursion, of up to `LONGEST` poses out and back, improves."""
    members = np.zeros(rows.shape[2], dtype=bool)
    members[np.random.default_rng(seed).choice(len(members), CHOSEN, replace=False)] = True
    best, length = Design(rows, members), 1
    while length <= LONGEST:
        for sign in (1.0, -1.0):
            tried = best.copy()
            for step in range(2 * length):
                tried.move(sign if step < length else -sign)
            if tried.log_det > best.log_det + 1e-9:
                best, length = tried, 0
                break
        length += 1
    return np.flatnonzero(best.members)


def pool() -> np.ndarray:
    """Candidates of W3, (5000, 3, 31), SI."""
    q, drawing = ball_poses("w3_pool.csv")[1].T, NOMINAL[:, None]
    chain = frames(np, drawing, q)
    return columns(np, drawing, chain, torques(np, chain)).transpose(2, 1, 0)


def peers() -> list[Peer]:
    """W3. Each run takes another seed: the time of a start varies with its luck."""
    jacobian = pool()
    rows = (jacobian / np.linalg.norm(jacobian, axis=(0, 1))).transpose(2, 1, 0).copy()
    expect_selection("numpy, DETMAX", jacobian, one_start(rows, 0))
    seeds = count(1)
    return [Peer("W3", "numpy, DETMAX", 1, lambda: one_start(rows, next(seeds)))]
