"""Draws scenes in motion as animated pictures; it runs as a separate program.

Only `scenes.drawing.clips` starts it: MuJoCo chooses its graphics library when it is first
imported, and a broken driver may end the whole process. Without arguments it draws an empty scene.
"""

# pyright: basic, reportAttributeAccessIssue=false
# MuJoCo and Pillow have incomplete types; only this module sees them here.

import sys
from collections.abc import Mapping
from pathlib import Path

import mujoco  # noqa: TID251 - this is the door to its renderer
import numpy as np

CAMERA_RADII = 3.2
"""Distance of the camera from the scene, in radii of the part that is shown."""
SKY, AMBIENT, DIFFUSE = (0.93, 0.95, 0.97), 0.45, 0.45
"""Colour of the background, and strengths of the ambient light and of the light from the camera."""
TEXT_RGB, LETTERS = (30, 30, 40), 18


def draw_clip(given: Mapping[str, np.ndarray], out: str) -> None:
    """Draw one frame of a clip for every row of joint positions, and write the clip."""
    from PIL import Image, ImageDraw, ImageFont  # noqa: TID251 - graphics are tried without it

    model = _lit(str(given["xml"]))
    for finger, colour in enumerate(given["colours"]):
        for place in range(model.ngeom):
            if model.geom(place).name == f"finger{finger}":
                model.geom_rgba[place, :3] = colour
    if "palm" in given:
        model.body("palm").quat[:] = given["palm"]
    data = mujoco.MjData(model)
    width, height = (int(size) for size in given["size"])
    model.vis.global_.offwidth, model.vis.global_.offheight = width, height
    camera = mujoco.MjvCamera()
    camera.lookat[:] = given.get("middle", 0.0)
    if "table" in given:
        data.mocap_pos[0], data.mocap_quat[0] = given["table"][:3], given["table"][3:]
    camera.distance = CAMERA_RADII * float(given["radius"])
    frames, font = [], ImageFont.load_default(LETTERS)
    with mujoco.Renderer(model, height, width) as renderer:
        for joints, (azimuth, elevation) in zip(given["joints"], given["angles"], strict=True):
            # MuJoCo's angles are those of the line of sight
            camera.azimuth, camera.elevation = azimuth + 180.0, -elevation
            data.qpos[:] = joints
            mujoco.mj_kinematics(model, data)
            renderer.update_scene(data, camera)
            picture, corner = Image.fromarray(renderer.render()), (LETTERS // 2, LETTERS // 2)
            ImageDraw.Draw(picture).text(corner, str(given["caption"]), TEXT_RGB, font=font)
            frames.append(picture)
    lasting = round(1000.0 / float(given["rate"]))
    frames[0].save(Path(out), save_all=True, append_images=frames[1:], duration=lasting, loop=0)


def try_out() -> None:
    """Draw an empty scene; this fails on a machine without graphics."""
    model = mujoco.MjModel.from_xml_string("<mujoco/>")
    with mujoco.Renderer(model, 8, 8) as renderer:
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        renderer.update_scene(data)
        renderer.render()


def _lit(xml: str) -> mujoco.MjModel:
    spec = mujoco.MjSpec.from_string(xml)
    kind, flat = mujoco.mjtTexture.mjTEXTURE_SKYBOX, mujoco.mjtBuiltin.mjBUILTIN_FLAT
    spec.add_texture(name="sky", type=kind, builtin=flat, rgb1=SKY, rgb2=SKY, width=8, height=8)
    model = spec.compile()
    model.vis.headlight.ambient[:], model.vis.headlight.diffuse[:] = AMBIENT, DIFFUSE
    return model


if __name__ == "__main__":
    quiet = mujoco.MjLogConfig.get()
    quiet.logto_file = False  # MUJOCO_LOG.TXT in the working folder
    mujoco.MjLogConfig.set(quiet)
    if sys.argv[1:]:
        with np.load(sys.argv[1], allow_pickle=False) as job:
            draw_clip(job, sys.argv[2])
    else:
        try_out()
