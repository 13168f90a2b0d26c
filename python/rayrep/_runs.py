"""Making insides, judging them, measuring prints."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from typing import Any, Callable, Dict, Iterator, List, Mapping, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np

from . import _rayrep
from ._errors import GoalError, InputError, UsageError, in_python
from ._physics import MassProperties
from ._rayrep import Mesh
from ._settings import GOALS, JUDGED, Settings, described, keyword_of, of_command, settings, words_for

Path = Union[str, "os.PathLike[str]"]
Progress = Callable[[str, float], Any]


def _shown(value: Any) -> str:
    """A value in a line."""
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, np.ndarray):
        text = np.array2string(value, precision=4, suppress_small=True, threshold=9, max_line_width=10**6)
        return " ".join(text.split())
    text = str(value)
    return text if len(text) <= 60 else text[:57] + "..."


class Figures(Mapping[str, Any]):
    """What was found out, by name: numbers, arrays (mm, g, rad as the names end), text, True, False or None.

    Prints as a table; `words` and `unit` say what a name means.
    """

    def __init__(self, rows: Sequence[Tuple[str, str, str, Any]]):
        self._rows = {row[0]: row for row in rows}

    def __getitem__(self, name: str) -> Any:
        return self._rows[name][3]

    def __iter__(self) -> Iterator[str]:
        return iter(self._rows)

    def __len__(self) -> int:
        return len(self._rows)

    def words(self, name: str) -> str:
        """What it is, for people; may be empty."""
        return self._rows[name][1]

    def unit(self, name: str) -> str:
        """mm, g, rad, ...; empty without one."""
        return self._rows[name][2]

    def __repr__(self) -> str:
        shown = []
        for name, words, unit, value in self._rows.values():
            shown.append(f"{name:38} {_shown(value)} {unit}".rstrip() + (f"  ({words})" if words else ""))
        return "\n".join(shown)


class Criterion(NamedTuple):
    """One thing that a mesh must satisfy."""

    name: str
    #: What is compared, with its unit.
    description: str
    value: float
    limit: float
    #: "at most" or "at least" the limit.
    kind: str
    passed: bool


class Verdict:
    """What a mesh was found to be, from its triangles; true if every criterion passes."""

    def __init__(self, outcome: "_rayrep.Outcome"):
        self._outcome = outcome
        found = outcome.verdict
        self._passed: bool = found["passed"]
        #: "float", "spin", ...
        self.goal: str = found["goal"]
        #: What it was held to.
        self.headline: str = found["headline"]
        #: Of what it was held to, and of what was found.
        self.figures = Figures(found["wanted"] + found["figures"])
        self.criteria: List[Criterion] = [Criterion(*one) for one in found["criteria"]]
        #: What it comes to for the print, in sentences.
        self.meaning: List[str] = [in_python(text) for text in found["meaning"]]
        self.notes: List[str] = [in_python(text) for text in found["notes"]]
        self.mass = MassProperties(**found["mass"])

    def __bool__(self) -> bool:
        return self._passed

    @property
    def failed(self) -> List[Criterion]:
        """The criteria that do not pass."""
        return [c for c in self.criteria if not c.passed]

    def report(self) -> Dict[str, Any]:
        """Everything, as the command's --report has it (docs/report.schema.json): mm, g, rad."""
        report: Dict[str, Any] = json.loads(self._outcome.json())
        return report

    def text(self, verbose: bool = False) -> str:
        """The same as the command prints it."""
        return self._outcome.text(verbose)

    def html(self, path: Optional[Path] = None) -> str:
        """A page with all figures and the bodies in 3D, one file that needs no network; written to `path` if there is one."""
        page = self._outcome.html()
        if path is not None:
            _rayrep.write_text(path, page)
        return page.decode(errors="replace")

    def picture(self, path: Path) -> None:
        """Draws it before and after, cut open, to an .svg or .png file."""
        self._draw(path, "")

    def section(self, plane: str, path: Path) -> None:
        """Draws the section in a plane, "y=0", "z=12.5", "x" (through the centre of mass), to an .svg or .png file."""
        if not plane:
            raise UsageError("A plane is y=0, z=12.5, x (through the centre of mass) or X,Y,Z=OFFSET.")
        self._draw(path, plane)

    def _draw(self, path: Path, plane: str) -> None:
        ending = os.path.splitext(os.fspath(path))[1].lower()
        if ending not in (".svg", ".png"):
            raise UsageError(f"Pictures are SVG or PNG: end {os.fspath(path)!r} in .svg or .png.")
        _rayrep.write_text(path, self._outcome.picture(ending, plane))

    def urdf(self) -> str:
        """The <inertial> element of URDF, in kg, m and kg m^2, of what was judged."""
        return self._outcome.urdf()

    def mjcf(self) -> str:
        """The <inertial> element of MuJoCo's MJCF, in kg, m and kg m^2, of what was judged."""
        return self._outcome.mjcf()

    def __repr__(self) -> str:
        lines = [f"<rayrep.Verdict: {self.goal} {'passes' if self else 'FAILS'}, {self.headline}>"]
        for c in self.criteria:
            lines.append(f"  {'ok  ' if c.passed else 'FAIL'} {c.name:20} {c.value:.4g} ({c.kind} {c.limit:.4g}; {c.description})")
        return "\n".join(lines)


