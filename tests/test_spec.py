"""The spec: every key and default, every refusal in a sentence, and where specs are found."""

import math
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import rigid
from rigid.io.errors import InputError
from rigid.records.defects import NAMES
from rigid.spec import (
    BandsSpec,
    ChannelSpec,
    Known,
    ModelSpec,
    RecordSpec,
    RigSpec,
    SamplerSpec,
    SensorSpec,
    find_spec,
    load_spec,
    parse_spec,
    read,
)
from rigid.spec.sentences import nearest
from rigid.spec.values import SpecBody
from rigid.spec.write import build_spec, spec_text

ROOT = Path(rigid.__file__).parents[1]
PSI = 6894.757293168
TIME = 'time = { column = "t", unit = "s" }'
CHANNELS = f'channels = {{ {TIME}, load = {{ column = "F", unit = "kN" }} }}'
FRAME = f'[[records]]\nname = "f"\nkind = "frame"\nfile = "f.csv"\n{CHANNELS}\n'
ACCELERATION = f'channels = {{ {TIME}, acceleration = {{ column = "a", unit = "g" }} }}'
FORCE = 'force = { column = "F", unit = "N" }'
PUSHED = f'channels = {{ {TIME}, position = {{ column = "x", unit = "m" }}, {FORCE} }}'
MOTION = f'[[records]]\nname = "m"\nkind = "motion"\nfile = "m.csv"\n{PUSHED}\n'
SHEET = "[sensors]\nforce = { noise = 2.0, gain_sd = 0, zero_sd = 0 }\n"
RELEASE = f'[[records]]\nname = "r"\nkind = "release"\nfile = "r.csv"\n{ACCELERATION}\n'


@pytest.fixture
def write(tmp_path):
    """Write a spec; gives its path."""

    def write(text: str, name: str = "own.toml") -> Path:
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, "utf-8")
        return path

    return write


@pytest.fixture
def refusal(write):
    """Load a spec that must be refused; gives its lines without the path."""

    def refusal(text: str) -> list[str]:
        path = write(text)
        with pytest.raises(InputError) as caught:
            load_spec(path)
        lines = str(caught.value).splitlines()
        assert all(line.startswith(f"{path} ") for line in lines)
        assert caught.value.status == 2
        return [line.removeprefix(f"{path} ") for line in lines]

    return refusal


# What is left out


def relative(known: Known) -> float:
    return known.sd / known.value


def test_the_rig_of_the_contract(write):
    """Values: paper, eqs. (1), (15); spreads: the contract's table."""
    rig = load_spec(write("")).rig
    assert (rig.M_HC.value, rig.M_Pl.value, rig.M_Fl.value) == (60.0, 10.0, 200.0)
    assert (rig.S_Pl, rig.p_max) == (Known(value=44.2e-4), Known(value=700e5))
    assert (rig.k_oil.value, rig.L_0.value) == (2e9, 0.20)
    for name, share in {"M_HC": 3, "M_Pl": 3, "M_Fl": 3, "k_oil": 5, "L_0": 2}.items():
        assert relative(getattr(rig, name)) == pytest.approx(share / 100)
    assert rig.frame_stiffness.value == pytest.approx(2 * 200e9 * 0.25 * 0.006 / 2.1)
    assert relative(rig.frame_stiffness) == pytest.approx(0.03)
    known = {"M_HC", "M_Pl", "M_Fl", "S_Pl", "k_oil", "L_0", "p_max", "k_frame"}
    assert set(rig.known) == known


SENSORS = {  # step, noise, gain, zero: the contract's table
    "load": (295.0, 295.0 / 2, 1e-3, 100.0),
    "stroke": (0.22e-3, 0.22e-3 / 4, 1e-3, 0.12e-3),
    "pressure": (5 * PSI, 5 * PSI / 3, 1e-3, 0.25e5),
    "acceleration": (0.0, 0.35, 1e-2, 0.05),
}


@pytest.mark.parametrize("quantity", SENSORS)
def test_the_sensors_of_the_contract(write, quantity):
    sheet = load_spec(write("")).sensors[quantity]
    found = (sheet.step, sheet.noise, sheet.gain_sd, sheet.zero_sd)
    assert found == pytest.approx(SENSORS[quantity])


def test_what_else_is_left_out(write):
    spec = load_spec(write(""))
    assert (spec.title, spec.simulated, spec.records, spec.bands) == ("", False, (), None)
    assert spec.model.effects == (
        "load-cell-spring",
        "oil-compressibility",
        "viscous-friction",
        "pump-curve",
    )
    assert (spec.model.candidates, dict(spec.model.vary), dict(spec.priors)) == (None, {}, {})
    rule = spec.sampler
    assert (rule.seed, rule.ensembles, rule.walkers, rule.starts) == (1, 4, 0, 16)
    assert (rule.r_hat, rule.ess, rule.max_steps, rule.block) == (1.01, 1000.0, 20000, 50)


