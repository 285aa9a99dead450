"""Names of all flags of a command, and how lists and vectors are written on the command line.

A list is written with commas, as in `--families pencil,regulus`, and a vector with spaces.

A TOML file of settings becomes flags of an equivalent command line. Examples of command lines stand
here, too, as `--help` shows them.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, is_dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, cast, get_args, get_origin

from tyro.conf import OmitArgPrefixes, UseAppendAction
from tyro.constructors import ConstructorRegistry, PrimitiveConstructorSpec

from grasp_core.errors import InputError
from grasp_core.kinds import Vector, near
from grasp_core.settings import types
from sim_validate.kit.command_flags import PLAIN
from sim_validate.kit.exit_codes import FlagsError

REGISTRY: Any = ConstructorRegistry()
"""How values of types that the parser of flags does not know are read."""


@dataclass(frozen=True, slots=True)
class Flag:
    """A flag of a command: its name without dashes, and the field that it sets."""

    name: str
    owner: type
    field: str
    kind: Any


def flags_of(command: Any, prefix: str = "", *, short: bool = False) -> Iterator[Flag]:
    """Yield the flags of a command, or of each command in a group, with those of their groups."""
    if not is_dataclass(command):
        for part in get_args(command):
            yield from flags_of(part, prefix, short=short)
        return
    for name, kind in types(command).items():  # type: ignore[arg-type]
        marks = get_args(kind)[1:] if get_origin(kind) is Annotated else ()
        groups = [part for part in parts_of(kind) if isinstance(part, type) and is_dataclass(part)]
        if not groups:
            yield Flag(prefix + name, command, name, kind)  # type: ignore[arg-type]
        all_short = short or OmitArgPrefixes in marks
        inner = prefix if all_short or PLAIN in marks else f"{prefix}{name}."
        for group in groups:
            yield from flags_of(group, inner, short=all_short)


def parts_of(kind: Any) -> Iterator[Any]:
    """Yield a type, and all types that it is made of."""
    yield kind
    for part in get_args(kind):
        yield from parts_of(part)


def listed(kind: Any) -> Any:
    """Return the type of the items of a list that is written with commas; None for other types."""
    if get_origin(kind) is Annotated:
        return None if UseAppendAction in get_args(kind)[1:] else listed(get_args(kind)[0])
    if get_origin(kind) is not tuple or get_args(kind)[-1] is not Ellipsis:
        return None
    item = get_args(kind)[0]
    item = get_args(item)[0] if get_origin(item) is Annotated else item
    return item if get_origin(item) is Literal or item in (int, float) else None


@REGISTRY.primitive_rule
def _list(info: Any) -> PrimitiveConstructorSpec[Any] | None:
    item = None if UseAppendAction in info.markers else listed(info.type)
    if item is None:
        return None
    choices = f"{{{','.join(map(str, get_args(item)))}}}" if get_args(item) else "NUMBER"
    read = str if get_args(item) else item
    return PrimitiveConstructorSpec(
        nargs=1,
        metavar=f"{choices},...",
        instance_from_str=lambda words: tuple(
            read(word.strip()) for word in words[0].split(",") if word
        ),
        is_instance=lambda value: isinstance(value, tuple),
        str_from_instance=lambda value: [",".join(map(str, value))],
    )


@REGISTRY.primitive_rule
def _vector(info: Any) -> PrimitiveConstructorSpec[Any] | None:
    if info.type != Vector:
        return None
    return PrimitiveConstructorSpec(
        nargs=3,
        metavar="X Y Z",
        instance_from_str=lambda words: tuple(map(float, words)),
        is_instance=lambda value: isinstance(value, tuple),
        str_from_instance=lambda value: [f"{part:g}" for part in value],
    )


COMMAND_WORDS = {"dataset": 2, "baseline": 2}
"""Number of words in those command names that have more than one."""


def with_config(arguments: list[str], commands: Mapping[str, type]) -> list[str]:
    """Put the settings of `--config FILE.toml` before the flags, which then override them."""
    words = [
        part
        for word in arguments
        for part in (word.split("=", 1) if word.startswith("--config=") else [word])
    ]
    if "--config" not in words:
        return arguments
    at = words.index("--config")
    if at + 1 >= len(words):
        raise FlagsError("--config needs the path of a TOML file after it")
    rest = words[:at] + words[at + 2 :]
    flags = _read(Path(words[at + 1]), commands.get(rest[0]) if rest else None)
    first = next((place for place, word in enumerate(rest) if word.startswith("-")), len(rest))
    return [*rest[:first], *flags, *rest[first:]]


def flags_from(settings: Mapping[str, Any], command: Any) -> list[str]:
    """Turn settings into the words of an equivalent command line; tables hold groups of flags."""
    known = {flag.name: flag for flag in flags_of(command)}
    words = list[str]()
    for name, value in _named(settings):
        flag = known.get(name.replace("-", "_"))
        if flag is None:
            meant = near(name.replace("-", "_"), known)
            raise FlagsError(f"{name!r}: unknown flag; {meant or 'keys are long flags'}")
        words += _as_flags(flag, value)
    return words


def _named(settings: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in settings.items():
        if isinstance(value, dict):
            yield from _named(cast("dict[str, Any]", value), f"{prefix}{name}.")
        else:
            yield prefix + name, value


def _read(path: Path, command: Any) -> list[str]:
    """Read a file of settings as words of a command line."""
    # imported only when there is a file to read
    from sim_validate.kit.files import read_tables

    try:
        settings = read_tables(path)
    except InputError as error:
        raise InputError(f"--config {error}") from error
    try:
        return flags_from(settings, command)
    except InputError as error:
        raise type(error)(f"--config {path}: {error}") from None


def _as_flags(flag: Flag, value: Any) -> list[str]:
    word, items = "--" + flag.name.replace("_", "-"), _items(value)
    if any(isinstance(part, dict) for item in items for part in _items(item)):
        raise InputError(f"{flag.name}: expected a value or a list, got a table")
    if isinstance(value, bool):
        return [word] if value else []
    if listed(flag.kind) is not None:
        return [word, ",".join(map(str, items))]
    if UseAppendAction in get_args(flag.kind)[1:]:
        return [part for item in items for part in (word, *map(str, _items(item)))]
    return [word, *map(str, items)]


def _items(value: Any) -> Sequence[Any]:
    return cast("Sequence[Any]", value) if isinstance(value, list | tuple) else [value]


EXAMPLES = """\
run wedge
run part.stl --unit mm --friction 0.3 --limit 20 --limits ramp --out results
run wedge --limit 10 --execute --mass-kg 0.3
plan wedge --limit 10 --out plan
plan wedge --limit 10 --best --gap 0.05 --time-limit-s 120 --out plan
plan wedge --limit 10 --best --measure weight --out plan
plan part.stl --unit mm --finger-radius-m 0.006 --approach-m 0.05 --out plan
validate plan/grasps.json --out plan
validate plan/grasps.json --protocol dexgraspbench --protocol dexonomy --out plan
validate plan/grasps.json --weight-n 3 --weight-down 0 0 -1 --limits ramp --repeats 20
execute plan/grasps.json --mass-kg 0.3 --out plan
execute plan/grasps.json --density-kg-m3 2700 --trials lift,shake --shake-g 2
scene plan/grasps.json --out scenes
scene plan/grasps.json --grasp c-0-1-2-7
scene plan/grasps.json --mass-kg 0.3 --out held
export plan/grasps.json --to gltf -o grasps.glb
export plan/grasps.json --to moveit --limit 5 -o grasps.yaml
regions plan/grasps.json --out plan
regions plan/grasps.json --reserve 0.1 --recenter --limit 5 --out smaller
replay graspproof-out/wedge --grasp c-0-1-2-7 --out replay
replay graspproof-out/wedge --grasp c-0-1-2-7 --wrench weakest --out replay
analyze contacts.json --friction 0.5 --wrench 0 0 -3 0 0 0
analyze plan/grasps.json --json
transfer plan/grasps.json part-v2.stl --unit mm --out carried
transfer plan/grasps.json part-v2.stl --unit mm --distance-m 0.005 --angle-deg 2
reach plan/grasps.json --hand allegro --out reached
reach plan/grasps.json --hand my_hand.xml --fingertips ff,mf,rf,th --table 0 0 -1
reach plan/grasps.json --hand leap --simulate --protocol dexgraspbench --out reached
hand allegro
hand my_hand.xml --fingertips ff,mf,rf,th
inspect part.stl --unit mm
inspect part.stl --unit mm --picture part.png
inspect mug.obj --scale 0.00026824
objects
doctor
doctor --compile
view DIR/grasps.json --grasp c-0-1-2-7
view DIR/grasps.json --picture grasp.png --page grasp.html --clip grasp.webp
report graspproof-out/wedge
report graspproof-out --out all-objects
dataset build meshes/ wedge --frictions 0.3,0.5 --limit 20 --out ds
dataset build ds/config.toml --out again
dataset import contacts.json mug.obj --out judged
dataset verify ds
dataset export ds --to isaac --out isaac
baseline record grasps.json -o wedge.baseline.json
baseline check wedge.baseline.json --strict
""".splitlines()
"""Examples of all commands, without the program's name."""
HELP = {"-h", "--help"}


def examples_for(arguments: list[str]) -> str:
    """Return the examples of a command if the arguments ask for its help, else an empty text."""
    if not HELP & set(arguments):
        return ""
    words = arguments[: COMMAND_WORDS.get(arguments[0], 1)]
    shown = [f"  graspproof {line}\n" for line in EXAMPLES if line.split()[: len(words)] == words]
    return "\nexamples:\n" + "".join(shown) if shown else ""
