"""Computes the energy of a module that was mapped to cells: power.py LIBERTY NODE NETLIST RECORD OUTPUT...

NETLIST is yosys's JSON, RECORD a file as record.sv writes it: inputs and outputs, a line for each cycle. The netlist is simulated with
the functions of the library, and the named outputs must be those of the record. A number has a bit for each cycle, so that a cell is
evaluated for all cycles at once, again until no register changes.

A toggle costs the internal energy of its cell (`internal_power`, at a slew and the load of pins) and C V^2 / 2 of the pins that it
drives. Toggles are counted three times: of settled values alone; with the delays of cells, where a cell swallows a pulse that is
shorter than its delay; and with every pulse. Wires have no capacitance, except for the highest figure, where they have that of the
pins. Nothing drives the clock's pins, which have the energy of their own.

Prints, in pJ for each pixel: the lowest, the middle and the highest figure, and of the middle one the internal energy, that of loads,
and the clock's; then that of a cycle in which nothing but the clock moves, the leakage in mW, the number of bits of outputs that were
compared, the share of cycles in which a pixel begins, and the factor that scales energy to 28 nm and 0.9 V.
"""
import json
import re
import sys
from bisect import bisect_right


class Group:
    """A group of a Liberty file: its attributes, and the groups within."""

    def __init__(self, kind, name):
        self.kind, self.name, self.attributes, self.groups = kind, name, {}, []

    def of(self, kind):
        return [group for group in self.groups if group.kind == kind]

    def number(self, name, otherwise=0.0):
        return float(self.attributes.get(name, otherwise))


TOKEN = re.compile(r'"[^"]*"|[(){};:]|[^\s(){};:"]+')


def parse(text):
    """The first group of a text."""
    tokens = [token.strip('"') or " " for token in TOKEN.findall(re.sub(r"/\*.*?\*/", " ", text, flags=re.S))]
    place = 0

    def group(kind):
        nonlocal place
        place += 1
        end = tokens.index(")", place)
        values, place = tokens[place:end], end + 1
        if tokens[place] != "{":
            return values
        made, place = Group(kind, "".join(values)), place + 1
        while tokens[place] != "}":
            name, place = tokens[place], place + 1
            if name == ";":
                continue
            if tokens[place] == ":":
                made.attributes[name], place = tokens[place + 1], place + 2
            else:
                inner = group(name)
                if isinstance(inner, Group):
                    made.groups.append(inner)
                else:
                    made.attributes[name] = " ".join(inner)
        place += 1
        return made

    place = 1
    return group(tokens[0])


def cells_of(text, names):
    """The groups of the cells with these names."""
    found = {}
    for match in re.finditer(r'\bcell\s*\(\s*"?(\w+)"?\s*\)\s*\{', text):
        if match[1] in names:
            depth, end = 1, match.end()
            while depth:
                brace = re.compile(r"[{}]").search(text, end)
                depth, end = depth + (1 if brace[0] == "{" else -1), brace.end()
            found[match[1]] = parse(text[match.start():end])
    return found


def numbers(text):
    return [float(number) for number in re.findall(r"[-+\d.eE]+", text)]


def between(points, values, at):
    """A line through the two points around a place, beyond the ends, too."""
    if len(points) < 2:
        return values[0]
    right = min(max(bisect_right(points, at), 1), len(points) - 1)
    share = (at - points[right - 1]) / (points[right] - points[right - 1])
    return values[right - 1] + share * (values[right] - values[right - 1])


def at_slew(table, slew):
    """A table's loads and values at a slew; a table without loads has one value."""
    values = numbers(table.attributes["values"].replace("\\", " "))
    slews, loads = (numbers(table.attributes.get(index, "")) for index in ("index_1", "index_2"))
    if not loads:
        return [0.0], [between(slews, values, slew) if slews else values[0]]
    rows = [values[row * len(loads):][:len(loads)] for row in range(len(slews))]
    return loads, [between(slews, [row[column] for row in rows], slew) for column in range(len(loads))]


def python(function):
    """A function of Liberty in the syntax of Python."""
    return function.replace("!", "~").replace("*", "&").replace("+", "|")


