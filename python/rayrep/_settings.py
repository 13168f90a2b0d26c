"""Settings as keywords: what there is, and how values become what the library reads."""

from __future__ import annotations

import difflib
import keyword
import os
import textwrap
from functools import lru_cache
from typing import Any, Iterator, List, Mapping, NamedTuple, Sequence, Tuple

import numpy as np

from . import _rayrep
from ._errors import in_python

#: What `hollow` makes and `verify` judges.
GOALS = ("float", "spin", "stand", "target", "pose", "dice")
#: What only `verify` knows: a yo-yo is made by hollow(mesh, "spin", yoyo=True).
JUDGED = ("float", "spin", "yoyo", "stand", "target", "pose", "dice")

# Files, terminal and batches of the command: here there are methods and loops.
_OF_THE_COMMAND = {"output", "suggest", "no-advice", "section", "picture", "config", "save-config", "report", "json", "html", "quiet",
                   "verbose", "help", "urdf", "mjcf", "gcode", "each", "phases", "goal", "original"}


class Setting(NamedTuple):
    """One keyword of a function."""

    name: str
    #: What it takes, with its unit: "MM", "G_CM3", "DEG"; empty of a switch, True or False.
    value: str
    words: str
    details: str
    default: str
    heading: str
    #: The option of the command.
    option: str
    #: "number", "whole", "switch" or "text".
    kind: str
    repeated: bool
    #: Which numbers it takes.
    range: str
    #: What True means; empty: it takes no True.
    alone: str


def keyword_of(option: str) -> str:
    """The keyword for an option of the command: "max-tilt" is max_tilt, "3mf-flavor" is flavor, "lambda" is lambda_."""
    name = "flavor" if option == "3mf-flavor" else option.replace("-", "_")
    return name + "_" if keyword.iskeyword(name) else name


class Settings(Mapping[str, Setting]):
    """The keywords of a function by name, in order; prints as a table."""

    def __init__(self, rows: Sequence[Setting]):
        self._rows = {row.name: row for row in rows}

    def __getitem__(self, name: str) -> Setting:
        return self._rows[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._rows)

    def __len__(self) -> int:
        return len(self._rows)

    def __repr__(self) -> str:
        lines: List[str] = []
        heading = None
        for row in self._rows.values():
            if row.heading != heading:
                heading = row.heading
                lines.append(heading)
            takes = "True" if row.kind == "switch" else row.value
            default = "" if row.default in ("", "no", "none") or "(default" in row.words else f" (default {row.default})"
            alone = f" (True: {row.alone})" if row.alone else ""
            text = f"{row.words}{alone}{default}"
            lead = f"  {row.name + '=' + takes:26} "
            lines += textwrap.wrap(text, 118, initial_indent=lead, subsequent_indent=" " * len(lead))
        return "\n".join(lines)


@lru_cache(maxsize=None)
def settings(goal: str = "float", *, of: str = "hollow") -> Settings:
    """The settings of a goal, as keywords of `hollow` (or, of="verify", of `verify`): names, units, defaults, ranges.

    >>> import rayrep
    >>> rayrep.settings("float")["wall"].value
    'MM'
    >>> rayrep.settings("stand", of="verify")["density"].default
    '1.24'
    """
    if of not in ("hollow", "verify"):
        raise ValueError(f"of is 'hollow' or 'verify'; it is {of!r}.")
    known = GOALS if of == "hollow" else JUDGED
    if goal not in known:
        near = difflib.get_close_matches(str(goal), known, 1, 0.5)
        hint = f" Did you mean {near[0]!r}?" if near else ""
        if goal == "yoyo":
            hint = " Say hollow(mesh, 'spin', yoyo=True)."
        raise ValueError(f"goal is one of {', '.join(known)}; it is {goal!r}.{hint}")
    return of_command(goal) if of == "hollow" else of_command("verify", goal)


