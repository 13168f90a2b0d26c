#!/bin/sh
# Sets everything up, builds everything and runs all tests, then builds with sanitizers and runs them again; ends with ctest's summary.
#
#   tools/test.sh                          the presets dev (optimised, assertions on, warnings are errors) and asan
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
  run asan
fi
