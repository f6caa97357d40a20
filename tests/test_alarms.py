"""False alarms of discovery on campaigns from which nothing is missing."""

import dataclasses
import json
from pathlib import Path

import equinox as eqx
import numpy as np
import pytest
from cart import write_cart

import rigid
from rigid.io.errors import InputError
from rigid.jobs.job import Given
from rigid.jobs.rows import read_rows
from rigid.study import alarms as asked
from rigid.study.validation import Replicates
from rigid.validate import main
from rigid.validation.alarms import alarms
from rigid.validation.design import Design, arguments

SEED = 20


@pytest.fixture(scope="module")
def study(tmp_path_factory) -> rigid.Study:
    return rigid.load(write_cart(tmp_path_factory.mktemp("cart"), seconds=8.0))


def row(verdict, blamed=None, failed=None):
    value = {"verdict": verdict, "blamed": blamed}
    return {"failed": failed, "value": None if failed else value, "cost": {"cpu_s": 2.0}}


def test_alarms_are_counted_with_the_exact_band_of_their_rate():
    clean, n = [row("nothing-missing")] * 30, 30
    found = alarms([*clean, row("", failed={"status": 1, "says": "no"})])
    assert (found.campaigns, found.failed, found.count, found.cpu_s) == (n, 1, 0, 62.0)
    assert (found.low, found.high) == (0.0, pytest.approx(1.0 - 0.025 ** (1.0 / n)))
    assert found.check.ok
    assert "0 false alarms in 30 clean campaigns" in found.says
    assert "1 more campaigns failed" in found.says
    every = alarms([row("named", "return-spring")] * 4 + [row("unnamed")])
    assert every.low == pytest.approx(0.025 ** (1.0 / 5.0))
    assert every.blamed == {"return-spring": 4, "unnamed": 1}
    assert not every.check.ok
    assert not alarms([]).check.ok


@pytest.mark.slow
def test_alarms_stand_beside_the_ranks_and_a_study_goes_on(study, tmp_path):
    study.validate(Replicates(1, discover=1), tmp_path, seed=SEED, quiet=True)
    rows = tmp_path / "validation" / "discover.jsonl"
    before = rows.read_bytes()
    found = study.validate(Replicates(1, discover=2), tmp_path, seed=SEED, quiet=True, resume=True)
    assert rows.read_bytes().startswith(before)
    values = [one["value"] for one in read_rows(rows)]
    assert [value["number"] for value in values] == [0, 1]
    alarms = found.verdict.alarms
    assert alarms is not None
    assert alarms.campaigns == 2
    assert alarms.count == sum(value["verdict"] != "nothing-missing" for value in values)
    told = json.loads((tmp_path / "validation.json").read_text("utf-8"))
    assert told["discovery"]["high"] == alarms.high
    assert "alarms" in [check["name"] for check in told["checks"]]
    assert "False alarms of discovery" in (tmp_path / "index.html").read_text("utf-8")
    assert alarms.says in found.table()


@pytest.mark.slow
def test_what_is_missing_from_a_campaign_is_an_alarm(study, monkeypatch, tmp_path):
    """The same job on a campaign with a force that the model has not: discovery is what runs."""
    plain = asked.draw

    def with_a_force(base, design, number):
        made = plain(base, design, number)
        data = np.asarray(made.problem.pieces[0].data)
        data = data + 200.0 * np.sign(np.sin(np.linspace(0.0, 24.0, len(data))))[:, None]
        problem = eqx.tree_at(lambda q: q.pieces[0].data, made.problem, data)
        return dataclasses.replace(made, problem=problem)

    monkeypatch.setattr(asked, "draw", with_a_force)
    given = Given(arguments(study.spec, Design(SEED), 0), Path("/"), tmp_path)
    value = asked.one(given)
    assert value["verdict"] != "nothing-missing"
    assert alarms([{"failed": None, "value": value, "cost": {"cpu_s": 1.0}}]).count == 1


def test_alarms_are_of_clean_campaigns_alone(study, tmp_path, capsys):
    with pytest.raises(InputError, match="leave out misfit and broken"):
        Replicates(2, misfit=2.0, discover=3)
    given = [str(study.spec.path), "--out", str(tmp_path), "--quiet", "--break", "noise-halved"]
    assert main([*given, "--discover", "2"]) == 2
    assert "nothing is missing" in capsys.readouterr().err
