// SPDX-License-Identifier: Apache-2.0
// strangers.mjs HOST PORT SECONDS [SEED]: what takt web must refuse, then random frames for so long. Prints one JSON
// object; exit 1 if somebody was let in or the server is gone.
import { request } from "node:http";
import WebSocket from "ws";

const [host, port, seconds, seed] = process.argv.slice(2);
const protocols = ["takt.v1", "foxglove.sdk.v1", "foxglove.websocket.v1"];
const out = { refused: 0, let_in: [], frames: 0, closed: 0, connections: 0 };

let state = Number(seed ?? 1) >>> 0 || 1;
function chance(below) {
  state ^= state << 13;
  state ^= state >>> 17;
  state ^= state << 5;
  return (state >>> 0) % below;
}

function handshake(options, protocol) {
  return new Promise((done) => {
    const socket = new WebSocket(`ws://${host}:${port}/`, protocol === undefined ? [] : [protocol], options);
    socket.on("open", () => (socket.terminate(), done(true)));
    socket.on("error", () => done(false));
  });
}

function status(headers) {
  return new Promise((done) => {
    const asked = request({ host, port, path: "/", headers }, (answer) => (answer.resume(), done(answer.statusCode)));
    asked.on("error", () => done(0));
    asked.end();
  });
}

async function expectRefused(what, options, protocol) {
  if (await handshake(options, protocol)) out.let_in.push(what);
  else out.refused += 1;
}

const openers = [
  { op: "look", port: "head_camera.pair", as: "picture" },
  { op: "ask", id: 1, question: { do: "set", param: "cruise.speed", value: "0.1 m/s" } },
  { op: "token", token: "x" },
  { op: "subscribe", subscriptions: [{ id: 1, channelId: 1 }] },
  { op: "setParameters", parameters: [{ name: "cruise.speed", value: 0.1 }], id: "a" },
  { op: "getParameters", parameterNames: [], id: "a" },
];
const values = [null, true, -1, 1e300, "", "x".repeat(300), [], {}, [[[]]], "\u0000", { op: "look" }];

/// A text near the protocol, or bytes of any kind.
function frame() {
  if (chance(3) === 0) return Buffer.from(Array.from({ length: chance(200) }, () => chance(256)));
  const text = structuredClone(openers[chance(openers.length)]);
  const keys = Object.keys(text);
  if (chance(2)) text[keys[chance(keys.length)]] = values[chance(values.length)];
  let json = JSON.stringify(text);
  if (chance(4) === 0) json = json.slice(0, chance(json.length + 1));
  return json;
}

function stranger() {
  return new Promise((done) => {
    const socket = new WebSocket(`ws://${host}:${port}/`, [protocols[chance(3)]]);
    const finish = () => (clearTimeout(timer), socket.terminate(), done());
    const timer = setTimeout(finish, 2000);
    socket.on("error", () => {});
    socket.on("close", () => ((out.closed += 1), finish()));
    socket.on("open", () => {
      out.connections += 1;
      for (let i = 0; i < 20 && socket.readyState === WebSocket.OPEN; ++i) {
        socket.send(frame());
        out.frames += 1;
      }
      setTimeout(finish, 50);
    });
  });
}

for (const protocol of protocols) {
  await expectRefused(`${protocol} under a foreign name`, { headers: { Host: "evil.example" } }, protocol);
  await expectRefused(`${protocol} from a foreign page`, { headers: { Origin: "http://evil.example" } }, protocol);
  await expectRefused(`${protocol} from a page without a name`, { headers: { Origin: "null" } }, protocol);
}
await expectRefused("no sub-protocol", {}, undefined);
await expectRefused("a foreign sub-protocol", {}, "chat");
if ((await status({ Host: "evil.example" })) !== 403) out.let_in.push("the page under a foreign name");
if ((await status({})) !== 200) out.let_in.push("the page is not there");
const end = Date.now() + Number(seconds) * 1000;
while (Date.now() < end) await Promise.all([stranger(), stranger(), stranger()]);
if ((await status({})) !== 200) out.let_in.push("the server is gone");
console.log(JSON.stringify(out));
process.exit(out.let_in.length > 0 ? 1 : 0);
