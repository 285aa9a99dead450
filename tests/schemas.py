"""Files compared with their schemas."""

import json
import re
import tomllib

from jsonschema import Draft202012Validator

from grasp_core.files.file_kinds import kind_of
from sim_validate.schemas.file_schemas import KINDS, address, schema_of

NAMES = {each.called: name for name, each in KINDS.items()}
ADDRESSED = re.compile(rf"#:schema {re.escape(address('NAME'))}\n".replace("NAME", r"(\w+)"))


def faults_of(name, document):
    """What a schema finds wrong with a document."""
    found = Draft202012Validator(schema_of(name)).iter_errors(document)
    return [f"{name}: {each.json_path}: {each.message[:200]}" for each in found]


def faults_of_file(path):
    """What is wrong with a JSON or TOML file; None if no kind of graspproof's files is like it."""
    text = path.read_text()
    if path.suffix == ".toml":
        return faults_of(ADDRESSED.match(text)[1], tomllib.loads(text))
    document = json.loads(text)
    name = NAMES.get(kind_of(document) if isinstance(document, dict) else None)
    return name and faults_of(name, document)