@pytest.mark.parametrize(
    ("kind", "position", "fit"),
    [("frame", "open", True), ("free-run", "open", True), ("field", "open", False)],
)
def test_what_a_record_leaves_out(write, kind, position, fit):
    (record,) = load_spec(write(FRAME.replace('"frame"', f'"{kind}"'))).records
    assert [(s.until, s.position) for s in record.valve] == [(math.inf, position)]
    assert (record.fit, record.cylinder) == (fit, "A")
    assert (record.preload, record.release_time, record.accept, record.rows) == (
        None,
        None,
        (),
        None,
    )
    assert (record.channels["load"].scale, record.channels["load"].offset) == (None, 0.0)


def test_what_a_release_leaves_out(write):
    (record,) = load_spec(write(RELEASE + "preload = 6000")).records
    assert [(s.until, s.position) for s in record.valve] == [(math.inf, "shut")]
    assert record.preload == Known(value=6000.0, sd=60.0)


# What is stated

FULL = """\
title = "Another rig"
simulated = true
[rig]
M_HC = { value = 61.0, sd = 1.0 }
M_Pl = 11
M_Fl = { value = 190.0 }
S_Pl = { value = 44e-4, sd = 1e-5 }
k_oil = { value = 1.8e9, sd = 1e8 }
L_0 = 0.3
p_max = 650e5
k_frame = { value = 2e8, sd = 1e7 }
frame_beams = "two-shared"
[model]
effects = ["load-cell-spring", "viscous-friction"]
candidates = ["coulomb-friction", "mine:Effect"]
vary = { mu = "kind", k_LC = "cylinder" }
[priors]
k_LC = { lognormal = { median = 6e7, factor = 2 } }
"mu[frame]" = { fixed = 3.7e3 }
[sensors]
load = { step = 100, noise = 50, gain_sd = 0.01, zero_sd = 10, range = [-1e6, 1e6] }
acceleration = { noise = 0.1 }
[[records]]
name = "squeeze 1"
kind = "frame"
cylinder = "left"
file = "../logger/day 1/a.dat"
valve = [
    { until = 2, position = "open" }, { until = 3.5, position = "tank" }, { position = "shut" },
]
accept = ["gap", "nan"]
rows = [5, 900]
fit = false
[records.channels]
time = { column = "TIMESTAMP", unit = "timestamp" }
load = { column = 3, unit = "counts", scale = -12.5, offset = 4 }
stroke = { column = "Weg [mm]", unit = "mm" }
pressure = { column = "p", unit = "psi" }
[[records]]
name = "snap"
kind = "release"
file = "/absolute/snap.csv"
preload = { value = 5000, sd = 50 }
release_time = { value = 0.1, sd = 0.01 }
[records.channels]
time = { column = "t", unit = "ms" }
acceleration = { column = "Az", unit = "g" }
[bands]
posterior = "../out/posterior.nc"
[sampler]
seed = 5
ensembles = 3
walkers = 64
starts = 8
r_hat = 1.02
ess = 500
max_steps = 400
block = 50
"""


def test_every_key_arrives(write, tmp_path):
    path = write(FULL, "specs/full.toml")
    spec = load_spec(path)
    assert (spec.title, spec.simulated, spec.path, spec.text) == ("Another rig", True, path, FULL)
    rig = spec.rig
    assert Known(value=61.0, sd=1.0) == rig.M_HC
    for known, value, share in ((rig.M_Pl, 11.0, 0.03), (rig.L_0, 0.3, 0.02)):
        assert known.value == value
        assert known.sd == pytest.approx(share * value)
    assert (rig.S_Pl.sd, rig.p_max.value) == (1e-5, 650e5)
    assert rig.frame_stiffness == Known(value=2e8, sd=1e7)
    assert dict(spec.model.vary) == {"mu": "kind", "k_LC": "cylinder"}
    assert spec.model.candidates == ("coulomb-friction", "mine:Effect")
    laws = {name: (p.law, dict(p.arguments)) for name, p in spec.priors.items()}
    assert laws == {
        "k_LC": ("lognormal", {"median": 6e7, "factor": 2.0}),
        "mu[frame]": ("fixed", {"value": 3.7e3}),
    }
    assert spec.sensors["load"].range == (-1e6, 1e6)
    assert (spec.sensors["acceleration"].noise, spec.sensors["acceleration"].gain_sd) == (0.1, 0.01)
    rule = spec.sampler
    assert (rule.seed, rule.ensembles, rule.walkers, rule.starts) == (5, 3, 64, 8)
    assert (rule.r_hat, rule.ess, rule.max_steps, rule.block) == (1.02, 500.0, 400, 50)


