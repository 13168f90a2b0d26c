# SPDX-License-Identifier: MIT
# Copyright (c) 2026 the rayrep authors
"""Blender add-on: has the rayrep command hollow the active object, so that its print floats, stands, spins or weighs what it shall.

Edit > Preferences > Add-ons > Install, this file; then View3D > Sidebar > rayrep. docs/blender.md tells more.
"""

import json
import shlex
import shutil
import subprocess
import tempfile
import textwrap
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

bl_info = {
    "name": "rayrep: prints that float, stand and spin",
    "author": "the rayrep authors",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "View3D > Sidebar > rayrep",
    "description": "Finds the cavity inside an object with which its print floats, stands, spins or weighs what it shall",
    "category": "Mesh",
}

MADE_BY_US = "rayrep"  # a property of the objects that hold what was found
STL_ROW = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


class Trouble(Exception):
    """What a maker is told."""

    level = "ERROR"


class Cancelled(Trouble):
    level = "INFO"


# ---------------------------------------------------------------------------------------------------------------- meshes and files


def mm_per_unit(scene):
    """Millimetres of one Blender unit, as the scene says or as the panel overrides it."""
    units = scene.unit_settings
    if scene.rayrep.unit == "MM" or units.system == "NONE":
        return 1.0
    return 1000.0 * units.scale_length


def triangles_of(thing, scene):
    """(n, 3, 3) corners in mm of an object as it is seen, modifiers applied; turned and scaled as in the world, seen from its origin."""
    if thing.mode == "EDIT":
        thing.update_from_editmode()
    evaluated = thing.evaluated_get(bpy.context.evaluated_depsgraph_get())
    try:
        mesh = evaluated.to_mesh()
    except RuntimeError:
        mesh = None
    if mesh is None:
        raise Trouble(f"'{thing.name}' has no surface: select a mesh.")
    mesh.calc_loop_triangles()
    vertices = np.empty(3 * len(mesh.vertices), dtype=np.float32)
    corners = np.empty(3 * len(mesh.loop_triangles), dtype=np.int32)
    mesh.vertices.foreach_get("co", vertices)
    mesh.loop_triangles.foreach_get("vertices", corners)
    evaluated.to_mesh_clear()
    if len(corners) == 0:
        raise Trouble(f"'{thing.name}' has no faces: select a mesh.")
    turned = np.array(evaluated.matrix_world.to_3x3(), dtype=np.float64)
    points = vertices.reshape(-1, 3).astype(np.float64) @ turned.T * mm_per_unit(scene)
    triangles = points[corners.reshape(-1, 3)]
    return triangles[:, ::-1] if np.linalg.det(turned) < 0 else triangles  # a mirrored object


def write_stl(path, triangles):
    rows = np.zeros(len(triangles), dtype=STL_ROW)
    rows["corners"] = triangles
    with open(path, "wb") as file:
        file.write(bytes(80) + np.uint32(len(rows)).tobytes() + rows.tobytes())


def read_stl(path):
    return np.fromfile(path, dtype=STL_ROW, offset=84)["corners"]


def welded(triangles):
    """Points and, for each triangle, three of them."""
    points, corners = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    return points, corners.reshape(-1, 3)


def bodies_of(corners, points):
    """For each triangle a number that those which hang together share: the smallest of their points."""
    label = np.arange(points)
    while True:
        before = label.copy()
        smallest = label[corners].min(axis=1)
        for side in range(3):
            np.minimum.at(label, corners[:, side], smallest)
        label = label[label]
        if np.array_equal(label, before):
            return label[corners[:, 0]]


def what_is_new(after, before):
    """Of a printed mesh the surfaces that were not there before: those that share no triangle with it."""
    known = {row.tobytes() for row in np.ascontiguousarray(before, dtype=np.float32)}
    points, corners = welded(after)
    body = bodies_of(corners, len(points))
    is_known = np.fromiter((row.tobytes() in known for row in np.ascontiguousarray(after)), dtype=bool, count=len(after))
    return after[~np.isin(body, np.unique(body[is_known]))]


def add_child(parent, name, triangles, scene):
    """What was found as an object of its own, in its place inside `parent`; it shines through."""
    points, corners = welded(triangles)
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata((points / mm_per_unit(scene)).tolist(), [], corners.tolist())
    child = bpy.data.objects.new(name, mesh)
    child[MADE_BY_US] = True
    child.show_in_front = True
    for collection in parent.users_collection or [scene.collection]:
        collection.objects.link(child)
    child.parent = parent
    child.matrix_parent_inverse = parent.matrix_world.inverted()
    child.matrix_basis = Matrix.Translation(parent.matrix_world.translation)
    return child


