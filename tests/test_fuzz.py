"""Damaged specs and records are taken or refused with a sentence, in bounded time."""

import pytest
from damage import is_sentence, outcome, texts, tried
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

INPUTS = 150
LONGEST = 5.0
"""Seconds of one input; the longest of 10^5 took a hundredth of it."""

few = settings(
    max_examples=150,
    derandomize=True,
    deadline=None,
    database=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)


@pytest.mark.parametrize("subject", sorted(texts()))
def test_what_is_damaged_is_taken_or_refused_with_a_sentence(subject, tmp_path):
    found = [outcome(subject, seed, tmp_path) for seed in range(INPUTS)]
    faults = [(seed, one.what) for seed, one in enumerate(found) if one.what not in PROPER]
    assert not faults
    assert max(one.seconds for one in found) < LONGEST
    refused = sum(one.what == "refused" for one in found)
    assert refused > 0.1 * INPUTS  # damage is damage


PROPER = {"taken", "refused"}


@few
@given(content=st.binary(max_size=400), subject=st.sampled_from(sorted(texts())))
def test_bytes_of_any_kind_are_refused_with_a_sentence(content, subject, tmp_path):
    assert tried(subject, content, tmp_path).what in PROPER


LEAVES = st.one_of(
    st.integers(), st.floats(), st.booleans(), st.text(max_size=8), st.sampled_from([[], {}])
)
KEYS = st.sampled_from(
    ["rig", "M_HC", "k_oil", "model", "effects", "priors", "k_LC", "records", "name", "kind"]
)
TREES = st.recursive(
    LEAVES, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(KEYS, inner, max_size=3)
)


def toml(value: object) -> str:
    """A value as TOML has it in a line."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return (
            '"' + "".join(f"\\U{ord(c):08x}" for c in value if not 0xD800 <= ord(c) < 0xE000) + '"'
        )
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{k} = {toml(v)}" for k, v in value.items()) + "}"
    return repr(value)


@few
@given(tables=st.dictionaries(KEYS | st.sampled_from(["sampler", "solve", "bands"]), TREES))
def test_tables_of_any_shape_are_refused_with_a_sentence(tables, tmp_path):
    text = "\n".join(f"{key} = {toml(value)}" for key, value in tables.items())
    assert tried("spec", text.encode(), tmp_path).what in PROPER


@pytest.mark.parametrize("subject", sorted(texts()))
def test_what_is_whole_is_taken(subject, tmp_path):
    assert tried(subject, texts()[subject], tmp_path).what == "taken"


def test_a_fault_would_be_seen(tmp_path, monkeypatch):
    def broken(*_given):
        raise IndexError("list index out of range")

    monkeypatch.setattr("damage.parse_spec", broken)
    assert tried("spec", texts()["spec"], tmp_path).what.startswith("IndexError")
    assert not is_sentence("invalid", tmp_path)
