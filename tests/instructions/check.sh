#!/usr/bin/env bash
# Counts the instructions of one frame and holds them against the figure stored beside this script, since a count does
# not depend on what else the machine does. `check.sh PROGRAM` checks the `gaurast-bench` program; `check.sh PROGRAM --store`
# stores its count. The figure is that of the profile that tests/run.sh builds.
#
# The frame is the third of frames.jsonl, at the AVX2 level on one thread, since the second one makes the chunks: its
# count is that of a run with all frames less that of a run with the first two.
set -euo pipefail
program=$(realpath "$1")
folder=$(cd "$(dirname "$0")" && pwd)
tolerance=3 # percent
if ! command -v valgrind >/dev/null; then
    echo "skipped: valgrind is not there" >&2
    exit 0
fi
if ! grep -qw avx2 /proc/cpuinfo; then
    echo "skipped: this processor has no AVX2" >&2
    exit 0
fi

count() { # count LINES: the instructions of a worker that is told that many lines
    local said
    said=$(head -n "$1" "$folder/frames.jsonl" |
        GAURAST_SIMD=avx2 GAURAST_THREADS=1 valgrind --tool=callgrind --callgrind-out-file=/dev/null "$program" \
            worker 2>&1 >/dev/null) || {
        echo "the worker failed: $said" >&2
        return 1
    }
    sed -n 's/.*Collected : \([0-9]*\).*/\1/p' <<<"$said"
}
all=$(count 4)
first=$(count 3)
frame=$((all - first))
if [ "${2:-}" = --store ]; then
    echo "$frame" >"$folder/stored.txt"
    echo "stored: $frame instructions"
    exit 0
fi
stored=$(cat "$folder/stored.txt")
echo "a frame takes $frame instructions; $stored are stored"
if [ $((frame * 100)) -gt $((stored * (100 + tolerance))) ]; then
    echo "that is more than $tolerance % more: find out why, or store the new figure" >&2
    exit 1
elif [ $((frame * 100)) -lt $((stored * (100 - tolerance))) ]; then
    echo "that is more than $tolerance % less: store the new figure, so that it stays so" >&2
fi
