"""Counts the instructions of the original 3DGS kernel, `renderCUDA`, as NVIDIA's compiler compiles it.

    python3 -m venv VENV
    VENV/bin/pip install nvidia-cuda-nvrtc-cu12==12.9.86 nvidia-cuda-runtime-cu12==12.9.79 \\
        nvidia-cuda-cccl-cu12==12.9.27 nvidia-cuda-nvdisasm==13.5.37
    VENV/bin/python count_instructions.py FORWARD.CU > counts.toml

FORWARD.CU is `cuda_rasterizer/forward.cu` of graphdeco-inria/diff-gaussian-rasterization, commit 59f5f77. Its licence is for
research only, so that neither it nor any code of it is here. The kernel is cut out of the file by its name. Its headers are not
needed: the macros of the block's size and the type uint32_t are defined here, and cooperative_groups.h is NVIDIA's.

The counts are of a warp whose lanes stay together. Where they part, the group that waits issues one BSYNC more. The machine
code becomes a graph of its branches. The loop over a batch's Gaussians is the one with the exponential, and the loop over batches
is the one around it with the count of finished lanes. Each way through a loop is a path, and its length is the number of
instructions that a warp issues. `--listing` prints the paths.
"""

import argparse
import collections
import ctypes
import hashlib
import json
import pathlib
import re
import subprocess
import sys
import sysconfig
import tempfile

COMMITS = {"83c182561b9f75e93b7b72a24aaf1fce507388a0198aa4a56137d25deabcd6c8": "59f5f77"}
FLAGS = [[], ["--use_fast_math"]]
PRELUDE = """
#include <cooperative_groups.h>
namespace cg = cooperative_groups;
typedef unsigned int uint32_t;
#define BLOCK_X 16
#define BLOCK_Y 16
#define BLOCK_SIZE (BLOCK_X * BLOCK_Y)
"""
INSTANCE = b"renderCUDA<3>"
FP32 = {"FADD", "FMUL", "FFMA", "FMNMX", "FSETP", "FSEL", "FSET"}
# Counted by the first part of the name.
KINDS = [
    ("special", "MUFU"),
    ("shared_loads", "LDS"),
    ("global_loads", "LDG"),
    ("shared_stores", "STS"),
    ("global_stores", "STG"),
    ("barriers", "BAR"),
]
KINDS_OF_PATHS = [
    # A Gaussian: the power is above zero, alpha is below 1/255, the transmittance is below 0.0001, or it is blended.
    "skipped_power",
    "skipped_alpha",
    "finished",
    "blended",
    # A batch without its Gaussians, with a warp that has some lanes left or none, and the vote that ends a block.
    "batch",
    "batch_of_finished_lanes",
    "last_vote",
    # What comes before the first batch and after the last one, at most.
    "prologue",
    "epilogue",
]


class Failure(Exception):
    """A sentence about what is missing or wrong."""


