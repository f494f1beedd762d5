# SPDX-License-Identifier: Apache-2.0
# takt run --web: the page is there before the run, shows it, and goes with it, however it ends.
source "$(dirname "$0")/lib.sh" "$@"
[ -x "${takt%/*}/takt-web" ] || { echo "NOT RUN: takt-web is not built, since libwebsockets-dev is missing"; exit 77; }
port=$((20000 + $$ % 12000))  # below those that the kernel gives to clients
cp -r "$source/examples/fleet" "$work/"
echo "web: {port: $port, token_file: token}" >>"$work/fleet/fleet.yaml"
graph=$work/fleet/fleet.yaml

servers() { pgrep -fc "takt-web --with-run" || true; }
# gone: the server ends within two seconds.
gone() {
  for ((i = 0; i < 20; ++i)); do
    [ "$(servers)" = 0 ] && return
    sleep 0.1
  done
  fail "takt-web did not end with its run"
}
page() { python3 -c "import sys, urllib.request as r; sys.exit(b'page.js' not in r.urlopen('http://127.0.0.1:$port/', timeout=10).read())"; }

for isolate in none subsystem; do
  echo "=== --isolate $isolate"
  start_run $isolate "$graph" --web --for 0s --isolate $isolate
  said "#token=$(cat "$work/fleet/token")" "$work/$isolate.err" && said "Foxglove: ws://" "$work/$isolate.err"
  page || fail "the page"
  [ "$(servers)" = 1 ] || fail "$(servers) servers"
  pgrep -f "takt-web --with-run $run" -P $run && fail "the server is a child of the run, which waits for its children"
  end_run 0 1
  gone
done

echo "=== a run that is killed"
start_run killed "$graph" --web --for 0s
kill -9 $run
wait $run 2>/dev/null
gone

echo "=== what does not begin, begins nothing"
expect 2 "leave --web or --clock virtual out" "$takt" run "$graph" --web --clock virtual
sed 's/type: obstacle_stop/type: obstacle_stopp/' "$graph" >"$work/fleet/bad.yaml"
expect 2 "obstacle_stopp" "$takt" run "$work/fleet/bad.yaml" --web --for 1s
grep -q "#token=" "$work/stderr" && fail "a page of a graph that is refused"
sed 's/web: {.*/web: {certificate: none.pem}/' "$graph" >"$work/fleet/half.yaml"
expect 2 "they belong together" "$takt" check "$work/fleet/half.yaml"
sed 's/web: {.*/web: {address: 192.168.1.7}/' "$graph" >"$work/fleet/open.yaml"
expect 2 'which others reach; it needs `certificate` and `key`' "$takt" check "$work/fleet/open.yaml"
python3 -c "import socket, time; s = socket.socket(); s.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1); s.bind(('127.0.0.1', $port)); s.listen(); print('bound', flush=True); time.sleep(60)" >"$work/bound" &
holder=$!
said bound "$work/bound"
expect 3 "takt-web did not start" "$takt" run "$graph" --web --for 1s
kill $holder
wait $holder 2>/dev/null
gone
finish
