"""Files of grippers to load: one of MJCF with fingers around a palm, and where they are written."""

import mujoco
import numpy as np

import scenes

FINGER = """
<body name="f{n}" pos="{x} {y} 0.01">
  <joint name="a{n}" axis="0 0 1" range="-40 40"/>
  <joint name="b{n}" axis="{ax} {ay} 0" range="-90 60" ref="10" pos="0 0 0.005"/>
  <geom name="g{n}" type="capsule" fromto="0 0 0 0 0 0.04" size="0.006"/>
  <body name="d{n}" pos="0 0 0.045">
    <joint name="c{n}" axis="{ax} {ay} 0" range="-90 60" actuatorfrcrange="-0.4 0.4"/>
    <geom name="p{n}" type="{kind}" {size}/>
    <site name="s{n}" pos="0 0 0.04" size="0.007"/>
  </body>
</body>"""
CAPSULE = ("capsule", 'fromto="0 0 0 0 0 0.04" size="0.007"')


def gripper(kind=CAPSULE, extra="", fingers=4, on_palm=""):
    """A gripper with fingers around a palm, in degrees, drawn with one joint at 10 degrees."""
    turns = [2.0 * np.pi * n / fingers for n in range(fingers)]
    bodies = "".join(
        FINGER.format(n=n, x=0.04 * np.cos(a), y=0.04 * np.sin(a), ax=-np.sin(a), ay=np.cos(a),
                      kind=kind[0], size=kind[1])
        for n, a in enumerate(turns)
    )  # fmt: skip
    return (
        '<mujoco model="gripper"><worldbody><geom type="plane" size="1 1 1"/>'
        f'<body name="base" pos="0 0 0.3"><geom name="base" type="cylinder" size="0.05 0.005"/>'
        f"{bodies}{on_palm}</body></worldbody>{extra}</mujoco>"
    )


def written(folder, text, name="gripper.xml"):
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / name
    path.write_text(text)
    return path


class Beside:
    """A hand's own file in MuJoCo, with an object beside it that can be put where a pose has it."""

    def __init__(self, path, body):
        spec = mujoco.MjSpec.from_file(str(path))
        mesh = spec.add_mesh(name="object")
        mesh.uservert = (body.vertices - body.center_of_mass).ravel()
        held = spec.worldbody.add_body(name="object", mocap=True)
        held.add_geom(name="object", type=mujoco.mjtGeom.mjGEOM_MESH, meshname="object")
        self.body, self.model = body, spec.compile()
        self.data = mujoco.MjData(self.model)

    def stand(self, hand, found, palm="base"):
        """Bend the joints, and put the object where it is seen from the palm."""
        for joint, angle in zip(hand.joints, found.joints, strict=True):
            self.data.joint(joint.name).qpos = angle
        pose, at = found.palm_pose, self.model.body(palm).pos
        mujoco.mju_mat2Quat(self.data.mocap_quat[0], pose[:3, :3].T.ravel())
        self.data.mocap_pos[0] = pose[:3, :3].T @ (self.body.center_of_mass - pose[:3, 3]) + at
        mujoco.mj_forward(self.model, self.data)

    def apart(self, one, other="object"):
        """The distance of two geoms of these names or numbers [m]."""
        ids = (self.model.geom(each).id for each in (one, other))
        return mujoco.mj_geomDistance(self.model, self.data, *ids, 1.0, None)


def loaded(folder, text, tips, name="hand.urdf"):
    return scenes.hand_from_file(written(folder, text, name), tips)
