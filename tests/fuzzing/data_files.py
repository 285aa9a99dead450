"""Readers of JSON and TOML files as targets, each with another reading of the same bytes."""

import json
import math
import tomllib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import grasp_core as gc
from grasp_core.files.records import RecordFile, entries, record_of
from grasp_core.files.text_files import text_of
from grasp_core.planning import grasps_json
from grasp_core.planning.planner import plan
from grasp_core.planning.result import Plan
from scenes.example_objects import example_object
from sim_validate.baselines.baseline import Baseline
from sim_validate.baselines.suite import suite_from_tables
from sim_validate.closure.validate import validate
from sim_validate.closure.verdict import Verdicts
from sim_validate.commands.config_file import flags_from
from sim_validate.commands.simulation_flags import RunFlags
from sim_validate.datasets.config import DatasetConfig, config_to_toml
from sim_validate.datasets.given_grasps import given_from_json
from sim_validate.datasets.manifest import Listed, Manifest
from sim_validate.datasets.quarantine import quarantine_from
from sim_validate.datasets.resuming import UnitRecord
from sim_validate.engine.setup import Agenda, Setup, wrenches_from_json
from sim_validate.execution.verdict import ExecutedGrasp, Executions
from sim_validate.files.toml_files import tables_of_toml
from sim_validate.hands.reaches import Reaches
from sim_validate.planning.regions import Regions
from tests.fuzzing.targets import Target
from tests.scenes.drawing.standing import reaches_text
from tests.sim_validate.execution.executed import executions

STABILITY = Path(__file__).parents[1] / "stability" / "box"
HASH = "0" * 64


@cache
def grasps_seed() -> bytes:
    """A small `grasps.json`."""
    body = example_object("tetrahedron")
    return grasps_json.plan_to_json(body, gc.plan(body, 0.5, limit=1)).encode()


def _same_grasps(data: bytes, found: Plan) -> None:
    stated = json.loads(data)
    assert stated["friction"] == found.friction
    assert stated["seed"] == found.seed
    assert stated["object"]["name"] == found.body.name
    assert len(stated["object"]["mesh"]["triangles"]) == len(found.body.triangles)
    for one, other in zip(stated["grasps"], found.grasps, strict=True):
        assert one["id"] == other.id
        assert one["faces"] == list(other.faces)
        assert [each["position_m"] for each in one["contacts"]] == other.positions.tolist()
        assert [each["normal"] for each in one["contacts"]] == other.normals.tolist()
        assert one["critical_friction"] == other.critical_friction
        assert one["witness"]["forces"] == other.witness.forces.tolist()


THREE = [
    {"position_m": [1.0, 0, 0], "normal": [-1.0, 0, 0]},
    {"position_m": [-1.0, 0, 0], "normal": [1.0, 0, 0]},
    {"position_m": [0, 1.0, 0], "normal": [0, -1.0, 0]},
]
FOUR = [*THREE, {"position_m": [0, -1.0, 0.5], "normal": [0, 1.0, 0]}]
CONTACTS = {
    "contacts": [THREE[0] | {"friction": 0.5}, *THREE[1:]],
    "friction": 0.4, "center_m": [0, 0, 0.1], "torque_scale_m": 1.0,
}  # fmt: skip
GIVEN = {"grasps": [{"id": "a", "contacts": FOUR}, {"contacts": FOUR}]}


def _same_contacts(data: bytes, found: Any) -> None:
    stated = json.loads(data)
    if "schema" in stated:
        return
    listed = stated.get("grasps", [stated])
    common = stated.get("friction")
    for one, other in zip(listed, found, strict=True):
        assert [each["position_m"] for each in one["contacts"]] == other.positions.tolist()
        assert [each.get("friction", common) for each in one["contacts"]] == other.friction.tolist()
    assert stated.get("torque_scale_m", found[0].torque_scale) == found[0].torque_scale


def _same_given(data: bytes, found: Any) -> None:
    stated = json.loads(data)
    for one, other in zip(stated.get("grasps", [stated]), found, strict=True):
        assert [each["position_m"] for each in one["contacts"]] == [list(p) for p in other.points]


@cache
def _verdicts_seed() -> str:
    body = example_object("tetrahedron")
    grasp = plan(body).grasps[0]
    agenda = Agenda(random_wrenches=0, repeats=1, limits="ramp")
    verdict = validate(body, grasp, agenda=agenda)
    return Verdicts.of(body, 0.5, verdict.gate, (verdict,)).text()


