"""A setting has the same bounds as a flag and in Python: each refuses what the other refuses."""

import math
from dataclasses import is_dataclass, replace
from typing import get_args, get_origin, get_type_hints

import pytest

import grasp_core as gc
import sim_validate as sv
from grasp_core.checked import BOUNDS
from grasp_core.declared import types
from grasp_core.hands.reach import HandReach
from grasp_core.kinds import takes
from grasp_core.objects.surface import PatchLimits
from scenes.example_objects import example_object
from scenes.mujoco.fingertips import FingerSettings
from scenes.mujoco.held import HeldSettings
from scenes.mujoco.physics import PhysicsSettings
from sim_validate.baselines.part import IfChanged
from sim_validate.datasets import flags as dataset_flags
from sim_validate.datasets.config import Learning
from sim_validate.engine.setup import Noise
from sim_validate.execution.settings import ExecutionSettings
from sim_validate.hands import flags as hand_flags
from sim_validate.kit import command_flags, flag_groups
from sim_validate.main import Command
from tests.sim_validate.rigs import grasps

ENDS = {end for ends in BOUNDS.values() for end in ends.values()}
PROBES = sorted(
    {-1.0, 1e-12, 1e-10, 1e-9, 2e-9, 1e-6, 1e9, 2e9, 1e12, math.inf}
    | {near for end in ENDS for near in (end, math.nextafter(end, 9e99), math.nextafter(end, -1))}
    | {end + step for end in ENDS for step in (-1.0, 1.0)}
)
EXECUTION = (
    "lift_m", "lift_s", "shake_g", "shake_hz", "stop_m_per_s2", "knock_n_s", "off_mm", "off_deg",
    "misplacements",
)  # fmt: skip
NOISE = ("shift", "turn_deg", "normal_deg", "friction", "mass")


def executing(name):
    # a stop of any deceleration is short enough from a crawl
    return lambda value: ExecutionSettings(
        **{"mass_kg": 1.0, "stop_from_m_per_s": 1e-9, name: value}
    )


def stops_at(name, call):
    """Let a call refuse the setting or, if it takes that, a later argument that is always wrong."""

    def tried(value):
        with pytest.raises(gc.InputError) as raised:
            call(value)
        if str(raised.value).startswith(name):
            raise raised.value

    return tried


def regions(**settings):
    body, (grasp,) = grasps("tetrahedron", 0.5, 1)
    return gc.certify_regions(body, grasp, -1.0, **settings)


def closure(friction):
    (grasp,) = grasps("tetrahedron", 0.5, 1)[1]
    gc.force_closure(grasp.contacts, friction=friction)


def best(**settings):
    return gc.best_grasp(example_object("tetrahedron"), 0.5, clearance=-1.0, **settings)


def ceiling(parts):
    body = example_object("tetrahedron")
    return gc.quality_ceiling(body, (0, 1, 2, 3), 0.5, parts=parts, finger_radius=-1.0)