def kernel(path):
    """The text of the kernel, and the name of the commit if it is known."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise Failure(f"{path} is not readable: {error.strerror}") from error
    text = re.sub(r"//[^\n]*|/\*.*?\*/", " ", data.decode("utf-8", "replace"), flags=re.S)
    head = re.search(r"template\s*<[^<>]*>\s*__global__[^;{}]*\brenderCUDA\s*\([^;{}]*\)\s*\{", text)
    if not head:
        raise Failure(f"{path} has no kernel template renderCUDA")
    depth = 1
    for end in range(head.end(), len(text)):
        depth += {"{": 1, "}": -1}.get(text[end], 0)
        if depth == 0:
            return text[head.start() : end + 1], COMMITS.get(hashlib.sha256(data).hexdigest(), "unknown")
    raise Failure(f"{path} ends within the kernel renderCUDA")


def find(folders, pattern, package):
    """The last path that matches the pattern in the first folder that has one."""
    for folder in folders:
        paths = sorted(path for path in folder.glob(pattern) if ".alt." not in path.name)
        if paths:
            return paths[-1]
    names = ", ".join(str(folder) for folder in folders)
    raise Failure(f"{pattern.split('/')[-1]} of the package {package} is not in {names}")


def compiled(source, folder, architecture, flags):
    """The machine code of the kernel."""
    library = find([folder], "nvidia/*/lib/libnvrtc.so.*", "nvidia-cuda-nvrtc-cu12")
    headers = find([folder], "nvidia/*/include/cooperative_groups.h", "nvidia-cuda-runtime-cu12").parent
    includes = {headers} | {path.parent.parent for path in folder.glob("nvidia/*/include/**/nv/target")}
    options = [f"--gpu-architecture={architecture}", "--std=c++17", *(f"-I{path}" for path in sorted(includes)), *flags]
    options = [option.encode() for option in options]
    try:
        nvrtc = ctypes.CDLL(str(library))
    except OSError as error:
        raise Failure(f"{library} does not load: {error}") from error
    program = ctypes.c_void_p()

    def read(what):
        size = ctypes.c_size_t()
        if getattr(nvrtc, f"nvrtcGet{what}Size")(program, ctypes.byref(size)) != 0:
            raise Failure(f"{library} gives no {what}")
        buffer = ctypes.create_string_buffer(size.value)
        getattr(nvrtc, f"nvrtcGet{what}")(program, buffer)
        return buffer.raw

    text = (PRELUDE + source).encode()
    if nvrtc.nvrtcCreateProgram(ctypes.byref(program), text, b"kernel.cu", 0, None, None) != 0:
        raise Failure(f"{library} takes no program")
    nvrtc.nvrtcAddNameExpression(program, INSTANCE)
    if nvrtc.nvrtcCompileProgram(program, len(options), (ctypes.c_char_p * len(options))(*options)) != 0:
        log = read("ProgramLog").decode("utf-8", "replace").strip("\0\n ")
        if "nv/target" in log:
            raise Failure(f"nv/target of the package nvidia-cuda-cccl-cu12 is not in {folder}")
        raise Failure(f"the kernel does not compile: {(log.splitlines() or ['no reason given'])[0]}")
    return read("CUBIN")


def version(folder):
    """The version of the compiler's package."""
    information = find([folder], "nvidia_cuda_nvrtc*-*.dist-info", "nvidia-cuda-nvrtc-cu12")
    return information.name.removesuffix(".dist-info").split("-")[-1]


def disassembled(code, folders):
    """The assembly of the machine code."""
    tool = find(folders, "nvidia/*/bin/nvdisasm", "nvidia-cuda-nvdisasm")
    with tempfile.NamedTemporaryFile(suffix=".cubin") as file:
        file.write(code)
        file.flush()
        try:
            done = subprocess.run([tool, "-c", file.name], capture_output=True, text=True, check=False)
        except OSError as error:
            raise Failure(f"{tool} does not start: {error.strerror}") from error
    if done.returncode != 0:
        raise Failure(f"nvdisasm fails: {(done.stderr.splitlines() or ['no reason given'])[0]}")
    return done.stdout


Instruction = collections.namedtuple("Instruction", "predicate name operands")


def parse(text):
    """The kernel's instructions, the places of its labels, and its number of registers."""
    instructions, labels, inside = [], {}, False
    for line in text.splitlines():
        label = re.match(r"([.$\w]+):", line)
        if label and not label[1].startswith(".text"):
            if not label[1].startswith(".L"):
                # Other functions of the section follow the kernel; its name is mangled.
                inside = "renderCUDA" in label[1] and not label[1].startswith("$")
            labels[label[1]] = len(instructions)
        found = re.match(r"\s+/\*[0-9a-f]+\*/\s+(@!?U?P\w+\s+)?([A-Z][\w.]*)\s*(.*?)\s*;", line)
        if found and inside:
            instructions.append(Instruction((found[1] or "").strip(), found[2], found[3]))
    if not instructions:
        raise Failure("the assembly has no renderCUDA")
    registers = re.search(r"SHI_REGISTERS=(\d+)", text)
    return instructions, labels, int(registers[1]) if registers else 0


