# Functions of the clients' scripts. Each script runs one third-party program on this driver, through the Vulkan loader.
# It exits with 0 if the program worked, with 1 if it did not, and with 77 and the reason if it cannot run here.
set -eu
root=$(cd "$(dirname "$0")/../.." && pwd)
out=${GAURAST_CLIENTS_OUT:-$(mktemp -d)}
mkdir -p "$out"

ignored() {
    echo "$(basename "$0" .sh): ignored: $1"
    exit 77
}

failed() {
    echo "$(basename "$0" .sh): failed: $1"
    exit 1
}

# need PROGRAM...: the script is ignored if a program is missing.
need() {
    for program in "$@"; do
        command -v "$program" > /dev/null || ignored "there is no $program"
    done
}

# The driver's library from the last release build, unless GAURAST_LIBRARY names another.
library=${GAURAST_LIBRARY:-$root/target/release/libvulkan_gaurast.so}
[ -e "$library" ] || ignored "there is no $library: cargo build --release, or GAURAST_LIBRARY"
manifest=$out/gaurast_icd.json
sed "s#\"library_path\": *\"[^\"]*\"#\"library_path\": \"$library\"#" "$root/driver/icd/gaurast_icd.json" > "$manifest"
export VK_DRIVER_FILES="$manifest" VK_ICD_FILENAMES="$manifest"

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