class Part(NamedTuple):
    """A piece of what was made."""

    #: "body", what is printed; "insert", put into it; "modifier", where a slicer prints sparsely.
    role: str
    mesh: Mesh
    #: g/cm^3
    density: float
    #: Percent, of a modifier; else None.
    infill: Optional[float]


class Result:
    """A body with the inside that was asked for, verified."""

    def __init__(self, outcome: "_rayrep.Outcome"):
        self._outcome = outcome
        self.verdict = Verdict(outcome)

    @property
    def parts(self) -> List[Part]:
        """All pieces: the body, cores and balls, regions of infill."""
        return [Part(*part) for part in self._outcome.parts]

    @property
    def mesh(self) -> Mesh:
        """What is printed: the outer surface, then the cavities as shells that face inward; mm, as it is stored."""
        return next(part.mesh for part in self.parts if part.role == "body")

    @property
    def figures(self) -> Figures:
        """What the judge found, by name; prints as a table with units."""
        return self.verdict.figures

    @property
    def before(self) -> Figures:
        """The same of the solid."""
        return Figures(self._outcome.before)

    @property
    def spec(self) -> Dict[str, Any]:
        """What it was made for, with what was found, as keywords of `verify`: waterline, axis, ..."""
        return {keyword_of(name): value for name, value in self._outcome.spec.items()}

    @property
    def proof(self) -> List[str]:
        """What is proven of it, in sentences."""
        return self._outcome.proof

    @property
    def changed(self) -> str:
        """What was changed of what was asked, as `allow` lets; empty: nothing."""
        return self._outcome.changed

    @property
    def outside(self) -> Optional[Mesh]:
        """The outside that was deformed (deform_limit) before it was hollowed; None: it was not."""
        return self._outcome.outside

    @property
    def gcode(self) -> str:
        """What the slicer made of it (setting `slicer`); else empty."""
        return self._outcome.gcode

    def report(self) -> Dict[str, Any]:
        """Everything, as the command's --report has it (docs/report.schema.json): mm, g, rad."""
        return self.verdict.report()

    def text(self, verbose: bool = False) -> str:
        """The same as the command prints it."""
        return self.verdict.text(verbose)

    def html(self, path: Optional[Path] = None) -> str:
        """A page with all figures and the bodies in 3D, one file that needs no network; written to `path` if there is one."""
        return self.verdict.html(path)

    def picture(self, path: Path) -> None:
        """Draws it before and after, cut open, to an .svg or .png file."""
        self.verdict.picture(path)

    def section(self, plane: str, path: Path) -> None:
        """Draws the section in a plane, "y=0", "z=12.5", "x" (through the centre of mass), to an .svg or .png file."""
        self.verdict.section(plane, path)

    def urdf(self) -> str:
        """The <inertial> element of URDF, in kg, m and kg m^2."""
        return self.verdict.urdf()

    def mjcf(self) -> str:
        """The <inertial> element of MuJoCo's MJCF, in kg, m and kg m^2."""
        return self.verdict.mjcf()

    def export(self, path: Path) -> None:
        """Writes what is printed: .stl, .obj, .ply or .3mf, the same bytes as the command; infill needs .3mf.

        All of the file or nothing is written. Cores and balls are `parts`, to be written by themselves.

        Raises
        ------
        UsageError
            for an ending that does not hold what was judged: see `format` of `hollow`.
        WriteError
            where it cannot be written.
        """
        self._outcome.export(path)

    def __repr__(self) -> str:
        verdict = self.verdict
        return f"<rayrep.Result: {verdict.goal}, {verdict.mass.mass:.4g} g, {len(self.mesh.faces)} faces, {verdict.headline}>"


