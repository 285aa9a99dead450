"""Group 1: what a name of a file may lead to, whatever is in the file."""

import io
import os
import zipfile
from pathlib import Path

from tests.bad_input.cases import Case, refused
from tests.bad_input.mesh_texts import obj, off, ply, stl_text

READERS = {
    "inspect": ("part.obj", "inspect FILE"),
    "plan": ("part.stl", "plan FILE"),
    "validate": ("grasps.json", "validate FILE"),
    "scene": ("grasps.json", "scene FILE"),
    "export": ("grasps.json", "export FILE --to gltf --out made.glb"),
    "analyze": ("contacts.json", "analyze FILE"),
    "wrenches": ("task.json", "validate good.json --wrenches FILE"),
    "setup": ("setup.toml", "validate good.json --setup FILE"),
    "config": ("flags.toml", "plan box --config FILE"),
    "replay": ("grasps.json", "replay FILE --out made"),
    "baseline": ("baseline.json", "baseline check FILE"),
    "dataset": ("dataset.toml", "dataset build FILE --out made"),
    "import": ("contacts.json", "dataset import FILE tetrahedron --frictions 0.5 --out made"),
}
"""Commands by what they read, each with a file of the right ending."""


KINDS = {
    "that is not there": lambda _: None,
    "that is a folder": Path.mkdir,
    "that is a pipe": os.mkfifo,
    "that is an endless device": lambda path: path.symlink_to("/dev/zero"),
    "that links to itself": lambda path: path.symlink_to(path.name),
    "without a byte": lambda path: path.write_bytes(b""),
    "of all bytes": lambda path: path.write_bytes(bytes(range(256)) * 4),
    "in UTF-16": lambda path: path.write_text('{"a": 1}\n', encoding="utf-16"),
}


NAMES = {
    "with a line break": "two\nlines.obj",
    "with quotes": 'it\'s "here".obj',
    "that is markup": "<b>part.obj",
    "with an escape": "red\x1b[31m.obj",
    "of 255 bytes": "x" * 251 + ".obj",
    "not in UTF-8": os.fsdecode(b"caf\xe9.obj"),
    "that is a flag": "-v.obj",
    "with a bell": "a\x07.obj",
}
ENTITIES = '<?xml version="1.0"?><!DOCTYPE l [<!ENTITY a "ha"><!ENTITY b "&a;&a;">]><l>&b;</l>'
OUTSIDE = '<?xml version="1.0"?><!DOCTYPE r [<!ENTITY x SYSTEM "file:///etc/passwd">]><r>&x;</r>'


def zipped(name: str, data: bytes) -> bytes:
    """An archive with one file."""
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(zipfile.ZipInfo(name), data, zipfile.ZIP_DEFLATED)
    return held.getvalue()


OTHERS = {
    "a bomb called 3mf": ("part.3mf", zipped("3dmodel.model", bytes(50_000_000)), "model|export"),
    "a zip bomb called obj": ("part.obj", zipped("part.obj", bytes(50_000_000)), "export"),
    "entities called off": ("part.off", ENTITIES, "export"),
    "an entity outside": ("part.x3d", OUTSIDE, "ending"),
    "a compressed OFF": ("part.off.gz", b"\x1f\x8b\x08", "ending"),
    "a page called obj": ("part.obj", "<!DOCTYPE html><p>404", "export"),
    "a picture called ply": ("part.ply", b"\x89PNG\r\n\x1a\n" + bytes(50), "export"),
    "a step file": ("part.step", "ISO-10303-21;", "ending|obj"),
    "a glTF in text": ("part.gltf", "{}", "ending|glb"),
    "no ending": ("part", obj(), "ending|obj"),
    "a text STL called ply": ("part.ply", stl_text(), "PLY|export"),
    "a PLY called stl": ("part.stl", ply(), "PLY|rename"),
    "an OBJ called off": ("part.off", obj(), "OFF|export"),
    "an OFF called obj": ("part.obj", off(), "OFF|export"),
    "a GLB called obj": ("part.obj", b"glTF\x02\0\0\0" + bytes(99), "GLB|rename"),
    "one byte": ("part.stl", b"s", "STL|export"),
    "65 MB": ("part.stl", bytes(65 * 2**20), "over|bytes|simplify"),
}


ALL_LEFT_OUT = {(file, "without a byte") for file in ("config", "setup")}
CASES = [
    Case(f"{reader}: a file {name}", command.replace("FILE", file), "", 0, {file: spoil})
    if (reader, name) in ALL_LEFT_OUT
    else refused(f"{reader}: a file {name}", file, spoil, command=command)
    for reader, (file, command) in READERS.items()
    for name, spoil in KINDS.items()
]
CASES += [
    Case(f"a name {name}", ["inspect", word], "", 2 if word.startswith("-") else 4, {word: "v 0 0"})
    for name, word in NAMES.items()
]
CASES += [refused(name, *said) for name, said in OTHERS.items()]
CASES += [
    refused("a kilobyte over a limit", "part.obj", obj() + "#" * 2000, "1024|simplify",
            "inspect --max-mesh-bytes 1024"),
    refused("YAML that runs", "grasps.yaml", "a: !!python/object/apply:os.system ['touch owned']",
            command="dataset import FILE tetrahedron --frictions 0.5 --out made"),
]  # fmt: skip
