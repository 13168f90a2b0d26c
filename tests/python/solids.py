"""Solids whose figures are known, and where the examples are."""
import math
from pathlib import Path

import numpy as np
import rayrep

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "examples"


def ball(radius=10.0, rings=24, center=(0, 0, 0)):
    """A sphere of triangles, all corners on it."""
    corners = [(0.0, 0.0, 1.0)]
    for i in range(1, rings):
        polar = math.pi * i / rings
        for j in range(2 * rings):
            angle = math.pi * j / rings
            corners.append((math.sin(polar) * math.cos(angle), math.sin(polar) * math.sin(angle), math.cos(polar)))
    corners.append((0.0, 0.0, -1.0))
    around = 2 * rings
    faces = [(0, 1 + j, 1 + (j + 1) % around) for j in range(around)]
    for i in range(rings - 2):
        a, b = 1 + i * around, 1 + (i + 1) * around
        for j in range(around):
            k = (j + 1) % around
            faces += [(a + j, b + j, b + k), (a + j, b + k, a + k)]
    last = 1 + (rings - 2) * around
    faces += [(len(corners) - 1, last + (j + 1) % around, last + j) for j in range(around)]
    return rayrep.Mesh(radius * np.array(corners) + np.array(center), faces)


def moments_of_tetrahedra(mesh):
    """Volume, first and second moments about the origin, by another way: over tetrahedra from the origin."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6
    first = (volume[:, None] * (a + b + c) / 4).sum(axis=0)
    total = a + b + c
    second = sum((np.einsum("i,ij,ik->jk", volume / 20, p, p) for p in (a, b, c, total)))
    return volume.sum(), first, second
