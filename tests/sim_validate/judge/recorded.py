"""Records of grasps for the tests of their readers, and files of them as NumPy writes them."""

import io
import pickle

import numpy as np
from scipy.spatial.transform import Rotation

from sim_validate.judge.formats.reading import read_records

JOINTS = 3


def random_pose(rng):
    """A pose (4, 4) within half a metre."""
    pose = np.eye(4)
    pose[:3, :3] = Rotation.random(random_state=rng).as_matrix()
    pose[:3, 3] = rng.uniform(-0.5, 0.5, 3)
    return pose


def seven(pose):
    """A pose as position and quaternion (w, x, y, z)."""
    turned = Rotation.from_matrix(pose[:3, :3]).as_quat(scalar_first=True)
    return np.concatenate([pose[:3, 3], turned])


def qpos(rng):
    """A random pose (4, 4), and the numbers of a posture there."""
    pose, joints = random_pose(rng), rng.uniform(-1.0, 1.0, JOINTS)
    return pose, np.concatenate([seven(pose), joints])


def pickled(value, protocol=4):
    """The bytes of a `.npy` file with a pickle of some protocol."""
    array = value if isinstance(value, np.ndarray) else np.array(value, dtype=object)
    held = io.BytesIO()
    header = {"descr": "|O", "fortran_order": False, "shape": array.shape}
    np.lib.format.write_array_header_1_0(held, header)
    return held.getvalue() + pickle.dumps(array, protocol=protocol)


def listed(tables):
    """An array of dictionaries."""
    found = np.empty(len(tables), dtype=object)
    found[:] = tables
    return found


def net_tables(rng, count):
    """What DexGraspNet lists of some grasps."""
    return [
        {"qpos": {"robot0:FFJ3": float(rng.uniform(-1, 1)), "robot0:FFJ2": 0.5,
                  **{f"WRJR{axis}": float(rng.uniform(-3, 3)) for axis in "xyz"},
                  **{f"WRJT{axis}": float(rng.uniform(-0.3, 0.3)) for axis in "xyz"}},
         "scale": np.float64(0.1), "qpos_st": {"other": 1.0}, "E_pen": 0.2}
        for _ in range(count)
    ]  # fmt: skip


def records(path, **asked):
    """All records of one file or folder."""
    return list(read_records([path], **asked))
