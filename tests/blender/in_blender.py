"""What tests/blender/run.py has Blender run: the add-on as a user has it, its results held against mathematics and `rayrep verify`."""
import importlib
import json
import math
import os
import subprocess
import sys
import time
from pathlib import Path

import addon_utils
import bpy
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
PLACE = Path.cwd()


def check(what, holds):
    print(("ok      " if holds else "FAILED  ") + what, flush=True)
    check.failed += not holds


check.failed = 0


def near(a, b, relative):
    return abs(a - b) <= relative * abs(b)


def fresh(scale_length=0.001):
    """An empty scene, where a unit is a millimetre unless told."""
    for thing in list(bpy.data.objects):
        bpy.data.objects.remove(thing)
    scene = bpy.context.scene
    scene.unit_settings.system, scene.unit_settings.scale_length = "METRIC", scale_length
    for name in ("goal", "unit", "fluid", "waterline", "mass", "wall", "density"):
        scene.rayrep.property_unset(name)
    scene.rayrep.options = "--resolution 60"
    return scene


def refusal(text, **how):
    """Whether the run is refused with these words, which a user then also reads in the panel."""
    scene = bpy.context.scene
    try:
        bpy.ops.rayrep.save(**how) if how else bpy.ops.rayrep.hollow()
    except RuntimeError as error:
        return text in str(error) and text in scene.rayrep.verdict and scene.rayrep.failed
    return False


def volume(triangles):
    a, b, c = np.moveaxis(triangles.astype(np.float64), 1, 0)
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6


def inside(target):
    return [child for child in target.children if child.name.startswith(f"{target.name} inside")]


def float_and_verify(addon, target, solid_mm3):
    """Hollows `target` to float in water of 1 g/cm3 and asks of what is in the scene then what was promised."""
    scene, name = bpy.context.scene, target.name
    before = addon.triangles_of(target, scene)
    check(f"{name}: goes out in mm", near(volume(before), solid_mm3, 1e-5))
    check(f"{name}: ends", bpy.ops.rayrep.hollow() == {"FINISHED"} and not scene.rayrep.failed)
    check(f"{name}: says what it comes to", "floats upright" in scene.rayrep.verdict and "g solid" in scene.rayrep.verdict)
    children = inside(target)
    check(f"{name}: has one child with the cavity", len(children) == 1)
    offset = np.array((children[0].matrix_world.translation - target.matrix_world.translation)) * addon.mm_per_unit(scene)
    cavity = addon.triangles_of(children[0], scene) + offset
    lowest, highest = before.min(axis=(0, 1)) + 1.1, before.max(axis=(0, 1)) - 1.1
    check(f"{name}: it lies a wall inside", (cavity.min(axis=(0, 1)) > lowest).all() and (cavity.max(axis=(0, 1)) < highest).all())
    solid, hollow = PLACE / "solid.stl", PLACE / "joined.stl"
    addon.write_stl(solid, before)
    addon.write_stl(hollow, np.concatenate([before, cavity]))
    ended = subprocess.run(["rayrep", "verify", hollow, "--original", solid, "--goal", "float", "--json"], capture_output=True, text=True)
    check(f"{name}: verify accepts both together", ended.returncode == 0)
    told = json.loads(ended.stdout)["after"]
    check(f"{name}: void is a negative volume, what is left weighs what is said",
          volume(cavity) < 0 and near((solid_mm3 + volume(cavity)) * 1.24e-3, told["mass_g"], 1e-5)
          and f"{told['mass_g']:.2f} g now" in scene.rayrep.verdict)
    return told


def bodies(addon):
    fresh()
    bpy.ops.mesh.primitive_cube_add(size=40, location=(300, -20, 7))
    float_and_verify(addon, bpy.context.active_object, 40.0**3)

    # In metres, scaled, mirrored, away from the origin and with a modifier: what is seen is what is hollowed.
    fresh(scale_length=1.0)
    bpy.ops.mesh.primitive_cube_add(size=0.04, location=(0.2, 1.5, -0.3))
    cube = bpy.context.active_object
    cube.scale = (1.5, -1, 1)
    first = float_and_verify(addon, cube, 1.5 * 40.0**3)
    bpy.ops.object.modifier_add(type="TRIANGULATE")
    second = float_and_verify(addon, cube, 1.5 * 40.0**3)
    check("once more: the child of before is replaced, the result is the same", near(second["mass_g"], first["mass_g"], 1e-6))
    bpy.context.view_layer.objects.active = inside(cube)[0]
    check("with the child selected its parent is hollowed", bpy.ops.rayrep.hollow() == {"FINISHED"} and len(inside(cube)) == 1)

    scene = fresh(scale_length=1.0)
    scene.rayrep.unit = "MM"
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=4, radius=25)
    sphere = bpy.context.active_object
    exact = volume(addon.triangles_of(sphere, scene))
    check("a sphere of radius 25", near(exact, 4 / 3 * math.pi * 25**3, 0.01))
    float_and_verify(addon, sphere, exact)

    fresh()
    bpy.ops.import_mesh.stl(filepath=str(ROOT / "examples/duck.stl"))
    float_and_verify(addon, bpy.context.active_object, volume(addon.read_stl(ROOT / "examples/duck.stl")))
    bpy.ops.object.mode_set(mode="EDIT")
    check("in edit mode too", bpy.ops.rayrep.hollow() == {"FINISHED"})
    bpy.ops.object.mode_set(mode="OBJECT")


