#!/bin/sh
# Builds the benchmarks, measures everything and writes docs/results.md and docs/results/*.svg anew.
#
#   benchmarks/run.sh [options of `rayrep_bench tables`]      e.g. --meshes ../shared/meshes, --cap 300, --quick
#   TABLES="table2 trace" benchmarks/run.sh ...               only these are measured again
#
# Each table is measured in a process of its own, so that the memory of one is not counted with another. The figures are kept in
# build/bench/results/*.json; to compare two runs: build/bench/rayrep_bench compare BEFORE.json AFTER.json
set -eu
called_from=$PWD
root=$(cd "$(dirname "$0")/.." && pwd)

{
  "$root/tools/setup.sh" bench
  cd "$root"
  cmake --preset release -B build/bench -DRAYREP_BUILD_BENCHMARKS=ON
  cmake --build build/bench --target rayrep_bench
} >&2

bench=$root/build/bench/rayrep_bench
results=$root/build/bench/results
mkdir -p "$results"
commit=$(git -C "$root" -c safe.directory="$root" describe --always --dirty --abbrev=10 2>/dev/null || echo unknown)

cd "$called_from"
for table in ${TABLES-table1 table2 trace quality cavities overhang roofs growth teapot sliced answers}; do
  "$bench" tables "$table" --commit "$commit" -o "$results/$table.json" "$@"
done
only=.
case " $* " in *" --quick "*) only=N:100/ ;; esac
[ -n "${TABLES-}" ] || "$bench" micro --benchmark_filter="$only" --benchmark_out="$results/micro.json" --benchmark_out_format=json >&2

set --
for table in table1 table2 trace quality cavities overhang roofs growth teapot sliced answers; do
  [ ! -e "$results/$table.json" ] || set -- "$@" "$results/$table.json"
done
[ ! -e "$results/micro.json" ] || set -- "$@" --micro "$results/micro.json"
"$bench" results "$@" -o "$root/docs"
