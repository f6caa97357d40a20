"""The specs of the five machines with a test each, whose load is sought."""

from pathlib import Path

import jax.numpy as jnp
import numpy as np
from machines.loading import written
from machines.loads import LOADS

from rigid.likelihood.assemble import assemble
from rigid.records.read import read_records
from rigid.smoothing.laws import RigModel
from rigid.smoothing.machine_records import read_at
from rigid.spec import Spec, load_spec

JOINTS = {
    "press": "",
    "table": "",
    "shaker": '[machine.joints.specimen]\nbetween = ["table", "ground"]\n',
    "swing": '[machine.joints.push]\nbetween = ["body", "ground"]\n',
    "hanging": '[machine.joints.blow]\nbetween = ["plate", "ground"]\n',
}
"""Joints at which nothing acts in a calibration."""

SOUGHT = {
    "press": "workpiece", "table": "specimen", "shaker": "specimen", "swing": "push",
    "hanging": "blow",
}  # fmt: skip

TIME = 'time = { column = "t", unit = "s" }'
READ: dict[str, dict[str, dict[str, tuple[str, str]]]] = {
    "press": {
        "head": {"stroke": ("x", "mm"), "pressure": ("p_head", "bar")},
        "rod": {"pressure": ("p_rod", "bar")},
    },
    "table": {
        f"c{i}": {"stroke": (f"x{i}", "mm"), "pressure": (f"p{i}", "bar")} for i in (1, 2, 3, 4)
    },
    "shaker": {
        "head": {
            "command": ("u", "1"), "stroke": ("x", "mm"), "acceleration": ("a", "m/s^2"),
            "pressure": ("p", "bar"),
        },
        "rod": {"command": ("minus_u", "1"), "pressure": ("r", "bar")},
    },
    "swing": {"spring": {"position": ("x", "mm")}},
    "hanging": {
        "ram": {"acceleration": ("a_plate", "m/s^2")},
        "rope": {"acceleration": ("a_root", "m/s^2")},
        "cell": {"load": ("F", "kN")},
    },
}  # fmt: skip


def with_test(name: str, spec: str) -> str:
    """Return the text of a machine's spec with a test, the joint where its load is sought first."""
    records = ""
    for joint, channels in READ[name].items():
        listed = ", ".join(
            f'{q} = {{ column = "{column}", unit = "{unit}" }}'
            for q, (column, unit) in channels.items()
        )
        records += (
            f'\n[[records]]\nname = "pressing"\nkind = "test"\ncylinder = "{joint}"\n'
            f'file = "{name}-test.csv"\nchannels = {{ {TIME}, {listed} }}\n'
        )
    here = f'\n[bands]\nposterior = "posterior.nc"\nloads = ["{SOUGHT[name]}"]\n'
    return spec.replace("[machine.joints.", JOINTS[name] + "[machine.joints.", 1) + here + records


def simulated_test(name: str, folder: Path, seed: int = 1) -> tuple[Spec, np.ndarray]:
    """Write a machine's spec and its simulated test; gives the spec and the true load."""
    load = LOADS[name](folder / f"{name}-test.csv", seed)
    return load_spec(written(name, folder, lambda text: with_test(name, text))), load


def true_law(spec: Spec, truth: dict[str, float], draws: int) -> RigModel:
    """Draws that all are the machine as it was made; its sensors have neither gain nor zero."""
    problem = assemble(spec, read_records(spec))
    middle = problem.parameters.values(jnp.zeros((1, problem.parameters.size)))
    values = {n: float(np.asarray(v).ravel()[0]) for n, v in middle.items()} | truth
    for record in spec.records:
        for one in read_at(record):
            plain = spec.sensors[one.quantity].noise
            values |= {f"gain[{one.label}]": 0.0, f"zero[{one.label}]": 0.0}
            values |= {f"noise[{one.label}]": plain}
    wide = {n: np.full(draws, v) for n, v in values.items()}
    return RigModel("true", 1.0, problem.effects, wide, machine=spec.machine)
