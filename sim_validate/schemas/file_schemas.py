"""JSON Schemas of the files of graspproof, draft 2020-12, made of their classes.

A schema says what each key means, its unit, and what values it may have. It allows what a class
writes; rules between several fields, which the reader of a file checks, are not in it.
"""

import json
import math
import re
from collections.abc import Mapping
from functools import cache
from pkgutil import resolve_name
from threading import Lock
from typing import Any, ClassVar, NamedTuple, cast

from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import core_schema
from tyro.conf import Positional

from grasp_core.allowed_values import adapter, rules
from grasp_core.errors import InputError
from grasp_core.figures import meanings, unit_of
from grasp_core.files import file_kinds as files
from grasp_core.files.records import entries
from grasp_core.messages import near, shown
from grasp_core.settings import CHOSEN
from sim_validate.commands.flag_values import flags_of
from sim_validate.commands.flags import Spoken
from sim_validate.commands.table import COMMANDS

REPOSITORY = "https://example.org/graspproof"
"""Address of the repository, which .github/workflows/release.yml puts here."""
DRAFT = "https://json-schema.org/draft/2020-12/schema"
ONE_AT_A_TIME = Lock()
"""Taken while a schema is made: pydantic fails where two threads build one class first."""
IN_FILES = re.compile(r"\b(None|NaN)\b")


class FileKind(NamedTuple):
    """A kind of files: what it is called, and the module and class of what it holds."""

    called: str
    declared: str
    written_by_users: bool = False
    """Whether settings that the program chooses have no place in it."""


FILE_KINDS: Mapping[str, FileKind] = {
    "grasps": FileKind(files.GRASPS, "grasp_core.planning.grasps_json:SavedGrasps"),
    "best": FileKind(files.BEST, "sim_validate.planning.best:Best"),
    "transfer": FileKind(files.TRANSFER, "sim_validate.planning.transfer:TransferFile"),
    "verdicts": FileKind(files.VERDICTS, "sim_validate.closure.verdict:Verdicts"),
    "executions": FileKind(files.EXECUTIONS, "sim_validate.execution.verdict:Executions"),
    "judgements": FileKind(files.JUDGEMENTS, "sim_validate.protocols.verdict:Judgements"),
    "regions": FileKind(files.REGIONS, "sim_validate.planning.regions:Regions"),
    "reaches": FileKind(files.REACHES, "sim_validate.hands.reaches:Reaches"),
    "manifest": FileKind(files.MANIFEST, "sim_validate.datasets.manifest:Manifest"),
    "unit": FileKind(files.UNIT, "sim_validate.datasets.resuming:UnitRecord"),
    "quarantine": FileKind(f"line of {files.QUARANTINE}",
                           "sim_validate.datasets.quarantine:QuarantinedUnit"),
    "baseline": FileKind(files.BASELINE, "sim_validate.baselines.baseline:Baseline"),
    "analyses": FileKind(files.ANALYSES, "sim_validate.planning.analyze:Analyses"),
    "wrenches": FileKind(files.WRENCH_FILE, "sim_validate.engine.setup:WrenchFile"),
    "contacts": FileKind(files.CONTACTS_FILE, "grasp_core.planning.grasps_json:ContactsFile"),
    "dataset": FileKind("configuration of a dataset, TOML",
                        "sim_validate.datasets.config:DatasetConfig", True),
    "setup": FileKind("setup of the simulation, TOML", "sim_validate.engine.setup:Setup", True),
    "suite": FileKind("NAME.grasps.toml of tests", "sim_validate.baselines.suite:Suite", True),
} | {
    f"{command.replace(' ', '-')}-flags": FileKind(
        f"TOML file for `{command} --config`", f"sim_validate.{each.flags}", True
    )
    for command, each in COMMANDS.items()
}  # fmt: skip
"""Every kind of files by its short name. Classes are named as text, since most are slow to load."""


def address(name: str) -> str:
    """Return where the schema of a kind of files is published."""
    return f"{REPOSITORY}/releases/latest/download/{name}.json"


def named(text: str) -> str:
    """Return the short name of the kind of files that a text names, with or without its ending."""
    names = {each.called: name for name, each in FILE_KINDS.items()} | {
        name: name for name in FILE_KINDS
    }
    word = text.lower().removesuffix(".json").removesuffix(".toml")
    found = names.get(word) or names.get(f"{word}.json")
    if found is None:
        hint = near(word, FILE_KINDS) or f"choose from {', '.join(FILE_KINDS)}"
        raise InputError(f"no kind of files is named {shown(text)}; {hint}")
    return found


