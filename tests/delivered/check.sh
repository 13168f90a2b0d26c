#!/bin/sh
# What rayrep delivers, byte for byte: runs every line of runs.txt in every format, of more_runs.txt as STL and of piece_runs.txt as 3MF, and compares the
# files, the terminal text (but its times) and the exit codes with the table delivered.txt. Without advice, which is many runs more.
#
#   tests/delivered/check.sh RAYREP            compares; exit 1 and the lines that differ
#   tests/delivered/check.sh RAYREP --update   writes the table: for a commit that means to change what is delivered
set -eu
tool=$(realpath "$1")
here=$(cd "$(dirname "$0")" && pwd)
cd "$here/../.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

hash_of() { [ -e "$1" ] && sha256sum "$1" | cut -c1-16 || echo none; }

run() {  # ENDING ARGUMENTS...
  ending=$1
  shift
  key=$(echo "$* $ending" | tr -c 'a-zA-Z0-9.\n' _)
  out="$work/$key/out.$ending"
  mkdir "$work/$key"
  code=0
  "$tool" "$@" --resolution 60 --no-advice -o "$out" >"$work/$key/text" 2>&1 || code=$?
  sed -i -e "s#$work/$key/##g" -e 's/, in [0-9.]* s$//' "$work/$key/text"
  echo "$code $(hash_of "$out") $(hash_of "$work/$key/text") $ending $*"
}

table() {
  for ending in stl obj ply 3mf; do
    grep -v '^#' "$here/runs.txt" | while read -r line; do
      # shellcheck disable=SC2086  # arguments without spaces
      run $ending $line
    done
  done
  while read -r line; do
    # shellcheck disable=SC2086
    run stl $line
  done <"$here/more_runs.txt"
  while read -r line; do
    # shellcheck disable=SC2086
    run 3mf $line
  done <"$here/piece_runs.txt"
}

table >"$work/now"
if [ "${2-}" = --update ]; then
  cp "$work/now" "$here/delivered.txt"
else
  diff "$here/delivered.txt" "$work/now" || {
    echo "delivered: these lines differ (exit code, file, text, ending, arguments); --update accepts them" >&2
    exit 1
  }
  echo "delivered: $(wc -l <"$work/now") runs as in the table"
fi
