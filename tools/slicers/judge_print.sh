#!/bin/sh
# A post-processing script for PrusaSlicer and SuperSlicer: judges every print as it is sliced.
#
#   Print Settings > Output options > Post-processing scripts:
#   /path/to/judge_print.sh /path/to/duck.stl --goal float
#
# The mesh as it was before it was hollowed, then any options of 'rayrep verify' (no blanks in them); the slicer adds the G-code. What
# rayrep says is beside the G-code, NAME.gcode.verdict.txt. A print that misses its goal is an error of the slicer's.
set -u
original=$1
shift
options=
while [ $# -gt 1 ]; do
  options="$options $1"
  shift
done
told=${SLIC3R_PP_OUTPUT_NAME:-$1}.verdict.txt
# shellcheck disable=SC2086  # the options are meant to be split
rayrep verify "$1" --original "$original" $options > "$told" 2>&1
code=$?
[ $code -eq 0 ] || tail -n 3 "$told" >&2
exit $code
