"""Interiors that make prints of 3D shapes float, stand, spin, weigh and turn as wanted.

>>> import rayrep
>>> result = rayrep.hollow(rayrep.box((40, 30, 20)), "float", resolution=40, wall=1.2)
>>> bool(result.verdict)
True

Lengths are in mm, masses in g, densities in g/cm^3, inertia in g mm^2, angles in rad (settings that say DEG: degrees).

    load, Mesh, inspect, repair      meshes
    hollow, suggest, verify          insides, and what they are worth; settings(goal) lists what can be set
    measure                          what a .gcode or .sl1 file prints
    mass_properties, hydrostatics, floating_rest, righting_arm, spin, support_polygon, resting_faces
"""

from ._errors import Error, GoalError, InputError, Interrupted, SolverError, UsageError, WriteError
from ._physics import (FloatingRest, Hydrostatics, MassProperties, RestingFace, RightingCurve, Spin, Support, box, core_materials,
                       floating_rest, fluids, hydrostatics, mass_properties, materials, mjcf, moments, resting_faces, righting_arm,
                       spin, support_polygon, urdf)
from ._rayrep import Mesh, __version__
from ._runs import (Criterion, Defect, Figures, Inspection, Measurement, Part, Result, Suggestion, Verdict, hollow, inspect, load,
                    measure, repair, suggest, verify)
from ._settings import GOALS, Setting, Settings, settings

__all__ = [
    "Criterion", "Defect", "Error", "Figures", "FloatingRest", "GOALS", "GoalError", "Hydrostatics", "InputError", "Inspection",
    "Interrupted", "MassProperties", "Measurement", "Mesh", "Part", "RestingFace", "Result", "RightingCurve", "Setting", "Settings",
    "SolverError", "Spin", "Suggestion", "Support", "UsageError", "Verdict", "WriteError", "__version__", "box", "core_materials",
    "floating_rest", "fluids", "hollow", "hydrostatics", "inspect", "load", "mass_properties", "materials", "measure", "mjcf",
    "moments", "repair", "resting_faces", "righting_arm", "settings", "spin", "suggest", "support_polygon", "urdf", "verify",
]

for _name in __all__:
    if _name == "Mesh":
        Mesh.__module__ = __name__
    elif hasattr(globals()[_name], "__module__"):
        try:
            globals()[_name].__module__ = __name__
        except AttributeError:
            pass
del _name
