"""`rigid.bands`: what it refuses, what it finds in a simulated test, and the files it writes."""

import csv
import dataclasses
import json
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from rigs import MEMORY, NOMINAL

from rigid.bands import bands
from rigid.cli import Options
from rigid.errors import InputError
from rigid.posterior import save_posterior
from rigid.smoothing import kept, paths
from rigid.smoothing.budget import Line
from rigid.smoothing.events import falls, turns
from rigid.smoothing.field import Field, read_fields
from rigid.smoothing.latent import calm
from rigid.smoothing.laws import Law, read_law, read_laws
from rigid.smoothing.learning import Learned
from rigid.smoothing.run import Band, Bands
from rigid.spec import load_spec

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


# What happened in a record


def known_by_hand(load, kappa):
    """A field and what would be learned of it, with variances where kappa jumps."""
    movement = calm(len(load), 4, np.full(3, 1e-6))
    rate = movement.rate.copy()
    rate[1:, 2] += movement.shape[2] * np.diff(kappa) ** 2 / 0.1**2
    mean = np.zeros((len(load), 4, 3))
    mean[:, :, 0], mean[:, :, 2] = load[:, None], kappa[:, None]
    reading = np.zeros((len(load), 3))
    field = Field("press", "B", "", 0.0, 0.01, reading, reading)
    return field, Learned(
        movement._replace(rate=rate), reading, reading, 0.0, mean, mean, np.zeros(3)
    )


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


# What is kept of a run


def test_what_is_kept_comes_back_as_it_was(tmp_path):
    field, learned = known_by_hand(np.arange(8.0), np.zeros(8))
    line = Line("B", "peak load", "N", 1.0, 0.5, 1.5, 0.1 / 3.0, (0.1, None, 0.2, None, 0.3))
    band = Band(np.ones((5, 29)) / 3.0, np.zeros((5, 29)))
    under = ((learned,), (learned._replace(bound=2.0),))
    test = paths.Test((field,), under[1], np.arange(29))
    made = Bands("press", test.time, {"load_B": band}, (line,), test)
    path = tmp_path / "press.npz"
    kept.save(path, "mark", kept.Kept(under, made))
    found = kept.load(path, "mark", [field])
    assert found.bands is not None
    assert found.bands.budget == (line,)
    assert found.bands.test.learned[0].bound == 2.0
    np.testing.assert_array_equal(found.bands.time, test.time)
    np.testing.assert_array_equal(found.bands.bands["load_B"].quantiles, band.quantiles)
    np.testing.assert_array_equal(found.learned[0][0].movement.rate, learned.movement.rate)
    assert found.learned[0][0].movement.steps == learned.movement.steps
    assert kept.load(path, "other", [field]) == kept.Kept()
    path.write_bytes(path.read_bytes()[:100])
    assert kept.load(path, "mark", [field]) == kept.Kept()


def test_another_seed_record_or_law_is_another_run():
    field, _ = known_by_hand(np.arange(8.0), np.zeros(8))
    law = Law("memory", 1.0, (), {"k_LC": np.ones(3)})
    first = kept.mark([field], [law], 1)
    assert first == kept.mark([field], [dataclasses.replace(law)], 1)
    others = [
        kept.mark([field], [law], 2),
        kept.mark([dataclasses.replace(field, reading=field.reading + 1.0)], [law], 1),
        kept.mark([field], [dataclasses.replace(law, weight=0.5)], 1),
        kept.mark([field], [dataclasses.replace(law, values={"k_LC": np.zeros(3)})], 1),
    ]
    assert len({first, *others}) == 5


# A whole run


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """A run on a simulated test of 4 s with a drop within 4 ms, at the posterior's centre."""
    from rigid.generator.field import Drop, contact_loss
    from rigid.generator.friction import Friction
    from rigid.generator.plant import Rig
    from rigid.generator.sensors import Sensor

    folder = tmp_path_factory.mktemp("bands")
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
    """Stopped after the draws; the resumed run learns and draws nothing anew."""

    def stop(*_):
        raise KeyboardInterrupt

    again = done.folder / "again"
    options = Options(str(done.folder / "field.toml"), again, None, False, True, False)
    with monkeypatch.context() as patch:
        patch.setattr("rigid.smoothing.output.write_bands", stop)
        with pytest.raises(KeyboardInterrupt):
            bands(options)
    monkeypatch.setattr("rigid.smoothing.run.learned", stop)
    monkeypatch.setattr("rigid.smoothing.run.bands", stop)
    assert bands(dataclasses.replace(options, resume=True)) == 0
    assert not (again / "bands" / "unfinished").exists()
    for name in ("press.csv", "press-parts.csv", "bands.json"):
        first, second = (folder / "bands" / name for folder in (done.out, again))
        assert first.read_bytes() == second.read_bytes(), name
