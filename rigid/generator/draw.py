"""The population that campaigns are drawn from, and the truth of one campaign."""

import zlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field

import numpy as np

from rigid.generator.constants import BAR, COUNT, PSI
from rigid.generator.core import Rig, Run
from rigid.generator.friction import Friction
from rigid.generator.schedule import schedule
from rigid.generator.sensors import Flaws, Sensor

# Normal laws: (nominal, relative standard deviation). Sources: eq. (1) and (15) for the values,
# the contract's table of uncertainties for the spreads.
NORMAL = {
    "k_oil": (2e9, 0.05),
    "L_0": (0.20, 0.02),
    "M_HC": (60.0, 0.03),
    "M_Pl": (10.0, 0.03),
    "M_Fl": (200.0, 0.03),
    "k_frame": (2 * 200e9 * (0.13 + 2 * 0.06) * 0.006 / 2.1, 0.03),
}
# Lognormal laws: (median, factor); two thirds of the draws lie within the factor. The medians make
# |mu| about 1e6 N s/m in free running, eq. (18), and 1e5 at 80 Hz.
LOGNORMAL = {
    "k_LC": (6e7, 1.15),
    "mu_inf": (8e4, 1.25),
    "mu_1": (9e5, 1.25),
    "tau_1": (0.2, 1.3),
    "mu_2": (1.2e5, 1.3),
    "tau_2": (8e-3, 1.3),
}
# The same of the friction alone, as wide as a fit that knows next to nothing of it may assume.
WIDE_FRICTION = {
    "mu_inf": (1e5, 10.0),
    "mu_1": (5e5, 5.0),
    "tau_1": (0.2, 2.0),
    "mu_2": (1e5, 5.0),
    "tau_2": (8e-3, 2.0),
}
# Sensors: (sd of the gain, sd of the zero, median of the noise, step of the converter).
SENSORS = {
    "load": (1e-3, 100.0, 295.0 / 2, 295.0),
    "stroke": (1e-3, 0.12e-3, 0.22e-3 / 4, 0.22e-3),
    "pressure": (1e-3, 0.25 * BAR, 5 * PSI / 3, 5 * PSI),
    "acceleration": (1e-2, 0.05, 0.35, COUNT),
}
NOISE_FACTOR = 1.15
FREQUENCIES = (0.0, 0.1, 1.0, 3.0, 10.0, 30.0, 80.0, 100.0, 300.0)  # Hz, of the truth's mu(omega)


@dataclass(frozen=True)
class Secret:
    """A piece of physics that is hidden in records.

    - equation: that it enters; law: as a formula; parameters: its numbers, SI
    - records: "record,cylinder" in which it acts
    - strength: what it leaves after all constants are refitted, in noise; None where not computed
    """

    name: str
    equation: str | None = None
    law: str | None = None
    parameters: Mapping[str, float] = field(default_factory=dict)
    records: tuple[str, ...] = ()
    strength: float | None = None