def _is_mesh(given: Any) -> bool:
    return isinstance(given, Mesh)


def _path(given: Any, what: str) -> str:
    if isinstance(given, bytes):
        given = os.fsdecode(given)
    if not isinstance(given, (str, os.PathLike)):
        hint = " Of arrays make one with rayrep.Mesh(vertices, faces)." if hasattr(given, "vertices") or hasattr(given, "shape") else ""
        raise TypeError(f"{what} is a rayrep.Mesh or a path; it is a {type(given).__name__}.{hint}")
    path = os.fspath(given)
    if path.lower().endswith(".json"):
        raise UsageError(f"'{path}' is no mesh. Settings from a file: rayrep.hollow(mesh, **json.load(open('{path}'))).")
    return path


class _Call:
    """A call of the library: words for what has a path or a value, the rest as it is."""

    def __init__(self, words: List[str], mesh: Any = None, original: Any = None, *, original_option: str = "original"):
        self.words = list(words)
        self.body = mesh if _is_mesh(mesh) else None
        self.original = original if _is_mesh(original) else None
        if mesh is not None:
            self.words.append("--input=" + (self._name(mesh) if _is_mesh(mesh) else _path(mesh, "The mesh")))
        if original is not None:
            name = self._name(original) if _is_mesh(original) else _path(original, original_option)
            self.words.append(f"--{original_option}={name}")
        self.fixed: List[Tuple[Mesh, float]] = []
        self.deform_fixed: List[Mesh] = []

    @staticmethod
    def _name(mesh: Mesh) -> str:
        # What has no name must have one for the command's options; it is not read.
        name = mesh.name
        return name if name and not _rayrep.is_printed(name) and not name.endswith(".json") else "mesh"

    def take(self, given: Dict[str, Any]) -> Dict[str, Any]:
        """Keeps what is in memory and returns what is left as it is given."""
        rest = dict(given)
        if rest.get("fixed") is not None:
            rest["fixed"] = self._take_fixed(rest["fixed"])
        if rest.get("deform_fixed") is not None:
            regions = rest["deform_fixed"]
            regions = list(regions) if isinstance(regions, (list, tuple)) and not _is_numbers(regions) else [regions]
            self.deform_fixed = [one for one in regions if _is_mesh(one)]
            rest["deform_fixed"] = [one for one in regions if not _is_mesh(one)] or None
        return rest

    def _take_fixed(self, fixed: Any) -> Optional[List[str]]:
        bodies = [fixed] if isinstance(fixed, str) or (isinstance(fixed, tuple) and len(fixed) == 2) else list(fixed)
        paths = []
        for body in bodies:
            if isinstance(body, str):
                paths.append(body)
                continue
            try:
                mesh, density = body
                density = float(density)
            except (TypeError, ValueError):
                raise TypeError(f"fixed takes pairs of a mesh or path and its density, g/cm^3; it has {body!r}.") from None
            if not 0 < density <= 25:
                raise UsageError(f"The density in fixed must lie between 0 and 25 g/cm^3; it is {density:g}.")
            if _is_mesh(mesh):
                self.fixed.append((mesh, density))
            else:
                paths.append(f"{_path(mesh, 'What is fixed')}={density!r}")
        return paths or None

    def run(self, function: Callable[..., Any], *more: Any) -> Any:
        given = _rayrep.Given(self.body, self.original, self.fixed, self.deform_fixed)
        return function([os.fsencode(word) for word in self.words], given, *more)


