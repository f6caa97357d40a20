"""What results of all commands have in common."""

import contextlib
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from rigid.inference.summary import Check
from rigid.io.cli import Options
from rigid.io.files import json_text, locked


class CommandResult(ABC):
    """What a command found; `result` is all of its JSON file, as a mapping."""

    result: Any

    @abstractmethod
    def table(self) -> str:
        """What the command prints."""

    def json(self) -> str:
        """Text of the JSON file."""
        return json_text(self.result)

    @property
    def usable(self) -> bool:
        """Whether every check of the result holds."""
        return self.result["usable"]

    @property
    def status(self) -> int:
        """Exit status of the command: 0, or 1 for a result that must not be used."""
        return 0 if self.usable else 1

    @property
    def checks(self) -> tuple[Check, ...]:
        """What must hold for the result to be used: name, whether it does, a sentence."""
        return tuple(Check(**one) for one in self.result.get("checks", ()))

    @property
    def taken(self) -> Mapping[str, Any]:
        """What was held exact and set aside, as in the JSON file; empty where it does not say."""
        return self.result if "held_exact" in self.result else {}


@contextlib.contextmanager
def held_folder(options: Options) -> Iterator[Path]:
    """Hold the folder of a run, or one for as long as the run takes."""
    if options.out is None:
        with TemporaryDirectory(prefix="rigid-") as made:
            yield Path(made)
    else:
        with locked(options.out):
            yield options.out
