"""`croissant.json`: the description of a dataset for data catalogues and their readers.

It is Croissant 1.1 with the vocabulary for responsible AI 1.0: https://mlcommons.org/croissant/1.1.
Facts that only the maker of a dataset knows - its licence, its date - are left out where they are
not given.
"""

import json
from typing import Any, TypeAlias

from sim_validate.datasets.columns import KEYS, REFERENCES, TABLES, Column, Name
from sim_validate.datasets.config import DatasetConfig
from sim_validate.datasets.describing.licenses import known_license
from sim_validate.datasets.describing.statements import (
    CONVENTIONS,
    KEYWORDS,
    LABELS,
    LIMITS,
    ROWS,
    SOURCES,
    choice,
    made,
    makers,
    splitting,
    summary,
)
from sim_validate.datasets.manifest import SCHEMA, Listed, Manifest
from sim_validate.datasets.rows import SPLITS

Json: TypeAlias = dict[str, Any]

CROISSANT = "croissant.json"
CONFORMS_TO = ("http://mlcommons.org/croissant/1.1", "http://mlcommons.org/croissant/RAI/1.0")
ASKED = {
    "name": "title",
    "license": "license",
    "creator": "creator",
    "url": "url",
    "datePublished": "published",
}
"""Required fields that only the user can give, with the settings that give them."""
OWN_TERMS = (
    "annotation", "arrayShape", "citeAs", "column", "containedIn", "equivalentProperty",
    "excludes", "extract", "field", "fileObject", "fileProperty", "fileSet", "format", "includes",
    "isArray", "isLiveDataset", "jsonPath", "key", "md5", "parentField", "path", "readLines",
    "recordSet", "references", "regex", "repeated", "replace", "samplingRate", "sdVersion",
    "separator", "source", "subField", "transform", "unArchive", "value",
)  # fmt: skip
"""Terms of Croissant that need no rule of their own: the specification's, and its reader's."""
CONTEXT: Json = {
    "@language": "en",
    "@vocab": "https://schema.org/",
    "sc": "https://schema.org/",
    "cr": "http://mlcommons.org/croissant/",
    "rai": "http://mlcommons.org/croissant/RAI/",
    "dct": "http://purl.org/dc/terms/",
    "prov": "http://www.w3.org/ns/prov#",
    "conformsTo": "dct:conformsTo",
    "data": {"@id": "cr:data", "@type": "@json"},
    "dataType": {"@id": "cr:dataType", "@type": "@vocab"},
    "description": {"@container": "@language"},
    "examples": {"@id": "cr:examples", "@type": "@json"},
    "name": {"@container": "@language"},
    **{term: f"cr:{term}" for term in OWN_TERMS},
}
"""The context from the specification's appendix, with https for schema.org, as readers want it."""
TYPES = {"text": "sc:Text", "bool": "sc:Boolean", "int": "sc:Integer", "float": "sc:Float"}
FORMATS = {
    "parquet": "application/x-parquet",
    "toml": "application/toml",
    "json": "application/json",
    "jsonl": "application/jsonl",
    "md": "text/markdown",
    "obj": "model/obj",
    "xml": "application/xml",
}
"""Media types by the endings of files."""
FOLDERS = {
    "meshes": ("obj", "Canonical meshes of the objects [m]"),
    "scenes": ("xml", "Grasps as MuJoCo scenes"),
}
"""Folders of many files, which the manifest lists one by one, with their hashes."""
SPLIT_NAMES = {"train": "TrainingSplit", "validation": "ValidationSplit", "test": "TestSplit"}


def croissant_text(config: DatasetConfig, manifest: Manifest) -> str:
    """Describe a dataset in JSON; equal values give equal texts.

    Args:
        config: What the dataset is made of.
        manifest: The files of the dataset, and the versions that made them. This description itself
            cannot hold its own hash, so it is not listed.
    """
    record: Json = {
        "@context": CONTEXT,
        "@type": "sc:Dataset",
        "conformsTo": list(CONFORMS_TO),
        "description": " ".join((summary(config, manifest), made(config), CONVENTIONS, SOURCES)),
        **_credits(config),
        "version": f"{SCHEMA}.0.0",
        "keywords": list(KEYWORDS),
        "inLanguage": "en",
        "isLiveDataset": False,
        **_responsible(config, manifest),
        "distribution": _distribution(manifest),
        "recordSet": [_splits(), *(_records(name) for name in TABLES if manifest.of_table(name))],
    }
    return json.dumps(record, indent=1) + "\n"


def missing_fields(config: DatasetConfig) -> dict[str, str]:
    """Required fields that are left out, each with the setting that would give it."""
    return {name: setting for name, setting in ASKED.items() if not getattr(config, setting)}


def _credits(config: DatasetConfig) -> Json:
    values: Json = {
        "name": config.title,
        "license": _license(config.license),
        "creator": {"@type": "sc:Person", "name": config.creator},
        "url": config.url,
        "datePublished": config.published,
    }
    absent = missing_fields(config)
    return {name: value for name, value in values.items() if name not in absent}


