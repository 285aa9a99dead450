"""Reads the plain values of a pickled dictionary without unpickling it: nothing is executed.

Arrays that hold Python objects are pickles inside `.npy` files, and `numpy.load` would run what
they say. Here the opcodes of the pickle are read as data (`pickletools` only splits them), and only
those that make plain values count: numbers, text, lists, tuples, dictionaries, and NumPy's arrays
and scalars of plain numbers. The names of functions in the file are compared with those that NumPy
writes, never looked up. Anything else is refused.
"""

import math
import pickletools
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from grasp_core.errors import InputError
from grasp_core.files.strict_json import shown

MOST_OPCODES = 2_000_000
"""Largest number of opcodes: a record has some sixty, and a list of ten thousand grasps fewer."""
MODULES = ("numpy.core.multiarray", "numpy._core.multiarray", "numpy._core.numeric")
"""Modules of NumPy 1 and 2 whose functions make arrays and scalars."""
KINDS = "fiub"
"""Kinds of numbers in arrays: real, whole, truth values."""
CODECS = ("_codecs", "encode")


@dataclass(slots=True)
class _Named:
    """The name of a function or class in the file."""

    module: str
    name: str


@dataclass(slots=True)
class _Type:
    """The type of an array's numbers."""

    code: str
    order: str = "="

    def plain(self) -> "np.dtype[Any]":
        """Return it if it is one of plain numbers."""
        try:
            found = np.dtype(self.code)
            found = found.newbyteorder(">") if self.order == ">" else found
        except (TypeError, ValueError) as error:
            raise InputError(f"an array has the type {shown(self.code)}, not numbers") from error
        if found.kind not in KINDS:
            raise InputError(f"an array has the type {shown(self.code)}, expected numbers")
        return found


@dataclass(slots=True)
class _Made:
    """An array that is being made: its value comes with the opcode BUILD."""

    value: Any = None


class _End:
    """The end of a run of items on the stack."""


@dataclass(slots=True)
class _Reader:
    """A stack and a memory, as a pickle's opcodes use them."""

    stack: list[Any] = field(default_factory=list[Any])
    memory: dict[int, Any] = field(default_factory=dict[int, Any])

    def run(self, data: bytes) -> Any:
        """Carry out the opcodes up to STOP, and return the value at the top."""
        for number, (opcode, argument, _) in enumerate(pickletools.genops(data)):
            if number > MOST_OPCODES:
                raise InputError(f"the pickle has more than {MOST_OPCODES} opcodes; split the file")
            if opcode.name == "STOP":
                return self.stack.pop()
            if opcode.name in PUSHED:
                self.stack.append(argument)
            elif opcode.name in STEPS:
                STEPS[opcode.name](self, argument)
            elif opcode.name not in IGNORED:
                raise InputError(
                    f"the pickle has the opcode {opcode.name}, which plain values do not need; "
                    "save plain dictionaries of arrays, numbers and text"
                )
        raise InputError("the pickle has no end; write the file again")

    def items(self) -> list[Any]:
        """Take the items above the last mark."""
        place = len(self.stack) - 1  # looked for from the top, so that each item is met once
        while self.stack[place] is not _End:
            place -= 1
        found = self.stack[place + 1 :]
        del self.stack[place:]
        return found

    def last(self, count: int) -> list[Any]:
        """Take the last few items."""
        found = self.stack[-count:]
        del self.stack[-count:]
        return found


def pickled_value(data: bytes) -> Any:
    """Read the plain value of a pickle; nothing is executed.

    Raises:
        InputError: It is damaged, or holds anything but plain values.
    """
    try:
        return _Settling().value(_Reader().run(data))
    except InputError:
        raise
    except Exception as error:  # a damaged pickle can make each step raise anything
        raise InputError(
            f"the pickle cannot be read as plain values ({shown(str(error))}); save plain "
            "dictionaries of arrays, numbers and text"
        ) from error


@dataclass(slots=True)
class _Settling:
    """Replaces what was being made by its value, once for each holder, however often it is held."""

    done: dict[int, Any] = field(default_factory=dict[int, Any])
    """Values by the identity of their holders; None while a holder is looked into."""

    def value(self, found: Any, deep: int = 0) -> Any:
        """Return the plain value of what a pickle has made."""
        if isinstance(found, _Named | _Type) or found is _End:
            raise InputError("the file holds a function or a type; save plain dictionaries")
        if not isinstance(found, _Made | dict | list | tuple):
            return found
        if deep > MOST_DEEP:
            raise InputError(f"values are nested more than {MOST_DEEP} deep; save plainer ones")
        holder: Any = found  # pyright: ignore[reportUnknownVariableType]
        if id(holder) not in self.done:
            self.done[id(holder)] = None
            self.done[id(holder)] = self._inside(holder, deep + 1)
        settled = self.done[id(holder)]
        if settled is None:
            raise InputError("a value holds itself; save plain dictionaries of arrays")
        return settled

    def _inside(self, holder: Any, deep: int) -> Any:
        if isinstance(holder, _Made):
            return self.value(holder.value, deep)
        if not isinstance(holder, dict):
            return [self.value(each, deep) for each in holder]
        pairs: list[tuple[Any, Any]] = list(holder.items())  # pyright: ignore[reportUnknownArgumentType]
        if not all(isinstance(key, str) for key, _ in pairs):
            raise InputError("a dictionary has a key that is no text; save plain dictionaries")
        return {key: self.value(each, deep) for key, each in pairs}


MOST_DEEP = 20


def _named(reader: _Reader, argument: str) -> None:
    module, _, name = argument.partition(" ")
    reader.stack.append(_Named(module, name))