def test_records_of_ones_own_arrive(write, tmp_path):
    squeeze, snap = load_spec(write(FULL, "specs/full.toml")).records
    assert (squeeze.name, squeeze.kind, squeeze.cylinder, squeeze.fit) == (
        *("squeeze 1", "frame", "left"),
        False,
    )
    assert squeeze.file.resolve() == tmp_path / "logger" / "day 1" / "a.dat"
    assert snap.file == Path("/absolute/snap.csv")
    assert [(s.until, s.position) for s in squeeze.valve] == [
        (2.0, "open"),
        (3.5, "tank"),
        (math.inf, "shut"),
    ]
    assert (squeeze.accept, squeeze.rows) == (("gap", "nan"), (5, 900))
    load = squeeze.channels["load"]
    assert (load.column, load.unit, load.scale, load.offset) == (3, "counts", -12.5, 4.0)
    assert squeeze.channels["stroke"].column == "Weg [mm]"
    assert (snap.preload, snap.release_time) == (
        Known(value=5000.0, sd=50.0),
        Known(value=0.1, sd=0.01),
    )


def test_beams_halve_the_frame(write):
    shared = load_spec(write('[rig]\nframe_beams = "two-shared"\n')).rig
    own = load_spec(write("")).rig
    assert shared.frame_stiffness.value == pytest.approx(own.frame_stiffness.value / 2)


def test_paths_count_from_the_spec_wherever_one_stands(write, tmp_path, monkeypatch):
    write(FULL, "specs/full.toml")
    monkeypatch.chdir(tmp_path)
    spec = load_spec(Path("specs/full.toml"))
    assert spec.records[0].file.resolve() == tmp_path / "logger" / "day 1" / "a.dat"
    assert spec.bands.posterior.resolve() == tmp_path / "out" / "posterior.nc"


def test_values_are_frozen(write):
    spec = load_spec(write(FULL))
    for part, name in ((spec, "title"), (spec.rig, "M_HC"), (spec.records[0], "kind")):
        with pytest.raises(ValueError, match="frozen"):
            setattr(part, name, None)


def test_a_byte_order_mark_and_windows_lines_are_read(tmp_path):
    path = tmp_path / "own.toml"
    path.write_bytes(b"\xef\xbb\xbf" + FULL.replace("\n", "\r\n").encode())
    assert load_spec(path).title == "Another rig"


def test_the_shipped_specs_load():
    for name in ("calibration", "constant-mu"):
        spec = load_spec(find_spec(name))
        assert spec.simulated
        assert all(record.file.is_file() for record in spec.records)


# The documentation

DOCUMENT = ROOT / "docs" / "spec.md"


@pytest.mark.skipif(not DOCUMENT.exists(), reason="needs the checkout's documentation")
def test_the_example_of_the_documentation_loads(write):
    example = DOCUMENT.read_text("utf-8").split("```toml\n")[1].split("```")[0]
    spec = load_spec(write(example, "my-rig/specs/my-rig.toml"))
    runs = [(r.name, r.kind, r.cylinder) for r in spec.records]
    assert runs == [
        ("squeeze", "frame", "left"),
        ("stroll", "free-run", "left"),
        ("stroll", "free-run", "right"),
        ("snap", "release", "left"),
    ]
    assert spec.sensors["load"].noise == 60.0
    assert (spec.rig.M_HC.value, spec.rig.M_HC.sd) == (61.4, 0.2)


@pytest.mark.skipif(not DOCUMENT.exists(), reason="needs the checkout's documentation")
def test_the_example_of_another_machine_loads(write):
    text = DOCUMENT.with_name("machines.md").read_text("utf-8")
    spec = load_spec(write(text.split("```toml\n")[1].split("```")[0], "cart.toml"))
    (record,) = spec.records
    assert (record.kind, record.corner) == ("motion", 10.0)
    assert spec.model.equation("plunger-momentum") == "cart-momentum"


PARTS = (SpecBody, RigSpec, ModelSpec, SensorSpec, RecordSpec, ChannelSpec, BandsSpec, SamplerSpec)


