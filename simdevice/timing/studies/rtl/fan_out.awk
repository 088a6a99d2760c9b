# Puts buffers between a cell and its loads where there are more than 16: one buffer for 16 of them. Reads a netlist by yosys
# twice: awk -v buffer=CELL -f fan_out.awk NETLIST NETLIST. Outputs of cells have the names of NanGate's and SkyWater's libraries.
BEGIN {
    most = 16
    out = buffer ~ /^BUF/ ? "Z" : "X"
}
{
    net = ""
    if (match($0, /^    \.[A-Za-z0-9_]+\(/)) {
        pin = substr($0, 6, RLENGTH - 6)
        net = substr($0, RLENGTH + 1)
        sub(/\),?$/, "", net)
        drives = pin ~ /^(Q|QN|Q_N|X|Y|Z|ZN)$/
    }
}
NR == FNR {
    if (net != "" && drives) driven[net]
    else if (net != "") loads[net]++
    next
}
net != "" && !drives && net in driven && loads[net] > most {
    if (!(net in number)) number[net] = ++nets
    place = seen[net]++
    name = "buffered_" number[net] "_" int(place / most)
    if (!(name in from)) {
        from[name] = net
        names[++buffers] = name
    }
    sub(/\(.*\)/, "(" name ")")
}
/^endmodule/ {
    for (i = 1; i <= buffers; i++)
        printf "  %s buffer_%d (.A(%s), .%s(%s));\n", buffer, i, from[names[i]], out, names[i]
}
{ print }
