#!/bin/sh
# Makes gaurast_VERSION_amd64.deb of built files.
#
#   deb.sh BUILD OUT
set -eu
. "$(dirname "$0")/arguments.sh"
architecture=$(dpkg --print-architecture)
# The newest version of glibc's symbols that a built file asks for; 2.17 where zig has built them.
glibc=$(cat "$build/gaurast" "$build/libvulkan_gaurast.so" "$build"/libVkLayer_gaurast_*.so |
    grep --text --only-matching 'GLIBC_2\.[0-9]*' | sed 's/GLIBC_//' | sort --version-sort --unique | tail -n 1)
DESTDIR=$work PREFIX=/usr LIBDIR=/usr/lib/$(dpkg-architecture -qDEB_HOST_MULTIARCH 2>/dev/null || echo "$(uname -m)-linux-gnu") \
    "$here/install.sh" "$build"
find "$work/usr/share/man" -name '*.1' -exec gzip -9n {} +
mv "$work/usr/share/doc/gaurast/LICENSE-MIT" "$work/usr/share/doc/gaurast/copyright"
# Debian's systems have the text of the Apache licence.
rm "$work/usr/share/doc/gaurast/LICENSE-APACHE"
printf '\nOr, at your option, the Apache License 2.0: /usr/share/common-licenses/Apache-2.0\n' \
    >>"$work/usr/share/doc/gaurast/copyright"
mkdir -m 755 "$work/DEBIAN"
cat >"$work/DEBIAN/control" <<CONTROL
Package: gaurast
Version: $version
Architecture: $architecture
Maintainer: The GauRast project <gaurast@invalid>
Installed-Size: $(du -sk "$work/usr" | cut -f 1)
Depends: libc6 (>= $glibc), libgcc-s1
Recommends: libvulkan1
Suggests: ffmpeg
Section: graphics
Priority: optional
Description: Vulkan driver that runs on the CPU and draws 3D Gaussians
 GauRast is a software Vulkan driver in which a 3D Gaussian is a primitive, as a
 triangle is. The package has the driver for the Vulkan loader, a layer that
 checks the use of its extension, a layer that gives the extension to other
 devices, and the command that draws scenes.
CONTROL
chmod 755 "$work"
dpkg-deb --root-owner-group -Zxz --build "$work" "$out/gaurast_${version}_$architecture.deb" >/dev/null
echo "$out/gaurast_${version}_$architecture.deb"