class Cell:
    """A cell of the library, at a slew."""

    def __init__(self, group, slew):
        pins = {pin.name: pin for pin in group.of("pin")}
        self.inputs = [name for name, pin in pins.items() if pin.attributes["direction"] == "input"]
        self.outputs = [name for name, pin in pins.items() if pin.attributes["direction"] == "output"]
        self.capacitance = {name: pins[name].number("capacitance") for name in self.inputs}
        flops = group.of("ff")
        self.is_register = bool(flops)
        if flops:
            self.state, _ = re.findall(r"\w+", flops[0].name)
            self.next = self.compiled(flops[0].attributes["next_state"], self.inputs)
        else:
            self.functions = {name: self.compiled(pins[name].attributes["function"], self.inputs) for name in self.outputs}
        self.function_text = {name: pins[name].attributes.get("function", "").strip("() ") for name in self.outputs}
        tables = lambda group, kinds: [at_slew(table, slew) for kind in kinds for table in group.of(kind)]
        # Internal energy of an output: for each input that moves it, of its rise and its fall.
        self.energy = {
            name: [(power.attributes.get("related_pin"), tables(power, ["rise_power"]), tables(power, ["fall_power"]))
                   for power in pins[name].of("internal_power")]
            for name in self.outputs
        }
        # Internal energy of an input, of its rise and its fall, in a state.
        self.hidden = {
            name: [(self.condition(power), tables(power, ["rise_power"]), tables(power, ["fall_power"]))
                   for power in pins[name].of("internal_power")]
            for name in self.inputs
        }
        self.delays = {
            name: [table for timing in pins[name].of("timing") for table in tables(timing, ["cell_rise", "cell_fall"])]
            for name in self.outputs
        }
        self.leakage = [(self.condition(power), power.number("value")) for power in group.of("leakage_power")]
        self.leakage = self.leakage or [(None, group.number("cell_leakage_power"))]

    def compiled(self, function, names):
        return eval(f"lambda mask, {', '.join(names)}: ({python(function)}) & mask")

    def condition(self, group):
        when = group.attributes.get("when")
        return when and self.compiled(when, self.inputs + self.outputs)


def mean(tables, load):
    return sum(between(*table, load) for table in tables) / len(tables) if tables else 0.0


class Netlist:
    """A mapped module: its cells in the order of evaluation, and the load of its nets."""

    def __init__(self, path, library, slew):
        module = json.load(open(path))["modules"]["mapped"]
        self.ports = {name: port["bits"][0] for name, port in module["ports"].items()}
        self.outputs = [name for name, port in module["ports"].items() if port["direction"] == "output"]
        made = {name: Cell(group, slew) for name, group in library.items()}
        self.cells = [(made[cell["type"]], {pin: bits[0] for pin, bits in cell["connections"].items()})
                      for cell in module["cells"].values()]
        self.load = {}
        for cell, nets in self.cells:
            for pin in cell.inputs:
                self.load[nets[pin]] = self.load.get(nets[pin], 0.0) + cell.capacitance[pin]
        self.order()

    def order(self):
        """Sorts cells: registers, then the others, each after those that drive it."""
        driver = {nets[pin]: index for index, (cell, nets) in enumerate(self.cells) if not cell.is_register
                  for pin in cell.outputs if pin in nets}
        registers = [entry for entry in self.cells if entry[0].is_register]
        others, seen, done = [], set(), set()
        for first in driver.values():
            stack = [first]
            while stack:
                index = stack[-1]
                cell, nets = self.cells[index]
                if index not in seen:
                    seen.add(index)
                    stack += [driver[nets[pin]] for pin in cell.inputs if nets[pin] in driver and driver[nets[pin]] not in seen]
                else:
                    stack.pop()
                    if index not in done:
                        done.add(index)
                        others.append(self.cells[index])
        self.cells, self.registers, self.others = registers + others, registers, others

    def settled(self, inputs, mask):
        """The settled value of each net in each cycle; registers begin with zero."""
        values = {"0": 0, "1": mask, "x": 0} | {self.ports[name]: value for name, value in inputs.items()}
        states = [0] * len(self.registers)
        while True:
            for (cell, nets), state in zip(self.registers, states):
                for pin in cell.outputs:
                    if pin in nets:
                        values[nets[pin]] = state if cell.function_text[pin] == cell.state else ~state & mask
            for cell, nets in self.others:
                operands = [values[nets[pin]] for pin in cell.inputs]
                for pin in cell.outputs:
                    if pin in nets:
                        values[nets[pin]] = cell.functions[pin](mask, *operands)
            after = [cell.next(mask, *(values[nets[pin]] for pin in cell.inputs)) << 1 & mask for cell, nets in self.registers]
            if after == states:
                return values
            states = after

    def toggles(self, values, mask, window, step, swallows):
        """The rises and falls of each net in the cycles of a window, with the delays of cells in steps of some ns."""
        waves = {net: [(-1, value << 1 & mask | value & 1), (0, value)] for net, value in values.items()}
        for cell, nets in self.cells:
            for pin in cell.outputs:
                if pin not in nets:
                    continue
                net = nets[pin]
                delay = max(1, round(mean(cell.delays[pin], self.load.get(net, 0.0)) / step))
                if cell.is_register:
                    before, after = waves[net]
                    waves[net] = [before, (delay, after[1])]
                else:
                    inputs = [waves[nets[name]] for name in cell.inputs]
                    waves[net] = moved(inputs, cell.functions[pin], mask, delay, swallows)
        return {net: counted(wave, window) for net, wave in waves.items()}


