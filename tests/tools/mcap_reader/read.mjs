// SPDX-License-Identifier: Apache-2.0
// read.mjs FILE: every channel of an MCAP file with its schema and number of messages, as JSON; ends with an error if a
// CRC does not fit, or if what the summary counts is not what is there. read.mjs FILE TOPIC N: message N (from 0) of
// that topic, decoded from JSON, byte fields as {bytes, sum}.
import { readFileSync } from "node:fs";
import { McapStreamReader } from "@mcap/core";
import zstd from "@foxglove/wasm-zstd";

await zstd.isLoaded;
const [file, topic, wanted] = process.argv.slice(2);
const reader = new McapStreamReader({
  validateCrcs: true,
  decompressHandlers: { zstd: (data, size) => zstd.decompress(data, Number(size)) },
});
const channels = new Map(), schemas = new Map(), counts = new Map();
const found = { attachments: {}, metadata: {} };
let statistics, message, ended = false;

function take(record) {
  if (record.type === "Schema") schemas.set(record.id, record);
  if (record.type === "Channel") channels.set(record.id, record);
  if (record.type === "Message") {
    const count = counts.get(record.channelId) ?? 0;
    counts.set(record.channelId, count + 1);
    if (topic === channels.get(record.channelId).topic && count === Number(wanted)) message = record;
  }
  if (record.type === "Attachment") found.attachments[record.name] = record.data.byteLength;
  if (record.type === "Metadata") found.metadata[record.name] = record.metadata.size;
  if (record.type === "Statistics") statistics = record;
  if (record.type === "Footer") ended = true;
}

const bytes = readFileSync(file);
const step = 1 << 20;
for (let at = 0; at < bytes.length; at += step) {
  reader.append(bytes.subarray(at, at + step));
  for (let record; (record = reader.nextRecord()); ) take(record);
}
if (!ended || !reader.done()) throw new Error("the file has no end");

if (topic) {
  if (!message) throw new Error(`no message ${wanted} of ${topic}`);
  const decoded = JSON.parse(new TextDecoder().decode(message.data));
  if (typeof decoded.data === "string") {
    const data = Buffer.from(decoded.data, "base64");
    decoded.data = { bytes: data.length, sum: data.reduce((sum, byte) => sum + byte, 0) };
  }
  console.log(JSON.stringify(decoded));
} else {
  const list = {};
  for (const [id, channel] of channels) {
    const count = counts.get(id) ?? 0;
    if (Number(statistics.channelMessageCounts.get(id) ?? 0n) !== count) throw new Error(`${channel.topic}: the summary is wrong`);
    list[channel.topic] = { schema: schemas.get(channel.schemaId)?.name, encoding: channel.messageEncoding, messages: count };
  }
  console.log(JSON.stringify({ channels: list, ...found }));
}
