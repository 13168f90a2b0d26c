"""What bodies weigh, and how they float, spin, stand and fall."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Dict, List, Optional, Sequence, Tuple, Union

import numpy as np
import numpy.typing as npt

from . import _rayrep
from ._errors import UsageError
from ._rayrep import Mesh

Array = npt.NDArray[np.float64]
#: "x", "-z", ... or three numbers, which need not be a unit vector.
Direction = Union[str, Sequence[float], Array]
Point = Union[Sequence[float], Array]

_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def _point(name: str, value: Any) -> Tuple[float, float, float]:
    try:
        numbers = [float(v) for v in np.asarray(value, dtype=float).reshape(-1)]
    except (TypeError, ValueError):
        numbers = []
    if len(numbers) != 3:
        raise UsageError(f"{name} takes three numbers; it is {value!r}.")
    return numbers[0], numbers[1], numbers[2]


def _some_point(name: str, value: Optional[Point]) -> Optional[Tuple[float, float, float]]:
    return None if value is None else _point(name, value)


def _direction(value: Direction) -> Tuple[float, float, float]:
    if not isinstance(value, str):
        return _point("A direction", value)
    sign = -1.0 if value.startswith("-") else 1.0
    axis = _AXES.get(value.lstrip("+-").lower())
    if axis is None:
        raise UsageError(f"A direction is x, y, z, -x, -y, -z or three numbers; it is {value!r}.")
    return sign * axis[0], sign * axis[1], sign * axis[2]


@dataclass(frozen=True, eq=False)
class MassProperties:
    """Mass, centre of mass and inertia of a body."""

    #: mm^3
    volume: float
    #: g
    mass: float
    #: mm, shape (3,)
    center_mass: Array
    #: About the centre of mass, g mm^2, shape (3, 3): the integral of (|p|^2 1 - p p^T) dm.
    moment_inertia: Array
    #: Principal moments, g mm^2, ascending, shape (3,).
    principal_inertia_components: Array
    #: Unit principal axes in the order of the moments, one a row, right-handed.
    principal_inertia_vectors: Array


def moments(mesh: Mesh) -> Array:
    """The ten moments of what a closed mesh encloses, unit density, about the origin: shape (10,).

    The integrals of 1, x, y, z, xx, yy, zz, xy, yz, xz over the volume: mm^3, mm^4, mm^5. What overlaps counts twice.
    """
    return _rayrep.moments(mesh)


def mass_properties(mesh: Mesh, density: float = 1.24) -> MassProperties:
    """Mass, centre of mass and inertia; what overlaps counts once, a cavity is empty.

    Parameters
    ----------
    density : float
        g/cm^3; that of PLA. `rayrep.materials()` has others.

    Raises
    ------
    InputError
        for a mesh without a positive volume.
    """
    return MassProperties(**_rayrep.mass_properties(mesh, density))


def urdf(mesh: Mesh, density: float = 1.24) -> str:
    """The <inertial> element of URDF, in kg, m and kg m^2, of a solid of `density` g/cm^3."""
    return _rayrep.inertial(mesh, density)[0]


def mjcf(mesh: Mesh, density: float = 1.24) -> str:
    """The <inertial> element of MuJoCo's MJCF, in kg, m and kg m^2, of a solid of `density` g/cm^3."""
    return _rayrep.inertial(mesh, density)[1]


@dataclass(frozen=True, eq=False)
class Hydrostatics:
    """What the fluid sees of a body at a waterline; a dry pocket (a boat's cockpit) displaces as if it were filled."""

    #: Height of the fluid's surface above the lowest point along up, mm.
    waterline: float
    #: mm^3
    displaced_volume: float
    #: g
    displaced_mass: float
    #: Centroid of what is displaced, mm.
    center_buoyancy: Array
    #: mm^2
    waterplane_area: float
    #: Centroid of the waterplane, mm.
    center_flotation: Array
    #: Smallest and largest second moment of the waterplane about an axis through its centroid, mm^4.
    second_moments: Tuple[float, float]
    #: BM = I / V, mm.
    metacentric_radius: float
    #: mm
    metacentre: Array
    #: Volume of the dry pockets below the waterplane, mm^3.
    dry_interior: float
    #: Height of the lowest rim of a dry pocket above the fluid, mm; None without one.
    freeboard: Optional[float]
    #: Unit vector.
    up: Array

    def metacentric_height(self, center_mass: Point) -> float:
        """GM, mm: the metacentre's height above the centre of mass, along up. Positive is stable for small tilts."""
        return float((self.metacentre - np.asarray(center_mass, dtype=float)) @ self.up)


