"""CasADi: the arm as symbols, once; C generated from them."""

import ctypes
import tempfile
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import casadi
import numpy as np
from arm import columns, frames, tcp, torques
from compiled import address, library
from works import (
    NOMINAL,
    Peer,
    ball_poses,
    expect_identification,
    expect_kinematics,
    expect_torques,
    golden_configurations,
    random_configurations,
)

#: Configurations of one run: their results stay in the second cache.
BATCH = 400
DRAWING = NOMINAL[:, None]

LOOP = """
void {name}_all(const double *x, const double *rho, long count, double *result) {{
    double w[{work}];
    for (long n = 0; n < count; ++n, x += {inputs}, result += {results}) {{
        const double *arg[{arg}] = {{x, rho}};
        double *res[{res}] = {{result}};
        {name}(arg, res, 0, w, 0);
    }}
}}
"""


def exact(function: np.ufunc) -> Callable[[np.ndarray], np.ndarray]:
    """Sine or cosine; of a number, a quarter turn's is 0 or 1, which leaves nothing to compute."""
    return lambda x: function(x) if x.dtype == object else np.round(function(x), 15)


#: numpy on symbols.
SYMBOLS = SimpleNamespace(sin=exact(np.sin), cos=exact(np.cos), stack=np.stack, broadcast_arrays=np.broadcast_arrays)


def symbols(name: str, count: int) -> tuple[casadi.SX, np.ndarray]:
    """A vector for CasADi, and as numpy's (count, 1)."""
    vector = casadi.SX.sym(name, count)
    return vector, np.array(casadi.vertsplit(vector), dtype=object)[:, None]


def functions() -> dict[str, casadi.Function]:
    """TCP, columns (3 x 31) and torques of joints; the same of joints and parameters; torques of joints; TCP and columns of joints,
    torques and parameters.
    """
    (q, joints), (state, known), (rho, parameters) = symbols("q", 6), symbols("x", 12), symbols("rho", 31)
    nominal, arm = frames(SYMBOLS, DRAWING, joints), frames(SYMBOLS, parameters, known[:6], known[6:])
    tau = torques(SYMBOLS, nominal)
    derivatives = columns(SYMBOLS, DRAWING, nominal, tau), columns(SYMBOLS, parameters, arm, known[6:])
    rigid = frames(SYMBOLS, parameters, joints)
    loads = torques(SYMBOLS, rigid)
    of = {
        "w1": (q, [*tcp(nominal).flat, *derivatives[0].T.flat, *tau.flat]),
        "any_arm": (q, [*tcp(rigid).flat, *columns(SYMBOLS, parameters, rigid, loads).T.flat, *loads.flat]),
        "w5": (q, tau.flat),
        "linearise": (state, [*tcp(arm).flat, *derivatives[1].T.flat]),
    }
    return {name: casadi.Function(name, [x, rho], [casadi.vertcat(*result)], {"cse": True}) for name, (x, result) in of.items()}


def compiled(of: dict[str, casadi.Function]) -> ctypes.CDLL:
    """Their C, with a loop over configurations."""
    generator = casadi.CodeGenerator("peer.c")
    source = ""
    for name, function in of.items():
        generator.add(function)
        sizes = {"work": max(1, function.sz_w()), "arg": function.sz_arg(), "res": function.sz_res()}
        source += LOOP.format(name=name, inputs=function.size1_in(0), results=function.size1_out(0), **sizes)
    with tempfile.TemporaryDirectory() as scratch:
        file = Path(scratch) / "peer.c"
        file.write_text(generator.dump() + source)
        return library(file)


class Generated:
    """The generated C, called for many configurations at once."""

    def __init__(self) -> None:
        """Generates and compiles it."""
        self.code = compiled(functions())

    def call(self, name: str, x: np.ndarray, results: int, rho: np.ndarray = NOMINAL) -> np.ndarray:
        """Results (n, results) of rows (n, inputs)."""
        found = np.empty((len(x), results))
        getattr(self.code, f"{name}_all")(address(x), address(rho), ctypes.c_long(len(x)), address(found))
        return found

    def identify(self, balls: np.ndarray, q: np.ndarray) -> np.ndarray:
        """Parameters from poses (n, 6) at balls (n, 3): Gauss-Newton on normal equations with scaled columns, in numpy."""
        state, rho = np.hstack([q, self.call("w5", q, 6)]), NOMINAL
        while True:
            linear = self.call("linearise", state, 96, rho)
            jacobian = linear[:, 3:].reshape(-1, 31)
            scale = 1 / np.sqrt(np.einsum("ij,ij->j", jacobian, jacobian))
            jacobian *= scale
            step = np.linalg.solve(jacobian.T @ jacobian, jacobian.T @ (balls - linear[:, :3]).ravel())
            rho = rho + scale * step
            if np.linalg.norm(step) < 1e-12:
                return rho


def peers() -> list[Peer]:
    """W1, W2, W5."""
    generated = Generated()
    for name in ("w1", "any_arm"):
        result = generated.call(name, golden_configurations(), 102)
        expect_kinematics("CasADi", result[:, :3], result[:, 3:96].reshape(-1, 3, 31), result[:, 96:])
    expect_torques("CasADi", generated.call("w5", golden_configurations(), 6))
    balls, measured = ball_poses("w2_measured.csv")
    expect_identification("CasADi", generated.identify(balls, measured))
    q = random_configurations(BATCH)
    return [
        Peer("W1", "CasADi, generated C", BATCH, lambda: generated.call("w1", q, 102)),
        Peer("W1", "CasADi, generated C, parameters as inputs", BATCH, lambda: generated.call("any_arm", q, 102)),
        Peer("W5", "CasADi, generated C", BATCH, lambda: generated.call("w5", q, 6)),
        Peer("W2", "numpy, C generated by CasADi", 1, lambda: generated.identify(balls, measured)),
    ]