def remove_children(parent):
    """Those of an earlier run."""
    for child in [c for c in parent.children if MADE_BY_US in c]:
        mesh = child.data
        bpy.data.objects.remove(child)
        if mesh.users == 0:
            bpy.data.meshes.remove(mesh)


# --------------------------------------------------------------------------------------------------------------------- the command


def command_path():
    addon = bpy.context.preferences.addons.get(__name__)
    told = addon.preferences.command if addon else ""
    found = shutil.which(bpy.path.abspath(told) if told else "rayrep")
    if found:
        return found
    if told:
        raise Trouble(f"'{told}' is no program that can be run: say in the preferences of this add-on where the command rayrep is.")
    raise Trouble("The command rayrep was not found: install its package, or say in the preferences of this add-on where it is.")


def options_of(settings):
    """The words of the command line that the panel's settings stand for."""
    try:
        more = shlex.split(settings.options)
    except ValueError as error:
        raise Trouble(f"Options: a quotation mark is not closed ({error}).") from error
    words = ["spin", "--yoyo", "--axle", "none"] if settings.goal == "yoyo" else [settings.goal]
    words += ["--wall", f"{settings.wall:.6g}"]
    if "--material" not in more:
        words += ["--density", f"{settings.density:.6g}"]
    if settings.goal == "float":
        words += ["--fluid", f"{settings.fluid:.6g}"]
        if settings.waterline > 0:
            words += ["--waterline", f"{settings.waterline:.6g}"]
    if settings.goal == "target":
        words += ["--mass", f"{settings.mass:.6g}"]
    return words + more


class Job:
    """One run of the command on one object, as a process of its own. Only `finish` changes anything in Blender."""

    def __init__(self, context, target, output=None):
        self.name = target.name
        self.scene = context.scene
        self.before = triangles_of(target, context.scene)
        words = options_of(context.scene.rayrep)
        command = command_path()
        self.folder = Path(tempfile.mkdtemp(prefix="rayrep-"))
        mesh = self.folder / "body.stl"
        self.told, self.said = self.folder / "told.json", self.folder / "said"
        self.output = Path(output) if output else self.folder / "hollow.stl"
        self.keeps_output = output is not None
        self.cancelled = False
        write_stl(mesh, self.before)
        with open(self.told, "wb") as told, open(self.said, "wb") as said:
            self.process = subprocess.Popen(
                [command, words[0], str(mesh), *words[1:], "-o", str(self.output), "--json"],
                stdin=subprocess.DEVNULL, stdout=told, stderr=said)

    def runs(self):
        return self.process.poll() is None

    def cancel(self):
        """It ends within a second and leaves no file behind."""
        self.cancelled = True
        self.process.terminate()

    def discard(self):
        if self.runs():
            self.cancel()
        self.process.wait()
        shutil.rmtree(self.folder, ignore_errors=True)

    def finish(self):
        """Waits for the end, brings in what was found, and gives what there is to say of it.

        Raises Trouble with what the command says where it refuses.
        """
        try:
            code = self.process.wait()
            if self.cancelled:
                raise Cancelled("Cancelled. Nothing was changed.")
            if code != 0:
                raise Trouble(self.complaint(code))
            report = json.loads(self.told.read_text(encoding="utf-8"))
            if not self.keeps_output:
                self.bring_in(report)
            return self.summary(report)
        finally:
            self.discard()

    def complaint(self, code):
        said = self.said.read_text(encoding="utf-8", errors="replace").strip().replace(str(self.folder / "body.stl"), f"'{self.name}'")
        return said.removeprefix("rayrep: ") or f"The command ended with exit code {code} and said nothing."

    def bring_in(self, report):
        parent = bpy.data.objects.get(self.name)
        if parent is None:
            raise Trouble(f"'{self.name}' is not there any more, so that what was found for it has no place.")
        remove_children(parent)
        inside = what_is_new(read_stl(self.output), self.before)
        if len(inside):
            add_child(parent, f"{self.name} inside", inside, self.scene)
        core = report.get("insert", {}).get("path")
        if core:
            add_child(parent, f"{self.name} core", read_stl(core), self.scene)

    def summary(self, report):
        before, after = report["before"].get("mass_g"), report["after"].get("mass_g")
        lines = []
        if before is not None and after is not None:
            lines.append(f"Mass: {before:.2f} g solid, {after:.2f} g now.")
        lines += [*report["meaning"], *report["notes"], "Print it at 100 % infill, with supports on the build plate only."]
        if self.keeps_output:
            lines.append(f"Wrote {self.output}.")
        return "\n".join(lines)