def _license(name: str) -> str | Json:
    """The address of a usual licence, or any other licence by its name."""
    if name.startswith(("http://", "https://")):
        return name
    known = known_license(name)
    return {"@type": "sc:CreativeWork", "name": name} if known is None else known.url


def _responsible(config: DatasetConfig, manifest: Manifest) -> Json:
    """The fields that the vocabulary for responsible AI asks for, as far as they apply."""
    labels = "; ".join(f"{label}: {meaning}" for label, meaning in LABELS.items())
    tools = list(makers(manifest))
    return {
        "rai:hasSyntheticData": True,
        "rai:dataCollection": made(config),
        "rai:dataCollectionType": ["Software Collection", "Experiments"],
        "rai:dataCollectionRawData": SOURCES,
        "rai:dataCollectionMissingData": choice(config, manifest),
        "rai:dataPreprocessingProtocol": [splitting(), CONVENTIONS],
        "rai:dataAnnotationProtocol": f"No human labels. By analysis and simulation: {labels}.",
        "rai:machineAnnotationTools": tools,
        "rai:dataBiases": [choice(config, manifest)],
        "rai:dataLimitations": list(LIMITS),
        "rai:dataUseCases": [
            "Training and testing of methods that propose or judge contacts for grasps, and of "
            "criteria of success against proved failures. Not a proof that a robot will hold "
            "an object."
        ],
        "rai:personalSensitiveInformation": ["None: shapes, contacts and forces."],
        "prov:wasGeneratedBy": {
            "@type": "prov:Activity",
            "prov:wasAssociatedWith": [
                {"@type": "prov:SoftwareAgent", "prov:label": tool} for tool in tools
            ],
        },
    }


def _distribution(manifest: Manifest) -> list[Json]:
    """All files, except that the files of large folders are described as sets."""
    others = [each for each in manifest.files if each.path != CROISSANT]
    single = [each for each in others if each.path.partition("/")[0] not in FOLDERS]
    sets = [
        _file_set(_files(name), f"data/{name}/*.parquet", f"Table `{name}`")
        for name in TABLES
        if manifest.of_table(name)
    ]
    for folder, (ending, meaning) in FOLDERS.items():
        if any(each.path.startswith(f"{folder}/") for each in others):
            sets.append(_file_set(folder, f"{folder}/*.{ending}", meaning))
    return [*(_file(each) for each in sorted(single, key=lambda each: each.path)), *sets]


def _file(listed: Listed) -> Json:
    return {
        "@type": "cr:FileObject",
        "@id": listed.path,
        "name": listed.path,
        "contentUrl": listed.path,
        "contentSize": f"{listed.bytes} B",
        "encodingFormat": FORMATS[listed.path.rpartition(".")[2]],
        "sha256": listed.sha256,
    }


def _file_set(name: str, pattern: str, meaning: str) -> Json:
    return {
        "@type": "cr:FileSet",
        "@id": name,
        "name": name,
        "description": f"{meaning}; hashes are in `manifest.json`.",
        "encodingFormat": FORMATS[pattern.rpartition(".")[2]],
        "includes": pattern,
    }


def _files(name: Name) -> str:
    """The name of the set of a table's files."""
    return f"{name}-files"


def _splits() -> Json:
    """The splits, which the tables' own columns refer to."""
    return {
        "@type": "cr:RecordSet",
        "@id": "splits",
        "name": "splits",
        "description": splitting(),
        "dataType": "cr:Split",
        "key": {"@id": "splits/name"},
        "field": [
            {"@type": "cr:Field", "@id": "splits/name", "name": "name", "dataType": "sc:Text"},
            {"@type": "cr:Field", "@id": "splits/url", "name": "url", "dataType": "sc:URL"},
        ],
        "data": [
            {"splits/name": split, "splits/url": f"cr:{SPLIT_NAMES[split]}"} for split, _ in SPLITS
        ],
    }


def _records(name: Name) -> Json:
    """The description of a table."""
    return {
        "@type": "cr:RecordSet",
        "@id": name,
        "name": name,
        "description": f"A row is {ROWS[name]}.",
        "key": [{"@id": f"{name}/{key}"} for key in KEYS[name]],
        "field": [_field(name, column) for column in TABLES[name]],
    }


def _field(name: Name, column: Column) -> Json:
    """The description of a column."""
    field: Json = {
        "@type": "cr:Field",
        "@id": f"{name}/{column.name}",
        "name": column.name,
        "description": f"{column.meaning} [{column.unit}]" if column.unit else column.meaning,
        "dataType": TYPES[column.kind],
        "source": {"fileSet": {"@id": _files(name)}, "extract": {"column": column.name}},
    }
    if column.shape:
        field |= {"isArray": True, "arrayShape": ",".join(map(str, column.shape))}
    if column.name == "split":
        field["references"] = _reference("splits/name")
    elif (target := REFERENCES.get((name, column.name))) is not None:
        field["references"] = _reference("/".join(target))
    return field


def _reference(field: str) -> Json:
    """Refer to another field.

    mlcroissant 1.1.1 needs the key `field`, which the text of Croissant 1.1 leaves out.
    """
    return {"field": {"@id": field}}
