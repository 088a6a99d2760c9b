#!/usr/bin/env bash
# Proves the properties of properties.svh with yosys and its abc: for all inputs of the first cycles after a reset, of which
# there are as many as the argument says. The 18 without one are enough for a pixel to wait for its transmittance. The outputs of
# PEs, pixels and tile buffers are anything, and so are registers before the reset, so that the controller is what is proved.
# Must be in the folder of the modules' files.
set -euo pipefail
cd "$(dirname "$0")"
CYCLES=${1:-18}
SOURCES="delay.sv multiply_add.sv fp_round.sv fp_add.sv fp_mul.sv fp_div.sv fp_exp2.sv exp2_table.sv pe.sv pixel_buffer.sv primitive_buffer.sv"
yosys -q -p "read_verilog -DFORMAL -formal -sv -I. formal.sv $SOURCES raster_module.sv; hierarchy -top formal;
    cutpoint */t:*pe */t:*pixel_buffer */t:*primitive_buffer; prep -top formal -flatten; memory_map;
    setundef -undriven -anyseq; opt; techmap; opt_clean; dffunmap; simplemap; abc -g AND -fast; opt_clean;
    write_aiger -zinit formal.aig"
# An output of the circuit is a property that does not hold; fold puts what is assumed into them.
SAID=$(yosys-abc -c "read_aiger formal.aig; fold; strash; bmc3 -F $CYCLES")
grep -q "No output asserted in $CYCLES frames" <<< "$SAID" || { echo "$SAID" >&2; exit 1; }