@dataclass(frozen=True)
class Truth:
    """Everything that a fit does not know of a campaign.

    - sensors: by "channel,cylinder"; the accelerometer rides on cylinder A's
    - noise_correlation: AR(1) coefficient of the slow channels' noise
    - hidden: the pieces hidden in the data
    - flaws: of the records
    """

    seed: int
    rig: Rig
    friction: Friction
    sensors: dict[str, Sensor]
    runs: tuple[Run, ...]
    noise_correlation: float = 0.0
    hidden: tuple[Secret, ...] = ()
    flaws: Flaws = field(default_factory=Flaws)

    def parameters(self) -> dict[str, float]:
        """Flat table in the names of the fit with memory, e.g. `kappa[free-run-2,A]`.

        `mu` is the dashpot's coefficient mu_inf; `release_time` is on the clock of the file.
        """
        friction = {
            "mu": self.friction.mu_inf,
            "mu_branch[1]": self.friction.mu_1,
            "tau_branch[1]": self.friction.tau_1,
            "mu_branch[2]": self.friction.mu_2,
            "tau_branch[2]": self.friction.tau_2,
        }
        table = {**asdict(self.rig), **friction}
        for run in self.runs:
            own = {"kappa": run.kappa, "kappa_tank": run.kappa_tank, "preload": run.preload}
            if run.release_time is not None:
                own["release_time"] = run.file_start + run.release_time
            table |= {f"{key}[{run.name},{run.cylinder}]": value for key, value in own.items()}
        for name, sensor in self.sensors.items():
            table |= {f"{key}[{name}]": getattr(sensor, key) for key in ("gain", "zero", "noise")}
        return {key: value for key, value in table.items() if value is not None}

    def as_dict(self) -> dict:
        """All of it for a JSON file."""
        mu = [self.friction.coefficient(frequency) for frequency in FREQUENCIES]
        omega = 2 * np.pi * np.array(FREQUENCIES)
        flaws = {"flaws": asdict(self.flaws)} if self.flaws != Flaws() else {}
        return {
            "simulated": True,
            "seed": self.seed,
            "noise_correlation": self.noise_correlation,
            "hidden": [asdict(secret) for secret in self.hidden],
            **flaws,
            "parameters": self.parameters(),
            "frequency": list(FREQUENCIES),
            "mu_omega": np.real(mu).tolist(),
            "k_omega": (0.0 - omega * np.imag(mu)).tolist(),
            "sensors": {name: asdict(sensor) for name, sensor in self.sensors.items()},
            "runs": [asdict(run) for run in self.runs],
        }


def stream(seed: int, *name: str) -> np.random.Generator:
    """Give random numbers of their own for every purpose: more records never shift the others'."""
    key = tuple(zlib.crc32(part.encode()) for part in name)
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))


def _lognormal(rng: np.random.Generator, median: float, factor: float) -> float:
    return float(median * np.exp(np.log(factor) * rng.standard_normal()))


def _sensor(rng: np.random.Generator, channel: str) -> Sensor:
    gain, zero, noise, step = SENSORS[channel]
    return Sensor(
        gain=1.0 + gain * float(rng.standard_normal()),
        zero=zero * float(rng.standard_normal()),
        noise=_lognormal(rng, noise, NOISE_FACTOR),
        step=step,
    )


def draw(
    seed: int,
    *,
    field: bool = True,
    noise_correlation: float = 0.0,
    clock: int | None = None,
    wide_friction: bool = False,
) -> Truth:
    """Draw a campaign from the population.

    - seed: of everything, the noise included
    - field: whether the field record is part of it
    - noise_correlation: AR(1) coefficient, in [0, 1)
    - clock: a seed for lengths of records and times of the valve, so that campaigns of many seeds
      share them (and a study its compiled programs); left out: they follow `seed`
    - wide_friction: whether the friction comes from WIDE_FRICTION, not from the rig's own range
    """
    rng = stream(seed, "rig")
    clocks = None if clock is None else (lambda name: stream(clock, "clocks", name))
    values = {k: v * (1 + sd * float(rng.standard_normal())) for k, (v, sd) in NORMAL.items()}
    laws = LOGNORMAL | (WIDE_FRICTION if wide_friction else {})
    values |= {k: _lognormal(rng, *law) for k, law in laws.items()}
    rig = Rig(**{name: values.pop(name) for name in Rig.__dataclass_fields__})
    names = [(c, f"{c},{cyl}") for cyl in "AB" for c in ("load", "stroke", "pressure")]
    names.append(("acceleration", "acceleration,A"))
    return Truth(
        seed=seed,
        rig=rig,
        friction=Friction(**values),
        sensors={name: _sensor(stream(seed, "sensor", name), channel) for channel, name in names},
        runs=schedule(rig, lambda name: stream(seed, "schedule", name), field=field, clocks=clocks),
        noise_correlation=noise_correlation,
    )
