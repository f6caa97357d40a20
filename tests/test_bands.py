"""`rigid.bands`: what it refuses, what it finds in a simulated test, and the files it writes."""

import csv
import dataclasses
import gc
import json
import sys
import tracemalloc
import weakref
from pathlib import Path
from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import xarray as xr
from rigs import MEMORY, NOMINAL, effects

from rigid.bands import bands
from rigid.inference.posterior import save_posterior
from rigid.io.cache import Shelf
from rigid.io.cli import Options
from rigid.io.errors import InputError
from rigid.likelihood.set_aside import Aside
from rigid.physics.rig import build_rig
from rigid.plots.figure import Illustration
from rigid.report.bands.present import _thousandths
from rigid.smoothing import kept, learning, paths, quantised, reference_check
from rigid.smoothing.budget import Line
from rigid.smoothing.events import Fall, Turn, falls, turns
from rigid.smoothing.field import BLOCK, Field, rig_setup
from rigid.smoothing.finished import Finished
from rigid.smoothing.kalman import Backward, Filtered, Shown, Smoothed
from rigid.smoothing.latent import calm
from rigid.smoothing.laws import RigModel, read_law, read_laws, sheet
from rigid.smoothing.learning import Learned, Sheet
from rigid.smoothing.model import Calibration
from rigid.smoothing.plant import RigPlant
from rigid.smoothing.reading import read_fields
from rigid.smoothing.reference_check import against_reference
from rigid.smoothing.run import Band, Bands, Way
from rigid.smoothing.run import bands as run_bands
from rigid.smoothing.smoother import DrawBatch, Evidence, Keeping
from rigid.spec import load_spec
from rigid.study.bands import smoothing

EFFECTS = ", ".join(f'"{name}"' for name in MEMORY)
HEAD = f'title = "Field"\nsimulated = true\n[model]\neffects = [{EFFECTS}]\n'
CHANNELS = {
    "time": '{ column = "t", unit = "s" }',
    "load": '{ column = "F", unit = "N" }',
    "stroke": '{ column = "x", unit = "m" }',
    "pressure": '{ column = "p", unit = "Pa" }',
}


def spec_text(channels=CHANNELS, posterior='[bands]\nposterior = "posterior.nc"\n', head=HEAD):
    record = '[[records]]\nname = "press"\nkind = "field"\ncylinder = "A"\nfile = "press.csv"\n'
    rows = "".join(f"{name} = {entry}\n" for name, entry in channels.items())
    return f"{head}{posterior}{record}[records.channels]\n{rows}"


def write_posterior(path, spec=None, effects=MEMORY, draws=16, **more):
    """Draws about the nominal rig: stiffness within 1 %, the load cell's gain within 0.1 %."""
    rng = np.random.default_rng(1)

    def spread(value, share):
        return ("chain", "draw"), value * (1.0 + share * rng.standard_normal((1, draws))), "1"

    names = {k: v for k, v in NOMINAL.items() if "[" not in k}
    table = {k: spread(v, 0.01 if k == "k_LC" else 0.0) for k, v in names.items()}
    for name in ("mu_branch", "tau_branch"):
        pair = np.array([NOMINAL[f"{name}[{i}]"] for i in (1, 2)])
        table[name] = ("chain", "draw", "branch"), np.broadcast_to(pair, (1, draws, 2)), "1"
    gain = np.zeros((1, draws, 3, 1))
    gain[0, :, 0, 0] = 1e-3 * rng.standard_normal(draws)
    wide = ("chain", "draw", "quantity", "cylinder")
    table |= {"gain": (wide, gain, "1"), "zero": (wide, 0.0 * gain, "1")}
    posterior = xr.Dataset(
        {k: (dims, values, {"units": unit}) for k, (dims, values, unit) in table.items()},
        coords={
            "branch": ["1", "2"], "quantity": ["load", "stroke", "pressure"], "cylinder": ["A"],
        },
    )  # fmt: skip
    attrs = {"spec": spec or spec_text(), "effects": ",".join(effects)} | more
    save_posterior(path, {"posterior": posterior, "constant_data": xr.Dataset()}, attrs)


