# SPDX-License-Identifier: Apache-2.0
# The service: its unit is well-formed and closed, and under its restrictions (tests/tools/confined.py; no systemd is
# needed) the main graph runs under `deadline` with locked memory, its threads keep no right that they do not need, its
# group may speak to it, and SIGTERM to all ends it in order.
source "$(dirname "$0")/lib.sh" "$@"
unit=$work/takt@ace.service
cp "$source/packaging/systemd/takt@.service" "$unit"
confined=$source/tests/tools/confined.py

if command -v systemd-analyze >/dev/null; then
  systemd-analyze verify --man=no "$unit" 2>"$work/verify"
  grep -v "takt is not executable" "$work/verify" && fail "the unit is not well-formed"
  exposure=$(systemd-analyze security --offline=true "$unit" 2>&1 | sed -n 's/.*exposure level for takt@ace.service: \([0-9.]*\) .*/\1/p')
  echo "systemd-analyze security: $exposure"
  awk "BEGIN {exit !(${exposure:-10} <= 2.2)}" || fail "exposure ${exposure:-unknown} instead of at most 2.2"
else
  echo "NOT RUN: systemd-analyze is missing"
fi
if command -v systemd-sysusers systemd-tmpfiles >/dev/null; then
  mkdir -p "$work/root/etc" "$work/root/dev"
  printf 'root:x:0:0:root:/root:/bin/sh\n' >"$work/root/etc/passwd"
  printf 'root:x:0:\nvideo:x:44:\ndialout:x:20:\n' >"$work/root/etc/group"
  touch "$work/root/dev/cpu_dma_latency"
  systemd-sysusers --root="$work/root" "$(realpath "$source")/packaging/systemd/takt.sysusers.conf" 2>/dev/null || fail "the file for sysusers.d"
  grep -q '^takt:' "$work/root/etc/passwd" && grep -q 'video:.*takt' "$work/root/etc/group" || fail "no user takt with its groups"
  systemd-tmpfiles --root="$work/root" --create "$(realpath "$source")/packaging/systemd/takt.tmpfiles.conf" || fail "the file for tmpfiles.d"
  [ "$(stat -c %a "$work/root/dev/cpu_dma_latency")" = 660 ] || fail "tmpfiles.d does not open cpu_dma_latency"
fi

# takt status and takt logs, with programs in place of those of systemd.
mkdir "$work/bin"
cat >"$work/bin/systemctl" <<'SH'
#!/bin/sh
[ "$1 $2" = "show takt@ace.service" ] || exit 0
printf 'Id=takt@ace.service\nLoadState=loaded\nActiveState=active\nSubState=running\nStatusText=mode full\nNRestarts=1\nActiveEnterTimestamp=Mon 2026-11-30 08:12:01 UTC\nResult=success\n'
SH
printf '#!/bin/sh\necho "$@"\n' >"$work/bin/journalctl"
chmod +x "$work/bin/systemctl" "$work/bin/journalctl"
with_systemd() { PATH=$work/bin:$PATH "$@"; }
expect 0 "" with_systemd "$takt" status ace
prints "ace: active (running) since Mon 2026-11-30 08:12:01 UTC, restarted 1 time; mode full"
expect 0 "" with_systemd "$takt" status ace --json
prints '"restarts": 1'
expect 3 "takt@other.service" with_systemd "$takt" status other
expect 2 'is no name of a service' "$takt" status 'a b'
expect 0 "" with_systemd "$takt" logs ace --since -1h --follow
prints "--unit=takt@ace.service --output=short-iso --no-hostname --follow --since=-1h"
expect 2 'is no name of a service' "$takt" logs 'a;b'
printf '#!/bin/sh\nexec yes\n' >"$work/bin/journalctl"
(trap - PIPE; with_systemd timeout 20 "$takt" logs --follow; echo $? >"$work/code") 2>/dev/null | head -1 >/dev/null
[ "$(cat "$work/code")" = 3 ] || fail "logs whose reader has left ended with $(cat "$work/code")"
printf '#!/bin/sh\nexit 5\n' >"$work/bin/journalctl"
expect 3 "journalctl ended with 5" with_systemd "$takt" logs

