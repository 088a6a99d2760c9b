#!/bin/sh
# Makes gaurast-VERSION-x86_64-linux.tar.xz of built files, and its SHA-256 beside it.
#
#   archive.sh BUILD OUT
#
# The archive is an installed tree that runs where it is unpacked: `eval "$(gaurast-VERSION-x86_64-linux/bin/gaurast icd)"`.
# The same files give the same archive.
set -eu
. "$(dirname "$0")/arguments.sh"
name=gaurast-$version-$(uname -m)-linux
DESTDIR=$work PREFIX=/$name "$here/install.sh" "$build"
tar --sort=name --owner=0 --group=0 --numeric-owner --mtime="@${SOURCE_DATE_EPOCH:-0}" -C "$work" -cf - "$name" |
    xz -9e --threads=1 >"$out/$name.tar.xz"
cd "$out"
sha256sum "$name.tar.xz" >"$name.tar.xz.sha256"
echo "$out/$name.tar.xz"