def write_record(path, duration=3.0):
    """A quiet record: enough for whatever is refused before anything is computed."""
    time = np.arange(0.0, duration, 0.01)
    rows = np.column_stack([time, 0.0 * time, 0.22e-3 * np.round(30.0 * time), 0.0 * time])
    rows[5:, 1] = 295.0
    rows[5:, 3] = 34473.8  # a channel that never moves is refused for that
    text = "t,F,x,p\n" + "\n".join(",".join(f"{v:.6g}" for v in row) for row in rows)
    path.write_text(text, encoding="utf-8")


@pytest.fixture
def refused(tmp_path):
    """Run the command on a spec that it must refuse; gives what it says."""

    def run(text):
        spec = tmp_path / "field.toml"
        spec.write_text(text, encoding="utf-8")
        write_record(tmp_path / "press.csv")
        options = Options(str(spec), tmp_path / "out", None, False, True, False)
        with pytest.raises(InputError) as refusal:
            bands(options)
        assert not (tmp_path / "out").exists(), "a refused run left something behind"
        assert refusal.value.status == 2
        return str(refusal.value)

    run.folder = tmp_path
    return run


def test_no_bands_table(refused):
    assert 'no [bands] posterior = "..."' in refused(spec_text(posterior=""))


def test_no_posterior(refused):
    assert "no such file; run `python -m rigid.fit`" in refused(spec_text())


def test_a_file_that_is_no_posterior(refused):
    (refused.folder / "posterior.nc").write_text("no", encoding="utf-8")
    assert "not a posterior file" in refused(spec_text())


def test_posterior_of_other_effects(refused):
    write_posterior(refused.folder / "posterior.nc", effects=MEMORY[:-1])
    said = refused(spec_text())
    assert "posterior of a rig with" in said
    assert "frequency-dependent-friction" in said


def test_posterior_of_another_rig(refused):
    other = spec_text(head=HEAD + "[rig]\nL_0 = 0.3\n")
    write_posterior(refused.folder / "posterior.nc", spec=other)
    said = refused(spec_text())
    assert "posterior of another rig" in said
    assert "L_0" in said


@pytest.mark.parametrize("quantity", ["load", "stroke", "pressure"])
def test_a_missing_channel(refused, quantity):
    write_posterior(refused.folder / "posterior.nc")
    said = refused(spec_text({k: v for k, v in CHANNELS.items() if k != quantity}))
    assert f"has no channel {quantity}" in said


def test_a_wrong_unit(refused):
    write_posterior(refused.folder / "posterior.nc")
    said = refused(spec_text(CHANNELS | {"load": '{ column = "F", unit = "mm" }'}))
    assert "load" in said
    assert "mm" in said


LAWS = (
    '[[bands.laws]]\nposterior = "posterior.nc"\nprobability = 0.7\n'
    '[[bands.laws]]\nposterior = "other.nc"\nprobability = {}\n'
)


def test_one_posterior_and_several_laws(refused):
    both = '[bands]\nposterior = "posterior.nc"\n' + LAWS.format(0.3)
    assert "or [[bands.laws]] with a posterior and a probability" in refused(
        spec_text(posterior=both)
    )


def test_probabilities_that_do_not_sum_to_one(refused):
    assert "sum to 0.9" in refused(spec_text(posterior=LAWS.format(0.2)))


def test_a_law_without_its_posterior(refused):
    write_posterior(refused.folder / "posterior.nc")
    said = refused(spec_text(posterior=LAWS.format(0.3)))
    assert "other.nc: no such file" in said


def test_a_law_of_another_rig(refused):
    write_posterior(refused.folder / "posterior.nc")
    other = spec_text(head=HEAD + "[rig]\nL_0 = 0.3\n")
    write_posterior(refused.folder / "other.nc", spec=other)
    said = refused(spec_text(posterior=LAWS.format(0.3)))
    assert "other.nc: posterior of another rig" in said


