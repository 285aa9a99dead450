"""How many grasps a hand reaches, how long it takes, and whether the poses are what they claim.

    python -m tests.benchmarks.reach [--meshes FOLDER] [--limit 100] [--quick]
        [--hands NAME,NAME] [--jobs 2]

Eight built-in objects of 35 mm radius, four of them not convex, and up to four scans of a folder
scaled to it; the best grasps for fingers as thick as the hand's tips. For each object: grasps, how
many are reached with and without aiming at regions, the median and mean time of one search, the
median without regions, how the others ended, and how many poses open and have a straight way in.
`--jobs 1` measures times on a machine whose cores share their work.

Every pose is then checked by code that shares nothing with the search: joints against their ranges;
distances between the hand's parts, and from objects that are not scans, by MuJoCo's
`mj_geomDistance` on a compiled model; distances of 20,000 points of the surface, strewn by trimesh,
from every shape, in NumPy; and force closure by critical friction. Overlaps above 0.1 mm count.
"""

import argparse
import sys
import time
from collections import Counter
from itertools import combinations, pairwise
from pathlib import Path

import mujoco
import numpy as np
import trimesh
from scipy.spatial import ConvexHull

import grasp_core as gc
import scenes
from grasp_core.hands.kinematics import places
from scenes.execution.surface import touched_solids
from sim_validate.parallel.processes import available_cores, each
from tests.hand_models import hand_mjcf, numbers

FRICTION, RADIUS_M, APPROACH_M = 0.5, 0.035, 0.03
BUILT_IN = ("box", "dodecahedron", "wedge", "octahedron", "l-bracket", "hex-nut", "cross", "mug")
SCANS = ("003_cracker_box", "006_mustard_bottle", "036_wood_block", "061_foam_brick")
HANDS = ("allegro", "leap")
ALLOWED_M, POINTS, FAR_M = 1e-4, 20_000, 0.002


def scaled(body):
    vertices = (body.vertices - body.center_of_mass) * RADIUS_M / body.radius
    faces = "planar" if body.patches is None else "patches"
    return gc.Polyhedron.from_mesh(vertices, body.triangles, name=body.name, faces=faces)


def mesh_text(name, points):
    return f'<mesh name="{name}" vertex="{numbers(points)}"/>'


class Judge:
    """MuJoCo's model of a hand and an object, and points of the object's surface."""

    def __init__(self, hand, body):
        self.hand, self.is_scan = hand, body.patches is not None
        solids = () if self.is_scan else touched_solids(body, np.zeros((1, 3)), 1.0)
        asset = "".join(mesh_text(f"o{i}", points) for i, points in enumerate(solids))
        shift = numbers(body.center_of_mass)
        geoms = "".join(f'<geom name="o{i}" type="mesh" mesh="o{i}"/>' for i in range(len(solids)))
        objects = f'<body name="object" pos="{shift}">{geoms}</body>' if solids else ""
        self.model = mujoco.MjModel.from_xml_string(hand_mjcf(hand, asset, objects))
        self.data = mujoco.MjData(self.model)
        names = [self.model.geom(i).name for i in range(self.model.ngeom)]
        self.solids = [i for i, name in enumerate(names) if name.startswith("o")
                       and name[1:].isdigit()]  # fmt: skip
        own = [i for i in range(self.model.ngeom) if i not in self.solids]
        self.own = own
        link = {i: self.model.body(int(self.model.geom_bodyid[i])).name for i in own}
        beside = {frozenset(p) for p in hand.ignored_pairs}
        for finger in hand.fingers:
            chain = ["palm", *(each.name for each in finger.links)]
            beside |= {frozenset(p) for p in pairwise(chain)}
        self.pairs = [
            (i, j) for i, j in combinations(own, 2)
            if link[i] != link[j] and frozenset((link[i], link[j])) not in beside
        ]  # fmt: skip
        mesh = trimesh.Trimesh(body.vertices, body.triangles, process=False)
        self.points = np.vstack(
            [body.vertices, trimesh.sample.sample_surface(mesh, POINTS, seed=0)[0]]
        )

    def overlap(self, found):
        """The deepest overlap by MuJoCo [m]."""
        pose, quaternion = found.palm_pose, np.empty(4)
        mujoco.mju_mat2Quat(quaternion, pose[:3, :3].ravel())
        self.data.mocap_pos[0], self.data.mocap_quat[0] = pose[:3, 3], quaternion
        for joint, angle in zip(self.hand.joints, found.joints, strict=True):
            self.data.joint(joint.name).qpos = angle
        mujoco.mj_forward(self.model, self.data)
        pairs = [*self.pairs, *((i, j) for i in self.own for j in self.solids)]
        return -min(
            mujoco.mj_geomDistance(self.model, self.data, i, j, 0.01, None) for i, j in pairs
        )

    def depth(self, found):
        """How deep points of the surface are inside shapes [m]."""
        at, deepest = places(self.hand, found.joints, found.palm_pose), -FAR_M
        frames = [(s, found.palm_pose[:3, :3], found.palm_pose[:3, 3]) for s in self.hand.palm]
        blocks = [f for f in self.hand.fingers if f.tip.corners is not None]
        covers = {id(f.links[-1].shapes[-1]) for f in blocks}  # no parts of the hand
        frames += [(s, at.link_rotations[0, k], at.link_positions[0, k])
                   for k, link in enumerate(self.hand.links) for s in link.shapes
                   if id(s) not in covers]  # fmt: skip
        for shape, rotation, position in frames:
            middle, reach = position + rotation @ shape.position, np.linalg.norm(shape.half_sizes)
            near = np.linalg.norm(self.points - middle, axis=1) <= reach + shape.radius + FAR_M
            if not near.any():
                continue
            local = (self.points[near] - position) @ rotation - shape.position
            out = np.abs(local @ shape.rotation) - shape.half_sizes
            away = np.linalg.norm(np.maximum(out, 0.0), axis=1) + np.minimum(out.max(axis=1), 0.0)
            deepest = max(deepest, float(shape.radius - away.min()))
        for finger in self.hand.fingers:
            last = self.hand.links.index(finger.links[-1])
            local = (self.points - at.link_positions[0, last]) @ at.link_rotations[0, last]
            if finger.tip.corners is None:
                away = np.linalg.norm(local - finger.tip.center, axis=1).min()
                deepest = max(deepest, float(finger.tip.radius - away))
            else:
                sides = ConvexHull(finger.tip.corners).equations
                within = -(local @ sides[:, :3].T + sides[:, 3]).max(axis=1)
                deepest = max(deepest, float(within.max()))
        return deepest


