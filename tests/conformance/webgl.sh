#!/usr/bin/env bash
# Runs Khronos' WebGL conformance tests, those that the suite lists for WebGL 2, in Chromium: its ANGLE draws by Vulkan on this driver.
#
#   GAURAST_WEBGL=PATH/TO/WebGL/sdk/tests bash tests/conformance/webgl.sh [PATTERN...] [--angle vulkan|swiftshader] [--cases N]
#       [--seed N] [--jobs N] [--results FILE] [--list]
#
# GAURAST_WEBGL names the folder `sdk/tests` of Khronos' repository WebGL. PATTERN is a part of a test's name; without one, all tests
# are run. With --cases, N of them are drawn by the seed (1 by default). `--angle swiftshader` runs them on the SwiftShader that
# Chromium brings. The results are lines of a test, its outcome, seconds, passed checks, failed checks and the first failure, with tabs
# between; a file of them that exists is continued. The script prints the outcomes' counts and the tests that don't pass, and exits with 1
# if there is one that is not in tests/expected_failures/webgl.txt.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
if [ ! -e "${GAURAST_WEBGL:-}/00_test_list.txt" ]; then
    echo "GAURAST_WEBGL must name the folder sdk/tests of Khronos' repository WebGL" >&2
    exit 2
fi
GAURAST_WEBGL=$(realpath "$GAURAST_WEBGL")
export GAURAST_WEBGL
# shellcheck source=tests/clients/common.sh
. "$here/../clients/common.sh"
need chromium
node_packages playwright-core@1.64.1
CHROMIUM=$(command -v chromium)
export CHROMIUM
exec node "$here/webgl.mjs" "$modules" "$here/../expected_failures/webgl.txt" "$@"
