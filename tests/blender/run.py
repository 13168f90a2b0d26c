#!/usr/bin/python3
"""tools/blender/rayrep_addon.py in Debian's blender, without a window: tests/blender/run.py RAYREP. Skipped (77) where there is no blender.

Blender is large: neither the set-up scripts nor CI install it (apt-get install blender).
"""
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent


def main():
    blender = shutil.which("blender")
    if blender is None:
        print("skipped: there is no blender")
        return 77
    with tempfile.TemporaryDirectory() as place:
        # The add-on is installed into a user's folder of its own; the command is found by PATH first.
        os.symlink(Path(sys.argv[1]).resolve(), Path(place) / "rayrep")
        environment = dict(os.environ, PATH=place + os.pathsep + os.environ["PATH"], HOME=place, BLENDER_USER_SCRIPTS=place + "/scripts")
        return subprocess.run(
            [blender, "--background", "--factory-startup", "--python-exit-code", "1", "--python", str(HERE / "in_blender.py")],
            cwd=place, env=environment).returncode


if __name__ == "__main__":
    sys.exit(main())
