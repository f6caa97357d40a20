"""A cart of one body in files: record and spec."""

from pathlib import Path

import numpy as np

MASS, DRAG = 40.0, 120.0
SPEC = """\
title = "Cart"
simulated = true

[model]
body = "cart"
effects = ["viscous-friction"]

[priors]
M_Pl = { lognormal = { median = 30.0, factor = 2.0 } }
mu = { lognormal = { median = 100.0, factor = 3.0 } }

[sensors]
force = { noise = 2.0, gain_sd = 0.01, zero_sd = 1.0 }

[[records]]
name = "to-and-fro"
kind = "motion"
file = "cart.csv"
[records.channels]
time = { column = "t", unit = "s" }
position = { column = "x", unit = "m" }
force = { column = "F", unit = "N" }

[sampler]
ensembles = 2
starts = 4
walkers = 16
ess = 100.0
r_hat = 1.1
"""
SECOND = """
[[records]]
name = "{name}"
kind = "{kind}"
{more}
[records.channels]
{channels}
"""
"""A further record of the cart, to be put before the sampler."""


def write_cart(
    folder: Path, name: str = "cart", drag: float = DRAG, seed: int = 1, seconds: float = 20.0
) -> Path:
    """Write a record of a cart with known mass and drag, and its spec; gives the spec's path."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, seconds, 0.005)
    w = 2.0 * np.pi * 0.5
    x = 0.3 * np.sin(w * t)
    force = -MASS * 0.3 * w**2 * np.sin(w * t) + drag * 0.3 * w * np.cos(w * t)
    force = force + 8.0 * rng.standard_normal(t.size)
    rows = [f"{a:.4f},{b:.9f},{c:.4f}" for a, b, c in zip(t, x, force, strict=True)]
    (folder / f"{name}.csv").write_text("\n".join(["t,x,F", *rows]) + "\n", "utf-8")
    path = folder / f"{name}.toml"
    path.write_text(SPEC.replace("cart.csv", f"{name}.csv"), "utf-8")
    return path
