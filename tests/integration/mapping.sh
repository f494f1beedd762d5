# SPDX-License-Identifier: Apache-2.0
# Scan matching as a user runs it, on generated scans.
source "$(dirname "$0")/lib.sh" "$@"

expect 0 "" "$takt" eval scan_matching --json --seed 3 --picture "$work/map.png"
at_most error_m 0.005
at_most error_deg 0.05
at_least within_95_pct 90
[ -s "$work/map.png" ] || fail "no picture of the map"
expect 2 "ends in .png" "$takt" eval scan_matching --picture "$work/map.none"
expect 2 "none.log cannot be read: No such file" "$takt" eval scan_matching --log "$work/none.log"
printf 'ODOM 0 0 0 0 0 0 1 host 1\n' >"$work/empty.log"
expect 2 "0 scans have a corrected pose" "$takt" eval scan_matching --log "$work/empty.log"

finish
