"""The store of what a run has worked out: what comes back, and what is told and set aside."""

import dataclasses
from typing import NamedTuple

import numpy as np
import pytest

from rigid.io.cache import Shelf
from rigid.io.errors import EnvironmentFaultError
from rigid.io.values import pack


class Pair(NamedTuple):
    first: float
    second: "Box"


@dataclasses.dataclass(frozen=True)
class Box:
    array: np.ndarray
    by_place: dict
    kind: type = dict
    rest: tuple = ()


KINDS = (Pair, Box, dict)


@pytest.fixture
def made() -> list[str]:
    return []


@pytest.fixture
def told() -> list[str]:
    return []


def take(shelf: Shelf, made: list[str], value: float) -> float:
    def make() -> np.ndarray:
        made.append("made")
        return np.array([value, 0.1])

    return float(shelf.once("search", make)[0])


def flipped(path, at=-40):
    content = bytearray(path.read_bytes())
    content[at] ^= 1
    path.write_bytes(content)


def test_a_value_is_made_once_and_read_to_the_last_bit(tmp_path, made):
    take(Shelf(tmp_path, {"seed": "1"}), made, 1.0 / 3.0)
    assert take(Shelf(tmp_path, {"seed": "1"}, reads=True), made, 7.0) == 1.0 / 3.0
    assert made == ["made"]


def test_a_value_comes_back_with_its_classes_and_what_the_reader_has(tmp_path):
    heavy = object()
    box = Box(np.arange(6.0).reshape(2, 3), {("a", 1): 0.1, 2: [None, True]}, rest=(heavy, -0.0))
    shelf = Shelf(tmp_path, reads=True)
    shelf.put("pair", Pair(float("inf"), box), {"heavy": heavy})
    again = shelf.read("pair", KINDS, {"heavy": heavy})
    assert isinstance(again, Pair)
    assert again.first == float("inf")
    np.testing.assert_array_equal(again.second.array, box.array)
    assert (again.second.by_place, again.second.kind) == (box.by_place, dict)
    assert again.second.rest[0] is heavy
    assert np.signbit(again.second.rest[1])


def test_what_cannot_be_kept_is_refused():
    with pytest.raises(TypeError, match="function"):
        pack((1.0, take), {})


def test_a_class_that_was_not_named_is_not_made(tmp_path, told):
    Shelf(tmp_path).put("pair", Pair(1.0, Box(np.zeros(2), {})))
    assert Shelf(tmp_path, reads=True, tell=told.append).read("pair", (Box,)) is None
    assert "damaged (it is not what this version of rigid keeps)" in told[0]


def test_that_of_another_run_is_told_and_made_again(tmp_path, made, told):
    take(Shelf(tmp_path, {"seed": "1", "record a": "x"}), made, 1.0)
    other = Shelf(tmp_path, {"seed": "2", "record b": "x"}, True, told.append)
    assert take(other, made, 2.0) == 2.0
    assert "made with another seed, record a, record b; made again" in told[0]
    assert len(made) == 2


@pytest.mark.parametrize("at", [0, 64, 70, 200, -1, -40])
def test_a_flipped_bit_anywhere_is_told_and_set_aside(tmp_path, made, told, at):
    shelf = Shelf(tmp_path, {"seed": "1"}, True, told.append)
    take(shelf, made, 1.0)
    flipped(tmp_path / "search.kept", at)
    assert take(shelf, made, 3.0) == 3.0
    assert "search.kept: damaged (" in told[0]
    assert "set aside as search.kept.damaged, and made again" in told[0]
    assert (tmp_path / "search.kept.damaged").exists()
    assert take(shelf, made, 4.0) == 3.0
    assert len(told) == 1


def test_half_a_file_and_a_pipe_are_set_aside(tmp_path, made, told):
    import os

    shelf = Shelf(tmp_path, {}, True, told.append)
    take(shelf, made, 1.0)
    (tmp_path / "search.kept").write_bytes((tmp_path / "search.kept").read_bytes()[:40])
    assert take(shelf, made, 2.0) == 2.0
    (tmp_path / "search.kept").unlink()
    os.mkfifo(tmp_path / "search.kept")
    assert take(shelf, made, 3.0) == 3.0
    assert len(told) == 2


def test_a_disk_that_does_not_take_it_is_told(tmp_path, monkeypatch):
    def full(*_given, **_more):
        raise OSError(28, "No space left on device")

    shelf = Shelf(tmp_path, reads=True)
    shelf.put("x", 1.0)
    monkeypatch.setattr("rigid.io.files.fsync", full)
    with pytest.raises(EnvironmentFaultError, match=r"No space left.*then --resume goes on"):
        shelf.put("x", 2.0)
    assert shelf.read("x") == 1.0


def test_a_run_that_begins_anew_reads_nothing(tmp_path, made):
    take(Shelf(tmp_path), made, 1.0)
    assert take(Shelf(tmp_path), made, 2.0) == 2.0


def test_without_a_folder_nothing_is_kept(made):
    assert [take(Shelf(), made, 1.0), take(Shelf(), made, 2.0)] == [1.0, 2.0]
    Shelf().clear("search")


def test_what_nothing_needs_is_taken_away(tmp_path, made):
    shelf = Shelf(tmp_path / "kept", {}, reads=True)
    take(shelf, made, 1.0)
    shelf.clear("search")
    assert list(shelf.folder.iterdir()) == []
    take(shelf, made, 1.0)
    shelf.clear()
    assert list(tmp_path.iterdir()) == []
