#!/bin/sh
# Sets everything up, builds the rayrep command and runs it.
#
#   tools/run.sh                  rayrep float examples/duck.stl --fluid 1.0, in this repository's folder
#   tools/run.sh ARGUMENTS...     rayrep ARGUMENTS..., in the current folder
#
# Standard output is rayrep's alone; the preparations report on standard error.
set -eu
root=$(cd "$(dirname "$0")/.." && pwd)

{
  "$root/tools/setup.sh" run
  cd "$root"
  cmake --preset release
  cmake --build --preset release --target rayrep_tool
} >&2

if [ $# -eq 0 ]; then
  cd "$root"
  set -- float examples/duck.stl --fluid 1.0
fi
exec "$root/build/release/rayrep" "$@"