[ "$(id -u)" = 0 ] && [ -e /usr/lib/x86_64-linux-gnu/libseccomp.so.2 ] && command -v systemd-analyze setpriv >/dev/null &&
  unshare --mount true 2>/dev/null || { echo "NOT RUN: a run under the unit's restrictions needs root, libseccomp2 and systemd-analyze"; [ $failures -eq 0 ] || exit 1; exit 77; }

# What the service has in /usr/bin and /usr/share lies in one folder here.
mkdir "$work/program"
cp "$takt" "$work/program/takt"
cp -r "$source/graph" "$source/schedules" "$source/nodes" "$work/program/"
chmod -R go+rX "$work" && chmod 711 "$work"
export TAKT_HOME=/opt/takt
as_service() { /usr/bin/python3 "$confined" "$unit" "$work/program" "$@"; }

# Each restriction bites: a rule that is not there would let everything below pass.
expect 0 "" as_service sh -c '! touch /etc/x && ! touch /opt/takt/x && ! ls /root'
expect 0 "" as_service sh -c 'touch /run/takt/x /var/lib/takt/x /tmp/x'
expect 0 "" as_service /usr/bin/python3 -c '
import ctypes, mmap, os, socket
def refused(work):
    try: work()
    except OSError as problem: return problem.errno in (1, 13, 38, 97)
    return False
libc = ctypes.CDLL(None, use_errno=True)
def call(result):
    if result < 0: raise OSError(ctypes.get_errno(), "")
assert refused(lambda: socket.socket(socket.AF_INET6)) and refused(lambda: socket.socket(socket.AF_NETLINK))
assert refused(lambda: mmap.mmap(-1, 4096, prot=mmap.PROT_READ | mmap.PROT_WRITE | mmap.PROT_EXEC))
assert refused(lambda: call(libc.mount(b"none", b"/tmp", b"tmpfs", 0, None))) and refused(lambda: call(libc.unshare(0x10000000)))
assert refused(lambda: os.setpriority(os.PRIO_PROCESS, 0, 5)) and refused(lambda: os.setresuid(0, 0, 0))
socket.socket(socket.AF_UNIX), socket.socket(socket.AF_INET)
'

# The main graph, as long as a person would look. Its report is what it got.
as_service sh -c '/opt/takt/takt run /opt/takt/graph/ace.yaml --policy deadline --for 5s --output out --report report.json
  code=$?
  cat report.json >&2
  exit $code' >"$work/run.out" 2>"$work/run.json"
code=$?
cat "$work/run.out"
[ $code -eq 0 ] || { grep -v '^[ {}]' "$work/run.json" | head -n 30; fail "exit $code under the unit's restrictions"; }
limited=1
[ "$(as_service sh -c 'ulimit -l')" = unlimited ] && limited=0 || echo "NOT RUN: CAP_IPC_LOCK given up; this container limits locked memory"
python3 - "$work/run.json" $limited <<'PY' || fail "the report of the service"
import json, sys
text = open(sys.argv[1]).read()
report = json.loads(text[text.index("{\n"):])
assert report["policy_granted"] == "deadline", report["policy_granted"]
assert all(n["granted"]["policy"] == "deadline" and n["granted"]["verified"] for n in report["nodes"])
refused = [line for line in report["adjusted"] if "cpu_dma_latency" not in line]  # root's, without the udev rule
assert not refused, refused
rights = {p["process"]: p for p in report["rights"]}
print(json.dumps(report["rights"]))
members = [p for p in report["rights"] if p["process"] not in ("supervisor", "nursery")]
assert len(members) >= 5 and all(p["threads"] > 1 for p in members), members
assert all(p["others"] == 0 for p in report["rights"])
limited = int(sys.argv[2])  # then each allocation needs the right to lock memory
assert all(p["lock_memory"] == (p["threads"] if limited else 0) for p in report["rights"]), rights
lanes = sum(1 for n in report["nodes"])
# A worker a lane at most, and one watchdog a process; the first thread and those of devices have none.
assert sum(p["real_time"] for p in members) <= lanes + len(members), members
assert rights["supervisor"]["real_time"] == 1 and rights["nursery"]["real_time"] == 1, rights
PY

