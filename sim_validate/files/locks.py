"""Locks folders, so that one command at a time writes to each.

The system holds the lock, on a small file in the folder, and frees it when the process ends,
however that ends. A killed command leaves the file, which locks nothing; the next command takes it.
"""

import errno
from collections.abc import Generator
from contextlib import contextmanager, suppress
from pathlib import Path

LOCK = ".graspproof.lock"
"""Name of the file in a folder that a command writes to."""
WITHOUT_LOCKS = frozenset({errno.ENOSYS, errno.ENOLCK, errno.EOPNOTSUPP, errno.EINVAL})
"""Errors of file systems that have no locks: their users take care that commands do not meet."""


@contextmanager
def locked(folder: Path) -> Generator[bool | None]:
    """Lock a folder until the end of the block.

    Yields True; False if another command has locked it; None if its file system has no locks.
    """
    # commands that lock nothing need not wait for this
    from filelock import FileLock, Timeout  # noqa: TID251 - this is the door

    # a soft lock would outlive a killed command; who may write to a folder may lock it
    lock = FileLock(folder / LOCK, mode=0o666, blocking=False, fallback_to_soft=False)
    try:
        lock.acquire()
    except Timeout:
        yield False
        return
    except OSError as error:
        if error.errno not in WITHOUT_LOCKS:
            raise
    try:
        yield lock.is_locked or None
    finally:
        with suppress(OSError):  # on Windows it goes when it is let go
            (folder / LOCK).unlink()
        lock.release()


def entries(folder: Path) -> list[Path]:
    """List what is in a folder, in order, but for the lock."""
    return sorted(path for path in folder.iterdir() if path.name != LOCK)
