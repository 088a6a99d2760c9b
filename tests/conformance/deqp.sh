#!/usr/bin/env bash
# Runs dEQP-VK, Khronos' conformance tests, on this driver, or on the one that VK_DRIVER_FILES names.
#
#   GAURAST_DEQP=PATH/TO/deqp-vk bash tests/conformance/deqp.sh [MODULE...] [--families] [--cases N] [--seed N] [--jobs N] [--results FILE] [--list]
#
# MODULE is the beginning of a case's name without `dEQP-VK.`, such as `api.info`; without one, all modules are run. Of each module
# (of each first part of a name, such as `api`), N cases are drawn at random by the seed (1 by default); without --cases, all are run.
# With --families, N cases (14 by default) are drawn of each family: of each first three parts of a name, or four or five in large modules
# (`depth` below), so that rare kinds are not missed. What no feature of this driver concerns is left out: ray queries and ray tracing,
# sparse resources, `info`, and shader objects. --list prints the cases that would be run, and runs none.
#
# GAURAST_DEQP_CASES names a file of cases, such as one of `mustpass`; without it, the cases are those that deqp-vk lists.
#
# A process runs up to 200 cases. After a crash or a time-out, the next process goes on behind the case. The results are lines of a
# case, a tab and its outcome. The script prints the outcomes' counts by module and the cases that fail, crash or hang but for those of
# tests/expected_failures/cts.txt, and exits with 1 if there is one.
set -euo pipefail
repository=$(realpath "$(dirname "$0")/../..")

modules=() families= drawn= seed=1 jobs=$(nproc) results= list=
while [ $# -gt 0 ]; do
    case $1 in
    --families) families=1 ;;
    --list) list=1 ;;
    --cases) drawn=$2 && shift ;;
    --seed) seed=$2 && shift ;;
    --jobs) jobs=$2 && shift ;;
    --results) results=$(realpath "$2") && shift ;;
    -*)
        echo "unknown option $1" >&2
        exit 2
        ;;
    *) modules+=("$1") ;;
    esac
    shift
done
drawn=${drawn:-${families:+14}}
drawn=${drawn:-0}
if [ -x "${GAURAST_DEQP:-}" ]; then
    GAURAST_DEQP=$(realpath "$GAURAST_DEQP")
elif [ -z "$list" ] || [ -z "${GAURAST_DEQP_CASES:-}" ]; then
    echo "GAURAST_DEQP must name deqp-vk, built from VK-GL-CTS (docs/clients.md says how)" >&2
    exit 2
fi
export GAURAST_DEQP VK_DRIVER_FILES=${VK_DRIVER_FILES:-$repository/driver/icd/gaurast_icd.json}

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
results=${results:-$work/results}
: >"$results"

cases=${GAURAST_DEQP_CASES:-}
if [ -z "$cases" ]; then
    cases=$work/dEQP-VK-cases.txt
    (cd "$(dirname "$GAURAST_DEQP")" &&
        "$GAURAST_DEQP" --deqp-runmode=txt-caselist --deqp-caselist-export-file="$cases.listed" >/dev/null)
    sed -n 's/^TEST: //p' "$cases.listed" >"$cases"
fi

# Draws the cases: those of each module, or family, in a random order.
awk -v modules="${modules[*]}" -v families="$families" -v seed="$seed" '
    BEGIN {
        count = split(modules, wanted, " "); srand(seed)
        depth["pipeline"] = depth["renderpasses"] = depth["draw"] = depth["compute"] = 4; depth["spirv_assembly"] = 5
        without["sparse_resources"]; without["ray_query"]; without["ray_tracing_pipeline"]; without["info"]
        linked["monolithic"]; linked["pipeline_library"]; linked["fast_linked_library"]
    }
    # The family of a name of n parts; empty for what is left out.
    function family(n, last, name, i) {
        if (parts[2] in without || parts[2] == "pipeline" && !(parts[3] in linked)) return ""
        last = parts[2] in depth ? depth[parts[2]] : 3
        if (last > n - 1) last = n - 1
        name = parts[2]
        for (i = 3; i <= last; i++) name = name "." parts[i]
        return name
    }
    {
        keep = count == 0
        for (i = 1; i <= count; i++) keep = keep || index($0 ".", "dEQP-VK." wanted[i] ".") == 1
        n = split($0, parts, ".")
        group = families ? family(n) : parts[2]
        if (keep && group != "") printf "%s\t%.9f\t%s\n", group, rand(), $0
    }' "$cases" | LC_ALL=C sort -k1,1 -k2,2 |
    awk -F '\t' -v drawn="$drawn" 'drawn == 0 || number[$1]++ < drawn { print $3 }' | LC_ALL=C sort >"$work/cases"