POLYGON = [[0.0, 0, 0], [0.1, 0, 0], [0, 0.1, 0]]
NAMED = {"contacts_sha256": HASH, "planned_radius_m": 0.01}
FOUR_POINTS = [[0.0, 0, 0.1]] * 4
REGIONS = {
    "schema": 2, "object": {"name": "box", "source_sha256": "", "content_sha256": HASH},
    "friction": 0.5, "reserve": 0.0, "recenter": False, "edge_clearance_m": 0.0, "max_cones": 64,
    "grasps": [
        {"id": "c-0-1-2-3", "family": "concurrent", **NAMED, "disc_radius_m": 0.1,
         "regions": [{"kind": "certified", "polygon_m": POLYGON, "inscribed_radius_m": 0.01}] * 4,
         "centers_m": FOUR_POINTS, "normals": [[0.0, 0, 1]] * 4, "friction": [0.5] * 4, "cones": 3,
         "proof": {"file": "proofs/c-0-1-2-3.npz", "sha256": HASH},
         "inscribed_radius_m": 0.01, "area_m2": 0.02},
        {"id": "p-0-1-2-3", "family": "pencil", **NAMED, "reason": "open",
         "inscribed_radius_m": None, "area_m2": None}],
    "complete": True, "summary": {"grasps": 2, "proved": 1},
}  # fmt: skip


FOLLOWS = {each.key for each in entries(ExecutedGrasp) if each.computed}
"""What follows from other fields is made again, and may be off by rounding."""


def _same_record(data: bytes, found: RecordFile) -> None:
    """Every field that is spoken of is as it is written."""
    _compare(json.loads(data), json.loads(found.text()))


def _compare(stated: Any, found: Any) -> None:
    if isinstance(found, dict):
        assert isinstance(stated, dict)
        for key, value in found.items():
            if key in FOLLOWS and key in stated and isinstance(value, float):
                assert math.isclose(stated[key], value, rel_tol=1e-9, abs_tol=1e-18)
            elif key in stated:
                _compare(stated[key], value)
            else:
                assert value in (None, "", {})
    elif isinstance(found, list):
        assert isinstance(stated, list)
        for one, other in zip(stated, found, strict=True):
            _compare(one, other)
    else:
        assert (type(stated) is bool) == (type(found) is bool)
        assert (float(stated) if isinstance(found, float) else stated) == found


def _baseline_seed() -> str:
    stated = json.loads((STABILITY / "box.baseline.json").read_text())
    stated["grasps"] = stated["grasps"][:2]
    return json.dumps(stated)


def _same_baseline(data: bytes, found: Baseline) -> None:
    _same_record(data, found)
    assert json.loads(data).keys() == json.loads(found.text()).keys()


WRENCHES = {"wrenches": [{"name": "lift", "force_n": [0, 0, -3.5]},
                         {"name": "turn", "force_n": [0, 1.5, 0],
                          "torque_n_m": [0.1, 0, 0]}]}  # fmt: skip


def _same_wrenches(data: bytes, found: Any) -> None:
    for one, other in zip(json.loads(data)["wrenches"], found, strict=True):
        wanted = [*one["force_n"], *one.get("torque_n_m", [0, 0, 0])]
        largest = max(map(abs, wanted))
        assert one["name"] == other.name
        assert all(abs(a - b) <= 1e-8 * largest for a, b in zip(wanted, other.wrench, strict=True))


MANIFEST = Manifest(
    config_sha256=HASH, versions={"numpy": "2"}, arithmetic=HASH, units=3, units_sha256=HASH,
    quarantined=1,
    files=(Listed("config.toml", 5, HASH),
           Listed("data/grasps/train-00000-of-00001.parquet", 9, HASH, "grasps", "train", 2)),
)  # fmt: skip


def _same_manifest(data: bytes, found: Manifest) -> None:
    _same_record(data, found)
    assert not any(Path("/a/b", each.path).resolve() == Path("/a/b") for each in found.files)
    assert all(Path("/a/b", e.path).resolve().is_relative_to("/a/b") for e in found.files)


LEFT_OUT = {"object": "a.obj", "source_sha256": HASH, "friction": 0.5, "given": ["given-000001"],
            "reason": "no solid"}  # fmt: skip
UNIT = UnitRecord("a.obj", 0.5, (Listed("grasps.parquet", 9, HASH),), HASH, "train")


def _same_lines(data: bytes, found: Any) -> None:
    lines = data.decode().removesuffix("\n").split("\n") if data else []
    for line, other in zip(lines, found, strict=True):
        assert json.loads(line, parse_int=float) == record_of(other)


