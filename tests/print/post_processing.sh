#!/bin/sh
# tools/slicers/judge_print.sh as PrusaSlicer runs it: a print that meets its goal passes, one that does not is the slicer's error.
#   tests/print/post_processing.sh RAYREP
set -eu
root=$(cd "$(dirname "$0")/../.." && pwd)
rayrep=$(realpath "$1")
command -v prusa-slicer > /dev/null || exit 77
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
cd "$place"
ln -s "$rayrep" rayrep
PATH=$place:$PATH
rayrep float "$root/examples/duck.stl" --resolution 60 -o duck.3mf --quiet

# sliced OPTIONS_OF_VERIFY: with the exit code of the slicer
sliced() {
  { grep -v post_process "$root/benchmarks/everyday.ini"; echo "post_process = $root/tools/slicers/judge_print.sh $root/examples/duck.stl $*"; } > my.ini
  prusa-slicer --export-gcode --load my.ini --output out.gcode duck.3mf > log 2>&1
}

sliced --goal float || { cat log; exit 1; }
grep -q '^VERIFIED$' out.gcode.verdict.txt
if sliced --goal float --waterline 30; then
  echo "a print that floats elsewhere passed"
  exit 1
fi
grep -q 'does not meet the goal' log
echo "ok"