def _is_numbers(value: Any) -> bool:
    return all(isinstance(v, (int, float)) for v in value)


def load(path: Path, *, progress: Optional[Progress] = None, **settings: Any) -> Mesh:
    """Reads STL, OBJ, PLY, OFF or 3MF: in mm, equal corners joined, what needs no guess mended.

    A surface that is not closed comes back, too: see `is_watertight` and `inspect`.

    Parameters
    ----------
    unit : str
        Of the file's numbers: "mm", "cm", "m" or "in"; 3MF has its own.
    size : float
        Scales so that the longest side is that, mm.
    repair : bool
        Closes all holes, by a guess.
    memory : str
        The most it takes: "500MB".

    Raises
    ------
    InputError
        for a file that cannot be read, with the place in it.
    """
    call = _Call(["inspect"])
    known = Settings([row for row in of_command("inspect").values() if row.name in ("unit", "size", "repair", "memory")])
    call.words += words_for("load", known, "", settings) + ["--input=" + _path(path, "path")]
    return _rayrep.load([os.fsencode(word) for word in call.words], progress)


def repair(mesh: Mesh, *, guess: bool = False) -> Mesh:
    """Joins equal corners, turns what is inside out and closes what needs no guess; with `guess` all holes.

    What it did is told by `inspect(mesh).notes`.
    """
    return _rayrep.repair(mesh, guess)


@dataclass(frozen=True, eq=False)
class Defect:
    """How often a kind of defect occurs, and where it is first seen."""

    count: int
    #: mm, shape (3,)
    first: Any


@dataclass(frozen=True, eq=False, repr=False)
class Inspection:
    """What a mesh is, without a goal; prints as the command does."""

    #: It is closed, or was closed without a guess, and has a volume.
    usable: bool
    #: Why not, and what to do.
    refusal: str
    #: By name: "open_edges", "self_intersections", ...
    defects: Dict[str, Defect]
    #: mm^2
    area: float
    #: None where it is not usable.
    mass: Optional[MassProperties]
    notes: List[str]
    _json: str
    _text: str

    def report(self) -> Dict[str, Any]:
        """Everything, as `rayrep inspect --json` has it."""
        report: Dict[str, Any] = json.loads(self._json)
        return report

    def __repr__(self) -> str:
        return self._text


def inspect(mesh: Union[Mesh, Path], **settings: Any) -> Inspection:
    """Size, mass, inertia and defects of a mesh. Settings: density (g/cm^3) or material, unit, size, repair.

    >>> import rayrep
    >>> rayrep.inspect(rayrep.box((10, 10, 10)), density=1).mass.mass
    1.0
    """
    call = _Call(["inspect"], mesh)
    if not isinstance(mesh, Mesh) and _rayrep.is_printed(mesh):
        raise UsageError(f"'{os.fspath(mesh)}' is a file for a printer: rayrep.measure() reads it.")
    call.words += words_for("inspect", of_command("inspect"), "", settings)
    found = call.run(_rayrep.inspect)
    mass = None if found["mass"] is None else MassProperties(**found["mass"])
    return Inspection(found["usable"], in_python(found["refusal"]), {k: Defect(*v) for k, v in found["defects"].items()}, found["area"],
                      mass, [in_python(note) for note in found["notes"]], found["json"], found["text"])