# ---------------------------------------------------------------------------------------------------------------------- operators


def body_to_hollow(context):
    """The active object, or the one that what we made belongs to."""
    active = context.active_object
    if active is not None and MADE_BY_US in active and active.parent is not None:
        return active.parent
    return active


class RAYREP_OT_hollow(bpy.types.Operator):
    """Find the inside of the active object; what was found becomes its child"""

    bl_idname = "rayrep.hollow"
    bl_label = "Hollow"
    bl_options = {"REGISTER", "UNDO"}
    # Where the print is written instead of brought in.
    filepath: bpy.props.StringProperty(subtype="FILE_PATH", options={"HIDDEN", "SKIP_SAVE"})

    job = None  # the only one at a time

    def start(self, context):
        if RAYREP_OT_hollow.job is not None:
            raise Trouble("One run is going on: wait for it or cancel it.")
        target = body_to_hollow(context)
        if target is None:
            raise Trouble("Nothing is selected: select the body to hollow.")
        RAYREP_OT_hollow.job = Job(context, target, bpy.path.abspath(self.filepath) or None)
        context.scene.rayrep.verdict = ""

    def tell(self, context):
        try:
            context.scene.rayrep.verdict = RAYREP_OT_hollow.job.finish()
            context.scene.rayrep.failed = False
        finally:
            RAYREP_OT_hollow.job = None

    def refuse(self, context, trouble):
        context.scene.rayrep.verdict = str(trouble)
        context.scene.rayrep.failed = trouble.level == "ERROR"
        self.report({trouble.level}, str(trouble))
        return {"CANCELLED"}

    def execute(self, context):
        try:
            self.start(context)
            self.tell(context)
        except Trouble as trouble:
            return self.refuse(context, trouble)
        return {"FINISHED"}

    def invoke(self, context, _event):
        try:
            self.start(context)
        except Trouble as trouble:
            return self.refuse(context, trouble)
        self.timer = context.window_manager.event_timer_add(0.1, window=context.window)
        context.window_manager.modal_handler_add(self)
        redraw(context)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        job = RAYREP_OT_hollow.job
        if event.type == "ESC" and job is not None and job.runs():
            job.cancel()
        if event.type != "TIMER" or (job is not None and job.runs()):
            return {"PASS_THROUGH"}
        context.window_manager.event_timer_remove(self.timer)
        redraw(context)
        if job is None:  # the add-on was disabled meanwhile
            return {"CANCELLED"}
        try:
            self.tell(context)
        except Trouble as trouble:
            return self.refuse(context, trouble)
        return {"FINISHED"}

    def cancel(self, context):
        """Blender ends, or another file is opened."""
        drop_job()


def drop_job():
    if RAYREP_OT_hollow.job is not None:
        RAYREP_OT_hollow.job.discard()
        RAYREP_OT_hollow.job = None


def redraw(context):
    for area in context.screen.areas if context.screen else []:
        area.tag_redraw()


class RAYREP_OT_save(bpy.types.Operator):
    """Find it and write the print to a file for the slicer; a 3MF also says how to print it"""

    bl_idname = "rayrep.save"
    bl_label = "Hollow and save"
    filepath: bpy.props.StringProperty(subtype="FILE_PATH")
    filter_glob: bpy.props.StringProperty(default="*.3mf;*.stl;*.obj;*.ply", options={"HIDDEN"})

    def invoke(self, context, _event):
        target = body_to_hollow(context)
        self.filepath = bpy.path.ensure_ext(bpy.path.clean_name(target.name if target else "print"), ".3mf")
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, _context):
        try:
            bpy.ops.rayrep.hollow("EXEC_DEFAULT" if bpy.app.background else "INVOKE_DEFAULT", filepath=self.filepath)
        except RuntimeError as error:  # what the other one has reported
            self.report({"ERROR"}, str(error).removeprefix("Error: ").strip())
            return {"CANCELLED"}
        return {"FINISHED"}


