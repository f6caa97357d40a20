"""Results that a run that goes on does not take again."""

import numpy as np
import pytest

from rigid.io.cache import Shelf


@pytest.fixture
def made() -> list[str]:
    return []


def take(shelf: Shelf, made: list[str], value: float) -> float:
    def make() -> dict[str, np.ndarray]:
        made.append("made")
        return {"x": np.array([value, 0.1])}

    return float(shelf.once("search", make)["x"][0])


def test_a_result_is_made_once_and_read_to_the_last_bit(tmp_path, made):
    take(Shelf(tmp_path, {"seed": "1"}), made, 1.0 / 3.0)
    assert take(Shelf(tmp_path, {"seed": "1"}, reads=True), made, 7.0) == 1.0 / 3.0
    assert made == ["made"]


def test_that_of_another_run_or_half_a_file_is_made_again(tmp_path, made):
    take(Shelf(tmp_path, {"seed": "1"}), made, 1.0)
    assert take(Shelf(tmp_path, {"seed": "2"}, reads=True), made, 2.0) == 2.0
    (tmp_path / "search.npz").write_bytes((tmp_path / "search.npz").read_bytes()[:40])
    assert take(Shelf(tmp_path, {"seed": "2"}, reads=True), made, 3.0) == 3.0
    assert len(made) == 3


def test_a_run_that_begins_anew_reads_nothing(tmp_path, made):
    take(Shelf(tmp_path, {}), made, 1.0)
    assert take(Shelf(tmp_path, {}), made, 2.0) == 2.0


def test_without_a_folder_nothing_is_kept(made):
    assert [take(Shelf(), made, 1.0), take(Shelf(), made, 2.0)] == [1.0, 2.0]
    Shelf().clear("search")


def test_what_nothing_needs_is_taken_away(tmp_path, made):
    shelf = Shelf(tmp_path, {}, reads=True)
    take(shelf, made, 1.0)
    shelf.clear("search")
    assert list(tmp_path.iterdir()) == []
