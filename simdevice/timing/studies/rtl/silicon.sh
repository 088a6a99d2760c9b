#!/usr/bin/env bash
# Maps the units, a processing element and the arbiter of four modules to the cells of a library, and prints their areas and the
# times of their longest paths as a table in Markdown: GAURAST_LIBERTY=FILE GAURAST_LIBERTY_NODE=45 bash silicon.sh [quick]. FILE
# is a library in Liberty's format, such as NanGate45's, and the node its gate length in nm; `quick` maps one unit. Needs yosys
# and OpenSTA. Must be in the folder of the modules' files.
#
# Every unit is mapped alone, and a processing element consists of mapped units. abc puts no buffers behind flip-flops, nor
# between units, so fan_out.awk does. Wires have neither resistance nor capacitance, and a library is taken at its own voltage and
# temperature. Inputs come with the clock's edge, and a path ends with a flip-flop's setup. Times at 28 nm are taken to be
# shorter in proportion to the gate length; the slack is what a path leaves of 1 GHz there.
set -euo pipefail
source "$(dirname "$0")/cells.sh"

map() { # map NAME TOP PARAMETERS
    netlist "$2" "$3"
    longest_path
    awk -v name="$1" -v node="$node" -v area="$cell_area" -v time="$cell_time" -v slack="$cell_slack" 'BEGIN {
        printf "| %s | %.0f | %.2f | %+.2f | %.2f |\n", name, area, time, slack, node / (28 * time)
    }'
}

echo "| unit | area, um2 | longest path, ns | slack at 1 GHz, ns | GHz at 28 nm |"
echo "|---|---:|---:|---:|---:|"
if [ "${1:-}" = quick ]; then
    map "fp16 adder" fp_add "$half"
    exit
fi
for format in fp32 fp16; do
    [ $format = fp32 ] && bits=$single || bits=$half
    map "$format adder" fp_add "$bits"
    map "$format adder, two paths" fp_add "$bits -chparam TWO_PATHS 1"
    map "$format multiplier" fp_mul "$bits"
    map "$format multiplier, Booth" fp_mul "$bits -chparam BOOTH 1"
    map "$format divider" fp_div "$bits"
    map "$format exponential, table" fp_exp2 "$bits"
    map "$format exponential, polynomial" fp_exp2 "$bits -chparam POLYNOMIAL 1"
    map "$format PE, triangles" pe "$bits -chparam GAUSSIANS 0"
    map "$format PE, and Gaussians" pe "$bits -chparam GAUSSIANS 1"
done
map "arbiter of four modules" arbiter ""
