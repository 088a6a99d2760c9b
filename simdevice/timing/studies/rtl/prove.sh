#!/usr/bin/env bash
# Proves the properties of properties.svh with yosys' SAT solver: for all inputs of the first cycles after a reset, of which
# there are as many as the argument says (16 if there is none). Must be in the folder of the modules' files.
set -euo pipefail
cd "$(dirname "$0")"
yosys -q -p "read_verilog -DFORMAL -formal -sv -I. formal.sv delay.sv raster_module.sv; prep -top formal -flatten; memory_map;
    opt -full; setundef -anyseq; opt_clean;
    sat -verify -prove-asserts -set-assumes -set-at 1 reset 1 -seq 2 -maxsteps ${1:-16} -tempinduct-baseonly"
