#!/usr/bin/env bash
# Runs every check of the project. It installs missing programs and prints their names.
#
# Prints the seconds of each step, the slowest tests, and the reasons for which tests were ignored. A test that cannot run
# is ignored. With GAURAST_TEST_REQUIRE=programs, a missing program or system file is a failure; with
# GAURAST_TEST_REQUIRE=all, missing test data (GAURAST_TEST_DATA) are too. GAURAST_TEST_LONG=1 runs tests completely that
# otherwise use a small sample.
set -euo pipefail
cd "$(dirname "$0")/.."

# The programs and files that the tests use, and the Debian packages that contain them.
missing=()
need() { # need PACKAGE COMMAND-OR-FILE
    command -v "$2" >/dev/null 2>&1 || [ -e "$2" ] || missing+=("$1")
}
need gcc cc
need g++ c++
need libvulkan-dev /usr/include/vulkan/vulkan.h
# Newer Debian has it without the architecture.
need mesa-vulkan-drivers "$(echo /usr/share/vulkan/icd.d/lvp_icd*.json)"
need libvulkan1 "/usr/lib/$(uname -m)-linux-gnu/libvulkan.so.1"
need vulkan-tools vulkaninfo
need vulkan-validationlayers /usr/share/vulkan/explicit_layer.d/VkLayer_khronos_validation.json
need glslang-tools glslangValidator
need spirv-tools spirv-val
need valgrind valgrind
need asciidoctor asciidoctor
need verilator verilator
need iverilog iverilog
need make make
need yosys yosys
need opensta sta
need xvfb Xvfb
need qemu-user qemu-x86_64
if ! python3 -c 'import numpy' 2>/dev/null && ! /usr/bin/python3 -c 'import numpy' 2>/dev/null; then missing+=(python3-numpy); fi
if ! python3 -m pip --version >/dev/null 2>&1; then missing+=(python3-pip); fi
if ! python3 -c 'import ensurepip' >/dev/null 2>&1; then missing+=(python3-venv); fi
if [ ${#missing[@]} -gt 0 ]; then
    if command -v apt-get >/dev/null && [ "$(id -u)" = 0 ]; then
        echo "installing: ${missing[*]}"
        export DEBIAN_FRONTEND=noninteractive
        apt-get update -qq
        apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
    else
        echo "missing, and the tests that need them will be ignored: ${missing[*]}" >&2
    fi
fi

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export GAURAST_TEST_REPORT="$work/report"
touch "$GAURAST_TEST_REPORT"

# The Vulkan registry and SPIR-V's grammar, which the driver's generated files are compared with.
if [ -z "${GAURAST_VK_XML:-}" ] || [ -z "${GAURAST_SPIRV_GRAMMAR:-}" ]; then
    echo "fetching vk.xml and spirv.core.grammar.json"
    if driver/gen/fetch.sh "$work"; then
        export GAURAST_VK_XML="${GAURAST_VK_XML:-$work/vk.xml}"
        export GAURAST_SPIRV_GRAMMAR="${GAURAST_SPIRV_GRAMMAR:-$work/spirv.core.grammar.json}"
    else
        echo "they can't be had, and the tests that need them will be ignored" >&2
    fi
fi

# Prints a report on all steps so far; also after a failure.
tell() {
    echo
    echo "== the slowest tests, in seconds"
    grep -v '^ignored' "$GAURAST_TEST_REPORT" | sort -rn | head -n 20 || true
    echo
    echo "== ignored tests, by reason"
    sed -n 's/^ignored\t//p' "$GAURAST_TEST_REPORT" | sort | uniq -c | sort -rn
    echo
    echo "== seconds by step"
    cat "$work/steps"
}
step() { # step NAME COMMAND...
    local name=$1 start=$SECONDS
    shift
    echo
    echo "== $name: $*"
    if ! "$@"; then
        printf '%6d  %s (failed)\n' $((SECONDS - start)) "$name" >>"$work/steps"
        tell
        exit 1
    fi
    printf '%6d  %s\n' $((SECONDS - start)) "$name" >>"$work/steps"
}

# absent WHAT: a missing program fails if it is required; otherwise what needs it is ignored.
absent() {
    if [ -n "${GAURAST_TEST_REQUIRE:-}" ]; then
        echo "$1 is missing" >&2
        return 1
    fi
    printf 'ignored\t%s is missing\n' "$1" >>"$GAURAST_TEST_REPORT"
}

# The profile is optimised, since the oracle compares whole images, and checks debug assertions and overflow.
tests=(--workspace --profile checked --lib --bins --tests)
step format cargo fmt --all --check
step clippy cargo clippy --workspace --all-targets --profile checked --quiet -- -D warnings
step clippy-without-driver cargo clippy --package gaurast-cli --no-default-features --profile checked --quiet -- -D warnings
# The documentation of the crates that applications use: no broken link.
public=()
for crate in gaurast gaurast-emulation gaurast-scene gaurast-picture gaurast-render gaurast-layer gaurast-driver; do
    public+=(-p "$crate")
done
step documentation env RUSTDOCFLAGS="-D warnings" cargo doc --profile checked --no-deps --quiet "${public[@]}"
# The extension's text: no broken reference, table or list.
specification() {
    if command -v asciidoctor >/dev/null; then
        asciidoctor --failure-level WARN --destination-dir "$work/specification" api/spec/*.adoc
    else
        absent asciidoctor
    fi
}
step specification specification
# Builds the tests, and the files that tests start or load: the loader's library and the samples.
samples=()
for sample in hello_gaussians hello_tessellation hello_triangle picking wobbling_gaussians tilted_plane gallery; do
    samples+=(--example "$sample")
done
step "build tests" cargo build "${tests[@]}" "${samples[@]}" --quiet
GAURAST_TEST_LIBRARIES=$(realpath "${CARGO_TARGET_DIR:-target}/checked")
export GAURAST_TEST_LIBRARIES
step tests cargo test "${tests[@]}" --quiet --no-fail-fast
# The Python package on the libraries that the tests built.
python_tests() {
    if python3 -c 'import sys; sys.exit(sys.version_info < (3, 9))' 2>/dev/null; then
        # Within a condition, as steps are, a failure does not end a function by itself.
        api/python/tests/run.sh "$GAURAST_TEST_LIBRARIES" | tee "$work/pytest" || return 1
        sed -n 's/^SKIPPED \[[0-9]*\] [^ ]* /ignored\t/p' "$work/pytest" >>"$GAURAST_TEST_REPORT"
    else
        absent "Python 3.9"
    fi
}
step python python_tests
step "documentation tests" cargo test --workspace --profile checked --doc --quiet
# Counts the instructions of frames, since times depend on the machine.
step "build benchmarks" cargo build --profile profiling --quiet -p gaurast-bench
step counts cargo run --profile profiling --quiet -p gaurast-bench -- counts
printf '%6d  %s\n' $SECONDS all >>"$work/steps"
tell
echo "all checks passed"
