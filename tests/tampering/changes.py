"""Ways to tamper with a certificate: every field of it, and of what it is made of, in turn.

A field is named by its place, as `pieces[].normal` or `cover.forces`; of a tuple's members one is
drawn. New fields of any dataclass are found by themselves.
"""

import copy
import dataclasses

import numpy as np

from grasp_core.declared import Declared

WORDS = ("l1", "linf", "point", "disc", "cone", "certified", "")
NONSENSE = (None, "a", float("nan"), np.zeros((0, 3)), (), np.array([[None]]))


def forged(value, **fields):
    """A copy with other fields that no constructor has seen, and with all that it has kept."""
    made = copy.copy(value)
    for name, field in fields.items():
        object.__setattr__(made, name, field)
    return made


def places(value, name=""):
    """Names of all fields in a value, with their nearest dataclass, without repeats."""
    if dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            if not field.init:
                continue  # kept beside the fields, and no part of what is claimed
            inner = f"{name}.{field.name}" if name else field.name
            yield from dict.fromkeys(places(getattr(value, field.name), inner))
        return
    yield name
    if isinstance(value, tuple):
        for member in value:
            if dataclasses.is_dataclass(member) or isinstance(member, tuple | np.ndarray):
                yield from places(member, f"{name}[]")


def get(value, place, rng):
    """The value at a place; None where this certificate has none."""
    for step in steps(place):
        value = pick(value, rng) if step == "[]" else getattr(value, step, None)
    return value


def tampered(value, place, change, rng):
    """A value with `change` applied at a place, past constructors or not."""
    return _at(value, list(steps(place)), change, rng)


def steps(place):
    return place.replace("[]", ".[]").split(".")


def pick(value, rng):
    fit = [x for x in value if not isinstance(x, int)] if isinstance(value, tuple) else []
    return fit[rng.integers(len(fit))] if fit else None


def _at(value, path, change, rng):
    if not path:
        return change(value)
    step, *rest = path
    if step == "[]":
        fit = [i for i, x in enumerate(value) if not isinstance(x, int)]
        if not fit:
            raise LookupError(step)
        i = fit[rng.integers(len(fit))]
        return (*value[:i], _at(value[i], rest, change, rng), *value[i + 1 :])
    if not dataclasses.is_dataclass(value) or not hasattr(value, step):
        raise LookupError(step)
    make = forged if isinstance(value, Declared) and rng.integers(2) else dataclasses.replace
    return make(value, **{step: _at(getattr(value, step), rest, change, rng)})


def change_of(value, other, rng):
    """A random change of a value; `other` is what another certificate has in its place."""
    kind = rng.integers(10)
    if kind == 0:
        return NONSENSE[rng.integers(len(NONSENSE))]
    if kind == 1 or value is None or _is_empty(value):
        return other
    for kinds, way in WAYS:
        if isinstance(value, kinds):
            return way(value, rng)
    return other


def _is_empty(value):
    return len(value) == 0 if isinstance(value, tuple) else getattr(value, "size", 1) == 0


def _of_number(value, rng):
    size = 10.0 ** rng.integers(-7, 3)
    return [
        lambda: value * (1.0 + size), lambda: value * (1.0 - size), lambda: -value,
        lambda: value + size, lambda: value - size, lambda: 0.0, lambda: np.inf, lambda: -np.inf,
        lambda: value * 0.5, lambda: value * 100.0, lambda: value + 1, lambda: 1e300,
    ][rng.integers(12)]()  # fmt: skip


def _of_tuple(value, rng):
    order = rng.permutation(len(value))
    i = rng.integers(len(value))
    return [
        lambda: tuple(value[j] for j in order), lambda: value[1:], lambda: (*value, value[0]),
        lambda: (*value[:i], value[rng.integers(len(value))], *value[i + 1 :]), lambda: value[::-1],
        lambda: list(value),
    ][rng.integers(6)]()  # fmt: skip


def _of_array(value, rng):
    size = 10.0 ** rng.integers(-7, 3)
    array = np.array(value, dtype=value.dtype if value.dtype.kind == "f" else float)
    scale = float(np.abs(array).max()) or 1.0
    at = tuple(rng.integers(n) for n in array.shape)
    row = at[0] if at else ()
    some = rng.normal(size=array.shape)

    def entry(new):
        array[at] = new
        return array

    def along(new):
        array[row] = new
        return array

    ways = [
        lambda: array * (1.0 + size), lambda: array * (1.0 - size), lambda: -array,
        lambda: array + size * scale, lambda: array + size * scale * some,
        lambda: entry(array[at] + size * scale), lambda: entry(-array[at]), lambda: entry(0.0),
        lambda: entry(np.nan), lambda: entry(np.inf), lambda: entry(1e300),
        lambda: along(array[row] * (1.0 + size)), lambda: along(-array[row]),
        lambda: along(array[row] + size * scale), lambda: along(0.0),
        lambda: rng.permutation(array) if array.ndim else array * 2.0,
        lambda: np.roll(array, 1, axis=-1) if array.ndim else array - 1.0,
        lambda: array[1:] if array.ndim else array[None], lambda: array.ravel(),
        lambda: np.concatenate([array, array[:1]]) if array.ndim else array[None],
        lambda: array.T, lambda: array[None], lambda: np.zeros_like(array), lambda: 1.05 * array,
        lambda: 100.0 * array, lambda: np.abs(array),
    ]  # fmt: skip
    changed = ways[rng.integers(len(ways))]()
    return changed.astype(value.dtype) if _whole(changed, value) else changed


WAYS = (
    (bool, lambda value, _: not value),
    (np.ndarray, _of_array),
    ((int, float), _of_number),
    (tuple, _of_tuple),
    (str, lambda _, rng: rng.choice(WORDS).item()),
)


def _whole(changed, value):
    return value.dtype.kind in "iu" and np.isfinite(changed).all() and (abs(changed) < 1e9).all()