def goals(addon):
    scene = fresh()
    bpy.ops.import_mesh.stl(filepath=str(ROOT / "examples/duck.stl"))
    duck = bpy.context.active_object
    scene.rayrep.goal, scene.rayrep.mass = "target", 60
    check("weighs what is asked for", bpy.ops.rayrep.hollow() == {"FINISHED"} and "60.00 g now" in scene.rayrep.verdict)
    scene.rayrep.goal, scene.rayrep.waterline, scene.rayrep.fluid = "float", 20, 1.025
    check("floats at a waterline that is given", bpy.ops.rayrep.hollow() == {"FINISHED"} and "20.00 mm deep" in scene.rayrep.verdict)
    scene.rayrep.options += " --material petg"
    check("a material among the options counts instead of the density", bpy.ops.rayrep.hollow() == {"FINISHED"}
          and f"{volume(addon.triangles_of(duck, scene)) * 1.27e-3:.2f} g solid" in scene.rayrep.verdict)
    scene.rayrep.options, scene.rayrep.waterline = "--resolution 60", 0
    saved = PLACE / "duck.3mf"
    check("saves a file for the slicer, and only that", bpy.ops.rayrep.save(filepath=str(saved)) == {"FINISHED"}
          and saved.stat().st_size > 10000 and len(inside(duck)) == 1 and str(saved) in scene.rayrep.verdict)
    check("verify accepts that", subprocess.run(["rayrep", "verify", saved, "--fluid", "1.025", "--quiet"]).returncode == 0)

    for goal, mesh, says in (("stand", "teapot", "It stands"), ("spin", "bird", "spins as a top"), ("yoyo", "heart", "spins as a yo-yo"),
                             ("dice", "die", "falls fairly")):
        scene = fresh()
        bpy.ops.import_mesh.stl(filepath=str(ROOT / "examples" / (mesh + ".stl")))
        scene.rayrep.goal = goal
        scene.rayrep.options += " --up y" if goal == "yoyo" else " --size 25" if goal == "dice" else ""
        target = bpy.context.active_object
        check(f"{mesh}: {says}", bpy.ops.rayrep.hollow() == {"FINISHED"} and says in scene.rayrep.verdict and len(inside(target)) == 1)

    scene = fresh()
    bpy.ops.import_mesh.stl(filepath=str(ROOT / "examples/sumo.stl"))
    scene.rayrep.goal, scene.rayrep.options = "spin", "--resolution 60 --core-material tin"
    ended = bpy.ops.rayrep.hollow()
    names = [child.name for child in bpy.context.active_object.children]
    check("a core comes back as another child", ended == {"FINISHED"} and any(name.endswith("core") for name in names))


def wrong_input(addon):
    scene = fresh()
    bpy.context.view_layer.objects.active = None
    check("nothing selected", refusal("select the body"))
    bpy.ops.object.empty_add()
    check("an object without a surface", refusal("'Empty' has no surface"))
    bpy.ops.mesh.primitive_plane_add(size=40)
    check("a surface that is not closed", refusal("'Plane'") and "Error" not in scene.rayrep.verdict)
    bpy.ops.mesh.primitive_cube_add(size=40)
    cube = bpy.context.active_object
    scene.rayrep.fluid = 0.05
    check("what cannot float is refused with the reason and nothing is made", refusal("sinks at any waterline") and not cube.children)
    scene.rayrep.fluid = 1
    check("a folder that is not there", refusal("no/such", filepath=str(PLACE / "no/such/cube.3mf")))
    scene.rayrep.options = "--nonsense 3"
    check("an option that does not exist", refusal("--nonsense"))
    scene.rayrep.options = "--picture 'a b"
    check("a quotation mark that is not closed", refusal("quotation mark"))
    scene.rayrep.options = "--resolution 60"
    preferences = bpy.context.preferences.addons["rayrep_addon"].preferences
    preferences.command = str(PLACE / "nowhere")
    check("a command that is not where it is said to be", refusal("in the preferences"))
    preferences.command = str(PLACE / "rayrep")
    path, os.environ["PATH"] = os.environ["PATH"], "/nowhere"
    check("the command by the preferences alone", bpy.ops.rayrep.hollow() == {"FINISHED"})
    preferences.command = ""
    check("no command at all", refusal("was not found"))
    os.environ["PATH"] = path


def in_the_background(addon):
    """What a modal operator does, which needs a window: the job goes on by itself and can be ended."""
    scene = fresh()
    bpy.ops.import_mesh.stl(filepath=str(ROOT / "examples/duck.stl"))
    duck = bpy.context.active_object
    scene.rayrep.options = "--resolution 800"
    job = addon.Job(bpy.context, duck)
    check("a job goes on by itself", job.runs())
    job.cancel()
    try:
        job.finish()
        told = ""
    except addon.Trouble as trouble:
        told = str(trouble)
    check("a job that is cancelled says so, changes nothing, leaves nothing",
          "Cancelled" in told and not duck.children and not job.folder.exists())

    scene.rayrep.options = "--resolution 60"
    job = addon.Job(bpy.context, duck)
    bpy.data.objects.remove(duck)
    try:
        job.finish()
        told = ""
    except addon.Trouble as trouble:
        told = str(trouble)
    check("an object that is deleted meanwhile", "not there any more" in told)


def main():
    bpy.ops.preferences.addon_install(filepath=str(ROOT / "tools/blender/rayrep_addon.py"))
    check("it can be enabled", bpy.ops.preferences.addon_enable(module="rayrep_addon") == {"FINISHED"})
    addon = importlib.import_module("rayrep_addon")
    for part in (bodies, goals, wrong_input, in_the_background):
        part(addon)
    addon_utils.disable("rayrep_addon")
    check("it can be disabled, and leaves nothing", not hasattr(bpy.types.Scene, "rayrep"))
    print(f"{check.failed} failed")
    sys.exit(1 if check.failed else 0)


main()
