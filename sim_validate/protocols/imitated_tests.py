"""Published tests that run in Isaac Gym or Isaac Sim (PhysX): loads, durations, thresholds.

MuJoCo reproduces none of their contacts, so each is an imitation, and says so.
"""

from dataclasses import replace

from scenes.physics import PhysicsSettings
from sim_validate.protocols.mujoco_tests import SIX, scaled
from sim_validate.protocols.published import Passing, PublishedProtocol, Run, Source, Step, Triple

OUR_PHYSICS = PhysicsSettings()
"""The settings of closure tests. Under MuJoCo's other integrators stiff contacts under a hand creep
by centimetres where they should hold."""
PHYSX = "PhysX and its contacts are replaced by MuJoCo's with stiff contacts and Coulomb friction"
NO_PENETRATION = "Fingers of a planned grasp touch without overlap, so its limit is not asked for."
GRAVITY = 9.8
PULL_N, PULL_S, PAUSE_S, AFTER_S = 3.0, 0.5, 0.25, 0.25


def _graspqp_run(one: Triple, other: Triple) -> Run:
    """Return a pull and its opposite, with pauses; looks are three times a second."""
    look = 1.0 / 3.0
    return (
        Step(PAUSE_S),
        Step(PULL_S, force_n=scaled(one, PULL_N), look_s=look),
        Step(PAUSE_S),
        Step(PULL_S, force_n=scaled(other, PULL_N), look_s=look),
    )


GRASPQP = PublishedProtocol(
    name="graspqp",
    version="branch main, PullEventCfg and AgentEvalWrapper",
    sources=(
        Source(
            "leggedrobotics/graspqp", "744ffbc12582773091f13414e80f84dab50ea88a",
            ("graspqp_isaaclab/src/graspqp_isaaclab/tasks/manipulation/grasp/grasp_mining_env.py",
             "graspqp_isaaclab/src/graspqp_isaaclab/tasks/manipulation/grasp/mdp/events.py",
             "graspqp_isaaclab/src/graspqp_isaaclab/agents/eval.py"),
        ),
    ),
    imitates=f"{PHYSX}; its compliance of 1e5 N/m is left out.",
    ours=(
        "A trial passes as theirs is counted: if the object stays along one of the three axes.",
        "One trial is run, where theirs count half of several.",
        "Fingers close before the first pull; objects have the density of water.",
    ),
    friction=1.0,
    timestep_s=1.0 / 200.0,
    close_s=0.4,
    squeeze_s=0.4,
    runs=(
        _graspqp_run(SIX[5], SIX[4]), _graspqp_run(SIX[1], SIX[0]), _graspqp_run(SIX[3], SIX[2]),
    ),
    passing=Passing(most_m=0.03, runs=1),
    physics=OUR_PHYSICS,
)  # fmt: skip
TUGS: tuple[Triple, ...] = (
    (0.0, 0.0, 1.0), (0.0, 2.0, 1.0), (0.0, -2.0, 1.0), (2.0, 0.0, 1.0), (-2.0, 0.0, 1.0),
)  # fmt: skip
OBLIQUE = 5.0**0.5
"""Length of the oblique tugs' directions before they are scaled to one."""
TUG_ACCELERATION = 9.81
"""One g, as the size of the simulator's gravity."""


def _tug(way: Triple) -> Step:
    size = OBLIQUE if any(way[:2]) else 1.0
    return Step(0.5, pull_m_s2=scaled(way, TUG_ACCELERATION / size))


