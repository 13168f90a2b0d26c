#!/usr/bin/python3
"""A link of a robot that weighs what the model says: a mesh and the URDF that goes with it.

    python3 urdf_link.py [FOLDER]      writes link.stl and link.urdf there
"""
import sys
from pathlib import Path

import rayrep

URDF = """<?xml version="1.0"?>
<robot name="heart">
  <link name="heart">
    {inertial}
    <visual>
      <geometry>
        <mesh filename="link.stl" scale="0.001 0.001 0.001"/>
      </geometry>
    </visual>
  </link>
</robot>
"""


def main(folder):
    heart = rayrep.load(Path(__file__).parents[1] / "heart.stl")
    # 75 g, the centre of mass on the vertical through the origin, as high as it comes
    link = rayrep.hollow(heart, "target", mass=75, com=(0, 0, None), resolution=60)
    link.export(folder / "link.stl")
    (folder / "link.urdf").write_text(URDF.format(inertial=link.urdf().strip().replace("\n", "\n    ")))
    for criterion in link.verdict.criteria:
        print(f"{criterion.name:16} {criterion.value:.2g} ({criterion.kind} {criterion.limit:.2g})")
    print(f"{link.verdict.mass.mass:.2f} g, centre of mass {link.verdict.mass.center_mass.round(3)} mm")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
