"""Prints area, times and power of a module of 16 PEs: module.py NODE FIGURES. FIGURES is what power.sh gathers.

A module is its PEs and its memories; the controller is not in it. Memories are public macros, each with one port. From the gate length
of the library to 28 nm, areas shrink with its square, times with itself, and energy with capacitance (the gate length) and the square
of the voltage, down to 0.9 V. Leakage is the library's.
"""
import sys

# The memories of a module: area in um2, pJ of an access to a primitive and to a PE's word of four numbers, access time in ns, leakage in
# mW. 45 nm: macros by CACTI, fakeram45 of The-OpenROAD-Project/OpenROAD-flow-scripts: 64x96 three times and 64x21, and 32x64 32 times; 64x96
# and 64x64, and 32x64 16 times. 130 nm: by the bit, from OpenRAM's sky130_sram_1kbyte_1rw1r_32x256_8 of VLSIDA/sky130_sram_macros.
BITS = {"fp32": (19456, 65536), "fp16": (10240, 32768)}


def of_45(numbers):
    if numbers == "fp32":
        return dict(tiles=13545.8, pixels=56145.2, tile_pj=9.56, pixel_pj=3.00, time=0.234, leakage=0.563 + 2.513)
    return dict(tiles=8015.9, pixels=28072.6, tile_pj=5.48, pixel_pj=1.50, time=0.234, leakage=0.351 + 1.256)


def of_130(numbers):
    # 493.38 um by 400.22 um and 15.8 pJ for a word of 32 bits.
    tiles, pixels = BITS[numbers]
    area, energy = 493.38 * 400.22 / 8192, 15.8 / 32
    return dict(tiles=tiles * area, pixels=pixels * area, tile_pj=tiles / 64 * energy, pixel_pj=pixels / 512 * energy, time=3.29,
                leakage=(tiles + pixels) / 8192 * 0.91e-3)


MEMORIES = {45: of_45, 130: of_130}
PES = 16


def main():
    node = float(sys.argv[1])
    rows = [line.split() for line in open(sys.argv[2])]
    if node not in MEMORIES:
        sys.exit(f"no memory of {node:.0f} nm is known")
    cells = {(row[0], row[1]): (float(row[3]), float(row[4])) for row in rows}
    energies = {tuple(row[:3]): [float(number) for number in row[5:]] for row in rows}
    print("| numbers | module | draws | PEs, mm2 | memories, mm2 | both, mm2 | both at 28 nm, mm2 | longest path, ns | slack at 28 nm and 1 GHz, ns "
          "| W at 28 nm and 1 GHz |")
    print("|---|---|---|---:|---:|---:|---:|---:|---:|---:|")
    for (numbers, pe, draws), energy in energies.items():
        memory = MEMORIES[node](numbers)
        area, time = cells[numbers, pe]
        pes, memories = PES * area * 1e-6, (memory["tiles"] + memory["pixels"]) * 1e-6
        # Two ports, which pixels need, cost at most as much as a second memory.
        twice = memories + memory["pixels"] * 1e-6
        small, volts = (28 / node) ** 2, energy[10]
        # A pixel's word is read and written; a primitive is written and read for the 16 groups.
        access = PES * 2 * memory["pixel_pj"] + 2 * memory["tile_pj"] / 16
        leakage = (PES * energy[7] + memory["leakage"]) * 1e-3
        watts = [(PES * each + access) * volts * 1e-3 + leakage for each in energy[:3]]
        time_28 = max(time, memory["time"]) * 28 / node
        print(f"| {numbers} | {pe} | {draws} | {pes:.2f} | {memories:.3f} - {twice:.3f} | {pes + memories:.2f} - {pes + twice:.2f} | "
              f"{(pes + memories) * small:.2f} - {(pes + twice) * small:.2f} | {time:.2f} | {1 - time_28:+.2f} | "
              f"{watts[0]:.2f} - {watts[1]:.2f} - {watts[2]:.2f} |")
    print()
    print("| numbers | increase of the PEs by Gaussians | of the module with memories |")
    print("|---|---:|---:|")
    for numbers in dict.fromkeys(numbers for numbers, _ in cells):
        before, after = (cells[numbers, pe][0] * PES for pe in ("triangles", "both"))
        memory = MEMORIES[node](numbers)
        both = [(after + extra) / (before + extra) - 1 for extra in (memory["tiles"] + 2 * memory["pixels"], memory["tiles"] + memory["pixels"])]
        print(f"| {numbers} | {(after / before - 1) * 100:+.1f} % | {both[0] * 100:+.1f} - {both[1] * 100:+.1f} % |")


main()
