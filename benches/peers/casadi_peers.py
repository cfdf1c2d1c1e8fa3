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
from works import NOMINAL, Peer, expect_kinematics, expect_torques, golden_configurations, random_configurations

#: Configurations of one run: their results stay in the second cache.
BATCH = 400
DRAWING = NOMINAL[:, None]

LOOP = """
void {name}_all(const double *q, long count, double *result) {{
    double w[{work}];
    for (long n = 0; n < count; ++n, q += 6, result += {results}) {{
        const double *arg[{arg}] = {{q}};
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


def functions() -> dict[str, casadi.Function]:
    """W1 and W5 of a configuration of the nominal arm: TCP, columns one after the other, torques; torques."""
    q = casadi.SX.sym("q", 6)
    chain = frames(SYMBOLS, DRAWING, np.array(casadi.vertsplit(q), dtype=object)[:, None])
    tau = torques(SYMBOLS, chain)
    jacobian = columns(SYMBOLS, DRAWING, chain, tau)
    results = {"w1": [*tcp(chain).flat, *jacobian.flat, *tau.flat], "w5": tau.flat}
    return {name: casadi.Function(name, [q], [casadi.vertcat(*result)], {"cse": True}) for name, result in results.items()}


def compiled(of: dict[str, casadi.Function]) -> ctypes.CDLL:
    """Their C, with a loop over configurations."""
    generator = casadi.CodeGenerator("peer.c")
    source = ""
    for name, function in of.items():
        generator.add(function)
        sizes = {"work": max(1, function.sz_w()), "arg": function.sz_arg(), "res": function.sz_res()}
        source += LOOP.format(name=name, results=function.size1_out(0), **sizes)
    with tempfile.TemporaryDirectory() as scratch:
        file = Path(scratch) / "peer.c"
        file.write_text(generator.dump() + source)
        return library(file)


def peers() -> list[Peer]:
    """W1, W5."""
    code = compiled(functions())

    def w1(q: np.ndarray) -> np.ndarray:
        result = np.empty((len(q), 102))
        code.w1_all(address(q), ctypes.c_long(len(q)), address(result))
        return result

    def w5(q: np.ndarray) -> np.ndarray:
        tau = np.empty((len(q), 6))
        code.w5_all(address(q), ctypes.c_long(len(q)), address(tau))
        return tau

    result = w1(golden_configurations())
    expect_kinematics("CasADi", result[:, :3], result[:, 3:96].reshape(-1, 31, 3).transpose(0, 2, 1), result[:, 96:])
    expect_torques("CasADi", w5(golden_configurations()))
    q = random_configurations(BATCH)
    return [
        Peer("W1", "CasADi, generated C", BATCH, lambda: w1(q)),
        Peer("W5", "CasADi, generated C", BATCH, lambda: w5(q)),
    ]
