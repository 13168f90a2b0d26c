#!/usr/bin/python3
"""The Python package as it was built, and the command beside it.

  tests/python/run.py BUILD/python RAYREP [unittest's arguments]

Exit code 77: it was not built.
"""
import os
import sys
import unittest
from pathlib import Path


def main():
    package, command = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()
    if not list(package.glob("rayrep/_rayrep*.so")):
        print("skipped: the package is not built (-D RAYREP_PYTHON=ON)")
        return 77
    os.environ["RAYREP"] = str(command)
    os.environ["PYTHONPATH"] = str(package)  # of what tests start
    sys.path[:0] = [str(package), str(Path(__file__).parent)]
    arguments = [sys.argv[0]] + (sys.argv[3:] or ["discover", "-s", str(Path(__file__).parent)])
    return 0 if unittest.main(module=None, argv=arguments, exit=False).result.wasSuccessful() else 1


if __name__ == "__main__":
    sys.exit(main())
