"""Where searches of rigs that are not steady begin."""

import re
from pathlib import Path

import numpy as np
import pytest
from rigs import release_problem
from test_assemble import EXAMPLE, RECORDS, effects

from rigid.inference.descents import AGREE
from rigid.inference.search import prior_draws, search_from
from rigid.inference.steady_first import beginnings, steady_part
from rigid.likelihood.assemble import assemble
from rigid.records.read import read_records
from rigid.spec import Spec, load_spec

PRIORS = """
[priors]
k_LC = { lognormal = { median = 5e7, factor = 1.5 } }
F_C = { lognormal = { median = 30.0, factor = 3.0 } }
"pump_angle[frame-1]" = { uniform = { low = -1.0, high = 5.0 } }
"""


def spec_with(folder: Path, *, only: str = "", names: str = "", priors: str = "") -> Spec:
    """The reference campaign under other effects, with the records of one name or all."""
    text = EXAMPLE.read_text("utf-8")
    begin, end = text.index("[model]"), text.index("[channels.A]")
    channels, *records = text[end:].split("[[records]]")
    kept = [r for r in records if re.search(rf'name = "{only}', r)]
    table = f"[model]\neffects = {names}\n{priors}\n"
    text = text[:begin] + table + channels + "".join("[[records]]" + r for r in kept)
    data = EXAMPLE.parents[1] / "data" / "reference"
    path = folder / "changed.toml"
    path.write_text(text.replace(RECORDS, f'"{data.as_posix()}/'), "utf-8")
    return load_spec(path)


def test_the_steady_part_of_a_rig_has_all_but_what_makes_it_unsteady(tmp_path: Path):
    names = effects("coulomb-friction", "hose-pressure-drop", "pump-ripple")
    spec = spec_with(tmp_path, names=names, priors=PRIORS)
    part = steady_part(spec)
    assert part is not None
    gone = {"coulomb-friction", "pump-ripple"}
    assert set(spec.model.effects) - set(part.model.effects) == gone
    assert set(part.priors) == {"k_LC"}
    records = read_records(spec)
    whole, rig = (assemble(one, records).parameters.labels for one in (spec, part))
    assert set(rig) < set(whole)
    angles = {label for label in whole if label.startswith("pump_angle")}
    assert len(angles) == 6
    assert set(whole) - set(rig) == {"F_C", "presliding", "ripple", "f_ripple", *angles}


@pytest.mark.parametrize(
    "names",
    [
        effects("hose-pressure-drop"),  # steady as it is
        effects("coulomb-friction").replace('"viscous-friction", ', ""),  # then nothing would rub
    ],
)
def test_where_there_is_no_steady_part_the_prior_is_drawn_from(tmp_path: Path, names: str):
    spec = spec_with(tmp_path, only="release-1", names=names)
    assert steady_part(spec) is None
    problem = assemble(spec, records := read_records(spec))
    first = beginnings(spec, records, problem, 7)
    np.testing.assert_array_equal(first.z, prior_draws(problem, spec.sampler.starts, 7))
    assert set(first.counts) == {1}


@pytest.mark.slow
def test_a_search_from_the_steady_part_ends_where_one_from_the_prior_does(tmp_path: Path):
    spec = spec_with(tmp_path, only="release-1", names=effects("coulomb-friction"))
    problem = assemble(spec, records := read_records(spec))
    said: list[int] = []
    first = beginnings(spec, records, problem, 7, said.append)
    assert said[-1] == 14  # of 16; two go all the way
    assert len(first.z) < 14, "starts that end together go on together"
    assert first.counts.sum() <= 16
    near = search_from(problem, first.z, counts=first.counts)
    far = search_from(problem, prior_draws(problem, 8, 7))
    best = near.optima[0]
    assert best.log_posterior > far.optima[0].log_posterior - AGREE
    assert best.reached >= 2
    assert near.starts == len(near.levels) == first.counts.sum()


def test_starts_that_led_to_one_point_count_for_as_many():
    problem = release_problem({"k_LC": 6e7, "mu": 2e4}, samples=192, noise=0.1)
    first = prior_draws(problem, 3, 5)
    said: list[int] = []
    once = search_from(problem, first)
    found = search_from(problem, first, said.append, np.array([5, 1, 2]))
    assert said == sorted(said)
    assert said[-1] == 8
    assert found.starts == 8
    assert len(found.levels) == 8
    assert [o.log_posterior for o in found.optima] == [o.log_posterior for o in once.optima]
    assert sum(o.reached for o in found.optima) > sum(o.reached for o in once.optima)
