"""The kinds of JSON files of graspproof: what they are called, and how each is told from the rest.

A file that is given in place of another is refused by its name, rather than by its first field that
the other kind lacks.
"""

from collections.abc import Mapping
from typing import Any

from grasp_core.errors import InputError

GRASPS, BEST, TRANSFER = "grasps.json", "best.json", "transfer.json"
VERDICTS, EXECUTIONS, JUDGEMENTS = "verdicts.json", "executions.json", "judgements.json"
REGIONS, REACHES = "regions.json", "reaches.json"
MANIFEST, UNIT, QUARANTINE = "manifest.json", "unit.json", "quarantine.jsonl"
BASELINE, ANALYSES = "baseline", "document of analyses"
WRENCH_FILE, CONTACTS_FILE = "wrench file", "contacts file"

WRITTEN: Mapping[str, str] = {
    BASELINE: "grasps_file", VERDICTS: "verdicts", REGIONS: "reserve", EXECUTIONS: "executions",
    REACHES: "reaches", JUDGEMENTS: "judgements", TRANSFER: "old", MANIFEST: "units_sha256",
    UNIT: "object_id", GRASPS: "theta_rad", BEST: "history", ANALYSES: "source",
}  # fmt: skip
"""The kinds of files that graspproof writes, each with a key that no other kind has."""
GIVEN = {"wrenches": WRENCH_FILE, "contacts": CONTACTS_FILE, "grasps": CONTACTS_FILE}
"""The kinds of files that people write, without a `schema`, by keys that they begin with."""
BESIDE = (VERDICTS, REGIONS, EXECUTIONS, REACHES, JUDGEMENTS, TRANSFER, BEST)
"""Files that are kept in the same folder as the grasps.json that they belong to."""


def kind_of(found: Mapping[str, Any]) -> str | None:
    """Tell of which kind a JSON file of graspproof is, by its keys; None if that is not clear."""
    given = () if "schema" in found else GIVEN.items()
    named = (*((key, kind) for kind, key in WRITTEN.items()), *given)
    return next((kind for key, kind in named if key in found), None)


def check_kind(found: Mapping[str, Any], wanted: str) -> None:
    """Refuse a JSON file of graspproof that is of another kind than the one asked for."""
    kind = kind_of(found)
    if kind in (None, wanted) or WRITTEN.get(wanted) in found:
        return
    beside = " beside it" if wanted == GRASPS and kind in BESIDE else ""
    raise InputError(
        f"this is {with_article(kind)}, not {with_article(wanted)}; give the {wanted}{beside}"
    )


def with_article(kind: str) -> str:
    """Put `a` or `an` before the name of a kind of files."""
    return f"{'an' if kind[0] in 'aeio' else 'a'} {kind}"
