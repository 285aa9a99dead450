"""Writes small images with the colours of the ramp as PNG bytes (ISO/IEC 15948)."""

import struct
import zlib

import numpy as np

from grasp_core.arrays import Indices
from scenes.drawing.colours import LEVELS, ramp_bytes

SIGNATURE = b"\x89PNG\r\n\x1a\n"
PALETTE, BITS = 3, 8
"""PNG's number for pixels that name a colour of a palette, and the bits of such a name."""
HARDEST = 9
"""Level of compression; higher ones do not exist."""


def png_of(levels: Indices) -> bytes:
    """Write an image.

    Takes `levels` (rows, columns).
    """
    rows, columns = levels.shape
    names = np.where(levels < 0, LEVELS, levels).astype(np.uint8)
    lines = np.column_stack([np.zeros(rows, np.uint8), names])  # a line begins with its filter
    header = struct.pack(">IIBBBBB", columns, rows, BITS, PALETTE, 0, 0, 0)
    return SIGNATURE + b"".join([
        _chunk(b"IHDR", header),
        _chunk(b"PLTE", ramp_bytes().astype(np.uint8).tobytes() + b"\x00\x00\x00"),
        _chunk(b"tRNS", b"\xff" * LEVELS + b"\x00"),
        _chunk(b"IDAT", zlib.compress(lines.tobytes(), HARDEST)),
        _chunk(b"IEND", b""),
    ])  # fmt: skip


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
