#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# apart.sh [--first] SCRIPT TAKT SOURCE: runs an integration script as if it were alone on the machine, so that it may look for what a
# run leaves behind, or for every run there is, while other tests run: with its own processes, /tmp, /dev/shm and loopback
# network. That needs root's right to make namespaces. Without it, scripts started this way wait for one another.
# --first: on a processor before whatever runs next to it. For scripts that mostly wait, and fail if they are late.
# apart.sh --probe: exit 0 if the rights to both are there.
apart=$(realpath "${BASH_SOURCE[0]}")
first=(chrt --fifo 1)
separate=(unshare --mount --net --pid --fork --kill-child --mount-proc bash "$apart" --inside)

# Inside the namespaces. FOLDER holds the new /tmp; what the script needs of the old ones is shown there again.
if [ "${1:-}" = --inside ]; then
  folder=$2
  shift 2
  mkdir -p "$folder/tmp" "$folder/shm"
  chmod 1777 "$folder/tmp" &&
    mount -t tmpfs -o mode=1777 tmpfs "$folder/shm" || exit
  for path in "${@:2}" ${TAKT_DATA:+"$TAKT_DATA"}; do
    path=$(realpath "$path")
    [ -d "$path" ] || path=${path%/*}
    case $path in
      /tmp/*) place=$folder/tmp${path#/tmp} ;;
      /dev/shm/*) place=$folder/shm${path#/dev/shm} ;;
      *) continue ;;
    esac
    mkdir -p "$place" && mount --rbind "$path" "$place" || exit
  done
  mount --rbind "$folder/shm" /dev/shm && mount --rbind "$folder/tmp" /tmp || exit  # in this order: FOLDER is below /tmp
  python3 -c 'import fcntl, socket, struct; fcntl.ioctl(socket.socket(), 0x8914, struct.pack("16sH14x", b"lo", 0x41))' || exit
  unset TMPDIR
  "$@"  # no exec: this shell is process 1 there, and must wait for what lost its parent
  exit
fi

before=()
[ "${1:-}" != --first ] || { before=("${first[@]}"); shift; }
folder=$(mktemp -d -p /tmp)
trap 'rm -rf --one-file-system "$folder"' EXIT
if [ "${1:-}" = --probe ]; then
  "${first[@]}" "${separate[@]}" "$folder" true
elif "${before[@]}" "${separate[@]}" "$folder" true 2>/dev/null; then
  "${before[@]}" "${separate[@]}" "$folder" bash "$@"
else
  echo "NOT APART: no right to make namespaces; run as root. Scripts of this kind run one at a time"
  flock --close "$2" bash "$@"  # the command itself is the lock: it is there, and every user can read it
fi
