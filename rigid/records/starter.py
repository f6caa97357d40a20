"""A spec to begin with: what logger files hold, and what only whoever measured can say."""

import os
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from rigid.io.errors import InputError
from rigid.kinds import KINDS
from rigid.records.files import load
from rigid.records.guess import Guess, cylinders, guesses
from rigid.records.units import COUNTS, DIMENSIONS, SI_NAMES, allowed
from rigid.spec.sentences import unknown
from rigid.spec.values import ModelSpec
from rigid.spec.write import toml_value

HEAD = """\
# A spec to begin with, made from the headers of the files named below. What was guessed says so;
# what could not be guessed is a line that begins with #. `rigid check` says what is still missing.
# One cylinder has one name: write the same `cylinder` in all of its records.

title = {title}
# simulated = true          # where the records are not measured

[rig]                       # what you have weighed and measured; what is left out has a default
# M_HC = {{ value = 60.0, sd = 1.8 }}        # kg, cylinder with plunger
# M_Pl = {{ value = 10.0, sd = 0.3 }}        # kg, plunger
# M_Fl = {{ value = 200.0, sd = 6.0 }}       # kg, plate, of which each cylinder moves half
# S_Pl = 44.2e-4                           # m^2, area that the pressure acts on

[model]
effects = [
{effects}
    {memory}
]

[sensors]                   # the sheets of your sensors, SI; what is left out has a default
# load = {{ step = 295.0, noise = 147.5 }}   # step: the least difference of two values in the file
"""
VALVE = """\
valve = []                  # when it moved, in seconds on the clock of the file, as in
#   [{ until = 2.5, position = "open" }, { until = 7.0, position = "shut" }, { position = "tank" }];
#   leave the line out where it was open throughout"""
MEMORY = '"frequency-dependent-friction",        # friction with memory, '
SHAKEN = {"acceleration"}
FOLDED = re.compile(r"[^a-z]+")


def starter(files: Sequence[Path], kinds: Mapping[str, str], out: Path) -> str:
    """Return the text of a spec at `out` that names the files.

    - `kinds`: what was done, by the name of a record, which is that of its file.

    Raises InputError with the problems of all files, for kinds of other records, and for kinds that
    there are not.
    """
    names = _names(files)
    problems, tables, done = [*_unknown(kinds, names)], [], set()
    for name, path in zip(names, files, strict=True):
        if not path.exists():
            problems.append(f"{path}: there is no such file; name files of your loggers")
            continue
        try:
            found = guesses(load(path).table)
        except InputError as error:
            problems += str(error).splitlines()
            continue
        file = Path(os.path.relpath(path.resolve(), out.resolve().parent)).as_posix()
        done.add(kinds.get(name) or _kind(name, found)[0])
        for cylinder in cylinders(found):
            tables.append("\n".join(_record(name, file, kinds.get(name, ""), cylinder, found)))
    if problems:
        raise InputError("\n".join(problems))
    effects = "\n".join(f"    {toml_value(effect)}," for effect in ModelSpec().effects)
    both = "release" in done and len(done) > 1
    memory = MEMORY + ("as releases stand" if both else "where releases stand")
    memory = f"{'' if both else '# '}{memory} beside slower records"
    head = HEAD.format(title=toml_value(out.stem), effects=effects, memory=memory)
    return "\n".join([head, *tables])


def _unknown(kinds: Mapping[str, str], names: Sequence[str]) -> Iterator[str]:
    """Yield what is wrong with the kinds that the command line gives."""
    for name, kind in kinds.items():
        for what, given, known in (("record", name, names), ("kind", kind, KINDS)):
            if given not in known:
                yield f"--kind {name}={kind}: {unknown(what, given, known)}"


def _names(files: Sequence[Path]) -> list[str]:
    """Return a name of a record for each file, from that of the file."""
    names: list[str] = []
    for path in files:
        stem = re.sub(r"[\[\],/\s]+", "-", path.stem).strip("-") or "record"
        again = sum(stem == one or one.startswith(f"{stem}-again") for one in names)
        names.append(f"{stem}-again-{again}" if again else stem)
    return names


def _record(
    name: str, file: str, kind: str, cylinder: str, found: Sequence[Guess]
) -> Iterator[str]:
    """Yield the lines of one record: of a cylinder, with the columns that name none."""
    own = [g for g in found if g.cylinder in ("", cylinder) or g.quantity == "time"]
    yield "[[records]]"
    yield f"name = {toml_value(name)}"
    says = ""
    if not kind:
        kind, says = _kind(name, own)
    yield (
        f"kind = {toml_value(kind):19} {says}".rstrip()
        if kind
        else f'# kind = "frame"            # what was done: one of {", ".join(KINDS)}'
    )
    says = "# guessed from the columns' names" if cylinder else "# no column names one"
    yield f"cylinder = {toml_value(cylinder or 'A'):15} {says}"
    yield f"file = {toml_value(file)}"
    known = KINDS.get(kind)
    if known is None or (known.valve is not None and not known.held):
        yield VALVE
    for key, example in {} if known is None else known.own.items():
        if example:
            yield f"# {key} = {example.split(' (')[0]}    # its own value, not this one"
    yield "[records.channels]"
    yield from _channels(own, kind)
    yield ""


def _kind(name: str, found: Sequence[Guess]) -> tuple[str, str]:
    """Return what was done, and on what the guess rests; empty where nothing says it."""
    folded = FOLDED.sub("", name.lower())
    for kind in KINDS:
        if FOLDED.sub("", kind) in folded:
            return kind, "# guessed from the name of the file"
    quantities = {g.quantity for g in found} - {"", "time"}
    return ("release", "# guessed: only accelerations") if quantities == SHAKEN else ("", "")


OTHER = "keep one; of another cylinder, it goes into a second record of this name"


def _channels(found: Sequence[Guess], kind: str) -> Iterator[str]:
    """Yield a line for each column; the first of a quantity is its channel."""
    taken: set[str] = set()
    for guess in found:
        quantity = _of_kind(guess.quantity, kind)
        line = f"{quantity or 'QUANTITY'} = {{ column = {toml_value(guess.column)}, unit = "
        if not quantity:
            words = "time, load, stroke, pressure, acceleration"
            yield f'# {line}"..." }}    # {_plain(guess.why)}; QUANTITY is one of {words}'
        elif kind and quantity not in KINDS[kind].takes:
            yield f'# {line}"..." }}    # a {kind} takes no {quantity}'
        elif quantity in taken:
            yield f"# {line}{toml_value(guess.unit or '...')} }}    # another {quantity}: {OTHER}"
        elif not guess.unit:
            si = SI_NAMES[DIMENSIONS[quantity]]
            units = ", ".join(unit for unit in allowed(quantity) if unit != COUNTS)
            says = f"no unit stated: one of {units}, or counts with scale = ... ({si} per count)"
            yield f'# {line}"..." }}    # {guess.why}; {says}'
        else:
            taken.add(quantity)
            yield f"{line}{toml_value(guess.unit)} }}    # {guess.why}"


def _of_kind(quantity: str, kind: str) -> str:
    """Return a quantity as a kind of record calls it: a motion has a position and a force."""
    motion = {"stroke": "position", "load": "force"} if kind == "motion" else {}
    return motion.get(quantity, quantity)


def _plain(text: str) -> str:
    """Return a text without what a comment cannot hold."""
    return "".join(c if c.isprintable() else "?" for c in text)
