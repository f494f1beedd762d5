# SPDX-License-Identifier: Apache-2.0
# Admission as a gate: check.sh TAKT SOURCE. The thesis's schedule is admitted on two cores, with overheads that are checked in
# here and not this machine's; a budget is admitted up to the margin that is told of it, and no further; each other answer has
# its exit code and says what would make it fit. Nothing runs, so no right is needed.
source "$(dirname "$0")/lib.sh" "$@"
export TAKT_MACHINE=$work/machine.json
cat >"$TAKT_MACHINE" <<'JSON'
{"machine": {"cpu": "any", "cores": 2, "kernel": "6.12.0 #1"}, "measured_at": "2026-11-20T08:00:00Z", "release_us": 60, "switch_us": 5,
 "publish_us": 2, "take_us": 1, "per_mb_us": 10, "enforcement_us": 4000, "demotion_us": 50, "tick_us": 4000, "deadline_bandwidth": 1.8}
JSON
if [ "$(cat /sys/devices/system/cpu/online)" != "0-1" ]; then
  echo "NOT RUN: the policy deadline takes all CPUs that are online, and these are not two"
  exit 0
fi
mkdir "$work/schedules"

# schedule NAME SED...: the thesis's schedule on two cores, each expression of which must change something.
schedule() {
  local file=$work/schedules/$1.yaml
  shift
  sed 's/^policy: deadline$/&\ncores: [0, 1]/' "$source/schedules/thesis.yaml" >"$file"
  for expression; do
    cp "$file" "$work/before"
    sed -i -E "$expression" "$file"
    cmp -s "$file" "$work/before" && fail "the edit $expression changed nothing"
  done
}
check() { # check EXIT SCHEDULE OPTIONS...: of ace; the answer as JSON in $work/stdout
  local code=$1 name=$2
  shift 2
  expect "$code" "" "$takt" check "$source/graph/ace.yaml" --schedule "$work/schedules/$name.yaml" --json "$@"
}
told() { # told EXPRESSION: of the last answer, as `a`
  python3 - "$work/stdout" "$1" <<'PY' || fail "not so: $1"
import json, sys
a = json.load(open(sys.argv[1]))
mode = {m["name"]: m for m in a["modes"]}
node = {n["name"]: n for n in a["nodes"]}
ok = eval(sys.argv[2])
if not ok:
    print(a["answer"], a["problems"], a.get("change"))
sys.exit(not ok)
PY
}

schedule thesis
check 0 thesis
told 'a["admitted"] and a["verdict"] == "Valid" and a["cores"] == 2 and a["overheads"]["measured"]'
told 'all(n["margin_ms"] > 0 and n["response_ms"] <= n["deadline_ms"] for n in a["nodes"])'
told 'all(c["within"] and c["bound_ms"] <= c["max_age_ms"] for c in a["chains"] + a["edges"])'
told 'set(mode) == {"full", "no_stereo", "laser_only", "safe_stop"} and all(m["answer"] == "admitted" for m in a["modes"])'
told 'all(m["change_within_ms"] == (501 if m["name"] == "full" else 451) for m in a["modes"])'  # 1 ms and the longest period or deadline
told '"change" not in a and 450 < a["bandwidth_within_ms"] < 500'
cp "$work/stdout" "$work/thesis.json"

