"""Reads what `numpy.save` has pickled into `.npy` files: dictionaries, lists and arrays of them.

A pickle is a list of steps, such as "make an empty dictionary". They are carried out here, one by
one, and no others than plain values and arrays need. So nothing in a file is executed, and a small
file cannot claim much memory. Python's own `pickle` can be kept to some functions, too, but crashes
where tuples that are nested a million deep are the key of a dictionary.
"""

import io
import math
import pickletools
from collections.abc import Callable, Mapping
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from grasp_core.errors import InputError
from grasp_core.files.json_text import shown

MOST_PICKLE_BYTES = 128 * 2**20
"""Largest size of a file with many records: one of a hand takes one to ten thousand bytes."""
MOST_STEPS = 4_000_000
"""Most steps of a pickle, each of which makes at most some 100 bytes; a record takes one hundred.
"""
MOST_AXES = 8
"""Most dimensions of an array."""


class _Held:
    """An array in a pickle: its values come later, as its state."""

    __slots__ = ("kept",)

    def __init__(self, *_: Any) -> None:
        self.kept: list[int] = []  # places in which the pickle keeps it for later use

    def built(self, state: Any) -> NDArray[Any] | list[Any]:
        """Return its numbers, or the list of its objects."""
        _, shape, kind, by_columns, data = state
        if kind.plain.kind != "O":
            return _filled(data, kind, shape, "F" if by_columns else "C")
        if type(data) is not list or _count(shape) != len(cast("list[Any]", data)):
            raise InputError("an array of objects has not as many as its shape says")
        return cast("list[Any]", data)


class _Kind:
    """The type of an array's entries in a pickle."""

    __slots__ = ("plain",)

    def __init__(self, code: Any, *_: Any) -> None:
        self.plain = np.dtype(code if type(code) is str else "V")
        if self.plain.kind not in "fiubO":
            raise InputError(f"an array has the type {shown(code)}, expected numbers")

    def built(self, state: Any) -> "_Kind":
        """Take over the order of bytes."""
        self.plain = self.plain.newbyteorder(state[1])
        return self


def _count(shape: Any) -> int:
    """Return the number of entries of an array; a shape may be anything."""
    if type(shape) is not tuple or len(cast("Any", shape)) > MOST_AXES:
        raise InputError(f"an array must have at most {MOST_AXES} dimensions")
    lengths = cast("tuple[Any, ...]", shape)
    if not all(type(n) is int and 0 <= n <= MOST_PICKLE_BYTES for n in lengths):
        raise InputError(f"an array must have lengths from 0 to {MOST_PICKLE_BYTES}")
    return math.prod(lengths)


def _filled(data: Any, kind: Any, shape: Any, order: Any) -> NDArray[Any]:
    if kind.plain.kind == "O" or _count(shape) * kind.plain.itemsize != len(data):
        raise InputError(f"an array has {len(data)} bytes, which do not fit its shape")
    return np.frombuffer(data, kind.plain).reshape(shape, order=order)


def _scalar(kind: Any, data: Any) -> Any:
    return _filled(data, kind, (), "C").item()


def _encoded(text: Any, coding: Any) -> bytes:
    """Return bytes, for which pickles of protocols 0 to 2 have text."""
    if type(text) is not str or coding != "latin1":
        raise InputError("bytes must be written as text in latin1")
    return text.encode("latin1")


ALLOWED: Mapping[str, Callable[..., Any]] = {
    "numpy.ndarray": _Held, "numpy.dtype": _Kind, "_codecs.encode": _encoded
} | {
    f"{core}.{name}": made for core in ("numpy.core", "numpy._core") for name, made in (
        ("multiarray._reconstruct", _Held), ("multiarray.scalar", _scalar),
        ("numeric._frombuffer", _filled),
    )
}  # fmt: skip
"""What makes plain values in place of the functions that NumPy 1 and 2 name in pickles. NumPy's own
would trust the state that a file gives them."""


class _Named:
    """A function that a pickle names; only `_Stack.call` calls it."""

    __slots__ = ("make",)

    def __init__(self, name: str) -> None:
        if name not in ALLOWED:
            raise InputError(
                f"the file names {shown(name)}, which is not looked up; save plain dictionaries of "
                "arrays, numbers and text"
            )
        self.make = ALLOWED[name]


class _Stack:
    """Values that the steps of a pickle have made and not yet used."""

    def __init__(self) -> None:
        self.values: list[Any] = []
        self.below: list[list[Any]] = []  # what was there at each mark
        self.kept: dict[int, Any] = {}

    def mark(self) -> None:
        self.below.append(self.values)
        self.values = []

    def since_mark(self) -> list[Any]:
        found, self.values = self.values, self.below.pop()
        return found

    def last(self, count: int) -> list[Any]:
        return [self.values.pop() for _ in range(count)][::-1]

    def push(self, value: Any) -> None:
        self.values.append(value)

    def keep(self, place: int) -> None:
        if not 0 <= place <= MOST_STEPS:  # others could share their hashes
            raise InputError(f"the pickle keeps a value in place {shown(place)}; save it again")
        self.kept[place] = self.values[-1]
        if type(self.values[-1]) is _Held:
            self.values[-1].kept.append(place)

    def get(self, place: int) -> None:
        self.push(self.kept[place])

    def extend(self, items: list[Any]) -> None:
        """Extend a list, or a dictionary by names and values in turn."""
        found: Any = self.values[-1]
        if type(found) is list:
            cast("list[Any]", found).extend(items)
        elif type(found) is dict and all(type(name) is str for name in items[::2]):
            cast("dict[str, Any]", found).update(zip(items[::2], items[1::2], strict=True))
        else:  # other keys than text could take any time to be looked up
            raise InputError("expected lists, and dictionaries whose keys are text")

    def fill(self, items: list[Any], found: list[Any] | dict[str, Any]) -> None:
        self.push(found)
        self.extend(items)

    def call(self) -> None:
        named, given = self.last(2)
        if type(named) is not _Named or type(given) is not tuple:
            raise InputError("the file calls something that is no function")
        self.push(named.make(*cast("tuple[Any, ...]", given)))

    def build(self) -> None:
        """Give an array its numbers, or a type its order of bytes."""
        held, state = self.last(2)
        if type(held) not in (_Held, _Kind):
            raise InputError("the file sets the state of something that is no array")
        self.push(held.built(state))
        for place in getattr(held, "kept", ()):
            self.kept[place] = self.values[-1]


