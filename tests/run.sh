#!/usr/bin/env bash
# Runs every check of the project, installing what it needs where that is missing, and saying so.
#
# The tests themselves skip aloud where something is absent; this script makes sure that little is.
set -euo pipefail
cd "$(dirname "$0")/.."

# The programs and files that the tests use, and Debian's packages that bring them.
missing=()
need() { # need PACKAGE COMMAND-OR-FILE
    command -v "$2" >/dev/null 2>&1 || [ -e "$2" ] || missing+=("$1")
}
need gcc cc
need g++ c++
need libvulkan-dev /usr/include/vulkan/vulkan.h
need mesa-vulkan-drivers /usr/share/vulkan/icd.d/lvp_icd.x86_64.json
need libvulkan1 "/usr/lib/$(uname -m)-linux-gnu/libvulkan.so.1"
need vulkan-tools vulkaninfo
need vulkan-validationlayers /usr/share/vulkan/explicit_layer.d/VkLayer_khronos_validation.json
need glslang-tools glslangValidator
need spirv-tools spirv-val
need valgrind valgrind
if [ ${#missing[@]} -gt 0 ]; then
    if command -v apt-get >/dev/null && [ "$(id -u)" = 0 ]; then
        echo "installing: ${missing[*]}"
        export DEBIAN_FRONTEND=noninteractive
        apt-get update -qq
        apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
    else
        echo "missing, and the tests that need them will be skipped: ${missing[*]}" >&2
    fi
fi

step() {
    echo
    echo "== $*"
    "$@"
}
step cargo fmt --all --check
step cargo clippy --workspace --all-targets --quiet -- -D warnings
# With optimisation, since the oracle compares whole images, and with debug assertions and overflow checks.
step cargo test --workspace --profile checked --quiet
# What a frame costs, in instructions: times would depend on the machine.
step tests/instructions/check.sh "${CARGO_TARGET_DIR:-target}/checked/gaurast"
# The main job once more in a debug build, where overflow and bad pointers abort.
picture=$(mktemp -d)
trap 'rm -rf "$picture"' EXIT
step cargo run --quiet -- render --size 160x90 --quiet -o "$picture/debug.png"
echo "all checks passed"
