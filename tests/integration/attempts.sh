# SPDX-License-Identifier: Apache-2.0
# attempts.sh SCRIPT ARGUMENTS... : up to three times, for scripts that judge times: a host that takes the CPUs away for a
# moment is no fault of the code, a fault of the code fails every time. Each failed attempt is shown.
for attempt in 1 2 3; do
  bash "$@" && exit 0
  echo "attempt $attempt failed (time taken by the host so far: $(awk '/^cpu /{print $9 * 10}' /proc/stat) ms)"
done
exit 1