GIVEN = (
    "INT", "BININT", "BININT1", "BININT2", "LONG", "LONG1", "LONG4", "FLOAT", "BINFLOAT",
    "UNICODE", "SHORT_BINUNICODE", "BINUNICODE", "BINUNICODE8", "BINBYTES", "SHORT_BINBYTES",
    "BINBYTES8", "BYTEARRAY8",
)  # fmt: skip
"""Names in Python's `pickletools` of the steps that hold a number, text or bytes."""
STEPS: Mapping[str, Callable[[_Stack, Any], object]] = {
    **dict.fromkeys(GIVEN, _Stack.push),
    "PROTO": lambda _stack, _: None,
    "FRAME": lambda _stack, _: None,
    "STOP": lambda _stack, _: None,
    "MARK": lambda stack, _: stack.mark(),
    "NONE": lambda stack, _: stack.push(None),
    "NEWTRUE": lambda stack, _: stack.push(True),
    "NEWFALSE": lambda stack, _: stack.push(False),
    "EMPTY_TUPLE": lambda stack, _: stack.push(()),
    "EMPTY_LIST": lambda stack, _: stack.push([]),
    "EMPTY_DICT": lambda stack, _: stack.push({}),
    "TUPLE": lambda stack, _: stack.push(tuple(stack.since_mark())),
    "TUPLE1": lambda stack, _: stack.push(tuple(stack.last(1))),
    "TUPLE2": lambda stack, _: stack.push(tuple(stack.last(2))),
    "TUPLE3": lambda stack, _: stack.push(tuple(stack.last(3))),
    "LIST": lambda stack, _: stack.fill(stack.since_mark(), []),
    "DICT": lambda stack, _: stack.fill(stack.since_mark(), {}),
    "APPEND": lambda stack, _: stack.extend(stack.last(1)),
    "APPENDS": lambda stack, _: stack.extend(stack.since_mark()),
    "SETITEM": lambda stack, _: stack.extend(stack.last(2)),
    "SETITEMS": lambda stack, _: stack.extend(stack.since_mark()),
    "PUT": _Stack.keep, "BINPUT": _Stack.keep, "LONG_BINPUT": _Stack.keep,
    "MEMOIZE": lambda stack, _: stack.keep(len(stack.kept)),
    "GET": _Stack.get, "BINGET": _Stack.get, "LONG_BINGET": _Stack.get,
    "GLOBAL": lambda stack, name: stack.push(_Named(name.replace(" ", "."))),
    "STACK_GLOBAL": lambda stack, _: stack.push(_Named(".".join(stack.last(2)))),
    "REDUCE": lambda stack, _: stack.call(),
    "BUILD": lambda stack, _: stack.build(),
}  # fmt: skip
"""What each step does, by name; there are no others."""


def unpickled(data: bytes) -> Any:
    """Return the value that `numpy.save` has pickled, or a list of several.

    Arrays of objects are lists. Any part of the value may be of any kind, be nested to any depth,
    or contain itself.

    Args:
        data: The bytes of a `.npy` file.

    Raises:
        InputError: The file is no such file, names a function, or would take too much memory.
    """
    stream = io.BytesIO(data)
    try:
        read = {
            (1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0
        }[np.lib.format.read_magic(stream)]  # fmt: skip
        shape, _, dtype = read(stream)
        if dtype.kind != "O":
            raise InputError(f"expected a dictionary, got an array of numbers of shape {shape}")
        values = _loaded(stream)
        if not isinstance(values, list):
            raise InputError("expected an array of objects")
        return cast("list[Any]", values)[0] if shape == () else cast("list[Any]", values)
    except InputError:
        raise
    except Exception as error:  # a damaged file can make each step raise anything
        raise InputError(
            "expected a .npy file in which numpy.save has pickled a plain dictionary "
            f"({shown(str(error))})"
        ) from error


def _loaded(stream: io.BytesIO) -> Any:
    """Carry out the steps of a pickle; each has been seen to be complete when it comes."""
    stack = _Stack()
    for place, (step, argument, _) in enumerate(pickletools.genops(stream)):
        if place >= MOST_STEPS:
            raise InputError(f"the pickle has more than {MOST_STEPS} steps; save fewer records")
        if step.name not in STEPS:
            raise InputError(f"the pickle has the step {step.name}; save plain dictionaries")
        STEPS[step.name](stack, argument)
    return stack.values[-1]
