from scenes.fingertips import FingerSettings as FingerSettings
from scenes.layout import Layout as Layout
from scenes.mjcf import Scene as Scene
from scenes.mjcf import build_scene as build_scene
from scenes.mjcf import write_scene as write_scene
from scenes.objects import example_names as example_names
from scenes.objects import example_object as example_object
from scenes.physics import PhysicsSettings as PhysicsSettings
