"""Records of DexGraspNet: angles by name, and Euler angles about fixed axes."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sim_validate.judge.formats.dexgraspnet import euler_rotation
from sim_validate.judge.records import BadRecord
from tests.sim_validate.judge.recorded import listed, net_tables, pickled, records


def test_euler_angles_are_about_fixed_axes_x_then_y_then_z():
    rng = np.random.default_rng(0)
    for _ in range(50):
        angles = rng.uniform(-4, 4, 3)
        wanted = Rotation.from_euler("xyz", angles).as_matrix()  # extrinsic in small letters
        assert euler_rotation(*angles) == pytest.approx(wanted, abs=1e-14)


@pytest.mark.parametrize("protocol", range(6))
def test_a_list_is_read_with_names_and_the_object_of_the_file(protocol, tmp_path):
    given = net_tables(np.random.default_rng(1), 3)
    (tmp_path / "core-mug-1a.npy").write_bytes(pickled(listed(given), protocol))
    found = records(tmp_path)
    assert [each.id for each in found] == [f"core-mug-1a.npy#{k}" for k in range(3)]
    for table, each in zip(given, found, strict=True):
        angles = table["qpos"]
        turn = Rotation.from_euler("xyz", [angles[f"WRJR{axis}"] for axis in "xyz"]).as_matrix()
        assert (each.object, each.scale) == ("core-mug-1a", 0.1)
        assert each.joint_names == ("robot0:FFJ3", "robot0:FFJ2")
        assert each.grasp.joints.tolist() == [angles["robot0:FFJ3"], 0.5]
        assert each.grasp.root[:3, :3] == pytest.approx(turn, abs=1e-12)
        assert each.grasp.root[:3, 3].tolist() == [angles[f"WRJT{axis}"] for axis in "xyz"]
        assert (each.pregrasp, each.squeeze) == (None, None)
        assert each.axes.tolist() == np.eye(3).tolist()


def with_angles(**other):
    (table,) = net_tables(np.random.default_rng(2), 1)
    table["qpos"] = {k: v for k, v in (table["qpos"] | other).items() if v is not None}
    return table


@pytest.mark.parametrize(
    ("table", "said"),
    [(with_angles(WRJTx=None), "WRJTx: missing"), (with_angles(WRJRz=float("nan")), "finite"),
     (with_angles(a="text"), "qpos must be"), (with_angles(a=[1.0, 2.0]), "one number under each"),
     (with_angles(a=90.0), "joints"), (with_angles(WRJTx=900.0), "within 10 m"),
     ({"qpos": {f"WRJ{t}{x}": 0.0 for t in "TR" for x in "xyz"}, "scale": 1.0}, "qpos"),
     ({"qpos": with_angles()["qpos"]}, "scale: missing"), ({"qpos": 3, "scale": 1.0}, "WRJ"),
     ({"qpos": dict.fromkeys(map(str, range(2000)), 0.0), "scale": 1.0}, "WRJTx: missing"),
     (with_angles(**dict.fromkeys(map(str, range(2000)), 0.0)), "2008 names"),
     (with_angles() | {"scale": 0.0}, "scale"), (3, "expected a dictionary with qpos")],
    ids=lambda value: str(value)[:30],
)  # fmt: skip
def test_a_wrong_record_loses_only_itself(table, said, tmp_path):
    np.save(tmp_path / "mug.npy", listed([with_angles(), table, with_angles()]))
    first, bad, last = records(tmp_path)
    assert isinstance(bad, BadRecord)
    assert said in bad.reason
    assert first.grasp == last.grasp