def successors(instructions, labels):
    """For each instruction, those that can follow it in a warp whose lanes stay together."""

    def target(instruction):
        name = re.search(r"`\(([.$\w]+)\)", instruction.operands)
        place = labels.get(name[1]) if name else None
        if place is None:
            raise Failure(f"a branch has no label: {instruction.name} {instruction.operands}")
        return place

    joins = {target(one) for one in instructions if one.name == "BSSY"}
    following = []
    for place, one in enumerate(instructions):
        base = one.name.split(".")[0]
        conditional = one.predicate or re.match(r"!?U?P\d", one.operands)
        after = [place + 1]
        if base == "BRA" and ".CONV" in one.name:
            after = [target(one)]
        elif base == "BRA" and ".DIV" not in one.name:
            after = [target(one)] + (after if conditional else [])
        elif base in ("EXIT", "RET", "KILL"):
            after = after if conditional else []
        elif base in ("BRX", "JMX", "JMP"):
            raise Failure(f"the branch {one.name} is not known")
        elif base == "BSYNC" and place + 1 not in joins:
            raise Failure("a BSYNC is not in front of its label")
        following.append([next for next in after if next < len(instructions)])
    return following


def loops(following):
    """The natural loops: the place of the head, and those of the body."""
    reached, rest = {0}, [0]
    while rest:
        for after in following[rest.pop()]:
            if after not in reached:
                reached.add(after)
                rest.append(after)
    before = collections.defaultdict(list)
    for place in reached:
        for after in following[place]:
            before[after].append(place)
    dominators = {place: set(reached) for place in reached}
    dominators[0] = {0}
    changed = True
    while changed:
        changed = False
        for place in sorted(reached - {0}):
            new = set.intersection(*(dominators[one] for one in before[place])) | {place}
            changed |= new != dominators[place]
            dominators[place] = new
    bodies = collections.defaultdict(set)
    for place in reached:
        for head in following[place]:
            if head in dominators[place]:
                bodies[head] |= {head, place}
                rest = [place]
                while rest:
                    one = rest.pop()
                    for previous in before[one] if one != head else []:
                        if previous not in bodies[head]:
                            bodies[head].add(previous)
                            rest.append(previous)
    return list(bodies.items())


def paths(following, start, ends, skip=(None, frozenset(), frozenset())):
    """All ways from a place to one of `ends`, without it. A loop to skip is a head, a body and what follows; -1 marks it."""
    head, body, exits = skip
    found, rest = [], [(start, [])]
    while rest:
        place, path = rest.pop()
        if place in ends and path:
            found.append(path)
            continue
        if place in path:
            raise Failure("a loop is where none is expected")
        if place == head:
            rest += [(after, path + [-1]) for after in exits]
            continue
        if place in body:
            raise Failure("a loop has two heads")
        if not following[place]:
            if None in ends:
                found.append(path + [place])
            continue
        rest += [(after, path + [place]) for after in following[place]]
        if len(rest) > 10_000:
            raise Failure("the kernel has too many paths")
    return found


def has(instructions, path, name="", constant=None):
    """Whether a path has an instruction whose name begins so, or which has the constant."""
    for place in path:
        if place < 0 or not instructions[place].name.startswith(name):
            continue
        numbers = re.findall(r"(?<![\w.])-?\d+\.?\d*(?:e-?\d+)?(?![\w.])", instructions[place].operands)
        if constant is None or any(abs(float(number) / constant - 1) < 1e-5 for number in numbers):
            return True
    return False


