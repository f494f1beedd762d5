# SPDX-License-Identifier: Apache-2.0
# surroundings.sh TAKT SOURCE: a run in surroundings that limit it says which limit it is and how to raise it, or works
# all the same. A limit that cannot be set here is NOT RUN, by name.
source "$(dirname "$0")/lib.sh" "$@"
graph=$source/graph/ace.yaml
refuse=$source/tests/tools/refuse_calls.py
chmod 711 "$work"
mkdir -m 777 "$work/out" "$work/run"
run() { timeout -k 3 60 "$takt" run "$graph" --for 1s --output "$work/out" "$@"; }

# under LIMIT EXIT TEXT ARGUMENTS: a run after `ulimit LIMIT`. EXIT may be several: "0 1" where the machine may be late.
under() {
  local limit=$1 codes=$2 text=$3
  shift 3
  (ulimit $limit && run "$@") >"$work/stdout" 2>"$work/stderr"
  judge "ulimit $limit, run $*" $? "$codes" "$text"
}
judge() { # WHAT EXIT EXITS TEXT
  echo "--- $1: exit $2"
  grep -v '^completed' "$work/stderr" | cut -c1-240 | head -n 3
  [[ " $3 " == *" $2 "* ]] || { tail -n 20 "$work/stdout" "$work/stderr"; fail "$1: exit $2 instead of $3"; }
  [ -z "$4" ] || grep -qF -- "$4" "$work/stderr" || { cat "$work/stderr"; fail "$1: stderr lacks '$4'"; }
}
# shut COMMANDS EXITS TEXT ARGUMENTS: a run in a mount namespace where these commands have been carried out.
shut() {
  local commands=$1 codes=$2 text=$3
  shift 3
  unshare -m bash -c "$commands"' && exec "$@"' shut timeout -k 3 60 "$takt" run "$graph" --for 1s --output "$work/out" "$@" \
    >"$work/stdout" 2>"$work/stderr"
  judge "$commands, run $*" $? "$codes" "$text"
}

echo "=== memory and files"
for isolate in none subsystem; do under "-v 300000" 3 "RLIMIT_AS 307 MB: ulimit -v unlimited" --isolate $isolate; done
under "-n 8" "0 1 3" "RLIMIT_NOFILE 8: ulimit -n" --isolate subsystem
under "-v 700000" 3 "takt: error: " --isolate none  # when threads begin, there is not even memory for more words

echo "=== processes and threads, of a user"
if setpriv --reuid 65534 --regid 65534 --clear-groups test -x "$takt" 2>/dev/null && [ "$(id -u)" = 0 ]; then
  as_nobody() {
    local processes=$1 codes=$2 text=$3
    shift 3
    setpriv --reuid 65534 --regid 65534 --clear-groups env XDG_RUNTIME_DIR="$work/run" bash -c 'ulimit -u '"$processes"' && exec "$@"' limited \
      timeout -k 3 60 "$takt" run "$graph" --for 1s --output "$work/out" "$@" >"$work/stdout" 2>"$work/stderr"
    judge "ulimit -u $processes, run $*" $? "$codes" "$text"
  }
  for processes in 2 4 8 16; do as_nobody $processes 3 "RLIMIT_NPROC $processes, processes and threads of this user: ulimit -u" --isolate subsystem; done
  for processes in 4 8 16; do as_nobody $processes 3 "RLIMIT_NPROC $processes, processes" --isolate none; done
  as_nobody 3 3 "RLIMIT_NPROC 3, processes" --isolate none --policy cooperative
else
  echo "NOT RUN: ulimit -u counts no threads of root, and nobody else can be become here"
fi

echo "=== a control group"
group=/sys/fs/cgroup/memory/takt_surroundings limit=memory.limit_in_bytes
[ -f /sys/fs/cgroup/cgroup.controllers ] && group=/sys/fs/cgroup/takt_surroundings limit=memory.max
if mkdir "$group" 2>/dev/null && echo 250M >"$group/$limit" 2>/dev/null; then
  trap 'rm -rf "$work"; rmdir "$group"' EXIT
  # A run in one process that is killed cannot say why: docs/faq.md.
  bash -c 'echo $$ >"$1/cgroup.procs"; shift; exec "$@"' grouped "$group" timeout -k 3 60 "$takt" run "$graph" --for 1s --output "$work/out" --isolate subsystem \
    >"$work/stdout" 2>"$work/stderr"
  judge "250 MB in a control group" $? 3 "of control group /takt_surroundings: MemoryMax="
else
  rmdir "$group" 2>/dev/null
  echo "NOT RUN: no control group can be made here"
fi

echo "=== file systems"
if unshare -m true 2>/dev/null; then
  shut "mount -t tmpfs none /proc" 3 "is /proc mounted?"
  shut "mount -t tmpfs none /sys" "0 1" ""
  shut "mount -t tmpfs none /dev" "0 1" "/dev/cpu_dma_latency: No such file"
  shut "mount -t tmpfs -o ro none /dev/shm" "0 1" ""
  shut "mount -t tmpfs -o ro none /dev/shm" "0 1 3" "/dev/shm cannot be written: Read-only file system" --transport iceoryx
  shut "mount -t tmpfs -o size=1m none /dev/shm" 3 "sudo mount -o remount,size=" --transport iceoryx
  shut "mount --bind $work $work; mount --bind $work/out $work/out; mount -o remount,ro,bind /; mount -o remount,ro,bind $work" "0 1" ""
else
  echo "NOT RUN: no right to make mount namespaces"
fi

echo "=== system calls that a container refuses"
if python3 "$refuse" EPERM sched_setattr true 2>/dev/null; then
  for number in EPERM ENOSYS; do
    python3 "$refuse" $number sched_setattr,sched_setscheduler,sched_setparam timeout -k 3 60 "$takt" run "$graph" --for 1s --output "$work/out" >"$work/stdout" 2>"$work/stderr"
    judge "sched_setattr: $number" $? "0 1" ""
    grep -q "policy deadline -> cooperative: .*SCHED_DEADLINE was refused" "$work/stdout" || fail "$number: it is not told that no policy was granted"
    python3 "$refuse" $number mlockall,mlock,perf_event_open,membarrier,memfd_secret,userfaultfd timeout -k 3 60 "$takt" run "$graph" --for 1s --output "$work/out" >"$work/stdout" 2>"$work/stderr"
    judge "mlockall: $number" $? "0 1" "mlockall:"
  done
else
  echo "NOT RUN: libseccomp is missing, or no filter can be set"
fi

echo "=== a locale without UTF-8"
for name in C POSIX; do LC_ALL=$name tells 0 "obstacle_stop" "$takt" show "$graph"; done
finish
