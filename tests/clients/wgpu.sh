#!/bin/sh
# Builds and runs a program on wgpu, with wgpu's default limits: a scan's numbers, and the pixels of a multisampled draw.
. "$(dirname "$0")/common.sh"
need cargo
if [ -z "${GAURAST_CLIENTS_OFFLINE:-}" ]; then
    cargo fetch --locked --manifest-path "$here/wgpu/Cargo.toml" > "$out/wgpu.log" 2>&1 || ignored "cargo has no wgpu"
fi
CARGO_TARGET_DIR=$cache/wgpu cargo build --locked --offline --manifest-path "$here/wgpu/Cargo.toml" \
    > "$out/wgpu.log" 2>&1 || ignored "cargo doesn't build it ($out/wgpu.log)"
version=$(sed -n '/^name = "wgpu"$/{n;s/version = "\(.*\)"/\1/p}' "$here/wgpu/Cargo.lock")
check "$version" "$cache/wgpu/debug/wgpu-client"
