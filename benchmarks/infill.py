#!/usr/bin/env python3
"""Measures what PrusaSlicer lays down where it is told to print sparsely: the table in src/physics/infill.cpp.

    benchmarks/infill.py RAYREP [PROFILE (benchmarks/everyday.ini)]

A cube of 80 mm is sliced solid, and with a cube of 70 mm in its middle as a modifier of each pattern and percentage. What the
second lacks of the first, over the volume of the modifier, is what is not laid down. Prints rows of C++.
"""
import json
import pathlib
import subprocess
import sys
import tempfile
import zipfile

PERCENTS = [5, 10, 15, 20, 30, 50]
PATTERNS = ["gyroid", "grid", "rectilinear", "cubic", "triangles", "honeycomb", "3dhoneycomb", "line", "concentric"]
OUTER, INNER = 80.0, 70.0

TYPES = """<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
 <Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>
 <Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>
</Types>"""
RELATIONS = """<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
 <Relationship Target="/3D/3dmodel.model" Id="rel-1" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>
</Relationships>"""
SIDES = [(0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4),
         (2, 6, 7), (2, 7, 3), (0, 4, 6), (0, 6, 2), (1, 3, 7), (1, 7, 5)]


def cube(size):
    lo = (OUTER - size) / 2
    return [[lo + size * (k >> axis & 1) for axis in range(3)] for k in range(8)]


def project(path, modifier):
    """The cubes as PrusaSlicer's 3MF; `modifier` a list of settings, or None for the solid cube alone."""
    cubes = [cube(OUTER)] + ([cube(INNER)] if modifier else [])
    vertices = "".join(f'<vertex x="{x}" y="{y}" z="{z}"/>' for c in cubes for x, y, z in c)
    triangles = "".join(f'<triangle v1="{a + 8 * n}" v2="{b + 8 * n}" v3="{c + 8 * n}"/>'
                        for n in range(len(cubes)) for a, b, c in SIDES)
    model = ('<?xml version="1.0" encoding="UTF-8"?><model unit="millimeter" '
             'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02" '
             'xmlns:slic3rpe="http://schemas.slic3r.org/3mf/2017/06"><metadata name="slic3rpe:Version3mf">1</metadata>'
             f'<resources><object id="1" type="model"><mesh><vertices>{vertices}</vertices><triangles>{triangles}'
             '</triangles></mesh></object></resources><build><item objectid="1"/></build></model>')
    config = ('<?xml version="1.0" encoding="UTF-8"?><config><object id="1" instances_count="1">'
              '<metadata type="object" key="fill_density" value="100%"/>'
              '<metadata type="object" key="fill_pattern" value="rectilinear"/>'
              '<volume firstid="0" lastid="11"><metadata type="volume" key="volume_type" value="ModelPart"/></volume>')
    if modifier:
        config += ('<volume firstid="12" lastid="23"><metadata type="volume" key="modifier" value="1"/>'
                   '<metadata type="volume" key="volume_type" value="ParameterModifier"/>')
        config += "".join(f'<metadata type="volume" key="{key}" value="{value}"/>' for key, value in modifier) + "</volume>"
    config += "</object></config>"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("[Content_Types].xml", TYPES)
        archive.writestr("_rels/.rels", RELATIONS)
        archive.writestr("3D/3dmodel.model", model)
        archive.writestr("Metadata/Slic3r_PE_model.config", config)


def volume_mm3(rayrep, profile, folder, modifier):
    """Of what is laid down for the body."""
    model, gcode = folder / "cube.3mf", folder / "cube.gcode"
    project(model, modifier)
    subprocess.run(["prusa-slicer", "--export-gcode", "--load", profile, "--output", gcode, model], check=True,
                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    measured = json.loads(subprocess.run([rayrep, "measure", gcode, "--json", "--density", "1"], check=True,
                                         capture_output=True, text=True).stdout)
    return sum(f["volume_mm3"] for f in measured["print"]["features"] if f["of_body"])


def main():
    rayrep = sys.argv[1]
    profile = sys.argv[2] if len(sys.argv) > 2 else pathlib.Path(__file__).parent / "everyday.ini"
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        solid = volume_mm3(rayrep, profile, folder, None)
        for pattern in PATTERNS:
            row = []
            for percent in PERCENTS:
                modifier = [("fill_density", f"{percent}%"), ("fill_pattern", pattern), ("top_solid_layers", "0"),
                            ("bottom_solid_layers", "0"), ("solid_infill_below_area", "0")]
                lacking = solid - volume_mm3(rayrep, profile, folder, modifier)
                row.append(100 * (1 - lacking / INNER ** 3))
            print(f'    {{"{pattern}", {{{", ".join(f"{x:.2f}" for x in row)}}}}},', flush=True)


if __name__ == "__main__":
    main()