def _failure(verdict: Verdict, result_of: str) -> GoalError:
    names = ", ".join(c.name for c in verdict.failed)
    error = GoalError(" ".join([f"{result_of} does not meet the goal ({names})."] + verdict.notes))
    error.verdict = verdict
    return error


def hollow(mesh: Union[Mesh, Path], goal: str = "float", *, format: Optional[str] = None, progress: Optional[Progress] = None,
           **settings: Any) -> Result:
    """Makes the inside of a body so that its print floats, spins, stands, ...; the same as the command of the goal's name.

    What is made is stored, read back and judged from its triangles; what comes back has passed.

    Parameters
    ----------
    mesh : Mesh or path
        Closed; in mm.
    goal : str
        "float", "spin", "stand", "target", "pose" or "dice".
    format : str
        What it is judged in and can be exported to without a loss: "stl" (float32), "obj", "ply" or "3mf". STL, and 3MF with
        infill or in pieces, if it is not given.
    progress : callable
        Is called with the stage and about how much is done, 0 to 1, several times a second. Returning False cancels
        (Interrupted); what it raises comes out. Ctrl-C raises KeyboardInterrupt with or without it.
    **settings
        See below; `rayrep.settings(goal)` shows them for one goal, with details. Numbers, text, True; lists of numbers for points
        and vectors, None in them for what is left open; a dict for numbers with names; a list where a setting may be given
        several times. `fixed` takes pairs of a mesh or path and a density, `deform_fixed` meshes, too.

    Raises
    ------
    UsageError, TypeError
        for settings that make no sense, or that there are not.
    InputError
        for a mesh that cannot be used.
    GoalError
        where the goal cannot be met, with figures and what to do; its `verdict` is that of what was made, if anything was.
    SolverError
        where a solver or slicer stops.

    Other threads of Python run meanwhile. The same input gives the same bytes.

    >>> import rayrep
    >>> result = rayrep.hollow(rayrep.box((40, 30, 20)), "float", resolution=40, waterline=14)
    >>> bool(result.verdict), round(result.figures["waterline_mm"], 6)
    (True, 14.0)
    """
    known = _settings_of(goal)
    call = _Call([goal], mesh)
    call.words += words_for("hollow", known, goal, call.take(settings))
    if format is not None:
        call.words.append("--output=/made." + _ending(format))
    outcome = call.run(_rayrep.hollow, progress)
    result = Result(outcome)
    if not result.verdict:
        raise _failure(result.verdict, "What was made")
    return result


def _settings_of(goal: str, of: str = "hollow") -> Settings:
    try:
        return settings(goal, of=of)
    except ValueError as error:
        raise UsageError(str(error)) from None


def _ending(format: str) -> str:
    ending = str(format).lower().lstrip(".")
    if ending not in ("stl", "obj", "ply", "3mf"):
        raise UsageError(f"format is 'stl', 'obj', 'ply' or '3mf'; it is {format!r}.")
    return ending


class Suggestion(NamedTuple):
    """A change with which the goal is met: it was made so and verified."""

    #: For people: "a wall of 0.8 mm".
    change: str
    #: To be given to `hollow` beside the others.
    settings: Dict[str, Any]


def suggest(mesh: Union[Mesh, Path], goal: str = "float", *, progress: Optional[Progress] = None,
            **settings: Any) -> List[Suggestion]:
    """What would do where `hollow` raises GoalError with these settings; from what changes least. Takes seconds to minutes.

    `allow` says which kinds of change are looked for, "wall,tilt"; all, if it is not given.
    """
    call = _Call([goal], mesh)
    call.words += words_for("suggest", _settings_of(goal), goal, call.take(settings))
    found = []
    for change, options in call.run(_rayrep.advise, progress):
        found.append(Suggestion(change, {keyword_of(name): _value(text) for name, text in options}))
    return found


