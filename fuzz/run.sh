#!/bin/sh
# Fuzzes for real, one target after the other, with clang and libFuzzer (Debian package clang-14):
#
#   fuzz/run.sh MINUTES [TARGET...]     each target (read_mesh read_gcode settings cast verify run; all of them) for so long
#
# Begins with fuzz/corpus/TARGET and what earlier runs have found in build/fuzz/corpus/TARGET. What fails is left in
# build/fuzz/finds/TARGET: mend it, and put it into fuzz/corpus/TARGET, over which every test run goes. Ends with a table; 1 if
# anything failed.
set -eu
cd "$(dirname "$0")/.."
minutes=${1:?"how many minutes for each target?"}
shift
[ $# -gt 0 ] || set -- read_mesh read_gcode settings cast verify run

cmake --preset fuzz
cmake --build --preset fuzz
cd build/fuzz
mkdir -p logs
status=0
table="target executions coverage features finds"
for target in "$@"; do
  mkdir -p "corpus/$target" "finds/$target"
  case $target in
    read_mesh | read_gcode) length=4096 ;;
    *) length=400 ;;
  esac
  log=logs/$target
  echo "fuzzing $target for $minutes minutes: build/fuzz/$log"
  "./fuzz_$target" -max_total_time=$((60 * minutes)) -max_len=$length -timeout=60 -rss_limit_mb=2500 -print_final_stats=1 \
    -artifact_prefix="finds/$target/" "corpus/$target" "../../fuzz/corpus/$target" >"$log" 2>&1 || status=1
  executions=$(sed -n 's/^stat::number_of_executed_units: *//p' "$log")
  coverage=$(sed -n 's/^#.* cov: \([0-9]*\) ft: \([0-9]*\).*/\1 \2/p' "$log" | tail -1)
  table="$table
$target ${executions:-?} ${coverage:-? ?} $(find "finds/$target" -type f | wc -l)"
done
echo "$table" | column -t
exit $status
