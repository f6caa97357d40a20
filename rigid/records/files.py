"""From the bytes of a file to its table: which format it is, and what is refused."""

import hashlib
import re
from dataclasses import dataclass
from pathlib import Path

from rigid.io.errors import EnvironmentFaultError, InputError
from rigid.io.files import MIB, read_bytes
from rigid.records import accelerometer, delimited, toa5
from rigid.records.table import Table

MOST_BYTES = 1024 * MIB
"""Of a record: days at 1,600 Hz."""

LOGGER = re.compile(rb'"?(TO[AB]\w{0,4})"?,')  # TOA5, TOB1, TOB3, TOACI1
KNOWN_BINARY = {
    b"PK\x03\x04": "a workbook or an archive; export the sheet as CSV",
    b"\xd0\xcf\x11\xe0": "an old workbook; export the sheet as CSV",
    b"\x89HDF": "an HDF5 or MATLAB file; export the columns as CSV",
    b"MATLAB": "a MATLAB file; export the columns as CSV",
    b"TDSm": "a TDMS file; export the channels as CSV",
    b"\x1f\x8b": "compressed; unpack it",
    b"\xff\xfe": "UTF-16 text; save it as UTF-8",
    b"\xfe\xff": "UTF-16 text; save it as UTF-8",
}


@dataclass(frozen=True, eq=False)
class Source:
    """A file's table, and the SHA-256 of its bytes in hexadecimal."""

    table: Table
    sha256: str


def load(path: Path) -> Source:
    """Read a file, whichever of the known formats it has.

    Raises InputError when it is missing, empty, binary or of no known format, and
    EnvironmentFaultError when the system does not let it be read.
    """
    try:
        content = read_bytes(path, MOST_BYTES)
    except (FileNotFoundError, NotADirectoryError):
        raise InputError(
            f"{path}: there is no such file; correct `file` in the spec (it counts from the "
            "folder of the spec)"
        ) from None
    except OSError as error:
        raise EnvironmentFaultError(f"{path}: could not be read ({error.strerror})") from error
    return Source(parse(path, content), hashlib.sha256(content).hexdigest())


def parse(path: Path, content: bytes) -> Table:
    """Return the table in the bytes of a file; raises InputError when there is none."""
    body = content.removeprefix(b"\xef\xbb\xbf")
    if not body.strip():
        raise InputError(f"{path}: the file is empty; copy or record it again")
    logger = LOGGER.match(body)
    if logger and logger[1].startswith(b"TOB"):
        raise InputError(
            f"{path}: this is binary logger data ({logger[1].decode()}); convert it to TOA5 with "
            "the logger maker's conversion tool (CardConvert) and name that file"
        )
    refuse_binary(path, body)
    text = decoded(body).replace("\r\n", "\n").replace("\r", "\n")
    if logger:
        return toa5.parse(path, text)
    if accelerometer.is_preamble(text):
        return accelerometer.parse(path, text)
    return delimited.parse(path, text)


def refuse_binary(path: Path, content: bytes) -> None:
    """Raise InputError when the bytes are not those of a text file."""
    for magic, what in KNOWN_BINARY.items():
        if content.startswith(magic):
            raise InputError(f"{path}: this is {what}, and name that file")
    zero = content.find(b"\0")
    if zero >= 0:
        line = content.count(b"\n", 0, zero) + 1
        raise InputError(
            f"{path}: line {line} holds bytes that are no text; the file is binary or was torn "
            "when the power failed: export it as CSV or remove the torn lines"
        )


def decoded(content: bytes) -> str:
    """Return the text, taken as UTF-8 or else as Latin-1."""
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError:
        return content.decode("latin-1")