# Its threads by name, who may speak to it, and SIGTERM to all of it, as `systemctl stop` sends it.
as_service sh -c '
  /opt/takt/takt run /opt/takt/graph/ace.yaml --policy deadline --for 0s --output out --report report.json >run.out 2>run.err &
  run=$!
  for i in $(seq 300); do /opt/takt/takt top --once >/dev/null 2>&1 && break; sleep 0.1; done
  sleep 1
  all="$run $(pgrep -P $run | tr "\n" " ")"
  for p in $all; do
    for t in /proc/$p/task/*/status; do
      echo $(sed -n "s/^Name:\t//p" /proc/$p/status) $(sed -n "s/^Name:\t//p; s/^CapPrm:\t//p" $t)
    done
  done >rights
  stat -c "%a %U" /run/takt /run/takt/*.sock >folder
  kill -TERM $all
  wait $run
  echo $? >code
  cat code rights folder run.out report.json run.err
' >"$work/stop.out" 2>&1
head -n 1 "$work/stop.out" | grep -qx "[01]" || { tail -n 40 "$work/stop.out"; fail "SIGTERM to all: $(head -n 1 "$work/stop.out")"; }
grep -qE "was ended by signal|is started again|did not end" "$work/stop.out" && fail "SIGTERM to all: a process did not end in order"
grep -q "ace on thesis" "$work/stop.out" && grep -q '"rights"' "$work/stop.out" || fail "SIGTERM to all: no summary, or no report"
grep -qx "750 nobody" "$work/stop.out" && grep -qx "660 nobody" "$work/stop.out" || fail "the folder of the sockets: $(grep nobody "$work/stop.out")"
# Nobody holds anything but CAP_SYS_NICE, bit 23; where locked memory is limited all have CAP_IPC_LOCK, bit 14, too.
[ $limited = 1 ] && lock=4 || lock=0
holders=$(grep -E ' [0-9a-f]{16}$' "$work/stop.out" | grep -v " 000000000000${lock}000$")
echo "$holders" | sort | uniq -c | sort -rn | head -n 40
echo "$holders" | grep -v " 000000000080${lock}000$" && fail "threads with rights that they do not need"
for name in takt-attach takt-write takt-rights watchdog-out takt-steal takt-probe; do
  echo "$holders" | grep -q " $name " && fail "$name has rights"
done

# Who may speak to the service: root and its group, and nobody else.
as() { setpriv --reuid="$1" --regid="$2" --clear-groups env -u XDG_RUNTIME_DIR HOME=/nonexistent TAKT_HOME="$work/program" "$work/program/takt" "${@:3}"; }
export -f as
export work
unshare --mount bash -c '
  mount -t tmpfs tmpfs /run && install -d -m 0750 -o 65534 -g 65534 /run/takt || exit 1
  mkdir -m 0777 "$work/served"
  as 65534 65534 run "$work/program/graph/lasers.yaml" --for 0s --policy cooperative --output "$work/served" >"$work/served/out" 2>&1 &
  for i in $(seq 300); do as 0 0 top --once >/dev/null 2>&1 && break; sleep 0.1; done
  as 0 0 top --once >/dev/null || exit 2
  as 12345 65534 top --once >/dev/null || exit 3
  as 12345 12345 top --once >/dev/null 2>&1 && exit 4
  as 12345 65534 stop >/dev/null || exit 5
  wait
' || fail "who may speak to the service: step $?"

# An ordinary user whose folder somebody else has taken: told by whom, and a folder of his own is found.
mkdir -m 0777 "$work/home" && chown 65534 "$work/home"
install -d -o 1 -m 0777 /tmp/takt.65534
setpriv --reuid=65534 --regid=65534 --clear-groups env -u XDG_RUNTIME_DIR HOME="$work/home" TAKT_HOME="$work/program" \
  "$work/program/takt" run "$work/program/graph/lasers.yaml" --for 1s --policy cooperative --output "$work/home/out" >"$work/taken" 2>&1
rm -rf /tmp/takt.65534
grep -q "adjusted: sockets lie in $work/home/.cache/takt/run: /tmp/takt.65534: belongs to user daemon (uid 1); its owner or root removes it" "$work/taken" ||
  { cat "$work/taken"; fail "a folder that another user has taken"; }
finish
