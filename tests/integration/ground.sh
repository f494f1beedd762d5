# SPDX-License-Identifier: Apache-2.0
# Ground and terrain as a user measures them, on generated pavements.
source "$(dirname "$0")/lib.sh" "$@"

expect 0 "" "$takt" eval ground --frames 8 --json --picture "$work/ground.png"
at_least precision_pct 95
at_least recall_pct 90
at_most turned_head_max_m 1e-6
[ -s "$work/ground.png" ] || fail "no picture of the ground"
expect 2 "belong together" "$takt" eval ground --images "$work"
expect 2 "valid are t_m" "$takt" eval ground --set t_x=1

# Learnt, written, read, learnt again: the same maps.
expect 0 "" "$takt" terrain learn --seed 5 --each 4 --measured "$work/measured.txt" --out "$work/terrain.txt"
expect 0 "" "$takt" terrain learn "$work/measured.txt" --out "$work/again.txt"
cmp -s "$work/terrain.txt" "$work/again.txt" || fail "maps learnt from a file are not those that were learnt when it was written"
expect 2 "cannot be read" "$takt" terrain learn "$work/none.txt" --out "$work/terrain.txt"
expect 0 "" "$takt" eval terrain --drives 1 --json --picture "$work/maps.png"
at_least right_pct 85
[ -s "$work/maps.png" ] || fail "no picture of the maps"

finish