def _same_settings(data: bytes, found: Any) -> None:
    _compare_settings(tomllib.loads(data.decode()), found)


def _compare_settings(stated: dict[str, Any], found: Any) -> None:
    for name, value in stated.items():
        came = getattr(found, name)
        if isinstance(value, dict):
            _compare_settings(value, came)
        elif isinstance(came, Path):
            assert came == Path(value)
        else:
            assert (list(came) if isinstance(came, tuple) else came) == value


SETUP = b"""[physics]
timestep = 0.001
gravity = [0.0, 0.0, 0.0]
cone = "elliptic"
autoreset = true
[fingers]
fingertip_radius_m = 0.004
approach = [0, 0, 1.0]
[hold]
hold_s = 0.5
[limit]
spans = [0.01, 0.2]
rounds = 3
[friction]
threshold = 1e-5
"""
SUITE = b"""grasps = "box.json"
baseline = "sub/box.baseline.json"
strict = true
limits = "ramp"
random_wrenches = 3
repeats = 2
seed = 7
[noise]
shift = 0.02
"""


def _same_config(data: bytes, found: DatasetConfig) -> None:
    _same_settings(data, found)
    assert DatasetConfig.of_table(tomllib.loads(config_to_toml(found))) == found


FLAGS = b"""friction = 0.4
families = ["pencil", "regulus"]
json = true
quiet = false
weight-down = [[0, 0, 1.5], [1, 0, 0]]
unit = "mm"
[noise]
shift = 0.02
"""


def _same_flags(data: bytes, found: list[str]) -> None:
    stated = tomllib.loads(data.decode())
    on = [name for name, value in stated.items() if value is not False and name != "noise"]
    assert all("--" + name.replace("_", "-") in found for name in on if stated[name] != [])


def _json(value: Any) -> bytes:
    return json.dumps(value).encode()


def _record(name: str, kind: type[RecordFile], seed: Callable[[], str | bytes],
            agrees: Callable[[bytes, Any], None] = _same_record) -> Target:  # fmt: skip
    def seeds() -> list[bytes]:
        made = seed()
        return [made if isinstance(made, bytes) else made.encode()]

    return Target(name, lambda data: kind.of_text(text_of(data)), seeds, agrees, "json")


def _tables(read: Callable[[dict[str, Any]], Any]) -> Callable[[bytes], Any]:
    return lambda data: read(tables_of_toml(text_of(data)))


TARGETS = (
    Target("grasps", lambda data: grasps_json.grasps_from_json(text_of(data)),
           lambda: [grasps_seed()], _same_grasps, "json"),
    Target("contacts", lambda data: grasps_json.contact_sets_from_json(text_of(data)),
           lambda: [_json(CONTACTS), _json(GIVEN | {"friction": 0.3})], _same_contacts, "json"),
    Target("given", lambda data: given_from_json(text_of(data)), lambda: [_json(GIVEN)],
           _same_given, "json"),
    _record("verdicts", Verdicts, _verdicts_seed),
    _record("executions", Executions, lambda: executions().text()),
    _record("regions", Regions, lambda: Regions.of_text(json.dumps(REGIONS)).text()),
    _record("reaches", Reaches, reaches_text),
    _record("baseline", Baseline, _baseline_seed, _same_baseline),
    _record("manifest", Manifest, MANIFEST.text, _same_manifest),
    _record("staged", UnitRecord, UNIT.text),
    Target("wrenches", lambda data: wrenches_from_json(text_of(data)), lambda: [_json(WRENCHES)],
           _same_wrenches, "json"),
    Target("quarantine", lambda data: quarantine_from(text_of(data)),
           lambda: [_json(LEFT_OUT) + b"\n" + _json(LEFT_OUT) + b"\n"], _same_lines, "json"),
    Target("setup", _tables(lambda tables: Setup.of_table(tables, usual=Setup())), lambda: [SETUP],
           _same_settings, "toml"),
    Target("suite", _tables(lambda tables: suite_from_tables(tables, Path("s.grasps.toml"))),
           lambda: [SUITE], _same_settings, "toml"),
    Target("dataset-config", _tables(DatasetConfig.of_table),
           lambda: [config_to_toml(DatasetConfig(objects=("wedge",))).encode()], _same_config,
           "toml"),
    Target("flags", _tables(lambda tables: flags_from(tables, RunFlags)), lambda: [FLAGS],
           _same_flags, "toml"),
)  # fmt: skip
