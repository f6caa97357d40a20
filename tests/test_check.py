"""`rigid check`: what it says of spec and records, and the schema that editors take."""

import json
import re
import tomllib

import pytest
from small_campaign import SPEC as OWN
from test_study import write_cart

from rigid.check import check, main
from rigid.io.cli import Options
from rigid.io.errors import InputError
from rigid.spec import load_spec
from rigid.spec.read import EXAMPLES
from rigid.spec.values import schema

KINDS = {"object": dict, "array": list, "string": str, "boolean": bool, "null": type(None)}


def options(spec, as_json=False):
    return Options(str(spec), None, None, False, True, as_json)


def test_a_spec_is_told(tmp_path, capsys):
    path = write_cart(tmp_path)
    before = sorted(tmp_path.iterdir())
    assert check(options(path, as_json=True)) == 0
    found = json.loads(capsys.readouterr().out, parse_constant=pytest.fail)
    (record,) = found["records"]
    assert (record["record"], record["kind"], record["rate_Hz"]) == ("to-and-fro", "motion", 200.0)
    assert {c["quantity"]: c["samples"] for c in record["channels"]} == {
        "position": 4000,
        "force": 4000,
    }
    priors = {p["name"]: p for p in found["parameters"]}
    assert priors["M_Pl"]["prior"] == "lognormal"
    assert priors["M_Pl"]["median"] == pytest.approx(30.0, rel=1e-12)
    # A factor is the distance of one standard deviation.
    assert priors["M_Pl"]["q95"] == pytest.approx(30.0 * 2.0**1.6448536, rel=1e-6)
    assert priors["S_Pl"]["prior"] == "exact"
    sampler = found["sampler"]
    assert (sampler["ensembles"], sampler["walkers"], sampler["parameters"]) == (2, 16, 3)
    assert sampler["chain_bytes_per_block"] == 2 * 16 * 50 * 4 * 8
    assert check(options(path)) == 0
    text = capsys.readouterr().out
    assert "to-and-fro,A" in text
    assert "2 ensembles of 16 walkers" in text
    assert sorted(tmp_path.iterdir()) == before


def test_what_is_wrong_is_refused(tmp_path):
    path = write_cart(tmp_path)
    path.write_text(path.read_text("utf-8").replace("[priors]", "[priors]\nmuu = { fixed = 1 }"))
    with pytest.raises(InputError, match="unknown name 'muu'; did you mean 'mu'"):
        check(options(path))


def test_published_numbers_are_no_mistake(capsys):
    assert check(options("paper")) == 0
    assert "no record is fitted" in capsys.readouterr().out


def faults(value, rule, root, where="spec"):
    """What of a value breaks a JSON Schema, as far as schemas of specs go."""
    if "$ref" in rule:
        rule = root["$defs"][rule["$ref"].rsplit("/", 1)[1]] | {
            k: v for k, v in rule.items() if k != "$ref"
        }
    if "anyOf" in rule:
        tried = [list(faults(value, one, root, where)) for one in rule["anyOf"]]
        if all(tried):
            yield from min(tried, key=len)
        return
    kind = rule.get("type")
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    fits = (
        kind is None
        or (kind == "number" and number)
        or (kind == "integer" and number and value == int(value))
        or isinstance(value, KINDS.get(kind, ()))
    )
    if not fits:
        yield f"{where}: {value!r} is no {kind}"
        return
    if "enum" in rule and value not in rule["enum"]:
        yield f"{where}: {value!r} is none of {rule['enum']}"
    if isinstance(value, dict):
        known, more = rule.get("properties", {}), rule.get("additionalProperties", True)
        for key, item in value.items():
            if key in known:
                yield from faults(item, known[key], root, f"{where} {key}")
            elif more is False:
                yield f"{where}: unknown key {key}"
            elif isinstance(more, dict):
                yield from faults(item, more, root, f"{where} {key}")
        yield from (f"{where}: lacks {key}" for key in set(rule.get("required", ())) - set(value))
    if isinstance(value, list):
        for number, item in enumerate(value):
            yield from faults(item, rule.get("items", {}), root, f"{where} {number}")