@pytest.mark.skipif(not DOCUMENT.exists(), reason="needs the checkout's documentation")
@pytest.mark.parametrize("part", PARTS, ids=lambda part: part.__name__)
def test_the_documentation_names_every_key(part):
    text = DOCUMENT.read_text("utf-8")
    missing = [
        key for key in part.model_fields if f"`{key}`" not in text and f"`[{key}]`" not in text
    ]
    assert [key for key in missing if f"[[{key}]]" not in text] == []


# Refusals: text -> its one line

LAW = "a prior is one law, as in { lognormal = { median = 6e7, factor = 2 } }"
KNOWN = "must be a number, or one with its sd, { value = ..., sd = ... }; found"
REFUSED = {
    # Unknown keys, wherever they stand
    "titel = 1": "[top level]: unknown key 'titel'; did you mean 'title'?",
    "zzz = 1": (
        "[top level]: unknown key 'zzz'; known are bands, channels, machine, model, plan, priors, "
        "published, records, rig, sampler, sensors, simulated, solve, title"
    ),
    "[rig]\nM_hc = 60": "[rig]: unknown key 'M_hc'; did you mean 'M_HC'?",
    "[rig]\nl_0 = 60": "[rig]: unknown key 'l_0'; did you mean 'L_0'?",
    "[rig.M_HC]\nvalue = 60\nsigma = 1": ("[rig] M_HC: unknown key 'sigma'; known are sd, value"),
    "[rig.k_frame]\nvalue = 60\nSD = 1": "[rig] k_frame: unknown key 'SD'; did you mean 'sd'?",
    "[model]\neffect = []": "[model]: unknown key 'effect'; did you mean 'effects'?",
    "[sensors]\nLoad = {}": "[sensors]: unknown key 'Load'; did you mean 'load'?",
    "[sensors]\nload = { steps = 1 }": (
        "[sensors] load: unknown key 'steps'; did you mean 'step'?"
    ),
    "[sampler]\nwalker = 8": "[sampler]: unknown key 'walker'; did you mean 'walkers'?",
    '[bands]\nposteriors = "x"\nposterior = "x"': (
        "[bands]: unknown key 'posteriors'; did you mean 'posterior'?"
    ),
    FRAME + 'Cylinder = "A"': ("[[records]] 'f': unknown key 'Cylinder'; did you mean 'cylinder'?"),
    FRAME.replace('column = "t",', 'column = "t", units = "s",'): (
        "[[records]] 'f' channels.time: unknown key 'units'; did you mean 'unit'?"
    ),
    FRAME + 'valve = [{ untill = 1, position = "shut" }]': (
        "[[records]] 'f' valve.entry 1: unknown key 'untill'; did you mean 'until'?"
    ),
    # Unknown words
    FRAME.replace("load =", "Load ="): (
        "[[records]] 'f' channels: unknown channel 'Load'; did you mean 'load'?"
    ),
    FRAME.replace("load =", "colour ="): (
        "[[records]] 'f' channels: unknown channel 'colour'; known are time, load, stroke, "
        "pressure, acceleration, position, force, command"
    ),
    FRAME.replace('"frame"', '"free_run"'): (
        "[[records]] 'f' kind: unknown kind 'free_run'; did you mean 'free-run'?"
    ),
    FRAME.replace('"frame"', '"Frame"'): (
        "[[records]] 'f' kind: unknown kind 'Frame'; did you mean 'frame'?"
    ),
    FRAME.replace('"frame"', "3"): (
        "[[records]] 'f' kind: must be one of frame, release, free-run, field, motion, run, test; "
        "found 3"
    ),
    FRAME + 'valve = [{ position = "closed" }]': (
        "[[records]] 'f' valve.entry 1.position: unknown position 'closed'; known are open, shut, "
        "tank"
    ),
    FRAME + 'accept = ["nan", "gaps"]': (
        "[[records]] 'f' accept.entry 2: unknown defect 'gaps'; did you mean 'gap'?"
    ),
    '[rig]\nframe_beams = "two"': (
        "[rig] frame_beams: unknown value 'two'; known are two-per-cylinder, two-shared"
    ),
    '[model]\nvary = { mu = "kinds" }': (
        "[model] vary.mu: unknown value 'kinds'; did you mean 'kind'?"
    ),
    # Wrong types and numbers
    'simulated = "yes"': "[simulated]: must be true or false; found 'yes'",
    "title = 3": "[title]: must be a text in quotes; found 3",
    "rig = 3": "[rig]: must be a table of keys; found 3",
    'records = "all"': "[records]: every record is a table of its own, headed [[records]]",
    '[rig]\nM_HC = "60"': f"[rig] M_HC: {KNOWN} '60'",
    "[rig]\nM_HC = true": f"[rig] M_HC: {KNOWN} True",
    "[rig]\nM_HC = nan": "[rig] M_HC.value: must be a finite number; found nan",
    "[rig]\nM_HC = { sd = 1.0 }": "[rig] M_HC.value: is missing",
    "[rig]\nM_HC = { value = 60, sd = -1 }": "[rig] M_HC.sd: must be 0 or more; found -1",
    '[model]\neffects = "pump-curve"': (
        "[model] effects: must be a list, as in [ ... ]; found 'pump-curve'"
    ),
    '[model]\neffects = ["pump-curve", "pump-curve"]': (
        "[model]: effects: 'pump-curve' stands twice; name it once"
    ),
    "[priors]\nmu = 3": f"[priors] mu: {LAW}",
    "[priors]\nmu = { normal = { mean = 1, sd = 1 }, fixed = 1 }": f"[priors] mu: {LAW}",
    '[priors]\nmu = { normal = { mean = "1", sd = 1 } }': (
        "[priors] mu.mean: must be a number; found '1'"
    ),
    "[sensors]\nload = { noise = 0 }": "[sensors] load.noise: must be above 0; found 0",
    "[sensors]\nload = { range = [1] }": (
        "[sensors] load.range: must be two numbers, as in [-3.3e5, 3.3e5]"
    ),
    "[sensors]\nload = { range = [2, 1] }": (
        "[sensors] load: range: the first number must be below the second"
    ),
    "[sampler]\nensembles = 1": "[sampler] ensembles: must be 2 or more; found 1",
    "[sampler]\nensembles = 2.5": "[sampler] ensembles: must be a whole number; found 2.5",
    "[sampler]\nseed = -1": "[sampler] seed: must be 0 or more; found -1",
    "[sampler]\nwalkers = 33": "[sampler] walkers: must be a multiple of 2; found 33",
    "[sampler]\nr_hat = 1": "[sampler] r_hat: must be above 1; found 1",
    "[sampler]\nblock = 80\nmax_steps = 150": (
        "[sampler]: max_steps is 150; it must be at least two blocks, 160"
    ),
    # Records that cannot be
    FRAME.replace('name = "f"\n', ""): "[[records]] number 1 name: is missing",
    FRAME.replace('"f"', '"a,b"'): (
        "[[records]] 'a,b' name: must be a name without [ ] , / and without blanks at its ends; "
        "found 'a,b'"
    ),
    FRAME.replace('file = "f.csv"\n', ""): "[[records]] 'f' file: is missing",
    FRAME.replace(TIME + ", ", ""): "[[records]] 'f': channels needs an entry 'time'",
    FRAME.replace('column = "F"', 'column = ""'): (
        "[[records]] 'f' channels.load.column: must be the name of a column or its number from 1; "
        "found ''"
    ),
    FRAME.replace('column = "F"', "column = true"): (
        "[[records]] 'f' channels.load.column: must be the name of a column or its number from 1; "
        "found True"
    ),
    FRAME.replace("load =", "acceleration ="): (
        "[[records]] 'f': channels: a frame needs at least one of 'load', 'stroke' and 'pressure'"
    ),
    FRAME.replace('"frame"', '"field"').replace(', load = { column = "F", unit = "kN" }', ""): (
        "[[records]] 'f': channels names no quantity beside time"
    ),
    RELEASE: (
        "[[records]] 'r': a release needs its preload, as in { value = 6000.0, sd = 60.0 } (N)"
    ),
    RELEASE.replace("acceleration", "load") + "preload = 1": (
        "[[records]] 'r': channels: a release needs an entry 'acceleration'"
    ),
    RELEASE + 'preload = 1\nvalve = [{ position = "open" }]': (
        "[[records]] 'r': valve: it is shut in a release; leave `valve` out"
    ),
    FRAME + "preload = 6000": "[[records]] 'f': preload belongs to a release; this is a frame",
    FRAME + "release_time = 1": (
        "[[records]] 'f': release_time belongs to a release; this is a frame"
    ),
    FRAME + "valve = []": (
        "[[records]] 'f': valve: the list is empty; write when it moves, as in [{ until = 2.5, "
        "position = 'open' }, { position = 'shut' }], or leave `valve` out where it stays as it is"
    ),
    FRAME + 'valve = [{ until = 3, position = "open" }, { until = 2, position = "shut" }, '
    '{ position = "open" }]': (
        "[[records]] 'f': valve: each `until` must lie after the one before; 2 follows 3"
    ),
    FRAME + 'valve = [{ position = "open" }, { position = "shut" }]': (
        "[[records]] 'f': valve: entry 1 lacks `until`; only the last lasts to the end"
    ),
    FRAME + 'valve = [{ until = 2, position = "open" }, { until = 9.5, position = "shut" }]': (
        "[[records]] 'f': valve: the last entry ends at 9.5 s; leave its `until` out, it lasts to "
        "the end of the record"
    ),
    FRAME + 'valve = [{ until = nan, position = "open" }]': (
        "[[records]] 'f' valve.entry 1.until: must be a time in s; found nan"
    ),
    FRAME + "rows = [1]": ("[[records]] 'f' rows: must be two line numbers, as in [5, 1200]"),
    FRAME + "rows = [9, 3]": (
        "[[records]] 'f': rows: the first line must be 1 or more, and not after the last"
    ),
    # Motions
    MOTION: (
        "[top level]: sensors: a motion needs the sheet of its force sensor, as in force = "
        "{ noise = 2.0, gain_sd = 0.01, zero_sd = 1.0 } (N)"
    ),
    SHEET.replace("noise", "step = 1, noise"): (
        "[sensors]: force: step: the low-pass of a motion leaves none; leave it out, it counts as "
        "noise of step/sqrt(12)"
    ),
    SHEET.replace(", zero_sd = 0", ""): "[sensors] force.zero_sd: is missing",
    SHEET + MOTION.replace("position =", "stroke ="): (
        "[[records]] 'm': channels: a motion needs an entry 'position'\n"
        "[[records]] 'm': channels: a motion has no 'stroke'; it takes time, position, force, "
        "pressure"
    ),
    SHEET + MOTION.replace("time =", 'load = { column = 1, unit = "N" }, time ='): (
        "[[records]] 'm': channels: a motion has no 'load'; it takes time, position, force, "
        "pressure"
    ),
    SHEET + MOTION + 'valve = [{ position = "open" }]': (
        "[[records]] 'm': valve: a motion has none; leave `valve` out"
    ),
    SHEET + MOTION + "corner = 0": "[[records]] 'm' corner: must be above 0; found 0",
    FRAME + "corner = 5": "[[records]] 'f': corner belongs to a motion; this is a frame",
    FRAME.replace("load =", 'force = { column = 1, unit = "N" }, load ='): (
        "[[records]] 'f': channels: 'force' belongs to a motion; this is a frame"
    ),
    '[model]\nbody = "my cart"': (
        "[model] body: must be a word in small letters, as in 'carriage'; found 'my cart'"
    ),
    FRAME + FRAME: (
        "[top level]: records: 'f' on cylinder A stands twice; give one of them another name"
    ),
    FRAME + FRAME.replace('"frame"', '"free-run"\ncylinder = "B"'): (
        "[top level]: records: 'f' is a frame on one cylinder and a free-run on another; one name "
        "is one run, give one of them another name"
    ),
}


