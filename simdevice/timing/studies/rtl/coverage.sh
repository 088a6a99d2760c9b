#!/usr/bin/env bash
# Measures with Verilator which lines and bits of a module in fp16 the lists of a folder reach: bash coverage.sh FOLDER. The example
# `rtl_lists` writes them. Prints percentages by file, then all lines and bits that nothing reaches. Must be in the folder of the
# modules' files.
set -euo pipefail
lists=$(realpath "${1:?is a folder of lists}")
cd "$(dirname "$0")"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
SOURCES="delay.sv multiply_add.sv fp_round.sv fp_add.sv fp_mul.sv fp_div.sv fp_exp2.sv exp2_table.sv pe.sv pixel_buffer.sv primitive_buffer.sv raster_module.sv"
# shellcheck disable=SC2086
verilator --cc --exe --build --hierarchical -MAKEFLAGS "OPT_FAST=-O1 OPT_SLOW=-O0 OPT_GLOBAL=-O0" --coverage-toggle --coverage-line -GEXPONENT=5 -GMANTISSA=10 \
    --Mdir "$work/objects" --top-module raster_module $SOURCES "$PWD/bench.cpp" >"$work/log" 2>&1 || { cat "$work/log" >&2; exit 1; }
for list in "$lists"/fp16-*.lists; do
    (cd "$work" && objects/Vraster_module "$list" pixels && mv coverage.dat "$(basename "$list").dat")
done
python3 coverage.py "$work"/*.dat
