# SPDX-License-Identifier: Apache-2.0
# The robot's own screen and loudspeaker: somebody answers over the attach socket, as the page of `takt web` does; the robot
# speaks into a WAV file; a killed process gives no answer twice; a replay repeats all of it.
source "$(dirname "$0")/lib.sh" "$@"

write_graph() { # FOLDER SETTINGS-OF-PERSON
  mkdir -p "$1"
  cat >"$1/kitchen.yaml" <<YAML
takt: 1
name: kitchen
schedule: schedule.yaml
default_profile: sim
devices:
  base: {kind: mobile_base, rate: 15, in: {velocity: {from: client.velocity, max_age: 300ms}}}
  person: {kind: interaction, rate: 5, in: {speech: {from: client.speech, depth: 4}}}
profiles:
  sim:
    base: {driver: sim, world: $source/graph/worlds/lab.xml, drive: command}
    person: {$2}
subsystems:
  mind:
    exports: [client.velocity, client.speech]
    client:
      type: robot_client
      in: {odometry: {from: base.odometry, max_age: 300ms}, task: person.task}
      params: {network: $source/graph/networks/kitchen.yaml}
YAML
  cat >"$1/schedule.yaml" <<YAML
takt: 1
name: kitchen
policy: cooperative
nodes:
  base: {rate: 15, budget: 1ms}
  person: {rate: 5, budget: 2ms}
  client: {rate: 15, offset: 5ms, budget: 20ms, criticality: high}
YAML
}

# answer DEVICE TEXT: on stdout what the run answers.
answer() {
  python3 - "$run" "$1" "$2" "$source/packaging/python/takt/live.py" <<'PY'
import importlib.util, sys
spec = importlib.util.spec_from_file_location("live", sys.argv[4])
live = importlib.util.module_from_spec(spec)
spec.loader.exec_module(live)
try:
    print(live.Connection(int(sys.argv[1])).ask(do="answer", device=sys.argv[2], text=sys.argv[3]))
except live.Error as refused:
    print("refused:", refused)
PY
}
answers() { # TEXT-EXPECTED DEVICE TEXT
  local got
  got=$(answer "$2" "$3")
  echo "--- answer $2 '$3': $got"
  [[ $got == *"$1"* ]] || fail "answered '$got' instead of '$1'"
}

echo "=== what is wrong is said before anything starts"
write_graph "$work/a" "driver: web, speech: espeak, speech_to: $work/a.wav"
expect 2 "use none, espeak-ng or double" "$takt" run "$work/a/kitchen.yaml" --for 1s --output "$work/out"
write_graph "$work/a" "driver: web, speech: espeak-ng, speech_to: $work/a.mp3"
expect 2 "ends with .wav" "$takt" run "$work/a/kitchen.yaml" --for 1s --output "$work/out"
write_graph "$work/a" "driver: web, voice: de"
expect 2 'there is `voice` and no `speech`' "$takt" run "$work/a/kitchen.yaml" --for 1s --output "$work/out"
write_graph "$work/a" "driver: web, speech: double, speech_to: $work/no/folder"
expect 2 "speech_to" "$takt" run "$work/a/kitchen.yaml" --for 1s --output "$work/out"
[ -x /usr/bin/espeak-ng ] || {
  write_graph "$work/a" "driver: web, speech: espeak-ng, speech_to: $work/a.wav"
  expect 3 "apt install espeak-ng" "$takt" run "$work/a/kitchen.yaml" --for 1s --output "$work/out"
}
[ ! -e "$work/a.wav" ] || fail "a run that never was left a WAV file"

dialogue() { # NAME ISOLATION: the robot client's, on the screen; what is said goes where $said_file says
  start_run "$1" "$work/$1/kitchen.yaml" --isolate "$2" --for 0s --record "$work/$1.mcap" --report "$work/$1.json"
  answers "'ok': True" person "tell cup_1.level=full"
  heard "I believe that cup_1.level=full"
  answers "'ok': True" person "goal cup_1.level=full"
  heard "goal cup_1.level=full: it is so already"
  answers "'ok': True" person "yes"
  heard '"yes" is no task'
  answers "refused: there is no device \`persn\`; did you mean \`person\`?" persn yes
  answers "refused: device base (kind mobile_base, driver sim) takes no answers: only those with the driver web do" base yes
  answers "refused: an answer has at most 127 bytes; this one to device person has 128" person "$(printf 'x%.0s' $(seq 128))"
  answers "refused: an answer to device person needs words" person ""
}
heard() { said "$1" "$said_file"; }