def counted(wave, window):
    """The rises and falls of a net in the cycles of a window."""
    pairs = [(before, after) for (_, before), (_, after) in zip(wave, wave[1:])]
    return (sum((~before & after & window).bit_count() for before, after in pairs),
            sum((before & ~after & window).bit_count() for before, after in pairs))


def moved(inputs, function, mask, delay, swallows):
    """The values of a cell's output over time."""
    times = sorted({time for wave in inputs for time, _ in wave})
    places, wave = [0] * len(inputs), []
    for time in times:
        for index, changes in enumerate(inputs):
            while places[index] + 1 < len(changes) and changes[places[index] + 1][0] <= time:
                places[index] += 1
        value = function(mask, *(changes[place][1] for changes, place in zip(inputs, places)))
        if not wave or wave[-1][1] != value:
            wave.append((time, value))
    if swallows:
        kept = wave[:1]
        for index in range(1, len(wave)):
            time, value = wave[index]
            leaves = 0
            for later, other in wave[index + 1:]:
                if later >= time + delay:
                    break
                leaves |= other ^ value
            kept.append((time, value & ~leaves | kept[-1][1] & leaves))
        wave = kept
    return [(time if time < 0 else time + delay, value) for time, value in wave]


def energy(netlist, values, counts, window, clock_net, volts):
    """Energy of the cycles of a window by its cause, and leakage, in the library's units."""
    cycles = window.bit_count()
    spent = dict.fromkeys(("internal", "loads", "clock", "clock loads", "leakage"), 0.0)

    def share(condition, cell, nets):
        known = {pin: values[net] for pin, net in nets.items()}
        for pin in cell.outputs:
            # A register's output that drives nothing is the inverse of the other.
            known.setdefault(pin, ~next((known[other] for other in cell.outputs if other in known), 0))
        total = 0
        # The clock is high half of the time.
        for level in (0, window):
            known.update((pin, level) for pin, net in nets.items() if net == clock_net)
            total += condition(window, *(known[pin] for pin in cell.inputs + cell.outputs)).bit_count()
        return total / (2 * cycles)

    def weighted(conditions, cell, nets, value):
        if all(condition is None for condition, *_ in conditions):
            return sum(value(entry) for entry in conditions) / len(conditions)
        shares = [share(entry[0], cell, nets) if entry[0] else 0.0 for entry in conditions]
        total = sum(shares)
        return sum(part * value(entry) for part, entry in zip(shares, conditions)) / total if total else 0.0

    for cell, nets in netlist.cells:
        spent["leakage"] += weighted(cell.leakage, cell, nets, lambda entry: entry[1])
        for pin in cell.inputs:
            net = nets[pin]
            is_clock = net == clock_net
            rises, falls = (cycles, cycles) if is_clock else counts.get(net, (0, 0))
            hidden = cell.hidden[pin]
            if hidden and rises + falls:
                cost = lambda entry: rises * mean(entry[1], 0.0) + falls * mean(entry[2], 0.0)
                spent["clock" if is_clock else "internal"] += weighted(hidden, cell, nets, cost)
            charge = (rises + falls) * cell.capacitance[pin]
            spent["clock loads" if is_clock else "loads"] += charge * volts * volts / 2
        for pin in cell.outputs:
            if pin not in nets:
                continue
            rises, falls = counts[nets[pin]]
            load = netlist.load.get(nets[pin], 0.0)
            moves_of = lambda related: sum(sum(counts.get(nets.get(name), (0, 0))) for name in re.findall(r"\w+", related or ""))
            arcs = [(moves_of(related), rise, fall) for related, rise, fall in cell.energy[pin]]
            if not any(moves for moves, _, _ in arcs):
                arcs = [(1, rise, fall) for _, rise, fall in arcs]
            total = sum(moves for moves, _, _ in arcs)
            if total:
                spent["internal"] += sum(moves * (rises * mean(rise, load) + falls * mean(fall, load)) for moves, rise, fall in arcs) / total
    return spent


