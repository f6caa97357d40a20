"""Commands whose whole runs are slow, run through themselves on a cart: seconds a fit."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from cart import write_cart

from rigid import __main__ as rigid_command
from rigid import batch, discover, load
from rigid.discovery import refit
from rigid.io.files import plain

DRY, SLOW = 30.0, 0.05
"""N of dry friction that the spec does not name, and m/s over which it turns round."""


def with_dry_friction(folder: Path, *others: str) -> Path:
    """The spec of a cart that slides on something, with dry friction as a candidate."""
    path = write_cart(folder, seconds=8.0)
    head, *rows = (folder / "cart.csv").read_text("utf-8").splitlines()
    time, place, force = np.array([row.split(",") for row in rows], dtype=float).T
    force += DRY * np.tanh(np.gradient(place, time) / SLOW)
    lines = [f"{a:.4f},{b:.9f},{c:.4f}" for a, b, c in zip(time, place, force, strict=True)]
    (folder / "cart.csv").write_text("\n".join([head, *lines]) + "\n", "utf-8")
    effects = 'effects = ["viscous-friction"]\n'
    more = effects + f"candidates = {json.dumps(['coulomb-friction', *others])}\n"
    path.write_text(path.read_text("utf-8").replace(effects, more), "utf-8")
    return path


def test_discover_names_what_a_cart_hides(tmp_path, capsys):
    path, out = with_dry_friction(tmp_path), tmp_path / "out"
    assert discover.main([str(path), "--quiet", "--seed", "1", "--out", str(out)]) in (0, 1)
    printed = capsys.readouterr().out
    made = json.loads((out / "discovery.json").read_text("utf-8"))
    step, *further = made["steps"]
    assert {one["effect"] for one in further} <= {None}  # what tanh's turn leaves has no name
    assert (made["verdict"], step["effect"]) == ("named", "coulomb-friction")
    assert printed.startswith("verdict: named")
    assert "coulomb-friction (probability" in printed
    low, high = (step["parameters"]["F_C"][q] for q in ("q05", "q95"))
    assert low - 0.1 * DRY < DRY < high + 0.1 * DRY  # a bristle's turn is another than tanh's
    assert step["gap"]["after"] < step["gap"]["before"]
    page = (out / "index.html").read_text("utf-8")
    for figure in ("against-1", "matrix", "where"):
        assert f'id="fig-discovery-{figure}"' in page
        assert (out / "figures" / f"discovery-{figure}.csv").is_file()


class Killed(BaseException):
    """As a run ends that is interrupted."""


@pytest.mark.slow
def test_discover_goes_on_between_two_refits(tmp_path, monkeypatch):
    """What was fitted in full before the end is not fitted again, and the result is the same."""
    path = with_dry_friction(tmp_path, "stribeck-friction", "direction-dependent-viscosity")
    study, fits = load(path), refit._followed
    whole = study.discover(tmp_path / "whole", quiet=True)
    assert len(whole.outcome.steps[0].refits) > 1
    done: list[int] = []

    def counted(found, begun, rival):
        done.append(begun.number)
        if len(done) == 2:
            raise Killed
        return fits(found, begun, rival)

    monkeypatch.setattr(refit, "_followed", counted)
    with pytest.raises(Killed):
        study.discover(tmp_path / "out", quiet=True)
    again = load(path).discover(tmp_path / "out", resume=True, quiet=True)
    assert done[0] not in done[1:]
    assert done[1] == done[2]
    assert len(done) == 1 + len([r for step in whole.outcome.steps for r in step.refits])
    told = [json.dumps(plain({**one.result, "steps": [], "spec": ""})) for one in (whole, again)]
    assert told[0] == told[1]
    for step, other in zip(whole.outcome.steps, again.outcome.steps, strict=True):
        assert step.probability == other.probability
        for name, one in step.refits.items():
            np.testing.assert_array_equal(one.after.w, other.refits[name].after.w)
    assert not list((tmp_path / "out").glob("discovery-refit*"))


@pytest.mark.slow
def test_batch_puts_all_carts_on_one_page(tmp_path, capsys):
    folder, out = tmp_path / "spring", tmp_path / "out"
    folder.mkdir()
    for number, drag in enumerate((120.0, 130.0)):
        write_cart(folder, f"day-{number + 1}", drag, seed=number, seconds=8.0)
    assert batch.main([str(folder), "--quiet", "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    made = json.loads((out / "batch.json").read_text("utf-8"))
    assert [one["name"] for one in made["campaigns"]] == ["day-1", "day-2"]
    assert all(one["status"] == "usable" for one in made["campaigns"])
    assert "2 of 2 campaigns gave a usable result" in printed
    assert 'id="fig-batch-season' in (out / "index.html").read_text("utf-8")
    assert (out / "day-1" / "posterior.nc").is_file()


@pytest.mark.parametrize(
    ("given", "status", "says"),
    [
        (["--version"], 0, "rigid 0."),
        (["--help"], 0, "usage: rigid COMMAND SPEC"),
        (["fti", "spec"], 2, "unknown command 'fti'"),
        (["check", "nowhere"], 2, "nowhere"),
    ],
)
def test_every_command_goes_by_its_name(given, status, says, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["rigid", *given])
    assert rigid_command.main() == status
    printed = capsys.readouterr()
    assert says in printed.out + printed.err