echo "=== the dialogue on the screen, spoken by the double; the process of the devices is killed"
write_graph "$work/double" "driver: web, speech: double, speech_to: $work/double.txt"
said_file=$work/double.txt
dialogue double subsystem
kill -KILL "$(member devices)"
said "process devices is back" "$work/double.err"
answers "'ok': True" person "drive 3 1"
answers "'ok': True" person "stop"
heard "I leave off: drive 3 1"
end_run 0 1
[ "$(grep -c "I believe that" "$said_file")" = 1 ] || fail "an answer was given twice: $(cat "$said_file")"
[ "$(grep -c 'is no task' "$said_file")" = 1 ] || fail "an answer was given again after the restart: $(cat "$said_file")"
grep -qEv '^[0-9]+\.[0-9]{3} s ' "$said_file" && fail "a line without its time: $(cat "$said_file")"
sort -n -c "$said_file" || fail "sentences are out of order"
for isolate in none subsystem; do
  expect 0 "" "$takt" replay "$work/double.mcap" --compare --isolate $isolate --output "$work/out"
  prints " 0 differ"
done
expect 0 "" "$takt" log info "$work/double.mcap"
prints " parameter" # the answers are events

echo "=== the same answers, spoken into a WAV file"
[ -x /usr/bin/espeak-ng ] || { echo "NOT RUN: espeak-ng is missing (apt install espeak-ng)"; [ $failures -eq 0 ] && exit 77; finish; }
write_graph "$work/wav" "driver: web, speech: espeak-ng, speech_to: $work/said.wav"
"$takt" run "$work/wav/kitchen.yaml" --isolate none --set person.voice=xx --for 1s --output "$work/out" 2>"$work/stderr"
[ $? = 2 ] && grep -q 'voice. is xx' "$work/stderr" || fail "an unknown voice: $(cat "$work/stderr")"
start_run wav "$work/wav/kitchen.yaml" --isolate none --for 0s --record "$work/wav.mcap" --report "$work/wav.json"
sentence() { # ANSWER BYTES: the file grows beyond these
  answers "'ok': True" person "$1"
  for ((i = 0; i < 600; ++i)); do [ "$(stat -c %s "$work/said.wav")" -gt "$2" ] && return; sleep 0.1; done
  fail "the robot does not speak"
}
sentence "tell cup_1.level=full" 0
sentence "goal cup_1.level=full" "$(stat -c %s "$work/said.wav")"
end_run 0 1
python3 "$source/tests/integration/spoken.py" "$work/said.wav" "I believe that cup_1.level=full" "goal cup_1.level=full: it is so already" ||
  fail "the WAV file is not what was said"
python3 - "$work/wav.json" <<'PY' || fail "what the device counted"
import json, sys
device = next(d for d in json.load(open(sys.argv[1]))["devices"] if d["name"] == "person")
assert device["received"] == 2 and device["unsent"] == 0 and device["trouble"] == "", device
PY
expect 0 "" "$takt" replay "$work/wav.mcap" --compare --output "$work/out"
prints " 0 differ"

echo "=== a script's tasks in virtual time, spoken by the double at its times"
write_graph "$work/virtual" "driver: sim, world: $source/graph/worlds/lab.xml, script: 1s tell cup_1.level=full; 3s goal cup_1.level=full, speech: double, speech_to: $work/virtual.txt"
sed -i 's/script: \(.*\), speech: double/script: "\1", speech: double/' "$work/virtual/kitchen.yaml"
expect 0 "" "$takt" run "$work/virtual/kitchen.yaml" --clock virtual --isolate none --for 6s --output "$work/out"
cat "$work/virtual.txt"
awk '$1 < 1 || $1 > 6 {exit 1}' "$work/virtual.txt" || fail "times of sentences"
grep -qE '^1\.[0-9]+ s I believe that cup_1.level=full$' "$work/virtual.txt" || fail "the first sentence"
grep -qE '^3\.[0-9]+ s goal cup_1.level=full: it is so already$' "$work/virtual.txt" || fail "the second sentence"
finish
