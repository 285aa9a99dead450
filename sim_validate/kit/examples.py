"""Examples that `--help` shows below the description of a command."""

EXAMPLES: dict[str, tuple[str, ...]] = {
    "run": (
        "run wedge",
        "run part.stl --unit mm --friction 0.3 --limit 20 --limits ramp --out results",
        "run wedge --limit 10 --execute --mass-kg 0.3",
    ),
    "plan": (
        "plan wedge --limit 10 --out plan",
        "plan wedge --limit 10 --best --gap 0.05 --time-limit-s 120 --out plan",
        "plan wedge --limit 10 --best --measure weight --out plan",
        "plan part.stl --unit mm --finger-radius-m 0.006 --approach-m 0.05 --out plan",
    ),
    "validate": (
        "validate plan/grasps.json --out plan",
        "validate plan/grasps.json --protocol dexgraspbench --protocol dexonomy --out plan",
        "validate plan/grasps.json --weight-n 3 --weight-down 0 0 -1 --limits ramp --repeats 20",
    ),
    "execute": (
        "execute plan/grasps.json --mass-kg 0.3 --out plan",
        "execute plan/grasps.json --density-kg-m3 2700 --trials lift,shake --shake-g 2",
    ),
    "scene": (
        "scene plan/grasps.json --out scenes",
        "scene plan/grasps.json --grasp c-0-1-2-7",
        "scene plan/grasps.json --mass-kg 0.3 --out held",
    ),
    "export": (
        "export plan/grasps.json --to gltf -o grasps.glb",
        "export plan/grasps.json --to moveit --limit 5 -o grasps.yaml",
    ),
    "regions": (
        "regions plan/grasps.json --out plan",
        "regions plan/grasps.json --reserve 0.1 --recenter --limit 5 --out smaller",
    ),
    "replay": (
        "replay graspproof-out/wedge --grasp c-0-1-2-7 --out replay",
        "replay graspproof-out/wedge --grasp c-0-1-2-7 --wrench weakest --out replay",
    ),
    "analyze": (
        "analyze contacts.json --friction 0.5 --wrench 0 0 -3 0 0 0",
        "analyze plan/grasps.json --json",
    ),
    "transfer": (
        "transfer plan/grasps.json part-v2.stl --unit mm --out carried",
        "transfer plan/grasps.json part-v2.stl --unit mm --distance-m 0.005 --angle-deg 2",
    ),
    "reach": (
        "reach plan/grasps.json --hand allegro --out reached",
        "reach plan/grasps.json --hand my_hand.xml --fingertips ff,mf,rf,th --table 0 0 -1",
        "reach plan/grasps.json --hand leap --simulate --protocol dexgraspbench --out reached",
    ),
    "hand": (
        "hand allegro",
        "hand my_hand.xml --fingertips ff,mf,rf,th",
    ),
    "inspect": (
        "inspect part.stl --unit mm",
        "inspect part.stl --unit mm --picture part.png",
        "inspect mug.obj --scale 0.00026824",
    ),
    "objects": ("objects",),
    "doctor": ("doctor", "doctor --compile"),
    "view": (
        "view DIR/grasps.json --grasp c-0-1-2-7",
        "view DIR/grasps.json --picture grasp.png --page grasp.html --clip grasp.webp",
    ),
    "report": (
        "report graspproof-out/wedge",
        "report graspproof-out --out all-objects",
    ),
    "dataset build": (
        "dataset build meshes/ wedge --frictions 0.3,0.5 --limit 20 --out ds",
        "dataset build ds/config.toml --out again",
    ),
    "dataset import": ("dataset import contacts.json mug.obj --out judged",),
    "dataset verify": ("dataset verify ds",),
    "dataset export": ("dataset export ds --to isaac --out isaac",),
    "baseline record": ("baseline record grasps.json -o wedge.baseline.json",),
    "baseline check": ("baseline check wedge.baseline.json --strict",),
}
"""Examples of each command, without the program's name."""
HELP = {"-h", "--help"}


def examples_for(arguments: list[str]) -> str:
    """Return the examples of a command if the arguments ask for its help, else an empty text."""
    if not HELP & set(arguments):
        return ""
    shown = next((EXAMPLES[" ".join(arguments[:words])] for words in (2, 1)
                  if " ".join(arguments[:words]) in EXAMPLES), ())  # fmt: skip
    return "\nexamples:\n" + "".join(f"  graspproof {line}\n" for line in shown) if shown else ""
