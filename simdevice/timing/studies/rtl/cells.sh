# What the scripts that need a library of cells share; source it. GAURAST_LIBERTY names a file in Liberty's format, such as NanGate45's,
# and GAURAST_LIBERTY_NODE the gate length of its process in nm. Must be in the folder of the modules' files.
library=$(realpath "${GAURAST_LIBERTY:?names a Liberty file}") node=${GAURAST_LIBERTY_NODE:?is the gate length of its process, in nm}
cd "$(dirname "${BASH_SOURCE[0]}")"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
SOURCES="delay.sv multiply_add.sv fp_round.sv fp_add.sv fp_mul.sv fp_div.sv fp_exp2.sv exp2_table.sv pe.sv arbiter.sv round_robin.sv"
UNITS="*fp_add* *fp_mul* *fp_div* *fp_exp2*"
single="-chparam EXPONENT 8 -chparam MANTISSA 23" half="-chparam EXPONENT 5 -chparam MANTISSA 10"
# The library's name of a cell with one of some endings.
cell() {
    grep -oE "cell *\(\"?[A-Za-z0-9_]*($1)\"?\)" "$library" | head -1 | sed 's/.*(\"\{0,1\}\([A-Za-z0-9_]*\).*/\1/'
}
# What drives the inputs, and what the outputs drive, in fF.
flop=$(cell 'DFF_X1|dfxtp_1') buffer=$(cell '_buf_4|BUF_X4')
printf 'set_driving_cell %s\nset_load 3.0 [all_outputs]\n' "$flop" >"$work/constraints"

# yosys_quietly COMMANDS: runs yosys, which is heard only if it fails.
yosys_quietly() {
    yosys -q -p "$1" >"$work/log" 2>&1 || { cat "$work/log" >&2; exit 1; }
}

# netlist TOP PARAMETERS: maps a module to cells, unit by unit, as netlist.v and netlist.json, and finds its area. All are in $work.
netlist() {
    yosys_quietly "read_verilog -sv -I. $SOURCES; hierarchy -top $1 $2; setattr -mod -set keep_hierarchy 1 $UNITS; synth -flatten -top $1;
        rename -top mapped; dfflibmap -liberty $library; abc -liberty $library -D 600 -constr $work/constraints;
        setattr -mod -unset keep_hierarchy *; flatten; setundef -zero; splitnets -ports; opt_clean -purge;
        write_verilog -noattr -noexpr $work/mapped.v"
    awk -v buffer="$buffer" -f fan_out.awk "$work/mapped.v" "$work/mapped.v" >"$work/netlist.v"
    yosys_quietly "read_verilog $work/netlist.v; tee -o $work/area stat -liberty $library; write_json $work/netlist.json"
    cell_area=$(awk '/Chip area/ { print $NF }' "$work/area")
}

# longest_path: the time of the longest path of the netlist in ns, by OpenSTA, and what it leaves of 1 GHz at 28 nm.
longest_path() {
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
    cell_slack=$(awk '/ slack / { slack = $1 } END { print slack }' "$work/paths")
    [ -n "$cell_slack" ] || { cat "$work/paths" >&2; exit 1; }
    cell_time=$(awk -v node="$node" -v slack="$cell_slack" 'BEGIN { print node / 28 - slack }')
}
