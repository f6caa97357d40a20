"""The rows by name. A new row is a function of the bench, and a line here."""

from collections.abc import Callable

import accuracy
import compiling
import ess
import friction
import growth
import joint
import limits
import release
import wait
import wall
from campaign import Bench
from table import Row

ROWS: dict[str, Callable[[Bench], list[Row]]] = {
    "wait": wait.rows,
    "joint": joint.rows,
    "compile": compiling.rows,
    "limits": limits.rows,
    "friction": friction.rows,
    "release": release.rows,
    "ess": ess.rows,
    "pints": ess.pints,
    "numpyro": ess.numpyro,
    "wall": wall.rows,
    "growth": growth.rows,
    "accuracy": accuracy.rows,
}
