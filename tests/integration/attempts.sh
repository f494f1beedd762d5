# SPDX-License-Identifier: Apache-2.0
# attempts.sh SCRIPT ARGUMENTS... : for scripts that judge times on the machine as it is. A failed attempt is void if the
# host took CPU time meanwhile, and is repeated, up to twice; if the host took none, the code is at fault. Each failed
# attempt is shown.
host_took_ms() { awk '/^cpu /{print $9 * 10}' /proc/stat; }
for attempt in 1 2 3; do
  before=$(host_took_ms)
  bash "$@" && exit 0
  took=$(($(host_took_ms) - before))
  echo "attempt $attempt failed; the host took $took ms meanwhile"
  [ $took -gt 20 ] || exit 1
done
exit 1
