#!/bin/sh
# Runs every client: passed, failed, or ignored with the reason. GAURAST_LIBRARY names the driver's library, by default
# target/release/libvulkan_gaurast.so.
cd "$(dirname "$0")"
code=0
for script in *.sh; do
    case $script in
        run.sh | common.sh) ;;
        *)
            sh "$script"
            # An ignored client has printed the reason.
            case $? in 0 | 77) ;; *) code=1 ;; esac
            ;;
    esac
done
exit $code
