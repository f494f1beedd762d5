# SPDX-License-Identifier: Apache-2.0
# The mission asks its way on the robot's own screen: Chromium presses the buttons of the view Touch, the simulated robot drives,
# what it says comes out of espeak-ng as a WAV file with these words and no others, and the record repeats all of it.
source "$(dirname "$0")/lib.sh" "$@"
[ -x "${takt%/*}/takt-web" ] || { echo "NOT RUN: takt-web is not built, since libwebsockets-dev is missing"; exit 77; }
for program in node npm "${CHROMIUM:-/usr/bin/chromium}" /usr/bin/espeak-ng; do
  command -v "$program" >/dev/null || { echo "NOT RUN: needs node, npm, chromium and espeak-ng; there is no $program"; exit 77; }
done
cp -r "$source/tests/tools/web_client" "$work/client" && (cd "$work/client" && npm install --no-audit --no-fund >"$work/npm.txt" 2>&1) ||
  { echo "NOT RUN: the packages of npm: $(tail -n 1 "$work/npm.txt")"; exit 77; }

# The mission's own graph, with somebody at the screen in place of what is expected of its end.
graph=$source/tests/scenarios/.touch_page_$$.yaml
trap 'rm -f "$graph"' EXIT
python3 - "$source/tests/scenarios/mission.yaml" "$graph" "$work/said.wav" <<'PY'
import sys
text = open(sys.argv[1]).read()
for before, after in (
    ("profiles:\n", "  person: {kind: interaction, rate: 5, in: {speech: {from: mission.speech, depth: 4}}}\nprofiles:\n"),
    ("    eyes: {types", f"    person: {{driver: web, speech: espeak-ng, speech_to: {sys.argv[3]}}}\n    eyes: {{types"),
    ("mission.requests]\n    robot_client", "mission.requests, mission.speech]\n    robot_client"),
    ("        taken: robot_client.taken\n", "        taken: robot_client.taken\n        answers: person.task\n"),
    ("schedule: schedules/mission.yaml", "schedule: .touch_page_schedule.yaml"),
):
    assert text.count(before) == 1, before
    text = text.replace(before, after)
open(sys.argv[2], "w").write(text[:text.index("expect:")])
PY
schedule=$source/tests/scenarios/.touch_page_schedule_$$.yaml
trap 'rm -f "$graph" "$schedule"' EXIT
sed -i "s/.touch_page_schedule.yaml/${schedule##*/}/" "$graph"
sed 's/^policy: .*/policy: cooperative/; $a\  person: {rate: 5, budget: 2ms}' "$source/tests/scenarios/schedules/mission.yaml" >"$schedule"

port=$((20000 + $$ % 12000))  # below those that the kernel gives to clients
start_run mission "$graph" --isolate none --for 0s --record "$work/mission.mcap"
beside web "$takt" web --port $port
web=$!
said "#token=" "$work/web.out"
(cd "$work/client" && node touch.mjs "$(head -n 1 "$work/web.out")" "$work/touch.png") >"$work/touch.json" || fail "the screen"
cat "$work/touch.json"
kill $web
end_run 0 1

echo "=== the words are those of the robot, and those of the WAV file"
"$takt" log echo "$work/mission.mcap" mission.speech >"$work/speech"
python3 - "$work" "$source" <<'PY' || fail "what was said"
import json, subprocess, sys
work = sys.argv[1]
robot = [json.loads(line)["message"]["text"] for line in open(f"{work}/speech")]
seen = json.load(open(f"{work}/touch.json"))["said"]
print(robot)
rest = iter(robot)
assert all(words in rest for words in seen), (seen, robot)  # in this order
subprocess.run([sys.executable, f"{sys.argv[2]}/tests/integration/spoken.py", f"{work}/said.wav", *robot], check=True)
PY
[ "$(stat -c %s "$work/touch.png")" -gt 10000 ] || fail "the picture"
expect 0 "" "$takt" replay "$work/mission.mcap" --compare --output "$work/out"
prints " 0 differ"
finish
