"""Group 7: settings and data that are no such files, of another kind, or of the future."""

import json
from functools import partial
from pathlib import Path

from tests.bad_input.cases import Case, file_case
from tests.bad_input.good_files import good, with_value, without

GROUP = "data files"
DEEP = "[" * 100_000
TEXTS = {
    "no JSON": ("{", "JSON"),
    "a list": ("[]", ""),
    "a number": ("5", ""),
    "null": ("null", ""),
    "an empty object": ("{}", ""),
    "10^5 deep": (DEEP, "deep"),
    "10^5 deep and closed": (DEEP + "]" * 100_000, "deep"),
    "a number of 5000 digits": ('{"schema": ' + "9" * 5000 + "}", ""),
    "a cut document": ("CUT", ""),
    "another kind of file": ("OTHER", ""),
    "a lone surrogate": ('{"schema": "\\ud800"}', ""),
    "a key twice": ("TWICE", "twice"),
}
READERS = {
    "grasps.json": "validate", "contacts.json": "analyze", "a.baseline.json": "baseline check",
    "verdicts.json": "replay", "task.json": "validate {grasps} --wrenches FILE",
}  # fmt: skip
TOMLS = {
    "flags.toml": "plan box --config FILE",
    "setup.toml": "validate {grasps} --setup FILE",
    "dataset.toml": "dataset build FILE --out made",
}
TOML_TEXTS = {
    "no TOML": ("a = = 1", ""),
    "a key twice": ("friction = 1\nfriction = 2\n", ""),
    "10^5 deep": ("a = " + DEEP, ""),
    "a key that is none": ("colour = 'red'\n", "colour"),
    "a table that is none": ("[colour]\nred = 1\n", "colour"),
    "a date": ("friction = 1979-05-27\n", "friction"),
    "a control code": ("friction = '\\u001b[2J'\n", "friction"),
}
SPOILT = {
    "grasps.json": {
        "of the future": with_value(good("grasps.json"), "schema", 99) + "|newer",
        "of schema 0": with_value(good("grasps.json"), "schema", 0) + "|schema",
        "with nan": with_value(good("grasps.json"), "friction", "raw:NaN") + "|friction",
        "with 1e999": with_value(good("grasps.json"), "friction", "raw:1e999") + "|friction",
        "without friction": without(good("grasps.json"), "friction") + "|friction",
        "without a mesh": without(good("grasps.json"), "object.mesh") + "|mesh",
        "with more": with_value(good("grasps.json"), "colour", 1) + "|colour",
        "with an id of a path": with_value(good("grasps.json"), "grasps.0.id", "../../x") + "|id",
        "with an id of codes": with_value(good("grasps.json"), "grasps.0.id", "\x1b[2J") + "|id",
        "with an id of nothing": with_value(good("grasps.json"), "grasps.0.id", "") + "|id",
        "with an id of 10^5 letters": with_value(good("grasps.json"), "grasps.0.id", "x" * 10**5) + "|id",
        "with null contacts": with_value(good("grasps.json"), "grasps.0.contacts", None) + "|contacts",
        "with a grasp twice": json.dumps(
            (lambda d: {**d, "grasps": d["grasps"] * 2})(json.loads(good("grasps.json")))
        ) + "|same id",
    },
    "a.baseline.json": {
        "of the future": with_value(good("a.baseline.json"), "schema", 99) + "|newer",
        "with no grasps": without(good("a.baseline.json"), "grasps") + "|grasps",
        "with a path that climbs": with_value(good("a.baseline.json"), "grasps_file", "../../etc/passwd")
        + "|",
    },
    "contacts.json": {
        "null": '{"contacts": null}|contacts',
        "one contact": '{"contacts": [{"position_m": [0,0,0], "normal": [0,0,1]}]}|contacts',
        "no normal": '{"contacts": [{"position_m": [0,0,0]}, {"position_m": [0,0,1]}]}|normal',
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
        "a million contacts":
            '{"friction": 0.5, "contacts": ['
            + ",".join(['{"position_m": [0,0,0], "normal": [0,0,1]}'] * 100_000) + "]}|contacts",
    },
}  # fmt: skip


def _text(said: str, file: str) -> str | bytes:
    """What a name stands for, of a file."""
    whole = (
        "a.baseline.json"
        if "baseline" in file
        else "verdicts.json"
        if "verd" in file
        else "grasps.json"
    )
    if said == "CUT":
        return good(whole)[:-50]
    if said == "OTHER":
        return good("grasps.json" if whole != "grasps.json" else "verdicts.json")
    if said == "TWICE":
        return '{"schema": 1, ' + good(whole).decode().lstrip()[1:]
    return said


def _make(file: str, command: str, text: str | bytes, folder: Path) -> list[str]:
    (folder / file).write_bytes(text if isinstance(text, bytes) else text.encode())
    words = command.split()
    if "{grasps}" in words:
        (folder / "good.json").write_bytes(good("grasps.json"))
        words[words.index("{grasps}")] = "good.json"
    return [
        file if word == "FILE" else word
        for word in (words if "FILE" in words else [*words, "FILE"])
    ]


def cases() -> list[Case]:
    """All of the group."""
    found = [
        Case(
            GROUP,
            f"{file}: {name}",
            partial(_make, file, command, _text(text, file)),
            4,
            (file, *filter(None, [says])),
        )
        for file, command in READERS.items()
        for name, (text, says) in TEXTS.items()
    ]
    found += [
        Case(
            GROUP,
            f"{file}: {name}",
            partial(_make, file, command, text),
            2 if file == "flags.toml" else 4,
            tuple(filter(None, [says])) if file == "flags.toml" else (file, *filter(None, [says])),
        )
        for file, command in TOMLS.items()
        for name, (text, says) in TOML_TEXTS.items()
    ]
    for file, table in SPOILT.items():
        for name, both in table.items():
            text, _, says = both.rpartition("|")
            found.append(
                file_case(GROUP, f"{file} {name}", file, text, says, command=READERS[file])
            )
    return found