def _value(text: str) -> Any:
    """Of a setting that is told as text: a number where it is one, True of a switch."""
    if text == "":
        return True
    try:
        return float(text)
    except ValueError:
        return text


def verify(mesh: Union[Mesh, Path], goal: str = "float", *, original: Union[Mesh, Path, None] = None,
           progress: Optional[Progress] = None, **settings: Any) -> Verdict:
    """Judges a mesh, or what a .gcode or .sl1 file prints, from its triangles: does it float upright, spin, stand, ...?

    Parameters
    ----------
    mesh : Mesh or path
        Of a print `original` is the mesh that it was made from.
    goal : str
        "float", "spin", "yoyo", "stand", "target", "pose" or "dice".
    original : Mesh or path
        The surface that must be found unchanged outside.
    **settings
        `rayrep.settings(goal, of="verify")` shows them; `Result.spec` has those a result was made for.

    Returns
    -------
    Verdict
        True if every criterion passes; a mesh that fails is no error.

    Raises
    ------
    GoalError
        where there is nothing to judge: a body that sinks has no waterline.
    InputError
        for a mesh that has no inside.

    >>> import rayrep
    >>> bool(rayrep.verify(rayrep.box((40, 40, 10)), "stand"))
    True
    """
    known = _settings_of(goal, "verify")
    call = _Call(["verify", "--goal=" + goal], mesh, original)
    call.words += words_for("verify", known, goal, call.take(settings))
    return Verdict(call.run(_rayrep.verify, progress))


@dataclass(frozen=True, eq=False, repr=False)
class Measurement:
    """What a file for a printer lays down; prints as the command does."""

    mass: MassProperties
    #: g/cm^3
    density: float
    #: As it names itself; may be empty.
    slicer: str
    #: (name, becomes part of the body, mm^3) of each kind of what is laid down.
    features: List[Tuple[str, bool, float]]
    notes: List[str]
    _json: str
    _text: str

    def report(self) -> Dict[str, Any]:
        """Everything, as `rayrep measure --json` has it."""
        report: Dict[str, Any] = json.loads(self._json)
        return report

    def __repr__(self) -> str:
        return self._text


def measure(path: Path, *, of: Union[Mesh, Path, None] = None, **settings: Any) -> Measurement:
    """Mass, centre of mass and inertia of what a .gcode or .sl1 file prints, skirt, brim and supports left out.

    Parameters
    ----------
    of : Mesh or path
        What was sliced, or anything with the same outside: it is told in its coordinates, else in the printer's.
    **settings
        density (g/cm^3) or material, where the file does not say it; measured_mass (g); print_direction, turned (degrees),
        bed_center (mm), filament_diameter (mm).

    Raises
    ------
    InputError
        for a file that cannot be read, or in which the mesh is not found.
    """
    name = _path(path, "path")
    if not _rayrep.is_printed(name):
        raise UsageError(f"'{name}' is no print by its name (.gcode, .sl1): rayrep.inspect() measures meshes.")
    call = _Call(["measure"], path, of, original_option="of")
    known = Settings([row for row in of_command("measure").values() if row.name not in ("of", "up", "threads")])
    call.words += words_for("measure", known, "", settings)
    found = call.run(_rayrep.measure)
    return Measurement(MassProperties(**found["mass"]), found["density"], found["slicer"], found["features"], found["notes"],
                       found["json"], found["text"])


def _describe() -> None:
    for function, goals, of in ((hollow, GOALS, "hollow"), (verify, JUDGED, "verify")):
        rows = described([(goal, settings(goal, of=of)) for goal in goals])
        function.__doc__ = f"{function.__doc__}\n    Settings\n    --------\n" + "".join(
            f"    {line}".rstrip() + "\n" for line in rows.splitlines())


_describe()