def hydrostatics(mesh: Mesh, waterline: Optional[float] = None, *, mass: Optional[float] = None, fluid: float = 1.0,
                 up: Direction = "z") -> Hydrostatics:
    """Exact hydrostatics of a closed mesh held with `up` upright; sealed cavities are dry.

    Parameters
    ----------
    waterline : float
        Height of the fluid's surface above the lowest point, mm; or
    mass : float
        g: the waterline at which it displaces that.
    fluid : float
        g/cm^3; `rayrep.fluids()` has some.

    Raises
    ------
    GoalError
        for a mass that sinks.

    >>> import rayrep
    >>> barge = rayrep.box((100, 40, 20))
    >>> water = rayrep.hydrostatics(barge, mass=40)
    >>> round(water.waterline, 9), round(water.metacentric_radius, 9)
    (10.0, 13.333333333)
    """
    if (waterline is None) == (mass is None):
        raise UsageError("hydrostatics() takes a waterline or a mass, one of them.")
    direction = _direction(up)
    found: Dict[str, Any] = _rayrep.hydrostatics(mesh, fluid, direction, waterline, mass)
    unit = np.asarray(direction) / np.linalg.norm(direction)
    return Hydrostatics(up=unit, **found)


@dataclass(frozen=True, eq=False)
class FloatingRest:
    """Where a floating body comes to rest."""

    #: "rests", "sinks" or "did_not_rest".
    outcome: str
    #: What points up then, in the frame of the mesh.
    up: Array
    #: Above the lowest point then, mm; None where it sinks.
    waterline: Optional[float]
    #: Between where it was let go and where it rests, rad.
    tilt: float
    #: A pocket that had been dry was flooded on the way.
    took_water: bool


def floating_rest(mesh: Mesh, mass: float, *, center_mass: Optional[Point] = None, fluid: float = 1.0,
                  up: Direction = "z") -> FloatingRest:
    """Follows the righting moment of a floating body that is let go with `up` upright, without inertia.

    `mass` in g; `center_mass` in mm, that of the mesh's material if it is not given; `fluid` in g/cm^3.
    """
    return FloatingRest(**_rayrep.floating_rest(mesh, mass, _some_point("center_mass", center_mass), _direction(up), fluid))


@dataclass(frozen=True, eq=False)
class RightingCurve:
    """Righting arms (GZ) over the heel."""

    #: rad, from 0 to pi.
    heel: Array
    #: mm, positive where it turns back; NaN where it has sunk.
    arm: Array
    #: The arm is positive and no water comes in up to this heel, rad.
    range: float
    #: What happens there: "turns_over", "takes_water", or "none".
    end: str
    #: Under the arms up to `range`, mm rad.
    area: float
    #: The side that goes down, unit vector.
    lowered: Array


def righting_arm(mesh: Mesh, mass: float, *, center_mass: Optional[Point] = None, fluid: float = 1.0, up: Direction = "z",
                 lowered: Optional[Direction] = None, steps: int = 18) -> RightingCurve:
    """GZ, mm, over the heel: the horizontal distance between centre of mass and centre of buoyancy as it is heeled.

    Parameters
    ----------
    mass : float
        g
    center_mass : array of shape (3,)
        mm; that of the mesh's material if it is not given.
    lowered : direction
        The side that goes down; if it is not given, that with the smallest range.
    steps : int
        Between 0 and pi.

    Raises
    ------
    GoalError
        for a body that sinks.
    """
    at = (mass, _some_point("center_mass", center_mass), _direction(up), fluid)
    return RightingCurve(**_rayrep.righting_curve(mesh, at, None if lowered is None else _direction(lowered), steps))


