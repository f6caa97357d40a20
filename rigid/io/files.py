"""Files written whole or not at all, and the lock that keeps two runs out of one folder."""

import csv
import errno
import fcntl
import io
import json
import math
import os
import socket
import stat
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from rigid.io.errors import EnvironmentFaultError, InputError

MIB = 1 << 20
KINDS_OF_FILE = {
    stat.S_IFDIR: "a folder",
    stat.S_IFIFO: "a pipe",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFSOCK: "a socket",
}


def read_bytes(path: Path, most: int) -> bytes:
    """Return what stands in a regular file of at most `most` bytes.

    A device has no end and a pipe may never begin: neither is waited for.

    Raises InputError for what is no such file, OSError where the system does not let it be read.
    """
    handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0))
    try:
        require_regular(path, os.fstat(handle), most)
    except InputError:
        os.close(handle)
        raise
    with os.fdopen(handle, "rb") as file:
        content = file.read(most + 1)
    if len(content) > most:  # it has grown meanwhile
        raise too_large(path, len(content), most)
    return content


def require_regular(path: Path, found: os.stat_result, most: int) -> None:
    """Raise InputError for what is no regular file, or one of more than `most` bytes."""
    if not stat.S_ISREG(found.st_mode):
        what = KINDS_OF_FILE.get(stat.S_IFMT(found.st_mode), "no regular file")
        raise InputError(f"{path}: this is {what}; name a regular file")
    if found.st_size > most:
        raise too_large(path, found.st_size, most)


def too_large(path: Path, size: int, most: int) -> InputError:
    """The fault of a file that has too many bytes."""
    return InputError(
        f"{path}: has {size / MIB:.0f} MiB; at most {most / MIB:.0f} MiB are read, split the file"
    )


@contextmanager
def replacing(path: Path | str) -> Iterator[Path]:
    """Give a temporary path beside `path`; when the block ends well, it takes the place of `path`.

    - path: where the file is to stand; its folder is made if need be

    A reader sees the old file or the new one, never a part. What was begun is removed when the
    block fails, and written over if the process was killed; two runs at once are for `locked`.

    Raises EnvironmentFaultError when the disk is full or the folder cannot be written.
    """
    path = Path(path)
    temporary = path.with_name(f".{path.name}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield temporary
        fsync(temporary)
        os.replace(temporary, path)
        fsync(path.parent)
    except OSError as error:
        raise write_fault(path, error) from error
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)


def write_text(path: Path | str, text: str) -> None:
    """Write `text` (UTF-8, as it is) to `path`, whole or not at all."""
    with replacing(path) as temporary:
        temporary.write_bytes(text.encode("utf-8"))


def fsync(path: Path) -> None:
    """Have the system put a file, or the entries of a folder, on the disk itself."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    except OSError as error:  # some network disks refuse to sync a folder
        if not (path.is_dir() and error.errno in (errno.EINVAL, errno.ENOTSUP)):
            raise
    finally:
        os.close(handle)


def write_fault(path: Path, error: OSError) -> EnvironmentFaultError:
    """The failure to report when writing `path` did not work."""
    why = error.strerror or str(error)
    todo = "free some space" if error.errno == errno.ENOSPC else "choose another folder with --out"
    return EnvironmentFaultError(f"{path}: could not be written ({why}); {todo}")


@contextmanager
def locked(directory: Path | str) -> Iterator[None]:
    """Hold a folder for this run alone; the system lets go of it when the process ends, however.

    - directory: the output folder; made if need be. The lock is on the file `.lock` in it

    Raises EnvironmentFaultError when another run holds it.
    """
    path = Path(directory) / ".lock"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
    except OSError as error:
        raise write_fault(path, error) from error
    try:
        _lock(handle, path)
        yield
    finally:
        os.close(handle)


def _lock(handle: int, path: Path) -> None:
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        raise EnvironmentFaultError(
            f"{path.parent}: in use by another run ({_holder(handle)}); wait for it to end, or "
            "choose another folder with --out"
        ) from error
    except OSError:  # a disk without locks: nothing to hold, and no reason to stop
        return
    os.ftruncate(handle, 0)
    since = datetime.now(UTC).strftime("%Y-%m-%d %H:%M:%S UTC")
    told = f"process {os.getpid()} on {socket.gethostname()} since {since}"
    os.pwrite(handle, told.encode(), 0)


def _holder(handle: int) -> str:
    told = os.pread(handle, 400, 0).decode(errors="replace")
    return told if told.startswith("process ") and told.isprintable() else "process unknown"


def finite(value: float | None) -> float | None:
    """A number for JSON: None where it is none."""
    return None if value is None or not math.isfinite(value) else float(value)


def plain(value: Any) -> Any:
    """A value in what JSON knows: text, numbers, lists, tables; None for what is not finite."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if hasattr(value, "tolist"):  # of NumPy, which is not imported before the first line is out
        return plain(value.tolist())
    return finite(value) if isinstance(value, float) else value


def csv_text(head: Iterable[str], rows: Iterable[Iterable[Any]]) -> str:
    """Rows under a head as the text of a CSV file; None leaves its cell empty."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([head, *rows])
    return text.getvalue()


def json_text(value: Any) -> str:
    """A value as the text of a JSON file."""
    return json.dumps(plain(value), indent=1, ensure_ascii=False, allow_nan=False) + "\n"