def test_several_laws_keep_their_effects_and_probabilities(tmp_path):
    """Unlike a single posterior, each may be of other effects than the spec's."""
    constant = MEMORY[:-1]
    effects = ", ".join(f'"{name}"' for name in constant)
    head = HEAD.replace(EFFECTS, effects)
    write_posterior(tmp_path / "posterior.nc")
    write_posterior(tmp_path / "other.nc", spec=spec_text(head=head), effects=constant)
    (tmp_path / "field.toml").write_text(spec_text(posterior=LAWS.format(0.3)), encoding="utf-8")
    laws = read_laws(load_spec(tmp_path / "field.toml"), np.random.default_rng(1))
    assert [law.weight for law in laws] == [0.7, 0.3]
    assert [len(law.effects) for law in laws] == [len(MEMORY), len(constant)]


def test_no_field_record(refused):
    write_posterior(refused.folder / "posterior.nc")
    text = spec_text().replace('kind = "field"', 'kind = "free-run"')
    assert "no record of kind 'field'" in refused(text)


def test_a_record_that_begins_under_load(refused):
    write_posterior(refused.folder / "posterior.nc")
    text = spec_text(CHANNELS | {"load": '{ column = "F", unit = "N", offset = 5000.0 }'})
    assert "must begin at rest and out of load" in refused(text)


def test_draws_bear_the_names_of_the_fit(tmp_path):
    (tmp_path / "field.toml").write_text(spec_text(), encoding="utf-8")
    write_posterior(tmp_path / "posterior.nc")
    law = read_law(
        load_spec(tmp_path / "field.toml"), tmp_path / "posterior.nc", np.random.default_rng(1)
    )
    for name in ("k_LC", "mu_branch[1]", "tau_branch[2]", "gain[load,A]", "noise[load,A]"):
        assert name in law.values, name
    np.testing.assert_allclose(law.values["mu_branch[2]"], NOMINAL["mu_branch[2]"])
    assert law.only(np.arange(3)).size == 3
    assert law.centre().size == 1
    assert law.failed == ""


def test_a_posterior_says_that_its_fit_must_not_be_used(tmp_path):
    (tmp_path / "field.toml").write_text(spec_text(), encoding="utf-8")
    said = {"usable": 0, "failed_checks": "converged: R-hat is 1.3"}
    write_posterior(tmp_path / "posterior.nc", **said)
    law = read_law(
        load_spec(tmp_path / "field.toml"), tmp_path / "posterior.nc", np.random.default_rng(1)
    )
    assert law.failed == said["failed_checks"]
    assert law.only(np.arange(3)).failed == law.centre().failed == law.failed


# What happened in a record


def known_by_hand(load, kappa):
    """A field and what would be learned of it, with variances where kappa jumps."""
    movement = calm(len(load), 4, np.full(3, 1e-6))
    rate = movement.rate.copy()
    rate[1:, 2] += movement.shape * np.diff(kappa) ** 2 / 0.1**2
    mean = np.zeros((len(load), 4, 3))
    mean[:, :, 0], mean[:, :, 2] = load[:, None], kappa[:, None]
    reading = np.zeros((len(load), 3))
    field = Field("press", "B", {}, 0.0, 0.01, reading, reading, rig_setup("B"))
    movement, none = movement._replace(rate=rate), np.zeros(reading.shape, dtype=bool)
    return field, Learned(movement, reading, reading, 0.0, mean, np.zeros(3), none)


def test_falls_and_turns_of_a_record_known_by_hand():
    time = np.arange(0.0, 10.0, 0.01)
    load = np.where(time < 4.0, 1e4 * time, 1e4 * time - 2e4)
    kappa = np.where((time < 6.0) | (time > 8.0), 0.12, 0.0)
    field, learned = known_by_hand(load, kappa)
    found = falls(field, learned)
    assert [(round(f.time, 1), round(f.before, -3)) for f in found] == [(4.0, 40e3)]
    moved = turns(field, learned)
    assert [(round(t.time, 1), t.before, t.after) for t in moved] == [
        (6.0, 0.12, 0.0),
        (8.0, 0.0, 0.12),
    ]


