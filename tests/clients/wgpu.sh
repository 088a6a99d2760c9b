#!/bin/sh
# Builds and runs a program of wgpu, with its default limits: a compute shader's numbers, and the pixels of a triangle.
. "$(dirname "$0")/common.sh"
rust_program wgpu 30.0.2
check 30.0.2 "$program"