Settings = {
    "reach --mass-kg": (hand_flags.Reach, "mass_kg", executing("mass_kg")),
    "reach --torque-limit-n-m": (
        hand_flags.Reach, "torque_limit_n_m",
        lambda value: gc.load_hand("allegro").with_torque_limits(value, "a test"),
    ),
    "reach --clearance-m": (
        hand_flags.Reach, "clearance_m", lambda value: HandReach("a", "b", "limit", "", 1, value),
    ),
    "analyze --friction": (
        command_flags.Analyze, "friction", closure,
    ),
    "regions --reserve": (
        command_flags.Regions, "reserve", stops_at("reserve", lambda v: regions(reserve=v)),
    ),
    "regions --max-cones": (
        command_flags.Regions, "max_cones", stops_at("max_cones", lambda v: regions(max_cones=v)),
    ),
    "plan --gap": (command_flags.Plan, "gap", stops_at("gap", lambda v: best(gap=v))),
    "plan --time-limit-s": (
        command_flags.Plan, "time_limit_s",
        stops_at("time_limit_s", lambda v: best(time_limit_s=v)),
    ),
    "plan --jobs": (command_flags.Plan, "jobs", stops_at("jobs", lambda v: best(jobs=v))),
    "plan --ceiling": (flag_groups.Planning, "ceiling", stops_at("parts", ceiling)),
    "execute --mass-kg": (flag_groups.Mass, "mass_kg", executing("mass_kg")),
    "execute --damping-ratio": (
        flag_groups.Tips, "damping_ratio", lambda value: HeldSettings(damping_ratio=value),
    ),
    "patches": (flag_groups.Mesh, "patches", lambda value: PatchLimits(most=value)),
    "patch spread": (
        flag_groups.Mesh, "patch_spread_deg", lambda value: PatchLimits(spread_deg=value),
    ),
    "patch depth": (flag_groups.Mesh, "patch_depth", lambda value: PatchLimits(depth=value)),
    "max normal force": (
        flag_groups.Fingers, "max_normal_force",
        lambda value: FingerSettings(max_normal_force_n=value),
    ),
    "transfer --angle-deg": (
        flag_groups.Carrying, "angle_deg", lambda value: IfChanged(angle_deg=value),
    ),
    "random wrenches": (
        flag_groups.Testing, "random_wrenches", lambda value: sv.Agenda(random_wrenches=value),
    ),
    "synthetic": (
        dataset_flags.Learned, "synthetic",
        lambda value: Learning.of_table({"synthetic": value}, "learning"),
    ),
    **{
        f"execute {name}": (flag_groups.Executing, name, executing(name)) for name in EXECUTION
    },
    **{
        f"noise of {name}": (
            flag_groups.Repeats, f"noise_{name}", lambda v, name=name: replace(Noise(), **{name: v})
        )
        for name in NOISE
    },
}  # fmt: skip


def refuses(flags, field, value):
    """Whether the type of a flag refuses a value."""
    try:
        takes(types(flags)[field])(value)
    except ValueError:
        return True
    return False


@pytest.mark.parametrize("name", Settings)
def test_a_flag_and_python_refuse_the_same_values(name):
    flags, field, call = Settings[name]
    counts = int in parts_of(types(flags)[field])
    refused = set[bool]()
    for value in PROBES:
        if counts and not float(value).is_integer():
            continue
        given = int(value) if counts else value
        try:
            call(given)
            python = True
        except gc.InputError:
            python = False
        refused.add(python)
        assert refuses(flags, field, given) != python, (name, given)
    assert refused == {True, False}


def numbers_of(flags):
    """The flags of a command and its groups that are numbers, as class and name."""
    for name, kind in get_type_hints(flags, include_extras=True).items():
        parts = list(parts_of(kind))
        for part in parts:
            if isinstance(part, type) and is_dataclass(part):
                yield from numbers_of(part)
        if int in parts or float in parts:
            yield flags, name


def parts_of(kind):
    yield kind
    for part in get_args(kind):
        yield from parts_of(part)


def with_number(kind, number):
    """A value of a type, with one number in it that the others are not."""
    inner = [part for part in get_args(kind) if part is not type(None)]
    if get_origin(kind) is tuple:
        rest = [] if inner[-1] is Ellipsis else [1.0] * (len(inner) - 1)
        return (with_number(inner[0], number), *rest)
    return with_number(inner[0], number) if inner else number


def test_every_number_of_a_command_has_bounds():
    found = {each for command in get_args(Command) for each in numbers_of(command)}
    assert len(found) >= 90
    for flags, name in found:
        kind = types(flags)[name]
        for value in (math.nan, math.inf, -math.inf):
            assert refuses(flags, name, with_number(kind, value)), name
        if tuple in map(get_origin, parts_of(kind)):  # it is the number that is refused
            assert not refuses(flags, name, with_number(kind, 1.0)), name


def test_torsion_has_one_range_and_no_values_that_mujoco_would_raise():
    for value in (-1e-3, 0.0, 1e-5, 1.0, 1.1):
        if not refuses(flag_groups.Fingers, "torsion_m", value):
            assert PhysicsSettings(torsion_m=value).torsion_m == value
        else:
            with pytest.raises(gc.InputError):
                PhysicsSettings(torsion_m=value)
