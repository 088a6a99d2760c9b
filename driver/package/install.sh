#!/bin/sh
# Installs the driver, the layers, the command, its manual pages and completions, and the C header.
#
#   install.sh BUILD        BUILD has the built files, such as target/release
#
# PREFIX is /usr/local unless it is set, and LIBDIR is PREFIX/lib. Everything is written below DESTDIR. The manifests name
# their libraries by relative paths, so that the installed tree may be moved.
set -eu
if [ $# -ne 1 ] || [ ! -e "$1/libvulkan_gaurast.so" ]; then
    echo "usage: [DESTDIR=...] [PREFIX=/usr/local] [LIBDIR=PREFIX/lib] $0 BUILD" >&2
    exit 2
fi
build=$(cd "$1" && pwd)
source=$(cd "$(dirname "$0")/../.." && pwd)
prefix=${PREFIX:-/usr/local}
libraries=${LIBDIR:-$prefix/lib}
root=${DESTDIR:-}
case $libraries in
"$prefix"/*) ;;
*)
    echo "install.sh: LIBDIR must be below PREFIX, since manifests are relative" >&2
    exit 2
    ;;
esac
version=$(sed -n 's/^version = "\(.*\)"/\1/p' "$source/Cargo.toml" | head -n 1)

file() { # file MODE FROM TO
    install -D -m "$1" "$2" "$root$3"
}
file 755 "$build/gaurast" "$prefix/bin/gaurast"
file 644 "$build/libvulkan_gaurast.so" "$libraries/libvulkan_gaurast.so"
for layer in validation emulation; do
    file 644 "$build/libVkLayer_gaurast_$layer.so" "$libraries/libVkLayer_gaurast_$layer.so"
done
file 644 "$source/api/include/vulkan_gaurast.h" "$prefix/include/vulkan/vulkan_gaurast.h"
file 644 "$source/api/include/vulkan_gaurast_defaults.h" "$prefix/include/vulkan/vulkan_gaurast_defaults.h"
file 644 "$source/LICENSE-MIT" "$prefix/share/doc/gaurast/LICENSE-MIT"
file 644 "$source/LICENSE-APACHE" "$prefix/share/doc/gaurast/LICENSE-APACHE"

# From PREFIX/share/vulkan/*.d to the libraries.
relative=../../..${libraries#"$prefix"}
manifest() { # manifest FROM TO
    mkdir -p "$root$(dirname "$2")"
    sed "s,\"library_path\": \".*/,\"library_path\": \"$relative/," "$1" >"$root$2"
    chmod 644 "$root$2"
}
manifest "$source/driver/icd/gaurast_icd.json" "$prefix/share/vulkan/icd.d/gaurast_icd.json"
manifest "$source/api/layer/gaurast_layer.json" "$prefix/share/vulkan/explicit_layer.d/gaurast_layer.json"
manifest "$source/api/emulation/layer/gaurast_emulation.json" "$prefix/share/vulkan/explicit_layer.d/gaurast_emulation.json"

pages=$root$prefix/share/man/man1
mkdir -p "$pages"
"$build/gaurast" man "$pages"
completion() { # completion SHELL TO
    mkdir -p "$(dirname "$root$2")"
    "$build/gaurast" completions "$1" >"$root$2"
}
completion bash "$prefix/share/bash-completion/completions/gaurast"
completion zsh "$prefix/share/zsh/site-functions/_gaurast"
completion fish "$prefix/share/fish/vendor_completions.d/gaurast.fish"

mkdir -p "$root$libraries/pkgconfig"
cat >"$root$libraries/pkgconfig/gaurast.pc" <<PC
prefix=\${pcfiledir}$(printf '%s' "${libraries#"$prefix"}/pkgconfig" | sed 's,/[^/]*,/..,g')
includedir=\${prefix}/include

Name: gaurast
Description: The C header of the Vulkan extension VK_GAURAST_gaussian_primitive_topology
Version: $version
Cflags: -I\${includedir}
PC
