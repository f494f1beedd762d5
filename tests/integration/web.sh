# SPDX-License-Identifier: Apache-2.0
# takt web: who is let in and who is not; each channel decoded by Foxglove's own programs, its numbers those of takt echo;
# the page in Chromium; and a run that does not notice its end.
source "$(dirname "$0")/lib.sh" "$@"
[ -x "${takt%/*}/takt-web" ] || { echo "NOT RUN: takt-web is not built, since libwebsockets-dev is missing"; exit 77; }
port=$((20000 + $$ % 12000))  # below those that the kernel gives to clients

# serve OPTIONS... : takt web in the background, its process in $web, the address to open in $address, the token in $token.
serve() {
  beside web "$takt" web --port $port "$@"
  web=$!
  said "#token=" "$work/web.out"
  address=$(head -n 1 "$work/web.out")
  token=${address##*=}
}
client() { (cd "$work/client" && node "$@"); }

echo "=== what it refuses to begin with"
expect 2 "belong together" "$takt" web --certificate "$source/README.md"
expect 2 "needs --certificate and --key" "$takt" web --address 0.0.0.0
expect 2 "fix: openssl req" "$takt" web --address 192.168.1.7
serve --token-file "$work/token"
[ "$(cat "$work/token")" = "$token" ] && [ "$(stat -c %a "$work/token")" = 600 ] || fail "the token's file"
expect 3 "fix: another --port" "$takt" web --port $port

echo "=== before there is a run, and with one"
python3 - $port "$source/graph/web/page/bundle" <<'PY' || fail "the page"
import http.client, sys
def get(path, **headers):
    connection = http.client.HTTPConnection("127.0.0.1", int(sys.argv[1]), timeout=10)
    connection.request("GET", path, headers=headers)
    answer = connection.getresponse()
    return answer.status, answer.getheader("content-security-policy"), answer.read()
status, policy, page = get("/")
assert status == 200 and b"page.js" in page, page
assert "default-src 'none'" in policy and "unsafe" not in policy, policy
for path, name in (("/", "index.html"), ("/page.js", "page.js"), ("/page.css", "page.css")):
    status, _, content = get(path)
    assert status == 200 and content == open(f"{sys.argv[2]}/{name}", "rb").read(), path  # and not of another version
for path in ("/../etc/passwd", "/page"): assert get(path)[0] == 404, path
assert get("/", Host="evil.example")[0] == 403
PY
start_run main --isolate subsystem --for 0s --report "$work/report.json"

if command -v node >/dev/null && command -v npm >/dev/null && cp -r "$source/tests/tools/web_client" "$work/client" &&
  (cd "$work/client" && npm install --no-audit --no-fund >"$work/npm.txt" 2>&1); then
  echo "=== strangers"
  client strangers.mjs 127.0.0.1 $port 5 $$ || fail "somebody was let in, or the server is gone"

  echo "=== Foxglove's client and decoders"
  for output in front_laser.scan stereo.disparity; do
    python3 - >"$work/$output" <<PY &  # as takt echo, but whole arrays
import json, socket
with socket.socket(socket.AF_UNIX) as connection:
    connection.connect("$XDG_RUNTIME_DIR/takt/$run.sock")
    lines = connection.makefile("rwb")
    lines.write(json.dumps({"do": "echo", "port": "$output", "items": 400000, "count": 60}).encode() + b"\n")
    lines.flush()
    for _ in range(60): print(lines.readline().decode(), end="")
PY
  done
  client foxglove.mjs ws://127.0.0.1:$port "$token" 5 mapping_3d.share 0.35 >"$work/foxglove.json" || fail "the client"
  wait $(jobs -p | grep -vx -e $web -e $run)
  python3 - "$work" <<'PY' || fail "what Foxglove sees"
import hashlib, json, struct, sys, time
since_1970_ns = time.time_ns() - time.monotonic_ns()
seen = json.load(open(f"{sys.argv[1]}/foxglove.json"))
assert not seen["problems"], seen["problems"][:3]
assert len(seen["topics"]) > 60 and seen["published"] > 60, len(seen["topics"])
schemas = {topic["schema"].split("/")[-1] for topic in seen["topics"].values() if topic["messages"] > 0}
assert {"CompressedImage", "RawImage", "LaserScan", "Grid", "PoseInFrame", "FrameTransform", "SceneUpdate"} <= schemas, schemas
assert seen["set"] == [{"name": "mapping_3d.share", "value": 0.35}], seen["set"]
assert seen["mark"]["ok"] and "error" in seen["no_mode"] and "token" in seen["refused"], seen
def same(output, numbers):
    hashes, compared = seen["hashes"][output], 0
    for line in open(f"{sys.argv[1]}/{output}"):
        message = json.loads(line)
        stamp_ns = message["stamp_ns"] + since_1970_ns
        told = [hash for stamp, hash in hashes.items() if abs(int(stamp) - stamp_ns) < 10_000_000]
        if not told: continue
        assert hashlib.sha256(numbers(message["message"])).hexdigest()[:16] == told[0], (output, message["stamp_ns"])
        compared += 1
    assert compared >= 3, (output, compared, len(hashes))
    print(f"{output}: {compared} messages equal those of takt echo")
same("front_laser.scan", lambda m: struct.pack(f"<{m['range_m']['size']}f", *m["range_m"]["first"]))
same("stereo.disparity", lambda m: struct.pack(f"<{m['disparity']['size']}H", *(d & 0xffff for d in m["disparity"]["first"])))
PY
  if [ -x "${CHROMIUM:-/usr/bin/chromium}" ]; then
    echo "=== the page"
    mkdir "$work/pictures"
    client page.mjs "$address" "$work/pictures" mapping_3d.share 0.4 >"$work/page.json" || fail "the page"
    cat "$work/page.json"
    "$takt" top --once --json --run $run | grep -q '"value":0.4' || fail "the parameter that the page set"
    grep -rq "0.4" "$work/state" || fail "the parameter that the page kept"
    [ "$(find "$work/pictures" -size +10k | wc -l)" = 8 ] || fail "eight pictures"
    echo "=== what the mark froze is fetched, and replayed in a page of its own"
    client replayed.mjs "$address" "$work/pictures" >"$work/replayed.json" || fail "the replay in the page"
    cat "$work/replayed.json"
    fetched=$(find "$work/pictures" -name '*.mcap')
    cmp "$fetched" "$work/main/flight/frozen/${fetched##*/}" || fail "the record that was fetched"
  else
    echo "NOT RUN: the page needs a browser: apt install chromium"
  fi
else
  echo "NOT RUN: Foxglove's programs need node, npm and its registry: $(tail -n 1 "$work/npm.txt" 2>/dev/null)"
fi

echo "=== its death changes nothing"
before=$("$takt" top --once --json --run $run | python3 -c 'import json, sys; print(sum(n["completed"] for n in json.load(sys.stdin)["nodes"]))')
kill -9 $web
wait $web 2>/dev/null
sleep 1
after=$("$takt" top --once --json --run $run | python3 -c 'import json, sys; print(sum(n["completed"] for n in json.load(sys.stdin)["nodes"]))')
[ "$after" -gt "$before" ] || fail "the run stands"
serve
if [ -d "$work/pictures" ]; then
  echo "=== a process that is killed comes back on the page, which stops the run"
  client end.mjs "$address" people >"$work/end.json" || { fail "the end in the page"; "$takt" stop --run $run; }
  cat "$work/end.json"
  wait $run
  [ $? -le 1 ] || fail "the run: $(tail -n 3 "$work/main.err")"
  python3 - "$work/end.json" "$work/report.json" <<'PY' || fail "the page's numbers are not the report's"
import json, sys
page, report = (json.load(open(name)) for name in sys.argv[1:])
assert page["restarts"] == sum(fault.get("kind") == "outage" and fault["process"] == "people" for fault in report["faults"]), report["faults"]
done = {node["name"]: node["completed"] for node in report["nodes"]}
assert len(page["done"]) >= 3, page
assert all(done[node] == count for node, count in page["done"].items()), (page, done)
PY
else
  end_run 0 1
fi
kill -TERM $web
wait $web || fail "takt web ended with $?"
finish
