#!/bin/sh
# Builds the Debian packages, has lintian look at them, installs and runs them on a bare Debian 12 (as root; packages debootstrap, lintian,
# desktop-file-utils; some minutes, 1 GB in TMPDIR).
#
#   tests/packages/run.sh [FOLDER]    keeps the packages in FOLDER
set -eu
root=$(cd "$(dirname "$0")/../.." && pwd)
place=$(mktemp -d)
trap 'umount -q "$place/bare/proc" || true; rm -rf "$place"' EXIT
trap 'exit 130' INT TERM

cmake --preset release -S "$root" -D RAYREP_PYTHON=ON >&2
cmake --build "$root/build/release" -j "$(nproc)" >&2
(cd "$root/build/release" && cpack -G DEB -B "$place/packages" >&2)
ls -l "$place"/packages/*.deb
if [ $# -gt 0 ]; then mkdir -p "$1" && cp "$place"/packages/*.deb "$1"; fi

echo "== as Debian's policy and desktops want them"
# No bug of Debian's asks for them.
lintian --allow-root --fail-on error,warning --suppress-tags initial-upload-closes-no-bugs "$place"/packages/*.deb
dpkg -x "$place"/packages/rayrep_*.deb "$place/unpacked"
desktop-file-validate "$place"/unpacked/usr/share/applications/*.desktop

echo "== a bare Debian 12"
debootstrap --variant=minbase bookworm "$place/bare" >&2
mount -t proc proc "$place/bare/proc"
cp "$place"/packages/*.deb "$place/bare/tmp"
cp "$root/examples/duck.stl" "$place/bare/tmp"
cp -r "$root/tests/consumer" "$place/bare/tmp/consumer"
within() { DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8 chroot "$place/bare" "$@"; }
within sh -c 'apt-get -qq update && apt-get -qq install -y --no-install-recommends /tmp/rayrep_*.deb >/dev/null'
within rayrep --version
within rayrep studio --help >/dev/null
within sh -c 'cd /tmp && rayrep float duck.stl --resolution 60 | tail -n 3 && rayrep verify duck_float.stl --original duck.stl --quiet'
within sh -c 'cd /usr/share && test -s man/man1/rayrep.1.gz && test -s bash-completion/completions/rayrep && test -s rayrep/rayrep_addon.py'
within sh -c 'cd /usr/share && test -s icons/hicolor/scalable/apps/$(sed -n s/^Icon=//p applications/rayrep-studio.desktop).svg'
# The script for slicers, with the command of the package: a mesh that meets its goal, and one that does not.
within sh -c 'cd /tmp && /usr/share/rayrep/judge_print.sh duck.stl --goal float duck_float.stl'
within sh -c 'cd /tmp && ! /usr/share/rayrep/judge_print.sh duck.stl --goal float --waterline 40 duck_float.stl 2>/dev/null'

echo "== a program that is built with librayrep-dev"
within sh -c 'apt-get -qq install -y --no-install-recommends /tmp/librayrep-dev_*.deb cmake g++ make >/dev/null'
within sh -c 'cmake -S /tmp/consumer -B /tmp/built >/dev/null && cmake --build /tmp/built >/dev/null && /tmp/built/consumer'
echo "== Python"
within sh -c 'apt-get -qq install -y --no-install-recommends /tmp/python3-rayrep_*.deb >/dev/null'
within python3 -c 'import rayrep
result = rayrep.hollow("/tmp/duck.stl", "float", resolution=60)
print(result.figures["mass_g"], bool(rayrep.verify(result.mesh, original="/tmp/duck.stl", **result.spec)))'
echo "== removed again"
within sh -c 'apt-get -qq purge -y rayrep librayrep-dev python3-rayrep >/dev/null && ! test -e /usr/bin/rayrep && ! test -e /usr/include/rayrep && ! test -e /usr/lib/python3/dist-packages/rayrep'
echo "ok"
