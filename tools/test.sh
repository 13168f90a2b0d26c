#!/bin/sh
# Sets everything up, builds everything and runs all tests; ends with ctest's summary.
#
#   tools/test.sh                          the preset dev: optimised, assertions on, warnings are errors
#   tools/test.sh PRESET [CTEST OPTIONS]   another test preset, e.g. tools/test.sh asan -R Moments
set -eu
cd "$(dirname "$0")/.."
preset=${1-dev}
[ $# -eq 0 ] || shift

tools/setup.sh test
cmake --preset "$preset"
cmake --build --preset "$preset"
exec ctest --preset "$preset" --output-on-failure "$@"