def _named_by_stack(reader: _Reader, _: Any) -> None:
    module, name = reader.last(2)
    reader.stack.append(_Named(str(module), str(name)))


def _called(reader: _Reader, _: Any) -> None:
    """Make what NumPy's own functions would make of plain arguments, and refuse all others."""
    called, given = reader.last(2)
    made = {"_reconstruct": _begun, "scalar": _scalar, "_frombuffer": _buffer}
    if not isinstance(called, _Named):
        raise InputError("the pickle calls what is no function; save plain dictionaries of arrays")
    if (called.module, called.name) == CODECS and given[1] == "latin1":
        reader.stack.append(given[0].encode("latin1"))
    elif called.name == "bytes" and not given:  # how the second protocol writes none
        reader.stack.append(b"")
    elif (called.module, called.name) == ("numpy", "dtype"):
        reader.stack.append(_Type(str(given[0])))
    elif called.module in MODULES and called.name in made:
        reader.stack.append(made[called.name](*given))
    else:
        raise InputError(
            f"the pickle calls {shown(f'{called.module}.{called.name}')}, which is not executed; "
            "save plain dictionaries of arrays, numbers and text"
        )


def _begun(kind: Any, *_: Any) -> _Made:
    if not isinstance(kind, _Named) or (kind.module, kind.name) != ("numpy", "ndarray"):
        raise InputError("the pickle holds an array of a class of its own; save plain arrays")
    return _Made()


def _scalar(kind: _Type, data: bytes) -> Any:
    found = np.frombuffer(data, kind.plain())
    return found[0].item()


def _buffer(data: Any, kind: _Type, shape: tuple[int, ...], order: str) -> Any:
    return _array(bytes(data), kind, shape, order == "F")


def _built(reader: _Reader, _: Any) -> None:
    """Fill in the byte order of a type, or the numbers of an array."""
    state = reader.stack.pop()
    target = reader.stack[-1]
    if isinstance(target, _Type):
        target.order = str(state[1])
        return
    if not isinstance(target, _Made):
        raise InputError("the pickle sets the state of an object; save plain dictionaries")
    _, shape, kind, by_columns, data = state
    if kind.code in {"O", "O8"}:
        if by_columns or math.prod(shape) != len(data):
            raise InputError("an array of objects has not as many as its shape says")
        target.value = data[0] if not shape else list(data)
        return
    target.value = _array(data, kind, shape, by_columns)


def _array(data: Any, kind: _Type, shape: tuple[int, ...], by_columns: bool) -> Any:
    if not isinstance(data, bytes):
        raise InputError("an array has no bytes; save it again")
    plain = kind.plain()
    if min(shape, default=0) < 0 or math.prod(shape) * plain.itemsize != len(data):
        raise InputError(f"an array has {len(data)} bytes, which do not fit the shape {shape}")
    found = np.frombuffer(data, plain)
    return found.reshape(shape, order="F" if by_columns else "C").astype(np.float64)


def _kept(reader: _Reader, place: Any) -> None:
    reader.memory[len(reader.memory) if place is None else int(place)] = reader.stack[-1]


def _set_items(reader: _Reader, items: list[Any]) -> None:
    reader.stack[-1].update(zip(items[::2], items[1::2], strict=True))


def _tuple(count: int) -> Callable[[_Reader, Any], None]:
    return lambda reader, _: reader.stack.append(tuple(reader.last(count)))


PUSHED = {
    "INT", "BININT", "BININT1", "BININT2", "LONG", "LONG1", "FLOAT", "BINFLOAT", "SHORT_BINBYTES",
    "BINBYTES", "BINBYTES8", "BYTEARRAY8", "BINUNICODE", "SHORT_BINUNICODE", "BINUNICODE8",
    "UNICODE",
}  # fmt: skip
"""Opcodes whose argument is the value."""
IGNORED = {"PROTO", "FRAME"}
STEPS: dict[str, Callable[[_Reader, Any], None]] = {
    "NONE": lambda reader, _: reader.stack.append(None),
    "NEWTRUE": lambda reader, _: reader.stack.append(True),
    "NEWFALSE": lambda reader, _: reader.stack.append(False),
    "EMPTY_TUPLE": lambda reader, _: reader.stack.append(()),
    "EMPTY_LIST": lambda reader, _: reader.stack.append([]),
    "EMPTY_DICT": lambda reader, _: reader.stack.append({}),
    "MARK": lambda reader, _: reader.stack.append(_End),
    "TUPLE": lambda reader, _: reader.stack.append(tuple(reader.items())),
    "TUPLE1": _tuple(1),
    "TUPLE2": _tuple(2),
    "TUPLE3": _tuple(3),
    "LIST": lambda reader, _: reader.stack.append(reader.items()),
    "APPEND": lambda reader, _: reader.stack[-2].append(reader.stack.pop()),
    "APPENDS": lambda reader, _: (lambda items: reader.stack[-1].extend(items))(reader.items()),
    "SETITEM": lambda reader, _: _set_items(reader, reader.last(2)),
    "SETITEMS": lambda reader, _: _set_items(reader, reader.items()),
    "PUT": _kept,
    "BINPUT": _kept,
    "LONG_BINPUT": _kept,
    "MEMOIZE": _kept,
    "GET": lambda reader, place: reader.stack.append(reader.memory[int(place)]),
    "BINGET": lambda reader, place: reader.stack.append(reader.memory[place]),
    "LONG_BINGET": lambda reader, place: reader.stack.append(reader.memory[place]),
    "GLOBAL": _named,
    "STACK_GLOBAL": _named_by_stack,
    "REDUCE": _called,
    "BUILD": _built,
}