@pytest.mark.parametrize("text", REFUSED)
def test_a_mistake_is_one_sentence(refusal, text):
    assert refusal(text) == REFUSED[text].split("\n")


def test_all_mistakes_are_told_at_once(refusal):
    lines = refusal("titel = 1\n[rig]\nM_hc = 1\n" + FRAME.replace('"frame"', '"frames"'))
    assert len(lines) == 3


def test_all_mistakes_of_a_record_and_of_a_campaign_are_told_at_once(refusal):
    assert refusal(RELEASE + 'rows = [9, 3]\nvalve = [{ position = "open" }]\n') == [
        "[[records]] 'r': a release needs its preload, as in { value = 6000.0, sd = 60.0 } (N)",
        "[[records]] 'r': valve: it is shut in a release; leave `valve` out",
        "[[records]] 'r': rows: the first line must be 1 or more, and not after the last",
    ]
    assert len(refusal("[model]\neffects = []\n" + FRAME + FRAME)) == 2


def test_channels_of_a_cylinder_stand_in_for_those_of_its_records(write):
    """The reference campaign with the columns of its loggers in every record is the same."""
    path = find_spec("calibration")
    text, shared = path.read_text("utf-8"), load_spec(path)
    head, *records = text.split("[[records]]\n")
    for side in "AB":
        columns = head.split(f"[channels.{side}]\n")[1].split("\n\n")[0]
        bare = [f'cylinder = "{side}"' in r and "channels" not in r for r in records]
        assert sum(bare) >= 4
        records = [
            f"{r.rstrip()}\n[records.channels]\n{columns}\n\n" if its else r
            for r, its in zip(records, bare, strict=True)
        ]
    head = head.split("[channels.A]")[0]
    found = load_spec(write("[[records]]\n".join([head, *records])))
    files = [r.model_copy(update={"file": r.file.name}) for r in found.records]
    assert files == [r.model_copy(update={"file": r.file.name}) for r in shared.records]
    # What a chain is resumed by.
    left_out = {"path", "text", "records"}
    assert found.model_dump(exclude=left_out) == shared.model_dump(exclude=left_out)