def test_a_shut_valve_is_no_negative_zero():
    assert [_thousandths(k) for k in (-1e-5, 0.12449, -0.2)] == ["0.000", "0.124", "-0.200"]


# What is kept of a run


def test_what_was_learned_comes_back_as_it_was(tmp_path):
    _, learned = known_by_hand(np.arange(8.0), np.zeros(8))
    shelf = Shelf(tmp_path, reads=True)
    shelf.put("learned", (learned._replace(bound=2.0),))
    (found,) = shelf.read("learned", kept.LEARNED)
    assert found.bound == 2.0
    np.testing.assert_array_equal(found.movement.rate, learned.movement.rate)
    np.testing.assert_array_equal(found.mean, learned.mean)
    assert found.movement.steps == learned.movement.steps


def test_a_test_that_is_done_comes_back_as_it_was(tmp_path):
    line = Line("B", "peak load", "N", 1.0, 0.5, 1.5, 0.1 / 3.0, (0.1, None, 0.2, None, 0.3))
    done = Finished(
        name="press",
        places=("A", "B"),
        budget=(line,),
        falls=(Fall("A", 1.0 / 3.0, 5e3, 1e3),),
        turns=(Turn("B", 2.0, 0.12, 0.0),),
        gaps={"load of press,A": 1.01},
        sha256={"press,A": "ab"},
        figures=(Illustration("fig-bands-press", "<svg/>", "caption", "alt"),),
        aside=(Aside("press", "A", "load", (0.5, 1.0 / 3.0)),),
        kind="field",
    )
    shelf = Shelf(tmp_path, reads=True)
    shelf.put("finished", done)
    assert shelf.read("finished", kept.FINISHED) == done


def test_another_seed_record_or_law_is_another_run():
    field, _ = known_by_hand(np.arange(8.0), np.zeros(8))
    law = RigModel("memory", 1.0, (), {"k_LC": np.ones(3)})
    first = kept.mark([field], [law], 1)
    assert first == kept.mark([field], [dataclasses.replace(law)], 1)
    others = [
        kept.mark([field], [law], 2),
        kept.mark([dataclasses.replace(field, reading=field.reading + 1.0)], [law], 1),
        kept.mark([field], [dataclasses.replace(law, weight=0.5)], 1),
        kept.mark([field], [dataclasses.replace(law, values={"k_LC": np.zeros(3)})], 1),
    ]
    assert len({tuple(one.items()) for one in (first, *others)}) == 5


# What is held while a run goes on


def bands_by_hand(name):
    """Bands of 3 s as a run would make them, and what they are held by."""
    field, learned = known_by_hand(
        np.where(np.arange(300) < 200, 50.0 * np.arange(300), 0.0), ZEROS
    )
    field = dataclasses.replace(field, name=name, known=np.ones((300, 3)))
    test = paths.Test((field,), (learned,), np.arange(299 * 4 + 1), (learned.evidence,))
    load = np.interp(test.time, 0.01 * np.arange(300), learned.mean[:, 0, 0])
    band = np.stack([load + level for level in (-20.0, -10.0, 0.0, 10.0, 20.0)])
    parts = np.full_like(band, 5.0)
    names = ("load_B", "displacement_B", "kappa_B")
    line = Line("B", "peak load", "N", 1.0, 0.5, 1.5, 0.1, (0.1, None, 0.2, None, 0.3))
    return Bands(name, test.time, {n: Band(band, parts) for n in names}, (line,), test)


ZEROS = np.zeros(300)


