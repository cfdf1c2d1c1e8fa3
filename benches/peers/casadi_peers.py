"""CasADi: the arm as symbols, once; C generated from them."""

import ctypes
import os
import tempfile
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


def exact(function: np.ufunc):
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
    peer = compiled(functions())
    w1 = lambda q, result: peer.w1_all(address(q), ctypes.c_long(len(q)), address(result))  # noqa: E731
    w5 = lambda q, result: peer.w5_all(address(q), ctypes.c_long(len(q)), address(result))  # noqa: E731
    q = golden_configurations()
    result, tau = np.empty((len(q), 102)), np.empty((len(q), 6))
    w1(q, result)
    expect_kinematics("CasADi", result[:, :3], result[:, 3:96].reshape(-1, 31, 3).transpose(0, 2, 1), result[:, 96:])
    w5(q, tau)
    expect_torques("CasADi", tau)
    few, result, tau = random_configurations(BATCH), np.empty((BATCH, 102)), np.empty((BATCH, 6))
    return [
        Peer("W1", "CasADi, generated C", BATCH, lambda: w1(few, result)),
        Peer("W5", "CasADi, generated C", BATCH, lambda: w5(few, tau)),
    ]
