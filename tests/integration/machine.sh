# SPDX-License-Identifier: Apache-2.0
# takt machine: a machine file shown, applied to a folder that is a system, undone; a wrong one refused.
source "$(dirname "$0")/lib.sh" "$@"
file=$source/packaging/machines/vision_pc.yaml

expect 0 "" "$takt" machine show "$file"
prints "vision-pc: kernel line: nohz_full=2-3 rcu_nocbs=2-3 irqaffinity=0-1"
prints "/etc/localtime -> /usr/share/zoneinfo/Europe/Berlin"
expect 0 "" "$takt" machine show "$file" --json
python3 -c '
import json, sys
shown = json.load(sys.stdin)
assert shown["kernel_arguments"][0] == "nohz_full=2-3", shown
assert any(f["path"] == "/etc/udev/rules.d/61-takt-machine.rules" and "takt/front_laser" in f["content"] for f in shown["files"]), shown
' <"$work/stdout" || fail "its JSON"

root=$work/root
mkdir -p "$root/etc/default"
touch "$root/etc/default/grub"
ln -s /usr/share/zoneinfo/UTC "$root/etc/localtime"
expect 0 "" "$takt" machine apply "$file" --root "$root"
prints "written  /etc/udev/rules.d/61-takt-machine.rules"
grep -q 'irqaffinity=0-1' "$root/etc/default/grub.d/61-takt-machine.cfg" || fail "the kernel's line is not where GRUB reads it"
if command -v systemd-tmpfiles >/dev/null; then
  mkdir -p "$root/sys/devices/system/cpu/cpu0/cpufreq"
  echo powersave >"$root/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor"
  systemd-tmpfiles --root="$root" --create "$root/etc/tmpfiles.d/61-takt-machine.conf" || fail "the file for tmpfiles.d"
  grep -q performance "$root/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor" || fail "tmpfiles.d does not set the governor"
fi
expect 0 "" "$takt" machine apply "$source/packaging/machines/qemu.yaml" --root "$root"
prints "restored /etc/localtime"
prints "removed  /etc/udev/rules.d/61-takt-machine.rules"
expect 0 "" "$takt" machine undo --root "$root"
[ "$(find "$root/etc" -type f | sort)" = "$root/etc/default/grub" ] || fail "undo left files: $(find "$root/etc" -type f)"
expect 0 "" "$takt" machine undo --root "$root"
prints "nothing was applied"

printf 'takt: 1\nmachine: robot\ncores: {count: 2, isolate: [2]}\ngovernor: fast\n' >"$work/wrong.yaml"
expect 2 "wrong.yaml:3:29: error: there is no CPU 2" "$takt" machine show "$work/wrong.yaml"
grep -q "wrong.yaml:4:.*performance" "$work/stderr" || fail "not every problem at once"
expect 2 "" "$takt" machine apply "$work/wrong.yaml" --root "$root"
[ -z "$(find "$root/etc" -name '61-takt*')" ] || fail "a wrong machine file was applied"
expect 2 "" "$takt" machine show "$work/none.yaml"
if [ "$(id -u)" != 0 ]; then expect 3 "" "$takt" machine apply "$file"; fi
finish