def examine(case):
    """The line of one object and one hand."""
    name, folder, hand_name, limit = case
    path = None if folder is None else Path(folder) / f"{name}.ply"
    body = scaled(scenes.example_object(name) if path is None else gc.load_polyhedron(path))
    hand = gc.load_hand(hand_name)
    finger = gc.Finger(hand.fingers[0].tip.radius, APPROACH_M)
    grasps = gc.plan(body, FRICTION, limit=limit, finger=finger).grasps
    gc.reach_with(hand, body, grasps[0], FRICTION)  # what is made once per hand and object
    judge, found, plain, seconds, plain_seconds = Judge(hand, body), [], 0, [], []
    for grasp in grasps:
        begun = time.process_time()
        found.append(gc.reach_with(hand, body, grasp, FRICTION))
        seconds.append(time.process_time() - begun)
        begun = time.process_time()
        plain += gc.reach_with(hand, body, grasp, FRICTION, regions=False).reached
        plain_seconds.append(time.process_time() - begun)
    good = [one for one in found if one.reached]
    low, high = hand.ranges.T
    wrong = Counter(
        limits=sum(((one.joints < low) | (one.joints > high)).any() for one in good),
        overlap=sum(judge.overlap(one) > ALLOWED_M for one in good),
        depth=sum(judge.depth(one) > ALLOWED_M for one in good),
        closure=sum(
            gc.critical_friction(
                [c.position for c in one.contacts], [c.normal for c in one.contacts]
            ) >= FRICTION
            for one in good
        ),
    )  # fmt: skip
    return {
        "hand": hand_name, "object": name, "grasps": len(grasps), "reached": len(good),
        "plain": plain, "seconds": seconds, "plain_seconds": plain_seconds, "wrong": wrong,
        "reasons": Counter(one.reason for one in found if not one.reached),
        "opens": sum(one.pregrasp is not None for one in good),
        "ways": sum(one.approach is not None for one in good),
        "within": sum(all(one.within_regions) for one in good),
    }  # fmt: skip


def main():
    """Print a line per hand and object, and the sums; 1 if a pose is not what it claims."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="five grasps of each object")
    parser.add_argument("--limit", type=int, default=100, help="grasps of each object")
    parser.add_argument("--meshes", type=Path, metavar="FOLDER")
    parser.add_argument("--hands", type=lambda text: text.split(","), default=HANDS)
    parser.add_argument("--jobs", type=int, default=available_cores())
    asked = parser.parse_args()
    places = [(name, None) for name in BUILT_IN]
    places += [(name, asked.meshes) for name in SCANS] if asked.meshes else []
    limit = 5 if asked.quick else asked.limit
    cases = [(*place, hand, limit) for hand in asked.hands for place in places]
    print("hand     object              grasps reached contacts-only median ms mean ms "
          "contacts-only ms  opens ways within  not reached")  # fmt: skip
    rows = []
    for row in each(examine, cases, jobs=asked.jobs):
        rows.append(row)
        ms, plain_ms = 1e3 * np.array(row["seconds"]), 1e3 * np.array(row["plain_seconds"])
        print(f"{row['hand']:8} {row['object']:20} {row['grasps']:5d} {row['reached']:7d} "
              f"{row['plain']:13d} {np.median(ms):9.0f} {ms.mean():7.0f} "
              f"{np.median(plain_ms):16.0f} {row['opens']:6d} {row['ways']:4d} "
              f"{row['within']:6d}  {dict(row['reasons'])}",
              flush=True)  # fmt: skip
    bad = 0
    for hand in asked.hands:
        own = [row for row in rows if row["hand"] == hand]
        total, good, plain = (
            sum(row[key] for row in own) for key in ("grasps", "reached", "plain")
        )
        ms, alone = (1e3 * np.concatenate([row[key] for row in own])
                     for key in ("seconds", "plain_seconds"))  # fmt: skip
        wrong = sum((row["wrong"] for row in own), Counter())
        bad += sum(wrong.values())
        print(f"{hand}: {good} of {total} grasps reached ({good / total:.1%}), {plain} "
              f"({plain / total:.1%}) at the planned contacts; median {np.median(ms):.0f} and "
              f"{np.median(alone):.0f} ms, mean {ms.mean():.0f} and {alone.mean():.0f} ms; wrong "
              f"claims: {dict(wrong) or 'none'}")  # fmt: skip
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