def of_command(word: str, goal: str = "") -> Settings:
    """Those of a command, without what is for its files and the terminal."""
    rows = []
    for heading, option, value, text, details, kind, default, repeated, _, allowed, alone in _rayrep.settings(word, goal):
        if option == "fixed":
            value = "[(MESH, G_CM3)]"
        if option not in _OF_THE_COMMAND:
            rows.append(Setting(keyword_of(option), value, in_python(text), in_python(details), default, heading, option, kind,
                                repeated, allowed, alone))
    return Settings(rows)


def _refuse(function: str, names: List[str], known: Settings, goal: str) -> None:
    """Raises TypeError for keywords that there are not."""
    for name in names:
        if name in known:
            continue
        text = f"{function}() has no setting {name!r}" + (f" for the goal {goal!r}." if goal else ".")
        near = difflib.get_close_matches(name, list(known), 3, 0.6)
        others = [g for g in GOALS if g != goal and name in settings(g)] if goal else []
        if near:
            text += f" Did you mean {' or '.join(near)}?"
        elif others:
            text += f" It belongs to {', '.join(others)}."
        if goal:
            of = "" if function in ("hollow", "suggest") else ', of="verify"'
            text += f' rayrep.settings("{goal}"{of}) lists all.'
        raise TypeError(text)


def _scalar(name: str, value: Any) -> str:
    if value is None:
        return "-"
    if isinstance(value, (bool, np.bool_)):
        raise TypeError(f"{name} takes numbers or text; it is {value!r}.")
    if isinstance(value, (int, np.integer)):
        return str(int(value))
    if isinstance(value, (float, np.floating)):
        return repr(float(value))
    if isinstance(value, str):
        return value
    if isinstance(value, os.PathLike):
        return str(os.fspath(value))
    raise TypeError(f"{name} takes a number, a text, or a list of them; it is {value!r}.")


def text_of(name: str, value: Any) -> str:
    """A value as the command line has it: 1.5, "auto", (0, 0, 1), [1, None, 2], {"mass": 14}."""
    if isinstance(value, Mapping):
        return ",".join(f"{key}={_scalar(name, one)}" for key, one in value.items())
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        if not value:
            raise TypeError(f"{name} is empty.")
        return ",".join(_scalar(name, one) for one in value)
    return _scalar(name, value)


def words_of(row: Setting, value: Any) -> List[str]:
    """The options for one keyword."""
    option = "--" + row.option
    if value is None:
        return []
    if row.kind == "switch":
        if not isinstance(value, (bool, np.bool_)):
            raise TypeError(f"{row.name} is True or False; it is {value!r}.")
        return [option] if value else []
    if row.alone and isinstance(value, (bool, np.bool_)):
        return [f"{option}={row.alone}"] if value else []
    if row.kind == "whole" and isinstance(value, (float, np.floating)) and float(value).is_integer():
        value = int(value)
    several = row.repeated and isinstance(value, (list, tuple)) and not all(isinstance(v, (int, float)) for v in value)
    return [f"{option}={text_of(row.name, one)}" for one in (value if several else [value])]


def words_for(function: str, known: Settings, goal: str, given: Mapping[str, Any]) -> List[str]:
    """All options for the keywords that were given."""
    _refuse(function, list(given), known, goal)
    words: List[str] = []
    for name, value in given.items():
        words += words_of(known[name], value)
    return words


def described(functions: Sequence[Tuple[str, Settings]]) -> str:
    """For a docstring: the settings of each goal, those that all have once."""
    common = [name for name in functions[0][1] if all(name in rows and rows[name][:5] == functions[0][1][name][:5]
                                                      for _, rows in functions)]
    parts = ["Of every goal\n" + textwrap.indent(repr(Settings([functions[0][1][n] for n in common])), "  ")]
    for goal, rows in functions:
        own = [rows[n] for n in rows if n not in common]
        parts.append(f"Of the goal {goal!r}\n" + textwrap.indent(repr(Settings(own)), "  "))
    return "\n\n".join(parts)
