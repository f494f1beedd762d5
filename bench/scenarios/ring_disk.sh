#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# A run whose ring's disk is full, slow or gone: ring_disk.sh [SECONDS]. The main graph must miss nothing more than without
# it, and the report must say what was not written. As root (it mounts a small file system); needs a C compiler.
set -u
root=$(readlink -f "$(dirname "$0")/../..")
takt=${TAKT:-$root/takt}
seconds=${1:-25}
work=$(mktemp -d)
trap 'umount "$work/full" 2>/dev/null; rm -rf "$work"' EXIT
mkdir "$work/full"
mount -t tmpfs -o size=4m none "$work/full" || { echo "NOT RUN: mounting needs root"; exit 77; }
cat >"$work/slow.c" <<'C'
#define _GNU_SOURCE
#include <dlfcn.h>
#include <unistd.h>
static long wait_us(void) { return 400000; }
ssize_t write(int fd, const void* data, size_t size) {
  static ssize_t (*next)(int, const void*, size_t);
  if (!next) next = (ssize_t(*)(int, const void*, size_t))dlsym(RTLD_NEXT, "write");
  char link[64] = "", path[512] = "";
  char* at = link;
  for (const char* from = "/proc/self/fd/"; *from; ++from) *at++ = *from;
  if (fd >= 100) *at++ = (char)('0' + fd / 100);
  if (fd >= 10) *at++ = (char)('0' + fd / 10 % 10);
  *at++ = (char)('0' + fd % 10);
  ssize_t length = readlink(link, path, sizeof path - 1);
  for (ssize_t i = 0; i + 12 < length; ++i)
    if (__builtin_memcmp(path + i, "/flight/ring", 12) == 0) { usleep(wait_us()); break; }
  return next(fd, data, size);
}
C
cc -shared -fPIC -o "$work/slow.so" "$work/slow.c" -ldl || exit 3
tell() { # NAME EXIT
  python3 - "$work/$1.json" "$1" "$2" <<'PY'
import json, sys
report, name, code = json.load(open(sys.argv[1])), sys.argv[2], sys.argv[3]
flight = report.get("flight", {})
disk = flight.get("disk") or {}
late = [n for n in report["nodes"] if n["criticality"] == "high"]
print(f"{name}: exit {code}, {sum(n['deadline_misses'] for n in report['nodes'])} misses, lateness p99 of high nodes "
      f"{sum(n['lateness_us']['p99'] or 0 for n in late) / len(late):.0f} us; ring lost {disk.get('lost')}, {disk.get('mb')} MB, "
      f"refused: {disk.get('refused')!r}; policy {report['policy_granted']}", flush=True)
PY
}
run() { # NAME OUTPUT PRELOAD
  LD_PRELOAD=$3 "$takt" run --for "${seconds}s" --ring on --output "$2" --report "$work/$1.json" >"$work/$1.log" 2>&1
}
"$takt" run --for "${seconds}s" --ring off --output "$work/out" --report "$work/off.json" >"$work/off.log" 2>&1
tell off $?
run well "$work/out" ""
tell well $?
run full "$work/full" ""
tell full $?
run slow "$work/slow" "$work/slow.so"
tell slow $?
run gone "$work/gone" "" & pid=$!
sleep 8
rm -rf "$work/gone/flight/ring"
touch "$work/gone/flight/ring"
wait $pid
tell gone $?
