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
cd "$(dirname "$0")"
library=${GAURAST_LIBERTY:?names a Liberty file} node=${GAURAST_LIBERTY_NODE:?is the gate length of its process, in nm}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
SOURCES="delay.sv multiply_add.sv fp_round.sv fp_add.sv fp_mul.sv fp_div.sv fp_exp2.sv exp2_table.sv pe.sv arbiter.sv round_robin.sv"
UNITS="*fp_add* *fp_mul* *fp_div* *fp_exp2*"
# The library's name of a cell with one of some endings.
cell() {
    grep -oE "cell *\(\"?[A-Za-z0-9_]*($1)\"?\)" "$library" | head -1 | sed 's/.*(\"\{0,1\}\([A-Za-z0-9_]*\).*/\1/'
}
# What drives the inputs, and what the outputs drive, in fF.
flop=$(cell 'DFF_X1|dfxtp_1') buffer=$(cell '_buf_4|BUF_X4')
printf 'set_driving_cell %s\nset_load 3.0 [all_outputs]\n' "$flop" >"$work/constraints"

map() { # map NAME TOP PARAMETERS
    yosys -q -p "read_verilog -sv -I. $SOURCES; hierarchy -top $2 $3; setattr -mod -set keep_hierarchy 1 $UNITS; synth -flatten -top $2;
        rename -top mapped; dfflibmap -liberty $library; abc -liberty $library -D 600 -constr $work/constraints;
        setattr -mod -unset keep_hierarchy *; flatten; setundef -zero; splitnets -ports; opt_clean -purge;
        write_verilog -noattr -noexpr $work/mapped.v" >"$work/log" 2>&1 ||
        { cat "$work/log" >&2; exit 1; }
    awk -v buffer="$buffer" -f fan_out.awk "$work/mapped.v" "$work/mapped.v" >"$work/netlist.v"
    yosys -q -p "read_verilog $work/netlist.v; tee -o $work/area stat -liberty $library" >"$work/log" 2>&1 ||
        { cat "$work/log" >&2; exit 1; }
    cat >"$work/times" <<END
read_liberty $library
read_verilog $work/netlist.v
link_design mapped
create_clock -name clk -period [expr $node / 28.0] [get_ports clk]
set_input_delay -clock clk 0 [all_inputs]
set_output_delay -clock clk 0 [all_outputs]
report_checks -path_delay max -digits 3
END
    sta -exit "$work/times" >"$work/paths" 2>&1
    awk -v name="$1" -v node="$node" '
        /Chip area/ { area = $NF }
        / slack / { slack = $1; met = 1 }
        END {
            if (!area || !met) exit 1
            time = node / 28 - slack
            printf "| %s | %.0f | %.2f | %+.2f | %.2f |\n", name, area, time, slack, node / (28 * time)
        }' "$work/area" "$work/paths" || { cat "$work/paths" >&2; exit 1; }
}

echo "| unit | area, um2 | longest path, ns | slack at 1 GHz, ns | GHz at 28 nm |"
echo "|---|---:|---:|---:|---:|"
single="-chparam EXPONENT 8 -chparam MANTISSA 23" half="-chparam EXPONENT 5 -chparam MANTISSA 10"
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
