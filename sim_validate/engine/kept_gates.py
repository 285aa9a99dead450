"""Refuses settings under which the simulator fails known cases, and keeps what they measured.

Measuring takes half a second, so the evidence goes to the user's cache folder, for later processes.
The figures depend on nothing but the settings, the packages' own text, the versions of what they
use and the arithmetic of the processor. So a file is named by the hash of these, states them, and
counts only where it states them wholly, and all of its figures lie in their intervals: whatever
else is found there is measured anew.
"""

import hashlib
import json
from collections.abc import Iterator, Mapping
from contextlib import suppress
from functools import cache, lru_cache
from importlib.resources import files
from pathlib import Path

from grasp_core.cache_folders import cache_folders
from grasp_core.errors import InputError, UnfaithfulError
from grasp_core.files.json_text import object_of
from grasp_core.files.records import from_record, record_of
from grasp_core.files.text_files import read_text, write_text
from grasp_core.provenance import arithmetic, versions
from sim_validate.engine.known_cases import Gate, KnownCase, measured

GATES = "gates"
"""Name of the folder in the cache folder."""
PACKAGES = ("grasp_core", "scenes", "sim_validate")


def checked(case: KnownCase) -> Gate:
    """Check the simulator on a known case, and refuse settings under which a check fails."""
    gate = _kept_or_measured(case)
    if not gate.passed:
        failed = "; ".join(str(check) for check in gate.checks if not check.passed)
        raise UnfaithfulError(
            "the simulator is not faithful with these settings, so nothing is simulated with them; "
            f"these checks failed: {failed}"
        )
    return gate


@lru_cache(maxsize=256)
def _kept_or_measured(case: KnownCase) -> Gate:
    gate = kept_gate(case)
    if gate is None:
        keep_gate(case, gate := measured(case))
    return gate


def kept_gate(case: KnownCase) -> Gate | None:
    """Return what was measured for equal settings on this machine, with all checks passed."""
    stated = _stated(case)
    for path in _places(stated):
        with suppress(OSError, InputError):
            found = object_of(read_text(path), "a kept gate")
            gate = from_record(Gate, found.get("gate"))
            if found.get("measured") == stated and gate.passed:
                return gate
    return None


def keep_gate(case: KnownCase, gate: Gate) -> None:
    """Write what was measured to the first cache folder that can be written, if there is one."""
    stated = _stated(case)
    text = json.dumps({"measured": stated, "gate": record_of(gate)}, indent=1)
    for path in _places(stated):
        with suppress(OSError):
            write_text(path, text)
            return


def _stated(case: KnownCase) -> dict[str, str]:
    """State all that the figures of a case depend on; its text has its numbers in full."""
    made_by = {**versions(), "arithmetic": arithmetic(), "text": _text_hash()}
    return {"case": repr(case), **made_by}


def _places(stated: Mapping[str, str]) -> Iterator[Path]:
    name = hashlib.sha256(repr(sorted(stated.items())).encode()).hexdigest()
    yield from (folder / GATES / f"{name}.json" for folder in cache_folders())


@cache
def _text_hash() -> str:
    """Hash the text of the packages: what is measured may change with any line."""
    digest = hashlib.sha256()
    for package in PACKAGES:
        top = Path(str(files(package)))
        for path in sorted(top.rglob("*.py")):
            digest.update(f"{path.relative_to(top)}\n".encode() + path.read_bytes())
    return digest.hexdigest()
