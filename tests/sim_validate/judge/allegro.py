"""Records of the Allegro hand at a dodecahedron, as tests of the judge need them."""

from dataclasses import replace
from functools import cache

import numpy as np

import grasp_core as gc
from grasp_core.objects.convex_pieces import PiecedObject
from sim_validate.hands.dexgraspbench import ROOT_POSE, dex_record, pose_of
from sim_validate.judge.hands import judged_hand
from sim_validate.judge.judging import Stage
from sim_validate.judge.records import HandRecord, Posture
from sim_validate.protocols.settings import JudgeSettings
from tests.grasp_core.hands.gripping import reaches, scaled

SETTINGS = JudgeSettings(tests=())
OPEN = 1
"""A finger that is kept open."""


def body():
    return scaled("dodecahedron", 0.035)


@cache
def hand():
    return judged_hand("allegro")


@cache
def stage(settings=SETTINGS):
    return Stage(hand(), PiecedObject(body()), settings)


@cache
def record():
    """A record of DexGraspBench's kind, from a pose that was searched."""
    found = reaches("allegro", "dodecahedron", 0.035)
    reach = next(each for each in found if each.pregrasp is not None)
    made = dex_record(gc.load_hand("allegro"), reach, "dodecahedron")
    stages = [Posture(pose_of(each), each[ROOT_POSE:])
              for each in (made.pregrasp, made.grasp, made.squeeze)]  # fmt: skip
    opened, grasp, squeeze = stages
    return HandRecord("0.npy", "dodecahedron", 1.0, (), grasp, opened, squeeze, np.eye(3))


def bent(posture, joints):
    """A posture with other angles."""
    return replace(posture, joints=np.array(joints))


def with_open_finger():
    """The record with one finger as open as before its grasp."""
    usual, own = record(), slice(4 * OPEN, 4 * OPEN + 4)
    grasp, squeeze = np.array(usual.grasp.joints), np.array(usual.squeeze.joints)
    grasp[own] = squeeze[own] = usual.pregrasp.joints[own]
    return replace(usual, id="open", grasp=bent(usual.grasp, grasp),
                   squeeze=bent(usual.squeeze, squeeze))  # fmt: skip


def lifted(away_m):
    """The record with its hand moved off the object along z."""
    up = np.zeros((4, 4))
    up[2, 3] = away_m
    usual = record()
    moved = {name: replace(getattr(usual, name), root=getattr(usual, name).root + up)
             for name in ("pregrasp", "grasp", "squeeze")}  # fmt: skip
    return replace(usual, id="away", **moved)
