// SPDX-License-Identifier: Apache-2.0
// cdr.mjs CDR JSON: every message of an export as CDR, decoded by the definition that its schema states, against the same
// message of the export as JSON; pictures, which are JPEG in one and raw in the other, pixel by pixel. The definitions of
// Foxglove's schemas against those of its own package. Nothing of takt takes part.
// Prints, as JSON, how many messages of each schema were compared, and the largest mean difference of a picture.
import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";
import schemas from "@foxglove/schemas/internal.js";
import jpeg from "jpeg-js";
import { forEachRecord } from "./mcap_file.mjs";

const [cdrFile, jsonFile] = process.argv.slice(2);
const kMostMeanDifference = 6;  // of a picture, in steps of 1/255; that of a left and a right one must be larger

/// By topic and kind of schema: the messages in their order, the schema.
function read(file, messageEncoding, schemaEncoding) {
  const bySchema = new Map(), channels = new Map(), found = new Map();
  forEachRecord(file, (record) => {
    if (record.type === "Schema") bySchema.set(record.id, record);
    if (record.type === "Channel") channels.set(record.id, record);
    if (record.type !== "Message") return;
    const channel = channels.get(record.channelId), schema = bySchema.get(channel.schemaId);
    if (channel.messageEncoding !== messageEncoding || schema.encoding !== schemaEncoding)
      throw new Error(`${channel.topic}: ${channel.messageEncoding} with ${schema.encoding}`);
    if (!found.has(record.channelId)) found.set(record.channelId, { topic: channel.topic, schema, messages: [] });
    found.get(record.channelId).messages.push(record);
  });
  return [...found.values()];
}

const text = (bytes) => new TextDecoder().decode(bytes);

/// The members of a parsed definition without constants and comments.
function members(definitions, name) {
  const found = definitions.find((d) => d.name === name) ?? definitions.find((d) => d.name === undefined);
  return found.definitions.filter((m) => !m.isConstant).map((m) => {
    const inner = m.isComplex ? members(definitions, m.type) : m.type;
    return [m.name, inner, m.isArray ?? false, m.arrayLength ?? null];
  });
}

/// The definition of a schema of Foxglove is that of its package.
function sameDefinition(schema) {
  const name = schema.name.replace("foxglove_msgs/msg/", "");
  const theirs = schemas.generateRosMsgMergedSchema(schemas.foxgloveMessageSchemas[name], { rosVersion: 2 });
  const wanted = JSON.stringify(members(parse(theirs, { ros2: true })));
  const got = JSON.stringify(members(parse(text(schema.data), { ros2: true })));
  if (got !== wanted) throw new Error(`${schema.name} is\n${got}\ninstead of\n${wanted}`);
}

/// A name of a field as ROS 2 allows it.
const legal = (name) => name.toLowerCase().replace(/[^a-z0-9]+/g, "_");

let numbers = 0;
function same(where, got, wanted) {
  if (ArrayBuffer.isView(got) || Array.isArray(got)) {
    if (typeof wanted === "string") wanted = Buffer.from(wanted, "base64");
    if (wanted?.size !== undefined && wanted.first) wanted = wanted.first.flat();
    if (got.length !== wanted?.length) throw new Error(`${where}: ${got.length} elements instead of ${wanted?.length}`);
    for (let i = 0; i < got.length; ++i) same(where, got[i], wanted[i]);
  } else if (typeof got === "object") {
    const members = new Map(Object.entries(wanted).map(([name, value]) => [name === "nsec" ? "nanosec" : legal(name), value]));
    for (const [name, value] of Object.entries(got)) same(`${where}.${name}`, value, members.get(name === "nsec" ? "nanosec" : name));
    if (members.size !== Object.keys(got).length) throw new Error(`${where}: other members: ${[...members.keys()]}`);
  } else {
    const value = typeof got === "bigint" ? Number(got) : got;  // JSON has no whole numbers beyond 2^53 in this language
    const shown = typeof value === "number" && !Number.isFinite(value) ? null : value;  // nor infinity
    ++numbers;
    if (shown !== wanted && !(shown === 0 && wanted === 0)) throw new Error(`${where} is ${got} instead of ${wanted}`);
  }
}

/// Mean difference of a JPEG and raw pixels.
function difference(where, picture, raw) {
  const { width, height, data } = jpeg.decode(picture.data, { useTArray: true });
  if (width !== raw.width || height !== raw.height) throw new Error(`${where}: ${width} x ${height}`);
  const pixels = Buffer.from(raw.data, "base64"), channels = raw.encoding === "bgr8" ? 3 : 1;
  let sum = 0;
  for (let i = 0; i < width * height; ++i)
    for (let c = 0; c < channels; ++c) sum += Math.abs(data[4 * i + (channels === 3 ? 2 - c : 0)] - pixels[channels * i + c]);
  return sum / (width * height * channels);
}

const jsonChannels = read(jsonFile, "json", "jsonschema"), cdrChannels = read(cdrFile, "cdr", "ros2msg");
const bare = (name) => name.replace(/^.*[./]/, "").replace(/_/g, "").toLowerCase();
const kind = (channel) => `${channel.topic} ${bare(channel.schema.name).replace("compressedimage", "rawimage")}`;
const wanted = new Map(jsonChannels.map((channel) => [kind(channel), channel]));
const compared = {}, checked = new Set();
let worst = 0, least = Infinity;
for (const channel of cdrChannels) {
  const { topic, schema, messages } = channel, other = wanted.get(kind(channel));
  if (!other) throw new Error(`${topic}: JSON has no ${schema.name}`);
  wanted.delete(kind(channel));
  if (other.messages.length !== messages.length) throw new Error(`${topic}: ${messages.length} instead of ${other.messages.length}`);
  if (schema.name.startsWith("foxglove_msgs/") && !checked.has(schema.name)) sameDefinition(schema);
  checked.add(schema.name);
  const reader = new MessageReader(parse(text(schema.data), { ros2: true }));
  messages.forEach((record, i) => {
    const where = `${topic} ${i}`, json = JSON.parse(text(other.messages[i].data));
    if (record.logTime !== other.messages[i].logTime || record.publishTime !== other.messages[i].publishTime || record.sequence !== other.messages[i].sequence)
      throw new Error(`${where}: another time or sequence`);
    const message = reader.readMessage(record.data);
    if (schema.name.endsWith("/CompressedImage")) {
      same(where, message.timestamp, json.timestamp);
      same(where, message.frame_id, json.frame_id);
      worst = Math.max(worst, difference(where, message, json));
      if (topic.endsWith(".left")) {
        const right = wanted.get(`${topic.replace(/left$/, "right")} rawimage`);
        if (right) least = Math.min(least, difference(where, message, JSON.parse(text(right.messages[i].data))));
      }
    } else {
      same(where, message, json);
    }
    compared[schema.name] = (compared[schema.name] ?? 0) + 1;
  });
}
if (wanted.size > 0) throw new Error(`CDR lacks ${[...wanted.keys()]}`);
if (worst > kMostMeanDifference) throw new Error(`a picture differs by ${worst} in the mean`);
if (!(least > kMostMeanDifference)) throw new Error(`left and right pictures are alike, ${least}: nothing was compared`);
console.log(JSON.stringify({ compared, numbers, picture: worst, otherPicture: least }));
