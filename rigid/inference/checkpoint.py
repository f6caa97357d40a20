"""The chain on disk: a block of steps after another, each an entry of the store.

A run that is killed at any moment leaves the blocks that were complete. A damaged block is set
aside, and the chain goes on from the one before it: it is the same chain, since a block ends with
all that decides how its ensembles go on.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path

from rigid.inference.chain import Block, ChainShape, EnsembleBlock, EnsembleState
from rigid.inference.proposal import MixtureProposal, Mode
from rigid.io.cache import Shelf
from rigid.io.errors import InputError

FOLDER, BEGIN = "chain", "begin"
PROPOSAL = (MixtureProposal, Mode)
BLOCK = (Block, EnsembleBlock, EnsembleState)


WORDS = {"dimension": "number of parameters", "apart": "way to begin its ensembles"}
"""What a spec has no key for, as a message calls it."""


def _listed(names: Sequence[str]) -> str:
    """What differs, as a message says it."""
    return ", ".join(WORDS.get(name, name) for name in names)


class Checkpoint:
    """The folder `chain` of a folder.

    - folder: where it stands; made if need be. The caller holds `rigid.io.files.locked` on it
    - fingerprint: what the chain depends on, by name: sha256 of the spec and of each record,
      version. Put in nothing that only decides when to stop: a chain can go on under another rule
    - resume: go on with the chain that is there, if there is one; else start anew
    """

    def __init__(
        self, folder: Path | str, fingerprint: Mapping[str, str], resume: bool = False
    ) -> None:
        self._shelf = Shelf(Path(folder) / FOLDER, fingerprint, resume)
        self._count = 0

    def begin(self, layout: ChainShape, proposal: MixtureProposal) -> MixtureProposal:
        """See that what is there is this run's chain, or begin one; gives the chain's proposal.

        Raises InputError for a chain that this run cannot go on with.
        """
        shape = {name: str(value) for name, value in asdict(layout).items()}
        self._shelf = replace(self._shelf, mark=dict(self._shelf.mark) | shape)
        if other := self._shelf.others(BEGIN):
            raise InputError(
                f"{self._shelf.folder}: the chain was drawn with another {_listed(other)}, so it "
                "cannot be gone on with; run without --resume to start anew, or choose another "
                "folder with --out"
            )
        there = self._shelf.read(BEGIN, PROPOSAL)
        if there is None:
            self._shelf.clear()
            self._shelf.put(BEGIN, proposal)
        return there or proposal

    def append(self, block: Block) -> None:
        """Put a complete block on the disk; it counts once this has returned.

        Raises EnvironmentFaultError when the disk does not take it.
        """
        self._shelf.put(_name(self._count), block)
        self._count += 1

    def read(self) -> list[Block]:
        """All complete blocks, in order."""
        blocks: list[Block] = []
        while (block := self._shelf.read(_name(len(blocks)), BLOCK)) is not None:
            blocks.append(block)
        self._count = len(blocks)
        return blocks


def _name(number: int) -> str:
    return f"block-{number:06d}"
