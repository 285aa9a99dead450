"""Scenes as MuJoCo compiles them."""

import mujoco


def compiled(scene, key=None):
    """The model of a scene and its state, at a keyframe if one is named."""
    model = mujoco.MjModel.from_xml_string(scene.xml)
    return model, state_of(model, key)


def state_of(model, key=None):
    data = mujoco.MjData(model)
    if key is not None:
        mujoco.mj_resetDataKeyframe(model, data, model.key(key).id)
    mujoco.mj_forward(model, data)
    return data