class RAYREP_OT_cancel(bpy.types.Operator):
    """End the run; nothing is changed"""

    bl_idname = "rayrep.cancel"
    bl_label = "Cancel"

    def execute(self, _context):
        if RAYREP_OT_hollow.job is None:
            return {"CANCELLED"}
        RAYREP_OT_hollow.job.cancel()
        return {"FINISHED"}


# ------------------------------------------------------------------------------------------------------------- settings and panel


class RayrepSettings(bpy.types.PropertyGroup):
    goal: bpy.props.EnumProperty(
        name="Goal", default="float",
        items=[("float", "Float", "Upright, at a waterline"), ("stand", "Stand", "As safely as it can"),
               ("spin", "Spin as a top", "About the vertical through its lowest point"),
               ("yoyo", "Spin as a yo-yo", "About the vertical through its centre; another axis: --up y"),
               ("dice", "Fall fairly", "On each of its faces as often"), ("target", "Weigh exactly", "What is asked for")])
    unit: bpy.props.EnumProperty(
        name="Units", default="SCENE",
        items=[("SCENE", "As in the scene", "Scene properties, Units: with the usual ones a Blender unit is a metre"),
               ("MM", "1 unit is 1 mm", "As models for printing are often drawn and STL files read")])
    fluid: bpy.props.FloatProperty(
        name="Fluid, g/cm³", default=1.0, min=0.01, max=30, precision=3, description="Its density: water 1, sea 1.025")
    waterline: bpy.props.FloatProperty(
        name="Waterline, mm", default=0, min=0, precision=2, description="Above the lowest point; 0: the most stable one is found")
    mass: bpy.props.FloatProperty(name="Mass, g", default=50, min=0.001, precision=2)
    wall: bpy.props.FloatProperty(name="Wall, mm", default=1.2, min=0.01, precision=2, description="The thinnest allowed")
    density: bpy.props.FloatProperty(
        name="Plastic, g/cm³", default=1.24, min=0.01, max=30, precision=3,
        description="Density of what is printed: PLA 1.24, PETG 1.27, ABS 1.04")
    options: bpy.props.StringProperty(
        name="Options", description="As on the command line, such as --resolution 300 or --core-material tin: rayrep float --help")
    verdict: bpy.props.StringProperty(options={"HIDDEN"})
    failed: bpy.props.BoolProperty(options={"HIDDEN"})


class RayrepPreferences(bpy.types.AddonPreferences):
    bl_idname = __name__
    command: bpy.props.StringProperty(
        name="Command rayrep", subtype="FILE_PATH", description="Left empty, it is looked for as programs are (PATH)")

    def draw(self, _context):
        self.layout.prop(self, "command")


class RAYREP_PT_panel(bpy.types.Panel):
    bl_label = "rayrep"
    bl_idname = "RAYREP_PT_panel"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "rayrep"

    def draw(self, context):
        settings, layout = context.scene.rayrep, self.layout
        target = body_to_hollow(context)
        layout.label(text=target.name if target else "Select the body to hollow", icon="OBJECT_DATA")
        if target:
            layout.label(text=" x ".join(f"{mm_per_unit(context.scene) * side:.4g}" for side in target.dimensions) + " mm")
        only_for = {"fluid": "float", "waterline": "float", "mass": "target"}
        for name in ("unit", "goal", "fluid", "waterline", "mass", "wall", "density", "options"):
            if only_for.get(name, settings.goal) == settings.goal:
                layout.prop(settings, name)
        if RAYREP_OT_hollow.job is None:
            layout.operator("rayrep.hollow")
            layout.operator("rayrep.save", text="Hollow and save ...")
        else:
            layout.label(text=f"Working on '{RAYREP_OT_hollow.job.name}' ...", icon="TIME")
            layout.operator("rayrep.cancel", icon="X")
        self.draw_verdict(context, settings)

    def draw_verdict(self, context, settings):
        if not settings.verdict:
            return
        box = self.layout.box()
        if settings.failed:
            box.label(text="It was not done:", icon="ERROR")
        columns = max(20, int(context.region.width / (7 * context.preferences.system.ui_scale)) - 4)
        text = box.column(align=True)
        for line in settings.verdict.splitlines():
            for part in textwrap.wrap(line, columns) or [""]:
                text.label(text=part)


CLASSES = (RayrepSettings, RayrepPreferences, RAYREP_OT_hollow, RAYREP_OT_save, RAYREP_OT_cancel, RAYREP_PT_panel)


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Scene.rayrep = bpy.props.PointerProperty(type=RayrepSettings)


def unregister():
    drop_job()
    del bpy.types.Scene.rayrep
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
