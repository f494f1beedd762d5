// SPDX-License-Identifier: Apache-2.0
// foxglove.mjs ws://HOST:PORT TOKEN SECONDS PARAM VALUE: follows every channel of takt web with Foxglove's own client and decoders,
// sets a parameter, calls services. Prints one JSON object: by topic the schema, messages, and of scans and disparities
// the hash of their numbers by stamp. A stamp in a message that is not that of its channel, or not of now, is a problem.
import { createHash } from "node:crypto";
import protocol from "@foxglove/ws-protocol";
import rosmsg from "@foxglove/rosmsg";
import serialization from "@foxglove/rosmsg2-serialization";
import WebSocket from "ws";

const { FoxgloveClient } = protocol; // these packages are CommonJS
const { parse } = rosmsg;
const { MessageReader } = serialization;

const [url, token, seconds, param, value] = process.argv.slice(2);
const out = { protocols: {}, topics: {}, hashes: {}, problems: [] };
const wait = (ms) => new Promise((done) => setTimeout(done, ms));

/// Resolves with the first event of that name that `fits`.
function next(client, name, fits = () => true) {
  return new Promise((done, fail) => {
    const timer = setTimeout(() => fail(new Error(`no ${name} within 10 s`)), 10000);
    const look = (event) => {
      if (!fits(event)) return;
      clearTimeout(timer);
      client.off(name, look);
      done(event);
    };
    client.on(name, look);
  });
}

function open(subProtocol, withToken) {
  const client = new FoxgloveClient({ ws: new WebSocket(withToken ? `${url}/?token=${token}` : url, [subProtocol]) });
  client.on("error", (error) => out.problems.push(String(error)));
  return client;
}

const numbersOf = (schema, message) =>
  schema.endsWith("/LaserScan") ? Float32Array.from(message.ranges) : message.encoding === "16UC1" ? message.data : undefined;

/// What is wrong with the stamps: of a message that has one, that of the channel.
function stampTrouble(message, channelStamp) {
  const away = Number(channelStamp) / 1e9 - Date.now() / 1e3;
  if (Math.abs(away) > 60) return `its channel is ${away} s from now`;
  const own = message.timestamp && BigInt(message.timestamp.sec) * 1000000000n + BigInt(message.timestamp.nanosec);
  return own !== undefined && own !== channelStamp ? `stamp ${own} in the message, ${channelStamp} of its channel` : undefined;
}

async function followAll() {
  const client = open("foxglove.sdk.v1", true);
  const info = next(client, "serverInfo");
  const services = next(client, "advertiseServices");
  const channels = await next(client, "advertise");
  out.server = await info;
  const readers = new Map();
  for (const channel of channels) {
    const reader = new MessageReader(parse(channel.schema, { ros2: true }));
    out.topics[channel.topic] = { schema: channel.schemaName, messages: 0 };
    readers.set(client.subscribe(channel.id), { channel, reader });
  }
  client.on("message", ({ subscriptionId, timestamp, data }) => {
    const { channel, reader } = readers.get(subscriptionId);
    try {
      const message = reader.readMessage(data);
      out.topics[channel.topic].messages += 1;
      const trouble = stampTrouble(message, timestamp);
      if (trouble) out.problems.push(`${channel.topic}: ${trouble}`);
      const numbers = numbersOf(channel.schemaName, message);
      if (numbers === undefined) return;
      const bytes = Buffer.from(numbers.buffer, numbers.byteOffset, numbers.byteLength);
      (out.hashes[channel.topic] ??= {})[String(timestamp)] = createHash("sha256").update(bytes).digest("hex").slice(0, 16);
    } catch (error) {
      out.problems.push(`${channel.topic}: ${error.message}`);
    }
  });
  await wait(Number(seconds) * 1000);

  const all = next(client, "parameterValues", (event) => event.id === "all");
  client.getParameters([], "all");
  out.parameters = (await all).parameters.length;
  const set = next(client, "parameterValues", (event) => event.id === "set");
  client.setParameters([{ name: param, value: Number(value) }], "set");
  out.set = (await set).parameters;

  const byName = Object.fromEntries((await services).map((service) => [service.name, service.id]));
  const call = async (name, request) => {
    const payload = new TextEncoder().encode(JSON.stringify(request));
    const answer = next(client, "serviceCallResponse");
    client.sendServiceCallRequest({ serviceId: byName[name], callId: 7, encoding: "json", data: new DataView(payload.buffer) });
    return JSON.parse(new TextDecoder().decode((await answer).data));
  };
  out.mark = await call("takt/mark", { words: "seen by foxglove" });
  out.no_mode = await call("takt/mode", { mode: "no such mode" });
  const graph = next(client, "connectionGraphUpdate");
  client.subscribeConnectionGraph();
  out.published = (await graph).publishedTopics.length;
  client.close();
}

/// The older sub-protocol, and a client without the token.
async function lookOnly() {
  const client = open("foxglove.websocket.v1", false);
  const channels = await next(client, "advertise");
  const scan = channels.find((channel) => channel.schemaName.endsWith("/LaserScan"));
  const message = next(client, "message");
  client.subscribe(scan.id);
  await message;
  const refused = next(client, "status");
  client.setParameters([{ name: param, value: Number(value) }], "set");
  out.refused = (await refused).message;
  out.protocols["foxglove.websocket.v1"] = true;
  client.close();
}

await followAll();
out.protocols["foxglove.sdk.v1"] = true;
await lookOnly();
console.log(JSON.stringify(out));
process.exit(0);