def read_record(path, most):
    """The cycles of a record from the first with a pixel: names and values."""
    with open(path) as file:
        names = file.readline().split()
        rows = [line.split() for line in file]
    first = next(index for index, row in enumerate(rows) if row[0] == "1")
    return names, rows[first:first + most]


def columns(names, rows, ports):
    """A number for each bit of each port, with a bit for each cycle."""
    found = {}
    for index, name in enumerate(names):
        values = [int(row[index], 16) for row in rows]
        width = 4 * len(rows[0][index])
        for bit in range(width):
            port = f"{name}[{bit}]" if f"{name}[{bit}]" in ports else name
            if port in ports and (port != name or bit == 0):
                found[port] = int("".join("1" if value >> bit & 1 else "0" for value in reversed(values)), 2)
    return found


# Cycles until all registers of a PE have values of the record, and the cycles that are measured after them.
FILL = 128
CYCLES = 2048
# The slew of all signals, in ns for each nm of the gate length.
SLEW = 0.7e-3
# The steps of time, likewise.
STEP = 0.2e-3


def compare(mapped, values, recorded, names, window):
    """The number of bits of the outputs with these names, which are those of the record."""
    outputs = [port for port in mapped.outputs if port.split("[")[0] in names]
    for port in outputs:
        if (values[mapped.ports[port]] ^ recorded[port]) & window:
            sys.exit(f"{port} of the netlist differs from the record")
    return len(outputs)


def main():
    liberty, node, netlist, record, *compared = sys.argv[1:]
    node, text = float(node), open(liberty).read()
    used = {cell["type"] for cell in json.load(open(netlist))["modules"]["mapped"]["cells"].values()}
    head = text[:re.search(r"\bcell\s*\(", text).start()]
    volts = float(re.search(r"nom_voltage\s*:\s*([\d.]+)", head)[1])
    unit = re.search(r'capacitive_load_unit\s*\(\s*([\d.]+)\s*,\s*"?(ff|pf)', head, re.I)
    picojoules = float(unit[1]) * (1e-3 if unit[2].lower() == "ff" else 1.0)
    milliwatts = float(re.search(r'leakage_power_unit\s*:\s*"(\d+)nW', head)[1]) * 1e-6
    mapped = Netlist(netlist, cells_of(text, used), SLEW * node)
    names, rows = read_record(record, FILL + CYCLES)
    mask = (1 << len(rows)) - 1
    window = mask >> FILL << FILL
    recorded = columns(names, rows, mapped.ports)
    inputs = {port: value for port, value in recorded.items() if port not in mapped.outputs} | {"clk": 0}
    values = mapped.settled(inputs, mask)
    bits = compare(mapped, values, recorded, compared, window)
    clock = mapped.ports["clk"]
    settled = {net: counted([(0, value << 1), (0, value)], window) for net, value in values.items()}
    spent = [energy(mapped, values, counts, window, clock, volts)
             for counts in (settled, *(mapped.toggles(values, mask, window, STEP * node, swallows) for swallows in (True, False)))]
    # Idle: the last inputs stay, and the clock runs.
    held = {port: mask if value >> (len(rows) - 1) & 1 else 0 for port, value in inputs.items()}
    resting = mapped.settled(held, mask)
    idle = energy(mapped, resting, dict.fromkeys(resting, (0, 0)), window, clock, volts)
    pixels = sum(row[0] == "1" for row in rows[FILL:])
    each = [{cause: part * picojoules / pixels for cause, part in parts.items() if cause != "leakage"} for parts in spent]
    low, middle, high = (sum(parts.values()) for parts in each)
    _, parts, most = each
    clocked = (idle["clock"] + idle["clock loads"]) * picojoules / window.bit_count()
    print(low, middle, high + most["loads"] + most["clock loads"], parts["internal"], parts["loads"],
          parts["clock"] + parts["clock loads"], clocked, spent[0]["leakage"] * milliwatts, bits,
          pixels / window.bit_count(), 28 / node * (0.9 / volts) ** 2)


main()
