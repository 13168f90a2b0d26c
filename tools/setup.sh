#!/bin/sh
# Installs what rayrep needs from Debian's own packages; only what is missing, so it may be run any number of times.
#
#   tools/setup.sh run     what building and running the rayrep command needs
#   tools/setup.sh test    the same, and what the tests and the format check need (default)
#   tools/setup.sh python  what building the Python package needs (-D RAYREP_PYTHON=ON)
#   tools/setup.sh bench   what building and running the benchmarks needs
set -eu

build_packages="g++ cmake ninja-build pkg-config ccache"
library_packages="libeigen3-dev libtbb-dev libembree-dev libopenvdb-dev coinor-libipopt-dev
  libboost-dev libboost-program-options-dev libzip-dev libpng-dev libcairo2-dev libpugixml-dev nlohmann-json3-dev libfmt-dev libssl-dev
  libcpp-httplib-dev"
python_packages="python3 python3-dev python3-numpy pybind11-dev"
# MuJoCo, PrusaSlicer and Slic3r are asked what they make of delivered files, Chromium looks at reports; without them these tests are
# skipped; Slurm and GNU parallel run shards of a batch.
test_packages="libgtest-dev libgmock-dev clang-format-14 libmujoco-dev prusa-slicer slic3r
  python3-matplotlib mypy python3-jsonschema chromium slurm-wlm munge parallel"

say() { echo "setup: $*" >&2; }

case "${1-test}" in
  run) wanted="$build_packages $library_packages" ;;
  bench) wanted="$build_packages $library_packages libbenchmark-dev" ;;
  python) wanted="$build_packages $library_packages $python_packages" ;;
  test) wanted="$build_packages $library_packages $python_packages $test_packages" ;;
  -h | --help) sed -n '2,7s/^# \{0,1\}//p' "$0"; exit 0 ;;
  *) say "unknown argument '$1': give 'run', 'python', 'test' or 'bench'"; exit 2 ;;
esac

if ! command -v dpkg-query >/dev/null || ! command -v apt-get >/dev/null; then
  say "this system has no apt: rayrep is built on Debian 12. Elsewhere, install what these Debian packages hold:"
  say "$(echo $wanted)"
  exit 1
fi

# shellcheck disable=SC2086  # the lists are meant to be split
installed=" $(dpkg-query -W -f='${Package}=${db:Status-Status} ' $wanted 2>/dev/null || true)"
missing=""
for package in $wanted; do
  case "$installed" in
    *" $package=installed "*) ;;
    *) missing="$missing $package" ;;
  esac
done
[ -n "$missing" ] || exit 0

system=$(. /etc/os-release 2>/dev/null && echo "${ID-} ${VERSION_ID-}") || system=unknown
[ "$system" = "debian 12" ] || say "made for Debian 12 and not tried on '$system'; going on with the same package names"

as_root=""
if [ "$(id -u)" -ne 0 ]; then
  if command -v sudo >/dev/null && { [ -t 0 ] || sudo -n true 2>/dev/null; }; then
    as_root="sudo"
  else
    say "installing packages needs root. Run this as root once, then again what you ran:"
    say "apt-get update && apt-get install -y --no-install-recommends$missing"
    exit 1
  fi
fi

say "installing$missing"
apt() { $as_root env DEBIAN_FRONTEND=noninteractive apt-get -o DPkg::Lock::Timeout=300 "$@" >&2; }
apt -q update || say "the package lists could not all be refreshed; trying with what there is"
# shellcheck disable=SC2086
apt -q install -y --no-install-recommends $missing
