"""Friction models compared at a joint of a machine that a spec puts together."""

from collections.abc import Callable

import numpy as np
import pytest
from machines.loading import machine

import rigid
from rigid.friction.models import (
    BRISTLES,
    COULOMB,
    MEMORY,
    SEAL,
    STRIBECK,
    VISCOUS,
    Place,
    amplitude_labels,
    models,
    place_of,
    with_friction,
    without_friction,
)
from rigid.io.errors import InputError
from rigid.likelihood.assemble import assemble
from rigid.likelihood.listing import given_priors


@pytest.mark.slow
def test_the_joint_that_rubs_is_meant(tmp_path):
    press = machine("press", tmp_path).solved
    assert place_of(press, None).joint == "head"
    with pytest.raises(InputError, match="did you mean 'head'"):
        place_of(press, "haed")
    with pytest.raises(InputError, match="leave --joint out"):
        place_of(press.model_copy(update={"machine": None}), "head")
    assert place_of(press.model_copy(update={"machine": None}), None) == Place()


def known_bending(joint: str) -> Callable[[str], str]:
    """Return what states at a joint where Coulomb friction slides, as a number of a candidate."""
    model = '[model]\ncandidates = ["coulomb-friction"]\n'
    return lambda spec: f'{spec}\n{model}[priors]\n"presliding[{joint}]" = {{ fixed = 2e-5 }}\n'


@pytest.mark.slow
def test_a_number_of_a_model_that_is_compared_can_be_stated(tmp_path):
    study = machine("swing", tmp_path, known_bending("spring"))
    place = place_of(study.solved, None)
    listed = {one.name: one for one in models(study.solved, given_priors(study.solved), place)}
    dry = assemble(with_friction(study.solved, place, listed[COULOMB].effects), study.records)
    assert "presliding[spring]" not in dry.parameters.labels  # known: nothing is sampled
    assert "F_C[spring]" in dry.parameters.labels


def test_a_number_at_a_joint_that_is_not_there_is_refused(tmp_path):
    study = machine("swing", tmp_path, known_bending("sprung"))
    with pytest.raises(InputError, match=r"did you mean 'presliding\[spring\]'"):
        assemble(study.solved, study.records)


@pytest.mark.slow
def test_where_several_joints_rub_one_must_be_said(tmp_path):
    table = machine("table", tmp_path).solved
    with pytest.raises(InputError, match="joints that rub are c1, c2, c3, c4; say with --joint"):
        place_of(table, None)
    assert place_of(table, "c3").label("mu") == "mu"  # shared by all joints
    assert place_of(table, "c3").label("F_C") == "F_C[c3]"


@pytest.mark.slow
def test_models_are_those_of_the_joint(tmp_path):
    study = machine("press", tmp_path)
    place = place_of(study.solved, None)
    plain = without_friction(study.solved, place)
    assert plain.machine is not None
    assert {VISCOUS, MEMORY} < set(plain.machine.joints["head"].effects)
    assert plain.machine.joints["rod"] == study.solved.machine.joints["rod"]
    problem = assemble(plain, study.records)
    assert {"mu[head]", "mu_branch[1][head]"} < set(problem.parameters.labels)
    listed = {one.name: one for one in models(study.solved, {}, place)}
    assert tuple(listed) == (VISCOUS, MEMORY, COULOMB, STRIBECK, BRISTLES, SEAL)
    assert amplitude_labels(listed[COULOMB], {}) == ("F_C[head]",)
    assert dict(listed[COULOMB].calls) == {"z_bristle[head]": "presliding[head]"}
    dry = assemble(with_friction(study.solved, place, listed[COULOMB].effects), study.records)
    assert "F_C[head]" in dry.parameters.labels
    assert "mu_branch[1][head]" not in dry.parameters.labels


@pytest.mark.slow
def test_where_there_is_no_oil_no_friction_goes_with_its_pressure(tmp_path):
    study = machine("swing", tmp_path)
    place = place_of(study.solved, None)
    assert SEAL not in {one.name for one in models(study.solved, {}, place)}


@pytest.mark.slow
def test_dry_friction_of_a_body_on_a_spring_is_named(tmp_path):
    """0.3 N, by bristles that bend, beside 0.7 N s/m; simulated by SciPy, read to 0.5 mm."""

    def read(spec: str) -> str:
        return spec.replace("noise = 5e-5", "noise = 5e-4") + "\n[solve]\nsteps = 100\n"

    study = machine("swing", tmp_path, read, seed=3, dry=0.3)
    path = tmp_path / "swing.csv"
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    table[:, 1] += 0.5 * np.random.default_rng(0).standard_normal(len(table))
    np.savetxt(path, table, "%.9g", ",", header="t,x", comments="")
    found = rigid.load(study.spec.path).laws(quiet=True).result
    assert found["usable"]
    assert found["joint"] == "spring"
    by_name = {one["law"]: one for one in found["laws"]}
    assert found["first"] == COULOMB
    assert all(by_name[name]["log_evidence"] < -100.0 for name in (VISCOUS, MEMORY))
    force = by_name[COULOMB]["parameters"]["F_C[spring]"]
    assert force["q05"] < 0.3 < force["q95"]
    assert force["q95"] - force["q05"] < 0.05
