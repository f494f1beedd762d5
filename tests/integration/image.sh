# SPDX-License-Identifier: Apache-2.0
# takt image: bad input is refused with its name before anything begins; a disk is put together without root, twice the same, with each
# part where GRUB and the slots expect it; only a whole disk that nothing uses is written to. tests/image boots images.
source "$(dirname "$0")/lib.sh" "$@"
command -v openssl >/dev/null || { echo "NOT RUN: openssl is missing"; exit 77; }

expect 2 "argument command: invalid choice: 'buidl'" "$takt" image buidl
expect 2 "none.yaml cannot be read: No such file or directory" "$takt" image build --graph "$source/graph/lasers.yaml" --machine "$work/none.yaml"
printf 'takt: 1\nmachine: robot\ncores: {count: 2, isolate: [2]}\n' >"$work/machine.yaml"
expect 2 "machine.yaml:3:29: error: there is no CPU 2" "$takt" image build --graph "$source/graph/lasers.yaml" --machine "$work/machine.yaml" --output "$work/out"
printf 'takt: 1\nmachine: robot\n' >"$work/machine.yaml"
expect 2 "nobody could update this image: name a folder with --keys" "$takt" image build --graph "$source/graph/lasers.yaml" --machine "$work/machine.yaml" --output "$work/out"
expect 2 "a graph begins with" "$takt" image build --graph "$work/machine.yaml" --machine "$work/machine.yaml"
expect 0 "" "$takt" image keys "$work/keys"
[ "$(stat -c %a "$work/keys/update.key")" = 600 ] || fail "others can read the key"
expect 2 "is there already" "$takt" image keys "$work/keys"
mkdir "$work/debs"
touch "$work/debs/takt_1_amd64.deb"
expect 2 "should have one package each of takt, takt-ace; not so: takt-ace (0 files)" \
  "$takt" image build --graph "$source/graph/lasers.yaml" --machine "$work/machine.yaml" --keys "$work/keys" --packages "$work/debs" --output "$work/out"
expect 2 "is no disk" "$takt" image write "$work/machine.yaml" "$work/keys/update.pem"
expect 2 "/dev/none: No such file or directory" "$takt" image write "$work/machine.yaml" /dev/none

expect 2 "is a folder, a file is expected" "$takt" image run "$work/keys"
expect 2 "is no disk of" "$takt" image run "$work/machine.yaml"
expect 2 "is no update of" "$takt" image update robot "$work/keys/update.pem"
printf "hsqs" >"$work/update.raucb"
expect 3 "robot: no machine made by takt image" "$takt" image update robot "$work/update.raucb" --ssh false

disk() { # disk NAME: from a system that is none
  PYTHONPATH=$source/packaging/image PYTHONDONTWRITEBYTECODE=1 SOURCE_DATE_EPOCH=1 python3 -c '
import pathlib, sys
from takt_image import disk, tools
try: disk.build(pathlib.Path(sys.argv[1]), ["nohz_full=1"], pathlib.Path(sys.argv[2]), "robot/1")
except tools.Failure as failure: sys.exit(f"NOT RUN: {failure}" if "are missing" in str(failure) else str(failure))' "$work/system.img" "$work/$1.img"
}
head -c 3000000 /dev/urandom >"$work/system.img"
truncate -s 4M "$work/large.raw"
truncate -s 2M "$work/small.raw"
large=$(losetup --find --show "$work/large.raw" 2>/dev/null) && small=$(losetup --find --show "$work/small.raw" 2>/dev/null) && {
  expect 0 "written to $large and read back" "$takt" image write "$work/system.img" "$large" --yes
  cmp -n 3000000 "$work/system.img" "$work/large.raw" || fail "the disk does not hold the image"
  expect 2 "$small has 2 MB, the image 3" "$takt" image write "$work/system.img" "$small" --yes
  expect 1 "nothing was written" "$takt" image write "$work/system.img" "$large" </dev/null
  gzip -k "$work/system.img" && mv "$work/system.img.gz" "$work/system.xz"
  expect 2 "system.xz is damaged" "$takt" image write "$work/system.xz" "$large" --yes
} || echo "NOT RUN: losetup makes no disk here"
for device in $large $small; do losetup --detach "$device"; done
# Data of an earlier release are brought forward, and come back where that does not end well; those of a later one are refused.
machine=$work/machine_scripts
mkdir -p "$machine" "$work/share/migrate" "$work/data/machine"
for script in common data; do
  sed "s#/usr/libexec/takt/machine#$machine#g; s#/var/lib/takt#$work/data#g; s#/usr/share/takt/image#$work/share#g" \
    "$source/packaging/image/files/usr/libexec/takt/machine/$script" >"$machine/$script"
done
holds() { # KEPT FRESH: what lies there
  [ "$(cat "$work/data/maps/kept")" = "$1" ] || fail "kept is '$(cat "$work/data/maps/kept")', not '$1'"
  [ "$(cat "$work/data/fresh" 2>/dev/null)" = "$2" ] || fail "fresh is '$(cat "$work/data/fresh" 2>/dev/null)', not '$2'"
}
mkdir "$work/data/maps"
echo old >"$work/data/maps/kept"
echo 1 >"$work/data/machine/data_version"
echo 3 >"$work/share/data_version"
printf '%s\n' 'keep maps/kept fresh' "sed -i 's/^/new /' maps/kept" 'echo 1 >fresh' >"$work/share/migrate/1"
printf '%s\n' 'keep maps/kept' "sed -i 's/^/newer /' maps/kept" "echo 'no room' >&2" false 'echo after' >"$work/share/migrate/2"
expect 1 "the migration of data of version 2: no room" sh -c "sh $machine/data >&2"
holds old ""
sed -i /false/d "$work/share/migrate/2"
expect 0 "the data of version 2 are brought to 3" sh -c "sh $machine/data >&2"
holds "newer new old" 1
expect 0 "the data of version 1 are brought to 2" sh -c "sh $machine/data >&2"  # nobody has said that the release is good
holds "newer new old" 1
echo 1 >"$work/share/data_version"
expect 0 "" sh -c "sh $machine/data >&2"  # back at the old release
holds old ""
echo 2 >"$work/data/machine/data_version"
expect 1 "the data are of version 2, of a later release; this one reads 1" sh -c "sh $machine/data >&2"

if disk first 2>"$work/stderr"; then
  sleep 3  # FAT counts time in steps of two seconds
  disk second
  cmp "$work/first.img" "$work/second.img" || fail "two disks from one system differ"
  cmp -n 3000000 "$work/system.img" <(tail -c +$((64 * 1048576 + 1)) "$work/first.img") || fail "slot A does not hold the system"
  sfdisk --json "$work/first.img" | python3 -c '
import json, sys
parts = json.load(sys.stdin)["partitiontable"]["partitions"]
assert [p["name"] for p in parts] == ["ESP", "system-a", "system-b", "bios", "takt-data"], parts
assert parts[1]["start"] == 64 * 2048 and all(a["start"] % 2048 == 0 for a in parts), parts' || fail "its partitions"
  mtype -i "$work/first.img@@2M" ::grub/machine.cfg | grep -qx 'set machine_arguments="nohz_full=1"' || fail "the kernel's words of the machine"
  mdir -i "$work/first.img@@2M" ::EFI/BOOT | grep -q BOOTX64 || fail "nothing for UEFI"
else
  cat "$work/stderr"
  grep -q "NOT RUN" "$work/stderr" || fail "no disk"
  [ $failures -ne 0 ] || exit 77
fi
finish
