#!/bin/sh
# Builds and runs a program of vello, which draws vector graphics by compute shaders: areas of shapes and a gradient.
. "$(dirname "$0")/common.sh"
rust_program vello 0.11.0
check 0.11.0 "$program"
