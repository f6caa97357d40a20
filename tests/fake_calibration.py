"""A made-up calibration for the tests of plots and report; no number here was ever measured."""

import numpy as np

from rigid.report import content as c

TIME = np.linspace(0.0, 30.0, 1000)
PAPER = (c.Published(6e7, "paper, eq. (16)"),)
SPEC = """title = "Calibration of the rig"
simulated = true

[model]
effects = ["load-cell-spring", "oil-compressibility", "viscous-friction", "pump-curve"]

[[records]]
name = "frame-1"
kind = "frame"   # <-- a comment with < and & in it
"""


def channel(record, kind, quantity, unit, seed, time=TIME):
    rng = np.random.default_rng(seed)
    span = time[-1]
    step, noise = {
        "load": (295.0, 150.0),
        "stroke": (2.2e-4, 6e-5),
        "pressure": (34474.0, 12e3),
        "acceleration": (0.02, 0.35),
    }[quantity]
    ramp = np.clip((time - 0.1 * span) / (0.35 * span), 0, 1) - np.clip(
        (time - 0.65 * span) / (0.1 * span), 0, 1
    )
    truth = {"load": 2.4e5 * ramp, "stroke": 4.9e-3 * ramp, "pressure": 5.4e7 * ramp}.get(
        quantity, 40 * np.exp(-time * 60) * np.sin(2 * np.pi * 97 * time) * (time > 0.01)
    )
    data = np.round((truth + noise * rng.standard_normal(time.size)) / step) * step
    width = (1 + 3 * np.abs(ramp)) * 0.6 * noise
    quantiles = truth + width * np.array([-1.64, -0.67, 0, 0.67, 1.64])[:, None]
    valve = (
        ((0.0, "shut"),)
        if kind == "release"
        else (
            (0.0, "shut"),
            (0.1 * span, "open"),
            (0.45 * span, "shut"),
            (0.65 * span, "tank"),
            (0.75 * span, "shut"),
        )
    )
    residual = rng.standard_normal(time.size)
    return c.ChannelFit(
        *(record, "B" if record.endswith("2") else "A", kind, quantity, unit, time, data),
        quantiles=quantiles,
        residual=residual,
        valve=valve,
        gap=1.0 + 0.05 * rng.random(),
        correlation_time=0.0 if kind == "release" else 0.031,
        autocorrelation=0.02 * rng.standard_normal((2, 40)),
    )


def fits():
    of = {"load": "N", "stroke": "m", "pressure": "Pa"}
    made = [
        channel(record, kind, quantity, unit, seed=31 * index + len(record))
        for record, kind in (("frame-1", "frame"), ("frame-2", "frame"), ("free-run-1", "free-run"))
        for index, (quantity, unit) in enumerate(of.items())
    ]
    short = np.arange(160) / 1600.0
    return (*made, channel("release-1", "release", "acceleration", "m/s^2", 7, short))


def friction():
    f = np.geomspace(1e-2, 1e3, 61)
    omega, tau = 2 * np.pi * f, 0.35
    mu = 3.6e3 + 1.5e6 / (1 + 1j * omega * tau)
    informed = (f < 2) | ((f > 40) & (f < 400))
    spread = np.where(informed, 0.07, 0.55 * np.exp(-(((np.log10(f) - 1) / 0.6) ** 2)) + 0.2)
    z = np.array([-1.64, -0.67, 0, 0.67, 1.64])[:, None]
    return c.FrictionCurve(
        frequency=f,
        dissipative=mu.real * np.exp(z * spread),
        storage=-omega * mu.imag * np.exp(z * spread),
        magnitude=np.abs(mu) * np.exp(z * spread),
        prior_magnitude=8e4 * np.exp(z * 2.2) * np.ones_like(f),
        informed=informed,
        excited=(("frame", 0.02, 0.6), ("free run", 0.05, 2.0), ("release", 60.0, 260.0)),
        published=(
            (100.0, 3.7e3, "paper, eq. (17), release"),
            (None, 1.35e6, "paper, eq. (18), cylinder A"),
            (None, 4.46e6, "paper, eq. (18), cylinder B"),
        ),
    )


def polynomial_roots(epsilon, a1=50 / 110, a2=6e7 * 0.2 / (2e9 * 44.2e-4)):
    coefficients = [a1, -1j * epsilon * (1 + a1), -(a1 + a2 + 1), 1j * epsilon * a2, a2]
    found = np.roots(coefficients)
    return found[np.argsort(found.real)]