BARE = FRAME.replace(f"{CHANNELS}\n", "")


def test_a_mistake_in_channels_of_a_cylinder_is_told_once_and_there(refusal):
    shared = f'[channels.A]\n{TIME}\nload = {{ column = "F", uint = "kN" }}\n'
    assert refusal(shared + BARE + BARE.replace('"f"', '"g"')) == [
        "[channels] A.load.unit: is missing",
        "[channels] A.load: unknown key 'uint'; did you mean 'unit'?",
    ]
    assert refusal("channels = { A = 3 }\n" + BARE) == [
        "[channels] A: must be a table of keys; found 3"
    ]
    lod = shared.replace("load", "lod").replace("uint", "unit")
    assert refusal(lod + BARE) == ["[channels] A: unknown channel 'lod'; did you mean 'load'?"]


def test_a_record_whose_cylinder_has_no_channels_is_told_so(refusal, write):
    (line,) = refusal(BARE + f"[channels.B]\n{TIME}\n")
    assert line.startswith("[[records]] 'f': channels: is missing")
    assert "[channels.A]" in line
    mine = load_spec(write(FRAME + f"[channels.A]\n{TIME}\n")).records[0]  # its own count alone
    assert mine == load_spec(write(FRAME)).records[0]


def test_the_same_record_on_two_cylinders_is_one_run(write):
    text = FRAME + FRAME.replace('name = "f"', 'name = "f"\ncylinder = "B"')
    assert [r.cylinder for r in load_spec(write(text)).records] == ["A", "B"]


