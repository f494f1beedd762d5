// SPDX-License-Identifier: Apache-2.0
// lookers.mjs PORT CLIENTS STALLED SECONDS OUTPUT KIND: so many clients of takt web look at an output; the first STALLED of
// them shake hands and read nothing more. Prints what each received, as one JSON object.
import WebSocket from "ws";

const [port, clients, stalled, seconds, output, kind] = process.argv.slice(2);
const counts = [];
for (let i = 0; i < Number(clients); ++i) {
  const socket = new WebSocket(`ws://127.0.0.1:${port}/`, ["takt.v1"]);
  const count = { frames: 0, bytes: 0, state: 0, stalled: i < Number(stalled), closed: false };
  counts.push(count);
  socket.on("open", () => {
    socket.send(JSON.stringify({ op: "look", port: output, as: kind, most_hz: 60 }));
    if (count.stalled) setTimeout(() => socket._socket.pause(), 500);
  });
  socket.on("message", (data, binary) => {
    count.bytes += data.length;
    if (binary) count.frames += 1;
    else if (JSON.parse(data).op === "state") count.state += 1;
  });
  socket.on("close", () => (count.closed = true));
  socket.on("error", () => {});
}
setTimeout(() => {
  console.log(JSON.stringify(counts));
  process.exit(0);
}, Number(seconds) * 1000);
