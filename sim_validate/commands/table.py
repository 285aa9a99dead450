"""The commands of `graspproof`: where their flags and actions are, what they do, and examples.

Modules are named as text, so that neither help nor any command waits for what others need.
"""

from collections.abc import Mapping
from typing import NamedTuple


class Command(NamedTuple):
    """A command: module and class of its flags, module and function that runs it, and its help."""

    flags: str
    action: str
    help: str


COMMANDS: Mapping[str, Command] = {
    "run": Command(
        "commands.simulation_flags:RunFlags", "run:run_object",
        "Plan grasps, simulate them and negative controls (contacts that must fail); write all.",
    ),
    "plan": Command(
        "commands.flags:PlanFlags", "planning.plan:plan_file",
        "Find force-closure grasps of an object, each with a checked certificate of force "
        "closure.",
    ),
    "validate": Command(
        "commands.simulation_flags:ValidateFlags", "protocols.command:validate_file",
        "Simulate the grasps of a file in MuJoCo, with negative controls: contacts that must "
        "fail.",
    ),
    "execute": Command(
        "commands.simulation_flags:ExecuteFlags", "execution.command:execute_file",
        "Simulate grasps as a robot executes them: true mass, springy fingers, one fixed squeeze.",
    ),
    "scene": Command(
        "commands.simulation_flags:SceneFlags", "execution.command:write_scenes",
        "Write grasps as MuJoCo scenes, which MuJoCo's own viewer can open.\n\n"
        "Without a mass, the scenes are those of `validate`: masses are scaled to suit the grasp, "
        "and there is no gravity. With a mass or a density, objects have their true mass and are "
        "held under gravity, as in the command `execute`.",
    ),
    "export": Command(
        "commands.simulation_flags:ExportFlags", "report.command:export_grasps",
        "Write grasps for other programs: as a 3D scene, or a hand in them for Isaac.",
    ),
    "view": Command(
        "commands.flags:ViewFlags", "report.command:view_grasp",
        "Look at a grasp: in MuJoCo's viewer if there is a display, or in a file.",
    ),
    "report": Command(
        "commands.flags:ReportFlags", "report.command:report_folder",
        "Write the results of a run as pages that open in a browser, without any network.",
    ),
    "regions": Command(
        "commands.simulation_flags:RegionFlags", "planning.regions:certify_file",
        "Prove regions in which each finger may stand anywhere, whatever the others do.",
    ),
    "replay": Command(
        "commands.flags:ReplayFlags", "report.command:replay_trial",
        "Simulate one recorded trial again, and write its motion, sample by sample, and a clip.",
    ),
    "analyze": Command(
        "commands.flags:AnalyzeFlags", "planning.analyze:analyze_file",
        "Judge contacts of any origin: force closure with a certificate, quality, wrench limits.",
    ),
    "transfer": Command(
        "commands.flags:TransferFlags", "planning.transfer:transfer_file",
        "Carry grasps over to a part that has changed since they were planned, and judge them "
        "anew.",
    ),
    "reach": Command(
        "hands.flags:Reach", "protocols.judging_command:judge_reach",
        "Look for poses in which a hand stands in grasps: palm pose and joints, checked exactly.",
    ),
    "judge": Command(
        "judge.flags:JudgeFlags", "judge.command:judge_files",
        "Judge recorded grasps, whoever made them: proofs, published tests, and our own trial.",
    ),
    "hand": Command(
        "hands.flags:ShownHand", "hands.command:show_hand",
        "Show what a hand was read as: fingers, joints with ranges and torque limits, fingertips.",
    ),
    "dataset build": Command(
        "datasets.flags:BuildFlags", "datasets.command:build_dataset",
        "Plan and simulate grasps of many objects and write tables; run it again to resume.",
    ),
    "dataset import": Command(
        "datasets.flags:ImportFlags", "datasets.command:import_dataset",
        "Judge grasps made by another tool, simulate them, and write them as a dataset.",
    ),
    "dataset verify": Command(
        "datasets.flags:VerifyFlags", "judge.command:verify_folder",
        "Check files and rows of a dataset, prove force closure again, and redo a sample; or check "
        "the judgements of records.",
    ),
    "dataset export": Command(
        "datasets.flags:ExportFlags", "datasets.command:export_dataset",
        "Write the poses of a dataset's hand for Isaac, a file for each object.",
    ),
    "baseline record": Command(
        "baselines.flags:RecordFlags", "baselines.command:record_baseline",
        "Simulate grasps and write a baseline: a file that records how stable each grasp is.",
    ),
    "baseline check": Command(
        "baselines.flags:CheckFlags", "baselines.command:check_baseline",
        "Simulate the grasps of a baseline again, and report how each result has changed.",
    ),
    "inspect": Command(
        "commands.flags:InspectFlags", "planning.objects:inspect_object",
        "Show a mesh as a polyhedron: faces, mass properties, face quadruples to grasp by.",
    ),
    "objects": Command(
        "commands.flags:ObjectsFlags", "planning.objects:list_objects",
        "List the names of the built-in objects.",
    ),
    "schema": Command(
        "commands.flags:SchemaFlags", "schemas.command:show_schema",
        "Print the JSON Schema of a kind of files, or list the kinds of files.",
    ),
    "doctor": Command(
        "commands.flags:DoctorFlags", "doctor:check_installation",
        "Check this installation: versions, solvers and simulator.",
    ),
}  # fmt: skip
GROUPS: Mapping[str, str] = {
    "dataset": "Build a dataset of grasps of many objects; check or export datasets.",
    "baseline": (
        "Record simulation results of grasps, and notice later when their stability changes."
    ),
}
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
export plan/grasps.json -o grasps.glb
export reached/grasps.json --to isaac -o grasps.yaml
regions plan/grasps.json --out plan
regions plan/grasps.json --reserve 0.1 --recenter --limit 5 --out smaller
replay graspproof-out/wedge --grasp c-0-1-2-7 --out replay
replay graspproof-out/wedge --grasp c-0-1-2-7 --wrench weakest --out replay
analyze contacts.json --friction 0.5 --wrench 0 0 -3 0 0 0
analyze plan/grasps.json --json
transfer plan/grasps.json part-v2.stl --unit mm --out carried
transfer plan/grasps.json part-v2.stl --unit mm --distance-m 0.005 --angle-deg 2
reach plan/grasps.json --hand allegro --out reached
reach plan/grasps.json --hand my_hand.xml --fingertips ff,mf,rf,th --table-down 0 0 -1
reach plan/grasps.json --hand leap --simulate --protocol dexgraspbench --out reached
judge grasps/ --hand allegro --objects meshes/ --out judged
judge grasps.npz --hand my_hand.xml --objects mug.obj --test dexonomy --no-trial --out judged
judge dexgraspnet/ --hand my_hand.xml --objects meshes/ --object "*mug*" --limit 100 --out judged
hand allegro
hand my_hand.xml --fingertips ff,mf,rf,th
inspect part.stl --unit mm
inspect part.stl --unit mm --picture part.png
inspect mug.obj --scale 0.00026824
objects
schema
schema verdicts
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
dataset verify judged
dataset export ds --out isaac
baseline record grasps.json -o wedge.baseline.json
baseline check wedge.baseline.json --strict
""".splitlines()
HELP = {"-h", "--help"}


def examples_for(arguments: list[str]) -> str:
    """Return the examples of a command if the arguments ask for its help, else an empty text."""
    if not HELP & set(arguments):
        return ""
    words = arguments[: 2 if arguments[0] in GROUPS else 1]
    shown = [f"  graspproof {line}\n" for line in EXAMPLES if line.split()[: len(words)] == words]
    return "\nexamples:\n" + "".join(shown) if shown else ""
