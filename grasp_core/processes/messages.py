"""Sends values between processes through pipes, each after its length in bytes."""

import gc
import pickle
import struct
from typing import IO, Any

LENGTH = struct.Struct("<Q")
"""How many bytes follow."""


def send(pipe: IO[bytes], value: Any) -> None:
    """Send one value, which the other process gets as a copy.

    Contiguous arrays keep their bits and stay read-only: protocol 5 writes their memory as it is.
    """
    message = pickle.dumps(value, protocol=5)
    pipe.write(LENGTH.pack(len(message)))
    pipe.write(message)
    pipe.flush()


def receive(pipe: IO[bytes]) -> bytes:
    """Receive the bytes of one value, for `unpacked`."""
    (length,) = LENGTH.unpack(_exactly(pipe, LENGTH.size))
    return _exactly(pipe, length)


def unpacked(message: bytes) -> Any:
    """Return the value of a message, which came from a process of our own.

    Nearly all objects made here live on: looking for unused ones would take longer than the rest.
    """
    collects = gc.isenabled()
    gc.disable()
    try:
        return pickle.loads(message)  # noqa: S301 - our own process sent it
    finally:
        if collects:
            gc.enable()


def _exactly(pipe: IO[bytes], length: int) -> bytes:
    message = pipe.read(length)
    if len(message) < length:
        raise EOFError("the other process has ended")
    return message
