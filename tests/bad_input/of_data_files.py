"""Group 7: settings and data that are no such files, of another kind, or of the future."""

import json
from dataclasses import replace

from tests.bad_input.cases import Case, refused
from tests.bad_input.good_files import changed, good

DEEP = "[" * 100_000
TEXTS = {
    "no JSON": ("{", "JSON"),
    "a list": ("[]", ""),
    "an empty object": ("{}", ""),
    "10^5 deep": (DEEP, "deep"),
    "another kind of file": ("OTHER", ""),
    "a key twice": ("TWICE", "twice"),
}
READERS = {
    "grasps.json": "validate", "contacts.json": "analyze", "a.baseline.json": "baseline check",
    "verdicts.json": "replay", "task.json": "validate good.json --wrenches FILE",
}  # fmt: skip
TOMLS = {
    "flags.toml": "plan box --config FILE",
    "setup.toml": "validate good.json --setup FILE",
    "physics.toml": "execute good.json --setup FILE",
    "dataset.toml": "dataset build FILE --out made",
}
TOML_TEXTS = {
    "no TOML": ("a = = 1", ""),
    "a key twice": ("friction = 1\nfriction = 2\n", ""),
    "10^5 deep": ("a = " + DEEP, ""),
    "a key that is none": ("colour = 'red'\n", "colour"),
    "a table that is none": ("[colour]\nred = 1\n", "colour"),
    "a date": ("friction = 1979-05-27\n", "friction: "),
}
VALUES_OF_FLAGS = {"friction", "colour"}
"""What is wrong with a flag is refused as if it stood on the command line."""
GRASPS, BASELINE = good("grasps.json"), good("a.baseline.json")
SPOILT = {
    "grasps.json": {
        "of the future": changed(GRASPS, "schema", 99) + "|newer",
        "of schema 0": changed(GRASPS, "schema", 0) + "|schema",
        "with an id of a path": changed(GRASPS, "grasps.0.id", "../../x") + "|id",
        "with an id of codes": changed(GRASPS, "grasps.0.id", "\x1b[2J") + "|id",
        "with a long id": changed(GRASPS, "grasps.0.id", "x" * 10**5) + "|id",
        "with a grasp twice": json.dumps(
            (lambda d: {**d, "grasps": d["grasps"] * 2})(json.loads(GRASPS))
        ) + "|same id",
    },
    "a.baseline.json": {
        "of the future": changed(BASELINE, "schema", 99) + "|newer",
        "with no grasps": changed(BASELINE, "grasps") + "|grasps",
        "with a path that climbs": changed(BASELINE, "grasps", "../../etc/passwd") + "|grasps",
    },
    "contacts.json": {
        "one contact": '{"contacts": [{"position_m": [0,0,0], "normal": [0,0,1]}]}|contacts',
        "a normal of no length":
            '{"friction": 0.5, "contacts": [{"position_m": [0,0,0], "normal": [0,0,0]},'
            ' {"position_m": [0,0,1], "normal": [0,0,1]}]}|normal',
        "friction -1":
            '{"friction": -1, "contacts": [{"position_m": [0,0,0], "normal": [0,0,1]},'
            ' {"position_m": [0,0,1], "normal": [0,0,-1]}]}|friction',
        "no friction":
            '{"contacts": [{"position_m": [0,0,0], "normal": [0,0,1]},'
            ' {"position_m": [0,0,1], "normal": [0,0,-1]}]}|friction',
        "a scale of 0":
            '{"friction": 0.5, "torque_scale_m": 0, "contacts": [{"position_m": [0,0,0],'
            ' "normal": [0,0,1]}, {"position_m": [0,0,1], "normal": [0,0,-1]}]}|torque_scale_m',
    },
}  # fmt: skip


def _text(said: str, file: str) -> str | bytes:
    """What a name stands for, of a file."""
    whole = file if file in {"a.baseline.json", "verdicts.json"} else "grasps.json"
    if said == "OTHER":
        return good("regions.json")
    if said == "TWICE":
        return '{"schema": 1, ' + good(whole).decode().lstrip()[1:]
    return said


def _of_text(file: str, command: str, name: str, text: str | bytes, says: str) -> Case:
    case = refused(f"{file}: {name}", file, text, says, command)
    of_flag = says in VALUES_OF_FLAGS and file == "flags.toml"
    return replace(case, says=says, code=2) if of_flag else case


CASES = [
    _of_text(file, command, name, _text(text, file), says)
    for file, command in READERS.items()
    for name, (text, says) in TEXTS.items()
]
CASES += [
    _of_text(file, command, name, text, says)
    for file, command in TOMLS.items()
    for name, (text, says) in TOML_TEXTS.items()
]
CASES += [
    refused(f"{file} {name}", file, *both.rsplit("|", 1), READERS[file])
    for file, table in SPOILT.items()
    for name, both in table.items()
]