def roots():
    scale = 634.0 * 110.0
    paths = [polynomial_roots(epsilon) for epsilon in np.linspace(0, 2.15, 200)]
    rng = np.random.default_rng(3)
    cloud = [polynomial_roots(3.6e3 * (1 + 0.05 * g) / scale) for g in rng.standard_normal(60)]
    return c.Roots(
        paths=np.array(paths).T,
        damping_range=(0.0, 2.15),
        undamped=polynomial_roots(0.0),
        marks=(
            ("paper, 3.7 kN·s/m", polynomial_roots(3.7e3 / scale)),
            ("paper, 1.35 MN·s/m (A)", polynomial_roots(1.35e6 / scale)),
            ("paper, 4.46 MN·s/m (B)", polynomial_roots(4.46e6 / scale)),
        ),
        posterior=(r"posterior, |μ| at 80 Hz", np.concatenate(cloud)),
    )


def draws():
    rng = np.random.default_rng(5)
    z = rng.standard_normal((5, 4000))
    values = np.array(
        [
            6.03e7 + 1.2e6 * z[0],
            1.5e6 * np.exp(0.3 * z[1]),
            3.6e3 * np.exp(0.08 * z[2]),
            2e9 * (1 + 0.03 * z[3]),
            0.2 * (1 + 0.9 * 0.03 * z[3] + 0.01 * z[4]),
        ]
    )
    symbols = ("k_{LC}", r"\mu(0)", r"|\mu|(80)", r"k_{oil}", r"L_0")
    units = ("N/m", "N s/m", "N s/m", "Pa", "m")
    return c.ParameterDraws(symbols, units, values, (6e7, 1.35e6, 3.7e3, 2e9, None))


def trace(symbol, unit, centre, spread, seed):
    rng = np.random.default_rng(seed)
    step = np.arange(0, 4000, 10)
    drift = np.exp(-step / 300.0) * rng.standard_normal((8, 1)) * 4
    means = centre + spread * (0.12 * rng.standard_normal((8, step.size)) + drift)
    return c.Trace(symbol, unit, step, means, 1000, rng.poisson(200, (8, 20)))


def parameter(name, symbol, unit, prior, post, informed, **more):
    (p05, p50, p95), (q05, q50, q95) = prior, post
    return c.ParameterShown(
        mean=q50, sd=(q95 - q05) / 3.29, median=q50, q05=q05, q95=q95,
        ess_bulk=2310.0, ess_tail=1875.0, r_hat=1.0031,
        name=name, symbol=symbol, unit=unit, prior_median=p50, prior_q05=p05, prior_q95=p95,
        informed=informed,
        **more,
    )  # fmt: skip


def parameters():
    return (
        parameter(
            *("k_LC", "k_{LC}", "N/m", (1.9e7, 6e7, 1.9e8), (5.83e7, 6.03e7, 6.22e7), 0.97),
            published=PAPER,
        ),
        parameter(
            *("mu_slow", r"\mu_0", "N s/m", (1.2e3, 7e5, 4e8), (1.1e6, 1.5e6, 2.6e6), 0.91),
            published=(
                c.Published(1.35e6, "eq. (18), A"),
                c.Published(4.46e6, "eq. (18), B"),
            ),
        ),
        parameter("tau", r"\tau_1", "s", (1e-3, 0.03, 1.0), (0.2, 0.35, 0.61), 0.62),
        parameter(
            *("k_oil", r"k_{oil}", "Pa", (1.84e9, 2e9, 2.17e9), (1.86e9, 2.01e9, 2.16e9), 0.04),
            published=(c.Published(2e9, "eq. (1)"),),
            note="only its ratio to L_0 is identified",
        ),
        parameter("L_0[A]", r"L_0", "m", (0.193, 0.2, 0.207), (0.194, 0.201, 0.208), 0.02),
        parameter(
            *("kappa[free-run-1,A]", r"\kappa", "-", (0.05, 0.2, 0.8), (0.196, 0.2004, 0.205)),
            0.98,
            published=(c.Published(0.2, "numerical simulations"),),
        ),
        parameter("M_HC", r"M_{HC}", "kg", (57.0, 60.0, 63.0), (57.1, 60.1, 62.9), 0.01),
    )


def key_numbers():
    paper_mu = (c.Published(1.35e6, "eq. (18), A"), c.Published(4.46e6, "eq. (18), B"))
    return (
        c.KeyNumber(
            "stiffness of the load-cell end",
            *("k_{LC}", "N/m", 6.03e7, 1.2e6, 5.83e7, 6.22e7, PAPER),
        ),
        c.KeyNumber(
            "friction coefficient at rest",
            *(r"\mu(0)", "N s/m", 1.5e6, 4.6e5, 1.1e6, 2.6e6, paper_mu),
        ),
        c.KeyNumber(
            "friction coefficient at 80 Hz",
            *(r"|\mu|(80\,\mathrm{Hz})", "N s/m", 3.61e3, 290.0, 3.14e3, 4.1e3),
            published=(c.Published(3.7e3, "eq. (17)"),),
            reading="The release says what the paper's decay estimate says.",
        ),
        c.KeyNumber(
            "flow fraction, free-run-1, A",
            *(r"\kappa", "-", 0.2004, 0.0027, 0.196, 0.205),
            published=(c.Published(0.2, "numerical simulations"),),
        ),
    )


