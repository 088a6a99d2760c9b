# What the scripts that need a library of cells share; source it. GAURAST_LIBERTY names a file in Liberty's format, such as NanGate45's,
# and GAURAST_LIBERTY_NODE the gate length of its process in nm. Must be in the folder of the modules' files.
library=$(realpath "${GAURAST_LIBERTY:?names a Liberty file}") node=${GAURAST_LIBERTY_NODE:?is the gate length of its process, in nm}
cd "$(dirname "${BASH_SOURCE[0]}")"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
SOURCES="delay.sv fp_round.sv fp_add.sv fp_mul.sv fp_div.sv fp_exp2.sv exp2_table.sv pe.sv arbiter.sv round_robin.sv"
single="-chparam EXPONENT 8 -chparam MANTISSA 23" half="-chparam EXPONENT 5 -chparam MANTISSA 10"
# What drives the inputs, and what the outputs drive, in fF.
flop=$(grep -oE 'cell *\("?[A-Za-z0-9_]*(DFF_X1|dfxtp_1)"?\)' "$library" | head -1 | sed 's/.*(\"\{0,1\}\([A-Za-z0-9_]*\).*/\1/')
printf 'set_driving_cell %s\nset_load 3.0 [all_outputs]\n' "$flop" >"$work/constraints"

# netlist TOP PARAMETERS: maps a module to cells, as netlist.v and netlist.json, and writes its area. All are in $work.
netlist() {
    yosys -q -p "read_verilog -sv -I. $SOURCES; hierarchy -top $1 $2; synth -flatten -top $1; rename -top mapped;
        dfflibmap -liberty $library; abc -liberty $library -D 600 -constr $work/constraints; setundef -zero; splitnets -ports; opt_clean -purge;
        tee -o $work/area stat -liberty $library; write_verilog -noattr -noexpr $work/netlist.v; write_json $work/netlist.json" \
        >"$work/log" 2>&1 || { cat "$work/log" >&2; exit 1; }
    cell_area=$(awk '/Chip area/ { print $NF }' "$work/area")
}

# longest_path: the time of the longest path of the netlist in ns, by OpenSTA.
longest_path() {
    cat >"$work/times" <<END
read_liberty $library
read_verilog $work/netlist.v
link_design mapped
create_clock -name clk -period 1 [get_ports clk]
report_checks -path_delay max -digits 3
END
    sta -exit "$work/times" >"$work/paths" 2>&1
    cell_time=$(awk '/data arrival time/ { print $1; exit }' "$work/paths")
    [ -n "$cell_time" ] || { cat "$work/paths" >&2; exit 1; }
}