@pytest.mark.slow
def test_a_test_is_written_and_let_go_before_the_next(tmp_path, monkeypatch):
    """Of three tests, none of the bands made before is alive as the next are made."""
    names = ("press", "second", "third")
    write_record(tmp_path / "press.csv")
    write_posterior(tmp_path / "posterior.nc")
    records = spec_text().split("[[records]]")
    text = records[0] + "".join(
        "[[records]]" + records[1].replace('"press"', f'"{name}"') for name in names
    )
    (tmp_path / "field.toml").write_text(text, encoding="utf-8")
    made, alive = [], []

    def mixed(under, *_):
        gc.collect()
        alive.append([one() is not None for one in made])
        before = names[: len(made)]
        assert all((tmp_path / "out/figures" / f"bands-{n}-drops.svg").exists() for n in before)
        found = bands_by_hand(under[0].test.fields[0].name)
        made.append(weakref.ref(found))
        return found

    hand = known_by_hand(ZEROS, ZEROS)[1]
    monkeypatch.setattr("rigid.smoothing.run.learned", lambda *_: (hand,))
    monkeypatch.setattr("rigid.smoothing.run.bands", mixed)
    monkeypatch.setattr("rigid.study.bands.against_reference", lambda *_: ())
    options = Options(str(tmp_path / "field.toml"), tmp_path / "out", None, False, True, False)
    assert bands(options) == 0
    assert alive == [[], [False], [False, False]]
    page = (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
    assert all(f"Record {name}" in page for name in names)
    assert not (tmp_path / "out" / "bands" / "unfinished").exists()


class Flat:
    """In place of the smoother: blocks of noise, as large as those of a run."""

    later = Backward(np.zeros(1), np.zeros(1))

    def __init__(self, *given):
        self.wide = given[1]

    def block(self, number):
        rng = np.random.default_rng(number)
        shape = (self.wide, BLOCK, 4, 3)
        series = rng.standard_normal(shape, dtype=np.float32).astype(float)
        read = series[..., 0, :]
        return Smoothed(series, series, read, read, Shown(series, series**2, series, series))


def peak_memory(monkeypatch, draws, blocks):
    """Greatest memory that Python and NumPy take for bands of some blocks, in bytes."""
    load = np.arange(blocks * BLOCK, dtype=float)
    field, learned = known_by_hand(load, np.zeros(len(load)))
    rows = np.arange(0, (len(load) - 1) * 4, 16)
    test = paths.Test((field,), (learned,), rows, (learned.evidence,))
    law = RigModel("memory", 1.0, (), {"k_LC": np.ones(draws), "gain[load,B]": np.zeros(draws)})
    monkeypatch.setattr(paths, "Back", Flat)
    monkeypatch.setattr(paths, "draws", lambda some, _: some.size)
    tracemalloc.start()
    try:
        run_bands([Way(test, law)], 1, apart=False)
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def test_memory_does_not_grow_with_draws(monkeypatch):
    """Held until the end, the paths of 64 draws more would take 4 x 64 x 2048 x 3 numbers."""
    few, many = (peak_memory(monkeypatch, draws, 16) for draws in (32, 96))
    held = 4 * 64 * 2048 * 3 * 8
    assert many - few < 0.1 * held


def test_memory_of_a_longer_record_is_that_of_its_bands(monkeypatch):
    """Twice the stretches take twice the bands (10 numbers of 3 quantities a row) and what was
    learned, not twice the paths of all draws."""
    short, long = (peak_memory(monkeypatch, 32, blocks) for blocks in (16, 32))
    more = 16 * BLOCK
    made, learned = 3 * 10 * 8 * more / 4, 12 * 8 * more + 8 * 3 * 8 * more
    paths_of_all = 4 * 32 * 3 * 8 * more / 4
    assert long - short < made + learned + 0.2 * paths_of_all


class Sum:
    """In place of the smoother: each block depends on all that were smoothed before it."""

    def __init__(self, *given):
        self.wide, keys, later = given[1], given[3], given[6]
        self.seed = int(np.asarray(jax.random.key_data(keys)).sum() % 1000)
        self.later = Backward(*(np.zeros((self.wide, 1)),) * 2) if later is None else later

    def block(self, number):
        rng = np.random.default_rng([self.seed, number])
        series = rng.standard_normal((self.wide, BLOCK, 4, 3)) + self.later.adjoint[:, None, None]
        more = series.mean(axis=(1, 2, 3))[:, None]
        self.later = self.later._replace(adjoint=self.later.adjoint + more)
        read = series[..., 0, :]
        return Smoothed(series, series, read, read, Shown(series, series**2, series, series))


def test_draws_go_on_where_they_were_stopped_to_the_bit(tmp_path, monkeypatch):
    """Stopped after each of four stretches in turn: with what it had gone over, and without."""
    load = np.arange(30 * BLOCK, dtype=float)
    field, learned = known_by_hand(load, np.zeros(len(load)))
    rows = np.arange(0, (len(load) - 1) * 4, 16)
    test = paths.Test((field,), (learned,), rows, (learned.evidence,))
    law = RigModel("memory", 1.0, (), {"k_LC": np.ones(40), "gain[load,B]": np.zeros(40)})
    monkeypatch.setattr(paths, "Back", Sum)
    monkeypatch.setattr(paths, "draws", lambda some, _: some.size)
    shelf = Shelf(tmp_path, {"seed": "1"}, reads=True)

    class Stops(Shelf):
        def put(self, name, *given):
            super().put(name, *given)
            raise KeyboardInterrupt

    def run(where):
        return run_bands([Way(test, law)], 1, Keeping(where, lambda _: None))

    whole = run(Shelf())
    for _ in range(3):
        with pytest.raises(KeyboardInterrupt):
            run(Stops(tmp_path, shelf.mark, reads=True))
    for again in (run(shelf), run(shelf)):
        assert again.budget == whole.budget
        for name, band in whole.bands.items():
            assert again.bands[name].quantiles.tobytes() == band.quantiles.tobytes()
            assert again.bands[name].parts.tobytes() == band.parts.tobytes()
    monkeypatch.setattr(Backward, "_replace", lambda self, **_: self)  # forgets what it went over
    assert run(Shelf()).budget != whole.budget


# The smoother's steps against diffrax


@pytest.mark.slow
def test_the_steps_are_held_against_diffrax_and_another_load_is_seen(tmp_path):
    """A simulated test with a drop, the load allowed to move as it likes; 1 % more load is seen."""
    write_drop(tmp_path)
    asked = smoothing(load_spec(tmp_path / "field.toml"), 1)
    ((field,),), (law,) = asked.tests, asked.laws
    exact = {"k_oil": np.median(law.values["k_oil"], keepdims=True)}  # one number for all draws
    law = dataclasses.replace(law, values=dict(law.values) | exact)
    sigma, steps = sheet(asked.spec, law, field.setup)
    movement = calm(field.samples, 4, np.array([0.3, 0.3, 0.01]))
    plain = quantised.plain(field.reading, sigma, steps)
    evidence = Evidence(field.reading, plain, movement.variances)
    mean, none = np.zeros((field.samples, 4, 3)), np.zeros(field.known.shape, dtype=bool)
    learned = Learned(movement, field.reading, plain, 0.0, mean, sigma, none)
    way = Way(paths.Test((field,), (learned,), np.arange(8), (evidence,)), law)
    (found,) = against_reference([way], asked.spec.sensors)
    assert (found.points, found.ended, found.ok) == (8, 8, True)
    assert 0.0 < found.worst.bars < 0.5
    assert "log-posterior" not in found.says
    real = reference_check.inferred
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(reference_check, "inferred", lambda *given: more_load(real(*given)))
        (broken,) = against_reference([way], asked.spec.sensors)
    assert not broken.ok
    assert broken.worst.bars > 2.0


def more_load(told):
    return told._replace(straight=1.01 * told.straight)


# The stretch over which scales are compared


def test_scales_are_compared_where_the_load_moves_most(monkeypatch):
    asked, before = [], Filtered(*(jnp.zeros(1),) * 4)
    monkeypatch.setattr(
        learning, "last_state", lambda field, *_: asked.append(field.samples) or before
    )
    rng = np.random.default_rng(1)
    blocks, first = 24, 5
    load = np.zeros(blocks * BLOCK + 100)
    load[first * BLOCK : (first + 16) * BLOCK] = 295.0 * rng.integers(0, 9, 16 * BLOCK)
    reading = np.stack([load, 0 * load, 0 * load], axis=1)
    field = Field("press", "B", {}, 2.0, 0.01, reading, np.ones_like(reading), rig_setup("B"))
    nothing = jnp.zeros((3, 1))
    centre = DrawBatch(
        RigPlant(rig=build_rig(effects(), NOMINAL), inputs=field.setup.inputs),
        Calibration(nothing, nothing),
    )
    sheet = Sheet(np.ones(3), np.ones(3))
    part, state = learning._liveliest(field, centre, sheet)
    assert part.samples == 16 * BLOCK
    assert part.first == pytest.approx(2.0 + 0.01 * first * BLOCK)
    np.testing.assert_array_equal(part.reading[:, 0], load[first * BLOCK :][: 16 * BLOCK])
    assert asked == [first * BLOCK]
    assert state is before
    short = field.cut(0, 16 * BLOCK)
    assert learning._liveliest(short, centre, sheet) == (short, None)


# Laws with effects of one's own


OWN = """
from typing import ClassVar

from rigid.effects import AbstractEffect, Action
from rigid.effects.declare import lognormal, parameter


class Drag(AbstractEffect):
    drag: object = parameter("c_drag", "c", "N s/m", lognormal(1e3, 10.0), absent=0.0)

    name: ClassVar[str] = "drag"
    equation: ClassVar[str] = "plunger-momentum"
    source: ClassVar[str] = "a test"

    def __call__(self, state, own):
        return Action(between=-self.drag * state.slip)
"""


def test_effects_of_ones_own_are_those_beside_the_fit(tmp_path):
    """A law's posterior tells where its fit's spec lies; a file of the same name beside the spec of
    the bands is another one."""
    (tmp_path / "fits").mkdir()
    (tmp_path / "fits" / "mine.py").write_text(OWN, encoding="utf-8")
    (tmp_path / "mine.py").write_text("raise RuntimeError('the wrong file')\n", encoding="utf-8")
    names = [*MEMORY, "mine:Drag"]
    effects = ", ".join(f'"{name}"' for name in names)
    write_posterior(tmp_path / "posterior.nc")
    write_posterior(
        tmp_path / "other.nc",
        spec=spec_text(head=HEAD.replace(EFFECTS, effects)),
        effects=names,
        spec_folder="fits",
    )
    (tmp_path / "field.toml").write_text(spec_text(posterior=LAWS.format(0.3)), encoding="utf-8")
    laws = read_laws(load_spec(tmp_path / "field.toml"), np.random.default_rng(1))
    assert [effect.name for effect in laws[1].effects][-1] == "drag"
    assert Path(sys.modules[laws[1].effects[-1].__module__].__file__).parent.name == "fits"


# A whole run


def write_drop(folder):
    """Write a simulated test of 4 s with a drop within 4 ms, spec and posterior; gives the test."""
    from rigid.generator.core import Rig
    from rigid.generator.field import Drop, contact_loss
    from rigid.generator.friction import Friction
    from rigid.generator.sensors import Sensor

    rig = Rig(**{n: NOMINAL[n] for n in Rig.__dataclass_fields__})
    labels = ("mu", "mu_branch[1]", "tau_branch[1]", "mu_branch[2]", "tau_branch[2]")
    friction = Friction(*(NOMINAL[n] for n in labels))
    sensors = {
        "load": Sensor(1.0, 0.0, 147.5, 295.0),
        "stroke": Sensor(1.0, 0.0, 0.055e-3, 0.22e-3),
        "pressure": Sensor(1.0, 0.0, 11491.0, 34473.786),
    }
    test = contact_loss(rig, friction, sensors, np.random.default_rng(3), Drop(2.503, 2.507, 0.4))
    rows = np.column_stack([test.time[::4], *(test.readings[q] for q in sensors)])
    text = "t,F,x,p\n" + "\n".join(",".join(f"{v:.9g}" for v in row) for row in rows)
    (folder / "press.csv").write_text(text, encoding="utf-8")
    (folder / "field.toml").write_text(spec_text(), encoding="utf-8")
    write_posterior(folder / "posterior.nc")
    return test


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """A run on a simulated test of 4 s with a drop within 4 ms, at the posterior's centre."""
    folder = tmp_path_factory.mktemp("bands")
    test = write_drop(folder)
    options = Options(str(folder / "field.toml"), folder / "out", None, False, True, False)
    return SimpleNamespace(status=bands(options), out=folder / "out", test=test, folder=folder)


@pytest.mark.slow
@pytest.mark.long
def test_the_files_are_there_and_the_page_says_simulated(done):
    assert done.status == 0
    page = (done.out / "index.html").read_text(encoding="utf-8")
    assert "Simulated data" in page
    assert 'id="bands-1"' in page
    made = json.loads((done.out / "bands" / "bands.json").read_text(encoding="utf-8"))
    assert made["usable"]
    assert len(made["records"]["press"]["budget"]) == 5
    assert [round(f["time"], 2) for f in made["records"]["press"]["falls"]] == [2.5]


def columns(path):
    with path.open(encoding="utf-8", newline="") as file:
        table = list(csv.reader(file))
    return dict(zip(table[0], np.array(table[1:], dtype=float).T, strict=True))


@pytest.mark.slow
@pytest.mark.long
def test_the_band_follows_the_drop_at_once(done):
    """10 ms after the end of a drop of 31 kN the band is back within 400 N of the truth; a load
    that is smoothed over 50 ms would be off by kilonewtons."""
    table = columns(done.out / "bands" / "press.csv")
    time, load = table["time [s]"], table["load_A median [N]"]
    truth = np.interp(time, done.test.time, done.test.load)
    off = np.abs(load - truth)
    assert off[(time > 2.517) & (time < 2.6)].max() < 400.0
    assert off[(time > 2.4) & (time < 2.49)].max() < 400.0
    width = table["load_A q95 [N]"] - table["load_A q05 [N]"]
    assert width[np.argmin(np.abs(time - 2.505))] > 5.0 * np.median(width)


@pytest.mark.slow
@pytest.mark.long
def test_bands_widen_between_samples(done):
    table = columns(done.out / "bands" / "press.csv")
    width = table["load_A q95 [N]"] - table["load_A q05 [N]"]
    inside = (table["time [s]"] > 2.5) & (table["time [s]"] < 2.51)
    assert inside.sum() == 3
    assert width[inside].min() > 2.0 * np.median(width)


@pytest.mark.slow
@pytest.mark.long
def test_fields_are_read_with_both_ends(done):
    ((field,),) = read_fields(load_spec(done.folder / "field.toml"))
    assert field.samples == 401
    assert field.label == "press,A"


@pytest.mark.slow
@pytest.mark.long
def test_an_interrupted_run_goes_on_and_ends_the_same(done, monkeypatch):
    """Stopped once its test is done; the resumed run learns and draws nothing anew."""

    def stop(*_):
        raise KeyboardInterrupt

    again = done.folder / "again"
    options = Options(str(done.folder / "field.toml"), again, None, False, True, False)
    with monkeypatch.context() as patch:
        patch.setattr("rigid.study.bands.content", stop)
        with pytest.raises(KeyboardInterrupt):
            bands(options)
    monkeypatch.setattr("rigid.smoothing.run.learned", stop)
    monkeypatch.setattr("rigid.smoothing.run.bands", stop)
    assert bands(dataclasses.replace(options, resume=True)) == 0
    assert not (again / "bands" / "unfinished").exists()
    tables = [f"bands/{name}" for name in ("press.csv", "press-parts.csv", "bands.json")]
    drawn = [f"figures/bands-press{name}" for name in (".svg", ".csv", "-drops.svg")]
    for name in (*tables, *drawn):
        first, second = (folder / name for folder in (done.out, again))
        assert first.read_bytes() == second.read_bytes(), name
