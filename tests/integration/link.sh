# SPDX-License-Identifier: Apache-2.0
# A simulated robot and its client as two runs, over UDP and over a D-Bus of this test's own: the cup gets full, both runs end when told to. `takt robot`
# finds the run that has the client by itself.
source "$(dirname "$0")/lib.sh" "$@"

# comes_true SECONDS TEXT COMMAND... : until the command prints it.
comes_true() {
  local until=$((SECONDS + $1)) seconds=$1 text=$2
  shift 2
  while [ $SECONDS -lt $until ]; do
    "$@" >"$work/told" 2>&1 && grep -qF -- "$text" "$work/told" && return
    sleep 0.25
  done
  cat "$work/told"
  fail "'$text' is not told within $seconds s: ${*##*/}"
  return 1
}

# ends RUN NAME: told to stop it ends. A deadline that was missed on this machine is no verdict on the link, and is told.
ends() {
  expect 0 "" "$takt" stop --run "$1"
  wait "$1"
  local got=$?
  [ $got -eq 0 ] && return
  grep -F "deadline" "$work/$2.out" "$work/$2.err" | tail -n 3
  [ $got -eq 1 ] && return
  cat "$work/$2.out" "$work/$2.err"
  fail "the run $2 ended with $got"
}

# fills PROFILE: with everything over that driver.
fills() {
  start_run "simulator_$1" graph/simulator.yaml --profile "$1" --for 0s
  local simulator=$run
  expect 2 "the run has no node of type robot_client" "$takt" robot map
  start_run "client_$1" graph/remote_robot.yaml --profile "$1" --for 0s
  local client=$run
  comes_true 60 "IDLE" "$takt" echo robot_client.status --run "$client" &&
    expect 0 "" "$takt" robot task rotate 40deg &&
    comes_true 60 "cup_1" "$takt" robot map &&
    comes_true 60 "bottle_1" "$takt" robot map
  expect 2 "it knows:" "$takt" robot ask cup_9
  expect 0 "" "$takt" robot goal cup_1.level=full
  comes_true 180 "full" "$takt" robot ask cup_1.level
  comes_true 60 "IDLE" "$takt" echo robot_client.status --run "$client"
  comes_true 10 "empty" "$takt" robot ask bottle_1.level
  comes_true 10 "false" "$takt" robot ask bottle_1.closed
  if [ "$1" = udp ]; then
    start_run another graph/remote_robot.yaml --for 0s
    expect 3 "several running graphs have a robot; choose with --run: " "$takt" robot map
    expect 0 "" "$takt" robot --run "$client" map
    expect 3 "none of the graphs that run" "$takt" robot --node somebody map
    "$takt" stop --run $run
    wait $run  # the service keeps its first client: what becomes of this one does not count
  fi
  ends "$client" "client_$1"
  ends "$simulator" "simulator_$1"
}

cd "$source" || exit 1
expect 3 "no graph of this user is running" "$takt" robot map
fills udp
if command -v dbus-daemon >/dev/null; then
  coproc bus { exec dbus-daemon --session --nofork --nopidfile --print-address; }
  trap 'kill "$bus_PID"; rm -rf "$work"' EXIT
  read -r DBUS_SESSION_BUS_ADDRESS <&"${bus[0]}"
  export DBUS_SESSION_BUS_ADDRESS
  fills dbus
else
  echo "NOT RUN over D-Bus: no dbus-daemon; apt-get install dbus-daemon"
fi

finish
