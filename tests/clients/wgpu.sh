#!/bin/sh
# Builds and runs a program of wgpu, with its default limits: a compute shader's numbers, and the pixels of a triangle.
. "$(dirname "$0")/common.sh"
need cargo
target=$cache/wgpu-30.0.2
[ -e "$target/release/wgpu-client" ] || may_install wgpu-client
CARGO_TARGET_DIR=$target cargo build --release --locked --quiet --manifest-path "$here/programs/wgpu/Cargo.toml" \
    > "$out/$client-install.log" 2>&1 || ignored "cargo does not build it ($out/$client-install.log)"
check 30.0.2 "$target/release/wgpu-client"