def test_accept_takes_the_names_of_all_defects(write):
    text = FRAME + f"accept = {list(NAMES)}"
    assert load_spec(write(text)).records[0].accept == NAMES


def test_what_is_no_toml_is_told_with_its_place(write):
    path = write("title = \n")
    with pytest.raises(InputError, match=r"own\.toml: is not valid TOML: .*line 1"):
        load_spec(path)


@pytest.mark.parametrize("content", [b"title = '\xff'", b"\x00\x01"])
def test_what_is_no_text_is_refused(tmp_path, content):
    path = tmp_path / "own.toml"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"own\.toml: (cannot be read|is not valid TOML)"):
        load_spec(path)


def test_a_file_that_is_gone_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"gone\.toml: cannot be read"):
        load_spec(tmp_path / "gone.toml")


def test_a_motion_has_no_valve_and_its_force_may_be_exact(write):
    spec = load_spec(write(SHEET + '[model]\nbody = "carriage"\n' + MOTION + "corner = 5"))
    (record,) = spec.records
    assert (record.valve, record.fit, record.corner) == ((), True, 5.0)
    sheet = spec.sensors["force"]
    assert (sheet.step, sheet.noise, sheet.gain_sd, sheet.zero_sd) == (0.0, 2.0, 0.0, 0.0)
    assert spec.model.equation("plunger-momentum") == "carriage-momentum"
    assert spec.model.equation("cylinder-momentum") == "cylinder-momentum"


# Looking for a spec


@pytest.fixture
def places(tmp_path, monkeypatch):
    """An empty folder to stand in, and one with a shipped example."""
    shipped = tmp_path / "shipped"
    shipped.mkdir()
    (shipped / "own.toml").write_text("")
    here = tmp_path / "here"
    here.mkdir()
    monkeypatch.chdir(here)
    monkeypatch.setattr(read, "EXAMPLES", (shipped, tmp_path / "nowhere"))
    return here, shipped


def test_a_path_goes_before_fits_and_fits_before_what_is_shipped(places):
    here, shipped = places
    assert find_spec("own") == shipped / "own.toml"
    (here / "fits").mkdir()
    (here / "fits" / "own.toml").write_text("")
    assert find_spec("own") == Path("fits/own.toml")
    (here / "own").write_text("")
    assert find_spec("own") == Path("own")


def test_a_folder_of_the_name_is_no_spec(places):
    here, shipped = places
    (here / "own").mkdir()
    assert find_spec("own") == shipped / "own.toml"


def test_a_spec_that_is_nowhere(places):
    with pytest.raises(InputError) as caught:
        find_spec("won")
    assert str(caught.value) == (
        "no spec 'won': did you mean 'own'? there is no file won and no fits/won.toml; "
        "shipped examples are own"
    )