@cache
def schema_of(name: str) -> Mapping[str, Any]:
    """Return the JSON Schema of the kind of files with a short name."""
    called, place, by_users = FILE_KINDS[name]
    kind = resolve_name(place)
    with ONE_AT_A_TIME:
        if issubclass(kind, Spoken):
            made = _of_flags(kind)
        else:
            generator = _OfUsers if by_users else _OfFiles
            made = adapter(kind).json_schema(
                mode="serialization", by_alias=True, schema_generator=generator
            )
    head = {"$schema": DRAFT, "$id": address(name), "title": f"graspproof {called}"}
    return head | {key: value for key, value in made.items() if key not in head}


def schema_text(name: str) -> str:
    """Return the text of the JSON Schema of a kind of files."""
    return json.dumps(schema_of(name), indent=1, allow_nan=False) + "\n"


def _of_flags(command: type[Spoken]) -> JsonSchemaValue:
    """Return the schema of the flags of a command; those of a group are in a table of their own."""
    made: dict[str, Any] = _table() | {"description": command.__doc__}
    for flag in flags_of(command):
        marks, table = rules(flag.kind), made
        if Positional in marks:
            continue
        *groups, key = flag.name.split(".")
        for group in groups:
            table = table["properties"].setdefault(group, _table())
        helps = (getattr(mark, "help", None) for mark in marks)
        said = {"description": next(filter(None, helps), "")} | _about(flag.owner, flag.field, key)
        own = adapter(flag.kind).json_schema(schema_generator=_OfFiles)
        table["properties"][key] = own | said
    return made


def _table() -> dict[str, Any]:
    return {"type": "object", "additionalProperties": False, "properties": {}}


class _OfFiles(GenerateJsonSchema):
    """Makes schemas of declared classes, with the keys that files have."""

    LEFT_OUT: ClassVar[str | None] = None
    """Mark in the types of fields that are left out."""

    def field_title_should_be_set(self, schema: Any) -> bool:
        """Leave titles out, which would be the names again."""
        del schema
        return False

    def float_schema(self, schema: core_schema.FloatSchema) -> JsonSchemaValue:
        """Leave out ends of intervals at infinity, which JSON cannot say."""
        finite = {key: value for key, value in schema.items() if value not in (math.inf, -math.inf)}
        return super().float_schema(cast("core_schema.FloatSchema", finite))

    def function_before_schema(
        self, schema: core_schema.BeforeValidatorFunctionSchema
    ) -> JsonSchemaValue:
        """Say how many items a list has, which `allowed_values` checks before pydantic does."""
        made = super().function_before_schema(schema)
        least, most = getattr(schema["function"]["function"], "args", (0, None))
        made |= {"minItems": least} if least else {}
        return made | ({} if most is None else {"maxItems": most})

    def dataclass_schema(self, schema: core_schema.DataclassSchema) -> JsonSchemaValue:
        """Say what keys mean, and put those of flat parts among the others."""
        kind, made = schema["cls"], super().dataclass_schema(schema)
        said = (kind.__doc__ or "").partition("\n\n")[0]
        made["description"] = IN_FILES.sub("null", " ".join(said.split()))
        keys: dict[str, Any] = {}
        required: list[str] = list(made.get("required", ()))
        if version := getattr(kind, "SCHEMA", None):
            keys["schema"] = {"const": version, "description": "Version of the form of the file."}
            required.insert(0, "schema")
        for each in entries(kind):
            own = made["properties"][each.key]
            if each.flat is not None:
                part = self._part(each.flat)
                keys |= part["properties"]
                if "$ref" in own:  # else all of its keys may be absent
                    required += part.get("required", ())
                required = [key for key in required if key != each.key]
            elif self.LEFT_OUT not in rules(each.kind):
                keys[each.key] = own | _about(kind, each.name, each.key)
        return made | {"properties": keys} | ({"required": required} if required else {})

    def _part(self, kind: type) -> JsonSchemaValue:
        """Return the schema of the object that holds a flat part alone."""
        made = self.generate_inner(cast("Any", adapter(kind).core_schema))
        while "$ref" in made:
            made = self.get_schema_from_definitions(made["$ref"]) or {}
        return made


class _OfUsers(_OfFiles):
    LEFT_OUT = CHOSEN


def _about(kind: type, name: str, key: str) -> dict[str, str]:
    said = {"description": IN_FILES.sub("null", meanings(kind).get(name, "")), "unit": unit_of(key)}
    return {word: text for word, text in said.items() if text}
