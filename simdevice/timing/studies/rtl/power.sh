#!/usr/bin/env bash
# Maps PEs to a library of cells and computes from toggles what they and a module of 16 draw:
# GAURAST_LIBERTY=FILE GAURAST_LIBERTY_NODE=45 bash power.sh FOLDER. FOLDER has lists as the example `rtl_lists` writes them. Prints two
# tables in Markdown: energy of a PE, and area, times and power of a module. `bash power.sh FILE adder` prints the figures of
# power.py for an adder in fp16 whose record is in the file. Needs yosys, Verilator, OpenSTA and Python. Must be in the folder of the
# modules' files.
set -euo pipefail
lists=$(realpath "${1:?is a folder of lists}")
source "$(dirname "$0")/cells.sh"
MODULE="pixel_buffer.sv primitive_buffer.sv raster_module.sv"

# record FORMAT KIND: what enters and leaves a PE of the module that draws such lists, as record.txt in $work/FORMAT-KIND.
record() {
    local bits="-GEXPONENT=8 -GMANTISSA=23"
    [ "$1" = fp32 ] || bits="-GEXPONENT=5 -GMANTISSA=10"
    # shellcheck disable=SC2086
    [ -e "$work/$1/Vraster_module" ] ||
        verilator --cc --exe --build --hierarchical -O3 -MAKEFLAGS "OPT_FAST=-O1 OPT_SLOW=-O0 OPT_GLOBAL=-O0" $bits --Mdir "$work/$1" \
            --top-module raster_module $SOURCES $MODULE record.sv "$PWD/bench.cpp" >"$work/log" 2>&1 || { cat "$work/log" >&2; exit 1; }
    mkdir -p "$work/$1-$2"
    (cd "$work/$1-$2" && "../$1/Vraster_module" "$lists/$1-$2.lists" pixels)
}

# measure FORMAT PE KIND: prints a row for the PE that was mapped, and appends the figures to $work/figures.
measure() {
    local outputs="fragment covered"
    [ "$3" = triangles ] || outputs="reaches open next_transmittance next_color"
    record "$1" "$3"
    # shellcheck disable=SC2086
    python3 power.py "$library" "$node" "$work/netlist.json" "$work/$1-$3/record.txt" $outputs >"$work/energy"
    awk -v name="| $1 | $2 | $3 |" '{
        printf "%s %.1f | %.1f | %.1f | %.1f | %.1f | %.1f | %.1f | %.2g | %.1f - %.1f - %.1f | %d | %.0f %% |\n", name, $1, $2, $3, $4, $5, $6,
            $7, $8, $1 * $11, $2 * $11, $3 * $11, $9, $10 * 100
    }' "$work/energy"
    echo "$1 $2 $3 $cell_area $cell_time $(cat "$work/energy")" >>"$work/figures"
}

if [ "${2:-}" = adder ]; then
    netlist fp_add "$half"
    python3 power.py "$library" "$node" "$work/netlist.json" "$lists" sum
    exit
fi
cat <<END
| numbers | PE | draws | settled, pJ | with delays | all pulses and wires | internal | loads | clock | idle cycle | leakage, mW | at 28 nm and 0.9 V, pJ | bits compared | busy |
|---|---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|
END
for format in fp32 fp16; do
    [ $format = fp32 ] && bits=$single || bits=$half
    netlist pe "$bits -chparam GAUSSIANS 0"
    longest_path
    measure $format triangles triangles
    netlist pe "$bits -chparam GAUSSIANS 1"
    longest_path
    measure $format both triangles
    measure $format both gaussians
done
echo
python3 module.py "$node" "$work/figures"