def documented():
    """Specs in the repository: the shipped ones, and those of the documentation."""
    for folder in EXAMPLES:
        for path in sorted(folder.glob("*.toml")):
            load_spec(path)
            yield path.name, path.read_text("utf-8")
    yield "own", OWN.format(valve='{ position = "open" }', shut=1.0, ess=10.0, r_hat=1.1)
    shared = (
        '[channels.A]\ntime = { column = 1, unit = "s" }\nload = { column = "F", unit = "N" }\n'
    )
    yield "shared", shared + '[[records]]\nname = "f"\nkind = "frame"\nfile = "f.csv"\n'
    text = (EXAMPLES[1].parent / "docs" / "machines.md").read_text("utf-8")
    for number, found in enumerate(re.findall(r"```toml\n(title.*?)```", text, re.S)):
        yield f"machines {number}", found


def test_the_schema_takes_what_the_reader_takes(capsys):
    assert main(["--schema"]) == 0
    made = json.loads(capsys.readouterr().out, parse_constant=pytest.fail)
    assert made == schema()
    texts = dict(documented())
    assert len(texts) >= 5
    for name, text in texts.items():
        assert not list(faults(tomllib.loads(text), made, made)), name


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[sampler]\nwalker = 3\n", "unknown key walker"),
        ("[rig]\nM_HC = true\n", "True is no"),
        ("[rig]\nM_HC = { mean = 3.0 }\n", "M_HC"),
        ('[model]\nvary = { mu = "hour" }\n', "'hour' is none of"),
        (
            '[[records]]\nname = "a"\nkind = "fame"\nfile = "a"\nchannels = {}\n',
            "'fame' is none of",
        ),
        ('[[records]]\nname = "a"\nkind = "frame"\n', "lacks"),
        ("[priors]\nk_LC = { lognormal = { median = true } }\n", "k_LC"),
        ("[sensors]\nload = { stp = 1.0 }\n", "unknown key stp"),
    ],
)
def test_the_schema_refuses_what_the_reader_refuses(text, says):
    found = list(faults(tomllib.loads(text), schema(), schema()))
    assert found
    assert any(says in one for one in found)


def test_a_number_with_or_without_its_sd_is_taken():
    for text in ("[rig]\nM_HC = 60.0\n", "[rig]\nM_HC = { value = 60.0, sd = 1.0 }\n"):
        assert not list(faults(tomllib.loads(text), schema(), schema()))
    text = "[sensors]\nload = { noise = 100.0 }\n"
    assert not list(faults(tomllib.loads(text), schema(), schema()))


def test_files_effects_and_laws_are_told_together_and_then_names_of_priors(tmp_path):
    path = write_cart(tmp_path)
    good = path.read_text("utf-8")
    bad = good.replace("[priors]", "[priors]\na = { norml = 1 }\nb = { uniform = { lo = 1 } }")
    bad = re.sub(r"(?m)^effects = .*$", 'effects = ["viscous-frictio", "oil"]', bad)
    path.write_text(re.sub(r"(?m)^file = .*$", 'file = "gone.csv"', bad), "utf-8")
    with pytest.raises(InputError) as caught:
        check(options(path))
    lines = str(caught.value).splitlines()
    places = ["[model] effects", "[model] effects", "[priors] a", "[priors] b", "gone.csv"]
    assert len(lines) == len(places)
    assert all(place in line for place, line in zip(places, lines, strict=True))
    fixed = "muu = { fixed = 1 }\nkapa = { fixed = 1 }"
    path.write_text(good.replace("[priors]", f"[priors]\n{fixed}"), "utf-8")
    with pytest.raises(InputError) as caught:
        check(options(path))
    assert len(str(caught.value).splitlines()) == 2
