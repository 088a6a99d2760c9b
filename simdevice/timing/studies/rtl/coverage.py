"""Prints what Verilator's files of coverage reach together: coverage.py FILE..., as percentages by file, then what nothing reaches."""
import re
import sys

KINDS = {"v_toggle": "bits", "v_line": "lines", "v_branch": "lines"}


def main():
    counts = {}
    for path in sys.argv[1:]:
        for point, count in re.findall(r"^C '(.*)' (\d+)$", open(path).read(), re.M):
            keys = dict(re.findall("\x01([^\x02]*)\x02([^\x01]*)", point))
            kind = KINDS[keys["page"].split("/")[0]]
            name = keys["o"] if kind == "bits" else f"line {keys['l']}, {keys['o']}"
            place = (keys["f"].split("/")[-1], kind, name)
            counts[place] = counts.get(place, 0) + int(count)
    print("| file | bits that toggle | lines and branches |")
    print("|---|---:|---:|")
    for file in sorted({file for file, _, _ in counts}) + ["all"]:
        cells = []
        for kind in ("bits", "lines"):
            points = [count for (where, what, _), count in counts.items() if what == kind and file in (where, "all")]
            reached = sum(count > 0 for count in points)
            cells.append(f"{reached} / {len(points)} ({reached / len(points) * 100:.1f} %)" if points else "")
        print(f"| {file} | {cells[0]} | {cells[1]} |")
    print("\nNever:")
    never = {}
    for (file, _, name), count in counts.items():
        if not count:
            signal, _, bit = name.partition("[")
            never.setdefault((file, signal), []).append(bit.rstrip("]"))
    for (file, signal), bits in sorted(never.items()):
        print(f"{file}: {signal}" + (f", bits {', '.join(bits)}" if any(bits) else ""))


main()
