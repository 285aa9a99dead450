"""What users hand in by mistake, by kind of argument: a label for each, and the value."""

import numpy as np

import grasp_core as gc

NOT_NUMBERS = {
    "none": None,
    "text": "a",
    "not a number": float("nan"),
    "infinite": float("inf"),
    "minus infinite": float("-inf"),
    "true": True,
    "complex": 1j,
    "list": [0.5],
    "array": np.zeros(2),
    "object": object(),
    "huge": 1e300,
}
POSITIVE = NOT_NUMBERS | {"zero": 0.0, "negative": -1.0, "tiny": 1e-300}
NOT_NEGATIVE = NOT_NUMBERS | {"negative": -1.0}
FRICTION = NOT_NUMBERS | {"zero": 0.0, "negative": -0.5, "a billion": 1e9}
COUNT = NOT_NUMBERS | {"fraction": 2.5, "negative": -1, "huge": 10**30}
AT_LEAST_ONE = COUNT | {"zero": 0}
SEED = NOT_NUMBERS | {"fraction": 0.5, "negative": -1, "huge": 2**64}
WORD = {"none": None, "number": 3, "unknown": "nonsense", "empty": "", "list": ["a"]}
SWITCH = {"none": None, "number": 3, "text": "yes", "not a number": float("nan"), "list": []}
PATH = {"none": None, "number": 3, "empty": "", "zero byte": "a\0b", "bytes": b"a"}
VALUE = {"none": None, "text": "a", "number": 3, "object": object(), "class": int}
TEXT = {"none": None, "number": 3, "bytes": b"a", "list": ["a"]}
SEVERAL = {"none": None, "text": "abcd", "number": 3, "of objects": [object()] * 4}
FACE_INDICES = SEVERAL | {
    "three": (0, 1, 2), "beyond": (0, 1, 2, 9), "negative": (-1, 1, 2, 3),
    "fraction": (0.5, 1, 2, 3), "bools": (True, 1, 2, 3), "huge": (0, 1, 2, 10**30),
}  # fmt: skip


def unless(kinds, *labels):
    """Without the labels that an argument takes."""
    return {label: value for label, value in kinds.items() if label not in labels}


def optional(kinds):
    """Of an argument that may be None."""
    return unless(kinds, "none")


def each_of(kinds, *more):
    """Of an argument that is one number for all or one each: lists and arrays are other cases."""
    kept = unless(kinds, "list", "array", *more)
    return kept | {
        "other length": [0.5] * 7,
        "table": [[0.5, 0.5]],
        "ragged": [[0.5], [0.5, 0.5]],
        "one is text": ["a", "b", "c", "d"],
        "of bools": np.ones(4, dtype=bool),
        "of complex": np.ones(4, dtype=complex),
        "of objects": np.array([object()] * 4),
    }


def array(good):
    """Of an argument that is an array like this one."""
    good = np.array(good, dtype=float)
    one = np.zeros(good.shape)
    one.flat[0] = 1.0
    return {
        "none": None,
        "text": "a",
        "number": 1.0,
        "object": object(),
        "not a number": np.where(one, np.nan, good),
        "infinite": np.where(one, np.inf, good),
        "huge": np.where(one, 1e300, good),
        "other shape": np.zeros((7, 7, 7, 7)),
        "other length": np.zeros((*good.shape[:-1], 11)),
        "ragged": [[1.0], [1.0, 2.0]],
        "empty": [],
        "of text": np.full(good.shape, "a"),
        "of digits": good.astype(str),
        "of bools": good.astype(bool),
        "of complex": good.astype(complex),
        "of objects": good.astype(object),
    }


def units(good):
    """Of an argument that is unit vectors like these."""
    good = np.array(good, dtype=float)
    return array(good) | {"zero vectors": 0.0 * good, "long vectors": 2.0 * good}


def spread(good):
    """Of an argument that is points like these, which must not be too close to tell apart."""
    return array(good) | {"tiny": 1e-300 * np.array(good)}


MOTORS = optional(VALUE) | {"of three contacts": gc.Motors.of(np.eye(2, 9), 1.0)}
USUAL = (
    dict.fromkeys(("body", "grasp", "hand", "reach", "scene", "record", "grip", "plan"), VALUE)
    | dict.fromkeys(("setup", "physics", "patches", "agenda", "view"), optional(VALUE))
    | dict.fromkeys(("solver", "norm", "cones", "objective", "measure", "rank_by"), WORD)
    | dict.fromkeys(("jobs", "threads", "max_face_parts"), AT_LEAST_ONE)
    | dict.fromkeys(("mass_kg", "torque_scale", "max_normal_force", "max_normal_force_n"), POSITIVE)
    | dict.fromkeys(("largest_part", "enough"), SWITCH)
    | dict.fromkeys(("name", "object_path"), TEXT)
    | {
        "friction": FRICTION,
        "torsion_m": each_of(NOT_NUMBERS, "tiny") | {"negative": -0.01, "ten million km": 1e10},
        "motors": MOTORS,
        "down": optional(array([0.0, 0.0, -1.0])) | {"zero": [0.0, 0.0, 0.0]},
        "push_n": POSITIVE,
        "path": PATH,
        "seed": SEED,
        "flatness_m": optional(NOT_NEGATIVE),
        "progress": {"number": 3, "text": "a"},
    }
)
"""What is refused of an argument of this name, where a call says nothing else."""