def classified(instructions, labels):
    """The paths by name."""
    following = successors(instructions, labels)
    every = loops(following)
    inner = [loop for loop in every if has(instructions, loop[1], "MUFU.EX2") and not has(instructions, loop[1], "BAR")]
    if len(inner) != 1 or sum(instructions[place].name.startswith("MUFU.EX2") for place in inner[0][1]) != 1:
        raise Failure("no loop has exactly one exponential, or it is unrolled")
    head, body = inner[0]
    outer = [loop for loop in every if head in loop[1] and has(instructions, loop[1], "BAR.RED")]
    if len(outer) != 1:
        raise Failure("no loop around the Gaussians counts finished lanes")
    outer_head, outer_body = outer[0]
    kinds = {name: [] for name in KINDS_OF_PATHS}
    within = [[one for one in after if one in body] for after in following]
    for path in paths(within, head, {head}):
        if not has(instructions, path, "MUFU.EX2"):
            kinds["skipped_power"].append(path)
        elif has(instructions, path, "LDG"):
            kinds["blended"].append(path)
        elif has(instructions, path, "FSETP", 0.0001):
            kinds["finished"].append(path)
        elif has(instructions, path, "FSETP", 1 / 255):
            kinds["skipped_alpha"].append(path)
        else:
            raise Failure("a path of the loop over Gaussians is not known")
    exits = frozenset(after for place in body for after in following[place] if after not in body)
    ends = {after for place in outer_body for after in following[place] if after not in outer_body}
    for path in paths(following, outer_head, {outer_head} | ends, (head, body, exits)):
        if has(instructions, path, "LDG"):
            # The last batch is as long as those before it, so that both are the same path.
            kinds["batch" if -1 in path else "batch_of_finished_lanes"].append(path)
        elif not has(instructions, path, "BAR.SYNC"):
            kinds["last_vote"].append(path)
    kinds["prologue"] = longest(paths(following, 0, {outer_head} | ends))
    kinds["epilogue"] = longest([path for end in ends for path in paths(following, end, {None})])
    for name, found in kinds.items():
        different = len({tuple(path) for path in found})
        if different != 1:
            raise Failure(f"the compiled kernel has {different} paths of the kind {name} and not one")
    return {name: [place for place in found[0] if place >= 0] for name, found in kinds.items()}


def longest(found):
    """The longest path alone."""
    return sorted(found, key=len)[-1:]


def counts(instructions, path):
    """A path's counts as a table in TOML."""
    names = [instructions[place].name.split(".")[0] for place in path]
    numbers = [f"instructions = {len(path)}"]
    numbers += [f"{kind} = {names.count(name)}" for kind, name in KINDS if name in names]
    floats = [f"{name} = {names.count(name)}" for name in sorted(FP32 & set(names))]
    if floats:
        numbers.append(f"fp32 = {{ {', '.join(floats)} }}")
    return f"{{ {', '.join(numbers)} }}"


def main():
    parser = argparse.ArgumentParser(description="Counts the instructions of renderCUDA of the original 3DGS code.")
    parser.add_argument("forward", type=pathlib.Path, metavar="FORWARD.CU", help="cuda_rasterizer/forward.cu")
    parser.add_argument("--arch", default="sm_87", help="the architecture (sm_87, that of Orin)")
    parser.add_argument(
        "--packages",
        type=pathlib.Path,
        action="append",
        metavar="FOLDER",
        help="a folder of NVIDIA's packages, as `pip install --target` makes it; this Python's own without it; may be repeated",
    )
    parser.add_argument("--listing", action="store_true", help="print the instructions of each path, too, as comments")
    arguments = parser.parse_args()
    folders = arguments.packages or [pathlib.Path(sysconfig.get_paths()["purelib"])]
    source, commit = kernel(arguments.forward)
    lines = [
        "# Instructions that a warp of the original 3DGS kernel issues; written by count_instructions.py.",
        "# A build without flags is the published one: its setup.py names only a folder of headers.",
        'kernel = "graphdeco-inria/diff-gaussian-rasterization, cuda_rasterizer/forward.cu, renderCUDA<3>"',
        f'commit = "{commit}"',
    ]
    for folder in folders:
        for flags in FLAGS:
            code = compiled(source, folder, arguments.arch, flags)
            text = disassembled(code, folders + [pathlib.Path(sysconfig.get_paths()["purelib"])])
            instructions, labels, registers = parse(text)
            lines += ["", "[[build]]", 'compiler = "NVRTC"', f'version = "{version(folder)}"']
            lines += [f'architecture = "{arguments.arch}"', f"flags = {json.dumps(flags)}", f"registers = {registers}"]
            for name, path in classified(instructions, labels).items():
                lines.append(f"{name} = {counts(instructions, path)}")
                if arguments.listing:
                    lines += [f"#   {one.predicate:6} {one.name} {one.operands}" for one in map(instructions.__getitem__, path)]
    print("\n".join(lines))


if __name__ == "__main__":
    try:
        main()
    except Failure as failure:
        sys.exit(f"{failure}.")
