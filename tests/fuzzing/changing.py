"""An input -> another one, changed in the way of its kind."""

import random

from tests.fuzzing.mesh_mutations import glb_changed, words_changed
from tests.fuzzing.mutations import Mutate, json_changed, npz_changed, toml_changed

BY_KIND = 0.85
"""How often a change is one of values, not of bytes."""
MOST_BYTES = 2**18
"""Longer inputs are left to the tests of limits."""
BY_TEXT = {
    "json": json_changed, "toml": toml_changed, "words": words_changed, "glb": glb_changed,
}  # fmt: skip


def changed(written: str, data: bytes, rng: random.Random, mutate: Mutate) -> bytes:
    """An input changed in the way of its kind, or bytewise where it is not of that kind."""
    made: bytes | None = None
    if rng.random() < BY_KIND:
        if written in BY_TEXT:
            made = BY_TEXT[written](data, rng)
        elif written == "npz":
            made = npz_changed(data, rng, mutate)
    return mutate(data, MOST_BYTES) if made is None or len(made) > MOST_BYTES else made
