"""Sends values between processes through pipes, each after its length in bytes."""

import pickle
import struct
from typing import IO, Any

LENGTH = struct.Struct("<Q")
"""How many bytes follow."""


def send(pipe: IO[bytes], value: Any) -> None:
    """Send one value, which the other process gets as a copy.

    Arrays keep their bits and stay read-only, as protocol 5 writes their memory as it is.
    """
    message = pickle.dumps(value, protocol=5)
    pipe.write(LENGTH.pack(len(message)))
    pipe.write(message)
    pipe.flush()


def receive(pipe: IO[bytes]) -> bytes:
    """Receive the bytes of one value, for `pickle.loads`.

    Raises:
        EOFError: The other process has ended.
    """
    (length,) = LENGTH.unpack(_exactly(pipe, LENGTH.size))
    return _exactly(pipe, length)


def _exactly(pipe: IO[bytes], length: int) -> bytes:
    message = pipe.read(length)
    if len(message) < length:
        raise EOFError("the other process has ended")
    return message
