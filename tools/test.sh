#!/bin/sh
# Sets everything up, builds everything and runs all tests; ends with ctest's summary.
#
#   tools/test.sh                          the preset dev: optimised, assertions on, warnings are errors
#   tools/test.sh PRESET [CTEST OPTIONS]   one test preset, e.g. tools/test.sh asan -R Moments
set -eu
cd "$(dirname "$0")/.."
tools/setup.sh test

run() {
  preset=$1
  shift
  cmake --preset "$preset"
  cmake --build --preset "$preset"
  ctest --preset "$preset" --output-on-failure "$@"
}

if [ $# -gt 0 ]; then
  run "$@"
else
  run dev
fi
