#!/usr/bin/env bash
# Transistors of a processing element for triangles alone and of one for Gaussians, too, in every design of the units, by
# yosys. Run beside the modules' files; prints a table in Markdown. `bash area.sh quick`: one design of each format.
set -euo pipefail
cd "$(dirname "$0")"

# synthesize NAME PARAMETERS TOP: the transistors, and flip-flops of 16 each, of a whole hierarchy.
synthesize() {
    local out
    out=$(yosys -p "read_verilog -sv -I. pe.sv fp_add.sv fp_mul.sv fp_div.sv fp_round.sv fp_exp2.sv delay.sv exp2_table.sv;
        hierarchy -top pe $1; synth -top pe; dfflegalize -cell \$_DFF_P_ x; abc -g cmos2; opt_clean; stat -top pe -tech cmos")
    echo "$out" | awk '
        /Number of cells/ { flops = 0 }
        $1 == "$_DFF_P_" { flops = $2 }
        /Estimated number of transistors/ { total = $NF }
        END { print total, flops }'
}

echo "| numbers | adder | multiplier | exponential | triangles | and Gaussians | added | without registers |"
echo "|---|---|---|---|---:|---:|---:|---:|"
row() { # row FORMAT TWO_PATHS BOOTH POLYNOMIAL
    local mantissa=23 exponent=8
    [ "$1" = fp32 ] || { mantissa=10; exponent=5; }
    local units="-chparam EXPONENT $exponent -chparam MANTISSA $mantissa -chparam TWO_PATHS $2 -chparam BOOTH $3"
    local key="$1 $2 $3" before after
    [ -n "${triangles[$key]:-}" ] || triangles[$key]=$(synthesize "$units -chparam GAUSSIANS 0")
    before=${triangles[$key]}
    after=$(synthesize "$units -chparam GAUSSIANS 1 -chparam POLYNOMIAL $4")
    local adders=("one path" "two paths") multipliers=(plain Booth) exponentials=(table polynomial)
    awk -v line="| $1 | ${adders[$2]} | ${multipliers[$3]} | ${exponentials[$4]} |" -v before="$before" -v after="$after" '
        BEGIN {
            split(before, b, " "); split(after, a, " ")
            printf "%s %d | %d | %+.1f %% | %+.1f %% |\n", line, b[1], a[1], (a[1] / b[1] - 1) * 100,
                ((a[1] - 16 * a[2]) / (b[1] - 16 * b[2]) - 1) * 100
        }'
}
declare -A triangles
for format in fp32 fp16; do
    for two_paths in 0 1; do
        for booth in 0 1; do
            for polynomial in 0 1; do
                if [ "${1:-}" = quick ] && [ "$two_paths$booth$polynomial" != 000 ]; then continue; fi
                row $format $two_paths $booth $polynomial
            done
        done
    done
done