if [ ! -s "$work/cases" ]; then
    echo "no case has a name that begins so" >&2
    exit 2
fi
if [ -n "$list" ]; then
    cat "$work/cases"
    exit
fi
split -l 200 "$work/cases" "$work/part."

# Runs the cases of file $1 and writes $1.results.
run_part() {
    local rest=$1.rest now=$1.now
    cp "$1" "$rest"
    while [ -s "$rest" ]; do
        # The watchdog of deqp-vk ends a case after five minutes, or after 30 s without a sign of life.
        (cd "$(dirname "$GAURAST_DEQP")" && timeout 3600 "$GAURAST_DEQP" --deqp-caselist-file="$rest" --deqp-watchdog=enable \
            --deqp-log-images=disable --deqp-log-shader-sources=disable --deqp-log-filename=/dev/null \
            --deqp-shadercache=disable >"$now" 2>"$1.errors") || true
        awk '
            /^Test case \047/ { name = $3; gsub(/\047|\.\.$/, "", name); open = 1; next }
            open && /^  (Pass|Fail|NotSupported|QualityWarning|CompatibilityWarning|InternalError|ResourceError|Crash|Timeout|Waiver|Pending|DeviceLost)/ {
                outcome = $1; $1 = ""; print name "\t" outcome "\t" substr($0, 2); open = 0
            }
            /Watchdog timer timeout/ { late = 1 }
            END { if (open) print name "\t" (late ? "Timeout" : "Crash") "\t" }' "$now" >"$now.done"
        if [ ! -s "$now.done" ]; then
            sed 1q "$rest" | sed 's/$/\tCrash\tbefore the first case/' >"$now.done"
        fi
        cat "$now.done" >>"$1.results"
        awk -F '\t' 'NR == FNR { done[$1]; next } !($0 in done)' "$now.done" "$rest" >"$now.rest"
        mv "$now.rest" "$rest"
    done
}
export -f run_part
find "$work" -name 'part.*' | sort | xargs -P "$jobs" -I {} bash -c 'run_part {}'
cat "$work"/part.*.results | sort >"$results"

echo "$VK_DRIVER_FILES"
printf '%-28s %8s %8s %8s %14s\n' module passed failed crashed 'not supported'
awk -F '\t' '
    { split($1, parts, "."); names[parts[2]]; names["~all"]
      kind = $2 ~ /^(Pass|QualityWarning|CompatibilityWarning|Waiver)$/ ? "pass" : $2 == "NotSupported" ? "unsupported" : \
          $2 ~ /^(Crash|Timeout|DeviceLost)$/ ? "crash" : "fail"
      count[parts[2], kind]++; count["~all", kind]++ }
    END {
        for (name in names)
            printf "%-28s %8d %8d %8d %14d\n", name, count[name, "pass"], count[name, "fail"], count[name, "crash"],
                count[name, "unsupported"]
    }' "$results" | sort | sed 's/^~all/all /'

# What fails unexpectedly: a line of cts.txt is a pattern of names, a colon and the reason.
sed -n 's/^\([^#:][^:]*\):.*/\1/p' "$repository/tests/expected_failures/cts.txt" >"$work/expected"
awk -F '\t' '$2 !~ /^(Pass|NotSupported|QualityWarning|CompatibilityWarning|Waiver)$/' "$results" |
    { grep -vxE -f <(sed 's/$/\t.*/' "$work/expected") || true; } >"$work/unexpected"
cat "$work/unexpected"
[ ! -s "$work/unexpected" ]
