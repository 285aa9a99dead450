"""Files that are written whole or not at all: a complete one is renamed into place."""

import os
import tempfile
from collections.abc import Generator, Iterable
from contextlib import contextmanager
from pathlib import Path


def write_parts(path: Path, parts: Iterable[bytes]) -> Path:
    """Write a file; folders are made as needed."""
    with replacing(path) as temporary, temporary.open("wb") as stream:
        stream.writelines(parts)
        stream.flush()
        os.fsync(stream.fileno())
    return path


@contextmanager
def replacing(path: Path) -> Generator[Path]:
    """Another path of the same ending to write to, which is put in the place of the file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.", suffix=path.suffix)
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        temporary.chmod(0o644)
        temporary.replace(path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
