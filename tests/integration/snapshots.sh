# SPDX-License-Identifier: Apache-2.0
# A replay that begins in the middle of a record goes on from what the nodes remembered: every byte again, and no node
# that does not declare it. With TAKT_SNAPSHOTS=all for all graphs that run without recordings, at more instants.
source "$(dirname "$0")/lib.sh" "$@"
cd "$source" || exit 1

# record GRAPH SECONDS OPTIONS...: of a run on virtual time, with every message. A scenario that is cut short may not end
# as it expects.
record() {
  local graph=$1 seconds=$2
  shift 2
  echo "=== $graph $*"
  "$takt" run "$graph" --clock virtual --for "${seconds}s" --record "$work/run.mcap" --record-port all \
    --output "$work/out" "$@" >"$work/run.txt" 2>&1
  [ $? -le 1 ] || fail "the run of $graph: $(cat "$work/run.txt")"
}

# goes_on FROM: a replay that begins there.
goes_on() {
  tells 0 " 0 differ" "$takt" replay "$work/run.mcap" --compare --from "$1" --output "$work/out"
  grep -q "nodes went on from a snapshot" "$work/stderr" || fail "no node went on from a snapshot at $1 s"
  ! grep "began without what they remember\|were not run\|cannot be" "$work/stderr" || fail "the replay from $1 s lacks something"
}

record graph/ace.yaml 9 --seed 3
for from in 2.5 5.3 8; do goes_on $from; done
record graph/ace.yaml 5 --seed 4 --durations random
goes_on 3.7

if [ "${TAKT_SNAPSHOTS:-}" = all ]; then
  for graph in graph/{ace,crossing,fine,lasers,people,simulator,yard}.yaml \
    tests/scenarios/{cup,cup_far,cup_seen,door,changed_state,hoover,mission,raw_cloud}.yaml; do
    for seed in 1 2 3; do
      for durations in "" "--durations random"; do
        record "$graph" 24 --seed $seed $durations
        for from in 3 7.1 11.6 16.2 21.3; do goes_on $from; done
      done
    done
  done
fi
finish
