#!/usr/bin/env bash
# Proves the properties of properties.svh with yosys' SAT solver: for all inputs of the first cycles after a reset, of which
# there are as many as the argument says. The 18 without one are enough for a pixel to wait for its transmittance. The outputs of
# PEs, pixels and tile buffers are anything, so that the controller is what is proved. Must be in the folder of the modules' files.
set -euo pipefail
cd "$(dirname "$0")"
SOURCES="delay.sv fp_round.sv fp_add.sv fp_mul.sv fp_div.sv fp_exp2.sv exp2_table.sv pe.sv pixel_buffer.sv primitive_buffer.sv"
yosys -q -p "read_verilog -DFORMAL -formal -sv -I. formal.sv $SOURCES raster_module.sv; hierarchy -top formal;
    cutpoint */t:*pe */t:*pixel_buffer */t:*primitive_buffer; prep -top formal -flatten; memory_map; opt -full;
    setundef -anyseq; opt_clean;
    sat -verify -prove-asserts -set-assumes -set-at 1 reset 1 -seq 2 -maxsteps ${1:-18} -tempinduct-baseonly"
