#!/bin/sh
# Makes docs/gallery.md and its pictures from the examples: docs/gallery.sh [RAYREP] (default build/release/rayrep, else build/dev/rayrep)
set -eu
root=$(cd "$(dirname "$0")/.." && pwd)
rayrep=${1-$root/build/release/rayrep}
[ -x "$rayrep" ] || rayrep=$root/build/dev/rayrep
case $rayrep in /*) ;; *) rayrep=$PWD/$rayrep ;; esac
pictures=$root/docs/gallery
mkdir -p "$pictures"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
cp "$root"/examples/*.stl .
text=$work/gallery.md
cat > "$text" <<'END'
# Gallery

Each picture shows a body before and after, cut open; below it the section through its centre of mass, the command, and what it says of the
print. Made by `docs/gallery.sh`.
END

# show TITLE PLANE COMMAND...: one body, in pictures called $as or by mesh and command
show() {
  title=$1 plane=$2
  shift 2
  name=${as-$(basename "$2" .stl)_$1}
  "$rayrep" "$@" --picture "$pictures/$name.png" --section "$plane:$pictures/${name}_section.png" -o "$name.3mf" --no-advice > out
  {
    printf '\n## %s\n\n![%s, before and after](gallery/%s.png)\n\n![section](gallery/%s_section.png)\n\n' "$title" "$title" "$name" "$name"
    printf '    rayrep'
    command=$1 mesh=$2
    shift 2
    printf ' %s examples/%s' "$command" "$mesh"
    for word in "$@"; do printf ' %s' "$word"; done
    printf '\n\n'
    # What it comes to, and the table of figures.
    awk 'NR > 2 && /^$/ && said { exit } NR > 2 && NF { said = 1; print }' out
    printf '\n```\n'
    awk '/before \(solid\)/ { table = 1 } table && /^$/ { exit } table' out
    printf '```\n'
  } >> "$text"
  echo "$title" >&2
}

show "A duck that floats" y float duck.stl
show "Three spheres that float as deep as they can" y float three_spheres.stl
show "A bird that spins" x spin bird.stl
show "An ellipsoid that leans and spins upright" x spin tilted_ellipsoid.stl
show "A plumper ellipsoid that spins" x spin ellipsoid.stl
show "A robin that spins" x spin robin.stl
show "A heart as a yo-yo" x spin heart.stl --yoyo --axle none --up y
show "A wrestler with a core of tin" x spin sumo.stl --core-material tin
show "A teapot that stands" y stand teapot.stl
show "A couple that leans apart, its outside moved by up to 3 mm" y stand couple.stl --deform-limit 3
show "A die that falls fairly, whatever was cut into it" y dice die.stl --size 25
as=duck_infill show "A duck printed with 15 % infill" y float duck.stl --infill 15
mv "$text" "$root/docs/gallery.md"
