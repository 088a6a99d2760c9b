#!/bin/sh
# Runs bazalt, a Python library whose graphs of passes place barriers by themselves.
. "$(dirname "$0")/common.sh"
python_packages bazalt==0.30.0 numpy==2.4.6
check 0.30.0 "$python" "$here/programs/bazalt_passes.py"
