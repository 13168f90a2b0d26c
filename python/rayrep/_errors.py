"""What can go wrong, by kind."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Optional

if TYPE_CHECKING:
    from ._runs import Verdict


class Error(Exception):
    """Anything that rayrep refuses or fails at. Its text says what is wrong, where, and what to do."""


class UsageError(Error, ValueError):
    """An argument or setting that makes no sense."""


class InputError(Error):
    """A mesh or file that cannot be read or used."""


class GoalError(Error):
    """A goal that physics or the wall does not allow, or that what was made does not meet.

    Attributes
    ----------
    verdict : Verdict or None
        Of what was made, with its figures; None where the goal was refused before anything was. What would do instead:
        `rayrep.suggest`.
    """

    verdict: Optional[Verdict] = None


class SolverError(Error):
    """A solver or slicer stopped before it was done."""


class WriteError(Error, OSError):
    """A file that could not be written."""


class Interrupted(Error):
    """`progress` returned False. Ctrl-C raises KeyboardInterrupt, and what `progress` raises comes out as it is."""


_OPTION = re.compile(r"(?<![\w-])--([a-z][a-z0-9-]*)(?: (-?\d+(?:\.\d+)?(?![\w%.]|,\d)|[A-Z][A-Z0-9_,]+\b))?")


def in_python(text: str) -> str:
    """A message that speaks of options as of keywords: "--max-tilt 4" is "max_tilt=4", "--infill FILE" is "infill=FILE"."""

    def keyword(match: "re.Match[str]") -> str:
        name = match[1].replace("-", "_")
        return name if match[2] is None else f"{name}={match[2]}"

    return _OPTION.sub(keyword, re.sub(r"end '[^']*' in \.3mf", "say format='3mf'", text))