# One percent less than its margin, one percent more: obstacle_stop (15 Hz, high), mapping_3d (2 Hz, low), stereo (most of the
# load), laser_fusion (on another one's output).
for node in obstacle_stop mapping_3d stereo laser_fusion; do
  for share in 0.99 1.01; do
    budget=$(python3 -c "
import json
n = {n['name']: n for n in json.load(open('$work/thesis.json'))['nodes']}['$node']
print(round((n['budget_ms'] + $share * n['margin_ms']) * 1000))")
    schedule margin "s/^(  $node: .*budget: )[0-9.]+(us|ms)/\1${budget}us/"
    check "$([ $share = 1.01 ] && echo 1 || echo 0)" margin
  done
  # Not proven; or the reservations no longer fit into what the kernel gives, which is as near.
  told 'a["answer"] == "not proven" or (a["answer"] == "infeasible" and "the kernel gives" in a["problems"][0])'
  told '"the smallest single change" in a["change"]'
done

# No scheduler could: more than two cores; a budget above its deadline.
schedule more 's/^(  stereo: .*budget: )16ms/\157ms/' 's/^(  ego_motion: .*budget: )11ms/\190ms/' 's/^(  traffic_signs: .*budget: )26ms/\1150ms/'
check 1 more
told 'a["answer"] == "infeasible" and any("budgets ask for" in p for p in a["problems"])'
schedule above 's/^(  obstacle_stop: .*budget: )2ms/\151ms/'
check 1 above
told 'a["answer"] == "infeasible" and "obstacle_stop: its budget of 51 ms is above its deadline of 38 ms" in a["problems"][0]'
told '"lower the budget of obstacle_stop" in a["change"]'
# With the change that is told it is admitted.
budget=$(python3 -c "import json, re; print(re.search(r'to ([0-9.]+) ms', json.load(open('$work/stdout'))['change']).group(1))")
schedule mended "s/^(  obstacle_stop: .*budget: )2ms/\1${budget}ms/"
check 0 mended

# The ages are no longer proven where a schedule makes data late, and what would do is told.
schedule late 's/^(  ground_map: .*deadline: )110ms/\1200ms, publish: let/'
check 1 late
told 'a["answer"] == "not proven" and any("chain ground: max_age" in p for p in a["problems"])'
told '"the smallest single change" in a["change"] and "raise the max_age of chain ground" in a["change"]'

# Invalid: SCHED_DEADLINE on one of the cores; an age that no execution meets.
schedule one 's/^cores: .*/cores: [0]/'
check 2 one
told 'a["verdict"] == "Invalid" and not a["admitted"] and "exclusive cpuset" in a["problems"][0]'
schedule apart 's/^(  obstacle_stop: .*offset: )40ms/\139ms/'
cp -r "$source"/graph/{worlds,rigs,objects,objects_3d.txt,terrain.txt,networks,signs,skeletons} "$work/schedules/"
sed -e '/^  # ACE itself/,/^    lines: /d' -e 's/\(to: obstacle_stop.stop, max_age: \)200ms/\15ms/' "$source/graph/ace.yaml" >"$work/schedules/ace.yaml"
expect 2 "" "$takt" check "$work/schedules/ace.yaml" --schedule "$work/schedules/apart.yaml" --json
told 'a["verdict"] == "Invalid" and any("even if every job took no time" in p for p in a["problems"])'

# Under fixed: admitted, with cores chosen or named; a core that the schedule does not have.
schedule fixed 's/^policy: deadline/policy: fixed/'
check 0 fixed
schedule named 's/^policy: deadline/policy: fixed/' 's/^(  stereo: \{rate: 15)/\1, core: 1/'
check 0 named
schedule none 's/^policy: deadline/policy: fixed/' 's/^(  stereo: \{rate: 15)/\1, core: 2/'
expect 2 "which is none of the schedule's; valid are: 0, 1" "$takt" check "$source/graph/ace.yaml" --schedule "$work/schedules/none.yaml"

# Each graph of the project is admitted in each of its profiles: an analysis that becomes stricter refuses none unnoticed.
walked=0
while read -r graph; do
  if [ ! -d "${TAKT_DATA:-$source/../shared/data}" ] && grep -q '\${TAKT_DATA' "$graph"; then
    echo "NOT RUN: $graph: there are no recordings (TAKT_DATA)"
    continue
  fi
  for profile in $(python3 -c "import sys; sys.path.insert(0, '$source/tests/tools'); import proof_rows; print(*proof_rows.profiles('$graph'))"); do
    chosen=()
    [ "$profile" = - ] || chosen=(--profile "$profile")
    "$takt" check "$graph" "${chosen[@]}" >"$work/stdout" 2>"$work/stderr"
    case $? in
      0) walked=$((walked + 1)) ;;
      3) echo "NOT RUN: $graph $profile: $(head -n 1 "$work/stderr")" ;;
      *) fail "$graph $profile: $(head -n 3 "$work/stdout" "$work/stderr")" ;;
    esac
  done
done < <(grep -rl --include='*.yaml' '^subsystems:' "$source"/{graph,tests,bench} | xargs grep -L '^plugins:')  # those: plugin.sh
echo "$walked graphs and profiles admitted"
[ $walked -ge 25 ] || fail "only $walked graphs were found"
finish