def records():
    return (
        c.RecordNote("frame-1", "A", "frame", "data/frame-1.csv", 1000, 30.0),
        c.RecordNote("frame-2", "B", "frame", "data/frame-2.csv", 1000, 30.0, ("3 gaps of 20 ms",)),
        c.RecordNote(
            *("free-run-1", "A", "free-run", "data/free-run-1.csv", 1000, 30.0),
            notes=("12 rows repeat the time before; kept the first", "stroke starts at 1.4 mm"),
        ),
        c.RecordNote("release-1", "A", "release", "data/release-1.csv", 160, 0.1),
    )


def provenance():
    return c.Provenance(
        version="0.1.0",
        commit="3f2a91c",
        command="python -m rigid.fit calibration --seed 1",
        date="2026-11-21 07:40 UTC",
        seed=1,
        spec_name="fits/calibration.toml",
        spec_text=SPEC,
        sha256=tuple((f"data/{r}.csv", "0123456789abcdef" * 4) for r in ("frame-1", "release-1")),
        versions=(("jax", "0.10.2"), ("emcee", "3.1.6")),
        wall_s=4350.0,
        compile_s=38.2,
        evaluations=1_234_567,
        failed_solves=3,
        evaluations_per_s=284.0,
        ess_min=1875.0,
        ess_min_per_s=0.43,
        machine="2 cores",
    )


def calibration(**changes):
    values = {
        "title": "Calibration of the rig",
        "simulated": True,
        "front": c.Front(
            "What are the 7 uncertain numbers of this rig, given 4 records?",
            c.GOOD,
            "Usable: all 3 checks passed.",
            answers=(c.Answer("stiffness of the load-cell end", "60.3 ± 1.2 MN/m", "", "k_{LC}"),),
            cannot=("Friction rests on the prior at 2 to 40 Hz.",),
            next=("Take the posterior to the field.",),
            figure="friction",
        ),
        "usable": True,
        "budgets": (
            c.GumBudget(
                *("k_LC", "N/m", 6.03e7, 1.2e6),
                (
                    c.BudgetLine("k_frame", "B", 2.86e8, 8.6e6, "N/m", -0.13, 1.1e6),
                    c.BudgetLine("readings", "A", None, None, "", None, 4e5),
                ),
            ),
        ),
        "paper": c.ForPaper("Methods.", "Results.", "\\begin{table}", "@misc{rigid}"),
        "checks": (
            c.Check("r_hat", True, "largest R-hat between ensembles 1.003, allowed 1.01"),
            c.Check("ess", True, "least effective sample size 1,875, asked for 1,000"),
            c.Check("gap", True, "largest gap 1.05 (frame-2, stroke), allowed 1.3"),
        ),
        "key_numbers": key_numbers(),
        "parameters": parameters(),
        "products": (
            c.KeyNumber(
                *("k_oil / L_0", r"k_{oil}/L_0", "Pa/m", 1.0e10, 5.2e7, 9.91e9, 1.009e10),
                reading="eq. (12) holds the two as a ratio only",
            ),
        ),
        "alternatives": (
            c.Alternative("beams of the frame", "two", True, 6.03e7, 5.83e7, 6.22e7, "eq. (15)"),
            c.Alternative("beams of the frame", "four", False, 5.2e7, 5.05e7, 5.36e7),
        ),
        "modes": (
            c.ModeRow(0.93, 0.021, (("k_{LC}", "N/m", 6.03e7), (r"\mu_0", "N s/m", 1.5e6))),
            c.ModeRow(0.07, 0.021, (("k_{LC}", "N/m", 5.1e7), (r"\mu_0", "N s/m", 9e5))),
        ),
        "gap": 1.02,
        "friction": friction(),
        "fits": fits(),
        "records": records(),
        "draws": draws(),
        "traces": (
            trace("k_{LC}", "N/m", 6.03e7, 1.2e6, 1),
            trace(r"\mu_0", "N s/m", 1.5e6, 4e5, 2),
            trace(r"\tau_1", "s", 0.35, 0.1, 3),
        ),
        "roots": roots(),
        "provenance": provenance(),
    }
    return c.CalibrationContent(**(values | changes))
