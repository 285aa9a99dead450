"""How far rounding by the program that wrote a mesh file may have moved a coordinate.

Two signs of rounding are known. Where all coordinates are numbers of single precision, as far as
their digits show, each is off by at most half the spacing of such numbers, 2^-24 of the largest.
And the numbers of a text show
how many digits its writer keeps: if none has more than S significant digits, the last digit of the
largest coordinate, of the order 10^e, counts for 10^(e + 1 - S), and half of that is the rounding,
whether the writer keeps S digits or a fixed number of decimals. Numbers that are all shorter than
`FEWEST_DIGITS` are taken as typed by hand, and exact, unless all have the same number of decimals,
`FEWEST_DIGITS` or more; those with `ALL_DIGITS` hold a double.
"""

import math
import re
from array import array
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from grasp_core.arrays import Array

SINGLE = 2.0**-24
"""Largest rounding error of single precision, relative to a number."""
FEWEST_DIGITS, ALL_DIGITS = 5, 17
WRITTEN = 0.501
"""Largest error of a written number, in units of its last digit."""
BLOCK, STRIDE = 1024, 64
"""Vertices whose words are looked at together; beyond the first block only every 64th of them, and
the one with the largest coordinate, which has the most digits where decimals are fixed."""
EXPONENT = re.compile(rb"[eE][+-]?\d+")
SIGNS = b"+-."
FLOATS = 3


@dataclass(slots=True)
class TextPoints:
    """The vertices of a text file as they are read, and how many digits they are written with."""

    numbers: "array[float]" = field(default_factory=lambda: array("d"))
    """Coordinates, three for each vertex."""
    _digits: int = 0
    _decimals: set[int] = field(default_factory=set[int])
    _waiting: list[Sequence[bytes]] = field(default_factory=list[Sequence[bytes]])

    def __len__(self) -> int:
        return len(self.numbers) // FLOATS

    def add(self, words: Sequence[bytes]) -> None:
        """Add a vertex, given by three words."""
        if len(words) != FLOATS:
            raise ValueError(f"a vertex needs three numbers, got {len(words)}")
        self.numbers.extend([float(word.replace(b"_", b"?")) for word in words])
        self._waiting.append(words)
        if len(self._waiting) == BLOCK:
            self._look()

    @property
    def array(self) -> Array:
        """The vertices, (n, 3), without a copy."""
        return np.frombuffer(self.numbers, dtype=np.float64).reshape(-1, 3)

    @property
    def digits(self) -> int:
        """Significant digits that the writer kept; 0 if the numbers may be exact."""
        self._look()
        fixed = len(self._decimals) == 1 and min(self._decimals) >= FEWEST_DIGITS
        return self._digits if fixed or self._digits >= FEWEST_DIGITS else 0

    def _look(self) -> None:
        waiting = self._waiting
        if waiting and self._digits < ALL_DIGITS:
            if len(self) > BLOCK:
                sizes = np.abs(self.numbers[-FLOATS * len(waiting) :])
                waiting = [*waiting[::STRIDE], waiting[int(sizes.argmax()) // FLOATS]]
            words = [word for words in waiting for word in words]
            self._digits = max(self._digits, most_digits(words))
            if len(self._decimals) <= 1:
                self._decimals |= {len(word.partition(b".")[2]) for word in words}
        self._waiting.clear()


def most_digits(words: Iterable[bytes]) -> int:
    """Return the most significant digits of some numbers, zeros at the end of decimals included."""
    plain = EXPONENT.sub(b"", b" ".join(words)).split()
    plain = [word if b"." in word else word.rstrip(b"0") for word in plain]
    digits = b" ".join(plain).translate(None, SIGNS).split()
    return max((len(each.lstrip(b"0")) for each in digits), default=0)


def text_rounding(points: Array, digits: int) -> float:
    """Return the rounding of coordinates (n, 3) written with at most so many digits."""
    largest = float(np.abs(points).max(initial=0.0))
    if not 0 < digits < ALL_DIGITS or largest == 0.0:
        return 0.0
    return 0.5 * 10.0 ** (math.floor(math.log10(largest)) + 1 - digits)


def single_rounding(points: Array, digits: int = 0) -> float:
    """Return the rounding of coordinates (n, 3) if all are of single precision; 0 otherwise."""
    with np.errstate(over="ignore", under="ignore", divide="ignore"):
        sizes = np.abs(points)
        last = 10.0 ** (np.floor(np.log10(sizes)) + 1 - digits) if digits else np.zeros(())
        if not (np.abs(points - points.astype(np.float32)) <= WRITTEN * last).all():
            return 0.0
    return SINGLE * float(np.abs(points).max(initial=0.0))