def test_reading_a_spec_loads_nothing_heavy(tmp_path):
    program = (
        "import sys; from rigid.spec import find_spec, load_spec; "
        "load_spec(find_spec('calibration')); print(*{m.split('.')[0] for m in sys.modules})"
    )
    run = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, cwd=ROOT
    )
    assert not {"jax", "numpy", "scipy"} & set(run.stdout.split())


# Laws

ANYTHING = st.recursive(
    st.one_of(
        st.booleans(),
        st.integers(-(2**60), 2**60),
        st.floats(),
        st.sampled_from(["frame", "open", "A", "", "x"]),
    ),
    lambda inner: st.one_of(
        st.lists(inner, max_size=3),
        st.dictionaries(
            st.sampled_from(["value", "sd", "until", "position", "law", "time", "column", "mu"]),
            inner,
            max_size=3,
        ),
    ),
    max_leaves=6,
)
TOP = ["title", "simulated", "rig", "model", "priors", "sensors", "records", "bands", "sampler"]
BELOW = ["M_HC", "effects", "vary", "load", "name", "kind", "file", "channels", "valve", "rows"]


def toml(value) -> str:
    """Inline TOML of a value."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {toml(v)}" for key, v in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    return f'"{value}"' if isinstance(value, str) else repr(value)


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    st.dictionaries(
        st.sampled_from(TOP),
        st.one_of(
            ANYTHING,
            st.dictionaries(st.sampled_from(BELOW), ANYTHING, max_size=4),
            st.lists(st.dictionaries(st.sampled_from(BELOW), ANYTHING, max_size=5), max_size=2),
        ),
        max_size=3,
    )
)
def test_any_toml_is_read_or_refused_in_sentences(tmp_path_factory, content):
    path = tmp_path_factory.mktemp("any") / "any.toml"
    path.write_text("".join(f"{key} = {toml(value)}\n" for key, value in content.items()), "utf-8")
    try:
        load_spec(path)
    except InputError as error:
        for line in str(error).splitlines():
            assert line.startswith(f"{path} [")
            assert "Input should" not in line
            assert "validation" not in line


@settings(max_examples=50, deadline=None)
@given(st.lists(st.floats(0.001, 1e4), min_size=1, max_size=6, unique=True))
def test_a_programme_is_taken_if_and_only_if_it_goes_forward(tmp_path_factory, times):
    path = tmp_path_factory.mktemp("valve") / "v.toml"
    entries = [f'{{ until = {t!r}, position = "open" }}' for t in times]
    path.write_text(FRAME + f'valve = [{", ".join(entries)}, {{ position = "shut" }}]\n', "utf-8")
    if times == sorted(times):
        (record,) = load_spec(path).records
        assert [s.until for s in record.valve] == [*times, math.inf]
    else:
        with pytest.raises(InputError, match="each `until` must lie after the one before"):
            load_spec(path)


@given(st.sampled_from(["M_HC", "L_0", "walkers", "k_oil", "frame_beams"]), st.data())
def test_the_nearest_name_does_not_mind_capitals(name, data):
    flips = data.draw(st.lists(st.booleans(), min_size=len(name), max_size=len(name)))
    typed = "".join(c.swapcase() if f else c for c, f in zip(name, flips, strict=True))
    assert nearest(typed, ["zz", "M_HC", "L_0", "walkers", "k_oil", "frame_beams"]) == name


@pytest.mark.parametrize("name", ["calibration", "constant-mu"])
def test_a_spec_built_of_values_is_that_of_the_file(name):
    path = find_spec(name)
    read = load_spec(path)
    tables = {
        key: getattr(read, key)
        for key in ("title", "simulated", "rig", "model", "priors", "sensors", "records", "sampler")
    }
    built = build_spec(path.stem, path.parent, tables)
    assert built.model_dump(exclude={"text", "path"}) == read.model_dump(exclude={"text", "path"})
    again = parse_spec(built.text, path)
    assert again.model_dump(exclude={"path"}) == built.model_dump(exclude={"path"})


def test_texts_and_numbers_survive_being_written():
    tables = {
        "title": 'a "quoted" ä \\ title',
        "priors": {"kappa[free-run-2,A]": {"lognormal": {"median": 1e-05, "factor": 2}}},
        "sensors": {"load": {"noise": 12.5}},
    }
    assert tomllib.loads(spec_text(tables)) == tables


def test_a_mistake_in_values_is_told_like_one_in_a_file(tmp_path):
    with pytest.raises(InputError, match=r"own.toml \[rig\]: unknown key 'M_Hc'; did you mean"):
        build_spec("own", tmp_path, {"rig": {"M_Hc": 60.0}})