@dataclass(frozen=True, eq=False)
class Spin:
    """A body on its spin axis."""

    #: Where it touches the ground; of a yo-yo any point of its axis, mm.
    contact: Array
    #: Distance of the centre of mass from the axis, mm.
    offset: float
    #: Of the centre of mass above the contact, mm.
    height: float
    #: Between the spin axis and the nearest principal axis, rad.
    axis_angle: float
    #: Of the moment of inertia about the axis: "largest", "middle" or "smallest".
    axis_class: str
    #: The axial moment over the larger, and over the smaller lateral one.
    ratio_larger: float
    ratio_smaller: float
    #: Ranges of stable speeds, rad/s, shape (k, 2), on a tip that slides; the last may end at inf.
    sliding: Array
    #: And on one that is held by friction.
    fixed: Array


def spin(mesh: Mesh, *, density: float = 1.24, up: Direction = "z", contact: Optional[Point] = None, yoyo: bool = False) -> Spin:
    """At which speeds a spin about the line through `contact` (the lowest point) along `up` is stable.

    A top spins stably where its axis is the largest and it turns fast enough: w^2 > M g l / (I3 - I2); rad/s.
    """
    return Spin(**_rayrep.spin(mesh, density, _direction(up), _some_point("contact", contact), yoyo))


@dataclass(frozen=True, eq=False)
class Support:
    """How a body stands on level ground."""

    #: Corners of the support polygon in the frame of the mesh, counter-clockwise from above, mm, shape (k, 3).
    corners: Array
    #: mm^2
    area: float
    #: Centre of the largest circle inside, mm, shape (3,).
    safest_point: Array
    #: By which the ground may be tilted about each edge before it tips, rad; negative where it tips by itself.
    tipping_angles: Array
    #: Of the centre of mass above the ground, mm.
    height: float
    #: What is no higher above the lowest point touches the ground, mm.
    tolerance: float

    @property
    def stands(self) -> bool:
        """It does not tip by itself."""
        return len(self.corners) > 2 and bool((self.tipping_angles > 0).all())


def support_polygon(mesh: Mesh, *, center_mass: Optional[Point] = None, up: Direction = "z",
                    tolerance: Optional[float] = None) -> Support:
    """Where a body touches level ground, and how far it is from tipping.

    `center_mass` in mm, that of the mesh's material if it is not given; `tolerance` in mm, what a print and the ground give way.
    """
    return Support(**_rayrep.support_polygon(mesh, _some_point("center_mass", center_mass), _direction(up), tolerance))


@dataclass(frozen=True, eq=False)
class RestingFace:
    """A face on which a body comes to rest."""

    #: What points up then, unit vector.
    up: Array
    #: Of all attitudes, each as likely as any other, from which it rolls there; 0 to 1.
    share: float
    #: Of the centre of mass above the ground, mm.
    height: float
    #: The smallest angle by which it must be tilted to roll on, rad.
    holds: float


def resting_faces(mesh: Mesh, *, center_mass: Optional[Point] = None, shake: float = np.pi / 60) -> List[RestingFace]:
    """On which faces of its convex hull a body comes to rest, thrown without inertia, and how often; the most frequent first.

    `center_mass` in mm; what holds it by no more than `shake` rad does not count.

    >>> import rayrep
    >>> [round(face.share, 6) for face in rayrep.resting_faces(rayrep.box((10, 10, 10)))]
    [0.166667, 0.166667, 0.166667, 0.166667, 0.166667, 0.166667]
    """
    return [RestingFace(**face) for face in _rayrep.resting_faces(mesh, _some_point("center_mass", center_mass), shake)]


def materials() -> Dict[str, float]:
    """Densities of printing materials by name, g/cm^3: for `density`, or as the setting `material`."""
    return _rayrep.materials()


def core_materials() -> Dict[str, float]:
    """Densities of heavy cores by name, g/cm^3: for the setting `core_material`."""
    return _rayrep.core_materials()


def fluids() -> Dict[str, float]:
    """Densities of fluids by name, g/cm^3: for `fluid`."""
    return _rayrep.fluids()


def box(extents: Sequence[float], center: Point = (0, 0, 0)) -> Mesh:
    """A box of these sides, mm, about `center`."""
    half = 0.5 * np.asarray(_point("extents", extents))
    if not (half > 0).all():
        raise UsageError(f"extents must be positive; they are {extents!r}.")
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    faces = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7],
             [1, 7, 3]]
    return Mesh(corners * half + np.asarray(_point("center", center)), faces)
