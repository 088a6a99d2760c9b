# Read by archive.sh and deb.sh, whose arguments are BUILD and OUT: sets `here`, `build`, `out`, the `version` and a folder `work` that
# goes when the script ends.
here=$(cd "$(dirname "$0")" && pwd)
build=$1
mkdir -p "$2"
out=$(cd "$2" && pwd)
version=$(sed -n 's/^version = "\(.*\)"/\1/p' "$here/../../Cargo.toml" | head -n 1)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
