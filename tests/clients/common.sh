# Functions of the clients' scripts. Each script runs one third-party program on this driver, through the Vulkan loader.
# It exits with 0 if the program worked, with 1 if it did not, and with 77 and the reason if it cannot run here.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
client=$(basename "$0" .sh)
out=${GAURAST_CLIENTS_OUT:-$(mktemp -d)}
mkdir -p "$out"
# Installed packages stay here, outside the tree.
cache=${GAURAST_CLIENTS_CACHE:-$HOME/.cache/gaurast-clients}

ignored() {
    echo "$client: ignored: $1"
    exit 77
}

failed() {
    echo "$client: failed: $1"
    exit 1
}

# need PROGRAM...: the script is ignored if a program is missing.
need() {
    for program in "$@"; do
        command -v "$program" > /dev/null || ignored "there is no $program"
    done
}

# The driver: GAURAST_CLIENTS_DRIVER names another one's manifest, for comparison. Otherwise it is this project's, whose
# library GAURAST_LIBRARY names, by default that of the last release build.
manifest=${GAURAST_CLIENTS_DRIVER:-}
if [ -z "$manifest" ]; then
    library=${GAURAST_LIBRARY:-$root/target/release/libvulkan_gaurast.so}
    [ -e "$library" ] || ignored "there is no $library: cargo build --release, or GAURAST_LIBRARY"
    manifest=$out/gaurast_icd.json
    sed "s#\"library_path\": *\"[^\"]*\"#\"library_path\": \"$library\"#" "$root/driver/icd/gaurast_icd.json" > "$manifest"
fi
export VK_DRIVER_FILES="$manifest" VK_ICD_FILENAMES="$manifest"

# Libraries of windows print messages if there is no folder for sockets.
XDG_RUNTIME_DIR=$out/runtime
export XDG_RUNTIME_DIR
mkdir -p "$XDG_RUNTIME_DIR"
chmod 700 "$XDG_RUNTIME_DIR"

# start_xvfb: starts an X server without a screen. It ends with the script.
start_xvfb() {
    need Xvfb
    number=$out/display
    rm -f "$number"
    mkfifo "$number"
    Xvfb -displayfd 3 -screen 0 1280x800x24 "$@" 3> "$number" 2> "$out/xvfb.log" &
    xvfb=$!
    trap 'kill $xvfb 2> /dev/null || true' EXIT
    read -r display < "$number"
    export DISPLAY=":$display"
}

# picture NAME: writes the current picture of the X server to a file.
picture() {
    if command -v import > /dev/null; then
        import -window root "$out/$1.png"
    fi
}

# colours FILE: prints the number of colours of a picture.
colours() {
    identify -format %k "$1"
}

# may_install: the script is ignored if packages are missing and must not be installed (GAURAST_CLIENTS_OFFLINE).
may_install() {
    [ -z "${GAURAST_CLIENTS_OFFLINE:-}" ] || ignored "$1 is not installed in $cache, and GAURAST_CLIENTS_OFFLINE is set"
}

# python_packages NAME==VERSION...: installs packages of PyPI into an environment of their own; $python is its Python.
python_packages() {
    environment=$cache/$(echo "python $*" | tr -s ' =' '-')
    python=$environment/bin/python
    [ ! -e "$environment/complete" ] || return 0
    may_install "$1"
    need python3
    rm -rf "$environment"
    python3 -m venv "$environment" > "$out/$client-install.log" 2>&1 || ignored "python3 has no venv"
    "$python" -m pip install --quiet --only-binary :all: "$@" > "$out/$client-install.log" 2>&1 \
        || ignored "pip does not install $* ($out/$client-install.log)"
    touch "$environment/complete"
}

# node_packages NAME@VERSION...: installs packages of npm; $modules is their folder.
node_packages() {
    need node npm
    environment=$cache/$(echo "node $*" | tr -s ' /@' '-')
    modules=$environment/node_modules
    [ ! -e "$environment/complete" ] || return 0
    may_install "$1"
    rm -rf "$environment"
    mkdir -p "$environment"
    npm install --prefix "$environment" --no-audit --no-fund --ignore-scripts "$@" > "$out/$client-install.log" 2>&1 \
        || ignored "npm does not install $* ($out/$client-install.log)"
    touch "$environment/complete"
}

# rust_program NAME VERSION: builds programs/NAME, whose main package has the version; $program is the built file.
rust_program() {
    need cargo
    program=$cache/$1-$2/release/$1-client
    [ -e "$program" ] || may_install "$1-client"
    CARGO_TARGET_DIR=$cache/$1-$2 cargo build --release --locked --quiet --manifest-path "$here/programs/$1/Cargo.toml" \
        > "$out/$client-install.log" 2>&1 || ignored "cargo does not build it ($out/$client-install.log)"
}

# check VERSION PROGRAM ARGUMENT...: runs a program that checks its results and prints the figures in its last line.
check() {
    version=$1
    shift
    timeout 600 "$@" > "$out/$client.txt" 2> "$out/$client.log" \
        || failed "$(tail -n 1 "$out/$client.txt") ($out/$client.log)"
    echo "$client $version: passed: $(tail -n 1 "$out/$client.txt")"
}