GRASPDATAGEN = PublishedProtocol(
    name="graspdatagen",
    version="branch main, grasp_sim.py with its defaults",
    sources=(
        Source(
            "NVlabs/GraspDataGen", "8e090052aff8f054a1141dfcbd6ac320d0fd3432",
            ("scripts/graspgen/grasp_sim.py", "docs/components/grasp-sim.md"),
        ),
    ),
    imitates=f"{PHYSX}.",
    ours=(
        "Both fingers of a gripper are two fingers here, whichever they are.",
        "Contact is looked at after each tug, where theirs is after the last.",
        "Objects have the density of water.",
    ),
    friction=1.0,
    timestep_s=1.0 / 250.0,
    close_s=0.5,
    squeeze_s=0.5,
    runs=(tuple(_tug(way) for way in TUGS),),
    passing=Passing(fingers=2),
    physics=OUR_PHYSICS,
)  # fmt: skip
DEXGRASPNET = PublishedProtocol(
    name="dexgraspnet",
    version="branch main, IsaacValidator with its defaults",
    sources=(
        Source(
            "PKU-EPIC/DexGraspNet", "bdb423c37d7e90e395e9d07cdd8d6aaa793bc06b",
            ("grasp_generation/utils/isaac_validator.py",
             "grasp_generation/scripts/validate_grasps.py"),
        ),
    ),
    imitates=f"{PHYSX}.",
    ours=(NO_PENETRATION,),
    friction=3.0,
    timestep_s=1.0 / 120.0,
    density_kg_per_m3=500.0,
    servo_n_m_per_rad=1000.0,
    runs=tuple((Step(100.0 / 60.0, pull_m_s2=scaled(way, GRAVITY)),) for way in SIX),
    passing=Passing(fingers=1, most_overlap_m=0.001),
    physics=OUR_PHYSICS,
)  # fmt: skip
GENDEXGRASP = PublishedProtocol(
    name="gendexgrasp",
    version="branch main, grasp_test_force.yaml",
    sources=(
        Source(
            "tengyu-liu/GenDexGrasp", "29fe7efc558b8cc3ce2d8e67c9c22b014adc21c7",
            ("envs/tasks/grasp_test_force.yaml", "envs/tasks/grasp_test_force_shadowhand.py",
             "run_grasp_test.py"),
        ),
    ),
    imitates=f"{PHYSX}; the object's damping (linear 10, angular 100) is left out.",
    ours=("The 5,000 N per cubic metre of its file are 0.5 m/s^2 at its density.",),
    friction=10.0,
    timestep_s=1.0 / 120.0,
    density_kg_per_m3=10_000.0,
    close_s=0.4,
    squeeze_s=0.4,
    servo_n_m_per_rad=400.0,
    runs=(
        tuple(
            Step(50.0 / 60.0, pull_m_s2=scaled(way, 0.5))
            for way in (SIX[1], SIX[0], SIX[3], SIX[2], SIX[5], SIX[4])
        ),
    ),
    passing=Passing(most_m=0.02, since="each step"),
    physics=OUR_PHYSICS,
)  # fmt: skip
MGG_SOURCES = (
    Source(
        "IRVLUTD/isaac_sim_grasping", "ee00ac4ef8dc5541d4b56c4eb516c09352f66e7f",
        ("tests.py", "docs/tests.md", "README.md", "grippers/gripper_isaac_info.json"),
    ),
)  # fmt: skip
MGG_OURS = (
    "Friction is 1, which its files do not state; objects have the density of water.",
    "Fingers close within 0.8 s, where theirs close as long as contacts are fewer than asked for.",
)
MGG_G = 9.81
DOWN: Triple = (0.0, 0.0, -1.0)
MULTIGRIPPERGRASP = PublishedProtocol(
    name="multigrippergrasp",
    version="branch main, test gravity, 3 s",
    sources=MGG_SOURCES,
    imitates=f"{PHYSX}.",
    ours=MGG_OURS,
    friction=1.0,
    timestep_s=1.0 / 240.0,
    close_s=0.4,
    squeeze_s=0.4,
    runs=((Step(3.0, pull_m_s2=scaled(DOWN, MGG_G), look_s=0.1),),),
    passing=Passing(most_m=0.3, since="after closing"),
    physics=OUR_PHYSICS,
)
MULTIGRIPPERGRASP_AXES = replace(
    MULTIGRIPPERGRASP,
    name="multigrippergrasp-axes",
    version="branch main, test axes_forces, 6 s",
    runs=(tuple(Step(1.0, pull_m_s2=scaled(way, 0.5), look_s=0.1) for way in SIX),),
    passing=Passing(most_m=0.02),
)
MULTIGRIPPERGRASP_RAMP = replace(
    MULTIGRIPPERGRASP,
    name="multigrippergrasp-ramp",
    version="branch main, test gradual_gravity, 3 s",
    runs=(
        (
            Step(2.1, pull_m_s2=scaled(DOWN, MGG_G), rises=True, look_s=0.1),
            Step(0.9, pull_m_s2=scaled(DOWN, MGG_G), look_s=0.1),
        ),
    ),
    passing=Passing(most_m=0.1, since="after closing"),
)
LIFT_S = 125.0 / 60.0 * 0.8
"""Eight of ten parts of the last phase, which has 125 of 200 steps of 1/60 s, lift the object."""
GET_A_GRIP = PublishedProtocol(
    name="get-a-grip",
    version="branch main, GRAVITY_AND_TABLE, five copies with noise",
    sources=(
        Source(
            "tylerlum/get_a_grip", "0492901c9b997647a78b575b29c761f86c1cf5ec",
            ("get_a_grip/dataset_generation/utils/isaac_validator.py",
             "get_a_grip/dataset_generation/scripts/eval_grasp_config_dict.py",
             "docs/dataset_generation.md"),
        ),
    ),
    imitates=f"{PHYSX}.",
    ours=(
        "Fingers of three links count as one finger each; forbidden contacts of links are not "
        "asked for.",
        "The table holds the object until the lift begins; the turn is one angle, where theirs is "
        "the largest of three.",
        "A grasp passes if all copies do, where theirs is given the share that does.",
    ),
    friction=0.9,
    timestep_s=1.0 / 120.0,
    density_kg_per_m3=500.0,
    close_s=0.25,
    servo_n_m_per_rad=50.0,
    runs=(
        (
            Step(LIFT_S, pull_m_s2=scaled(DOWN, GRAVITY), line_m=(0.0, 0.0, 0.2)),
            Step(0.25 * LIFT_S, pull_m_s2=scaled(DOWN, GRAVITY)),
        ),
    ),
    passing=Passing(most_m=0.1, most_deg=45.0, fingers=3),
    copies=5,
    noise_m=0.005,
    noise_deg=5.0,
    physics=OUR_PHYSICS,
)  # fmt: skip
IMITATED_TESTS = (
    GRASPQP, GRASPDATAGEN, DEXGRASPNET, GENDEXGRASP, MULTIGRIPPERGRASP, MULTIGRIPPERGRASP_AXES,
    MULTIGRIPPERGRASP_RAMP, GET_A_GRIP,
)  # fmt: skip
