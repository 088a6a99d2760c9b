#!/bin/sh
# Builds and runs a program of vello, which draws vector graphics by compute shaders: areas of shapes and a gradient.
. "$(dirname "$0")/common.sh"
need cargo
target=$cache/vello-0.11.0
[ -e "$target/release/vello-client" ] || may_install vello-client
CARGO_TARGET_DIR=$target cargo build --release --locked --quiet --manifest-path "$here/programs/vello/Cargo.toml" \
    > "$out/$client-install.log" 2>&1 || ignored "cargo does not build it ($out/$client-install.log)"
check 0.11.0 "$target/release/vello-client"
