// SPDX-License-Identifier: Apache-2.0
// compare.mjs RECORD EXPORT: every number of every whole image, disparity, cloud, scan and grid of a record, read by the
// layout that its schema states, against the same message of its export, read as Foxglove's schemas say; of poses and
// texts that they are there; of every other type all fields, which the export has by name. Nothing of takt takes part.
// Prints how many numbers of each topic were compared; ends with an error at the first that differs.
import { forEachRecord } from "./mcap_file.mjs";

const [recordFile, exportFile] = process.argv.slice(2);
const kHeaderBytes = 8 + 8 + 8 + 8 + 4 + 1 + 8, kWholeAt = 36;
const scalars = {
  u8: [1, "getUint8"], i8: [1, "getInt8"], u16: [2, "getUint16"], i16: [2, "getInt16"], u32: [4, "getUint32"],
  i32: [4, "getInt32"], f32: [4, "getFloat32"], f64: [8, "getFloat64"], u64: [8, "getBigUint64"], i64: [8, "getBigInt64"],
};
const foxgloveNumbers = { 1: "u8", 2: "i8", 3: "u16", 4: "i16", 5: "u32", 6: "i32", 7: "f32", 8: "f64" };

function number(view, scalar, at) {
  return view[scalars[scalar][1]](at, true);
}

/// The fields of a recorded message; arrays as {scalar, width, view, at, size, fixed, text}.
function unpack(layout, data) {
  const view = new DataView(data.buffer, data.byteOffset, data.byteLength);
  const message = {};
  let at = kHeaderBytes;
  for (const field of layout.fields) {
    const bytes = scalars[field.scalar][0];
    if (field.array_of === undefined) {
      message[field.name] = field.count === 1 ? number(view, field.scalar, at) : { scalar: field.scalar, width: 1, view, at, size: field.count, fixed: true };
      at += field.count * bytes;
    } else {
      const size = view.getUint32(at, true);
      message[field.name] = { scalar: field.scalar, width: field.array_of, view, at: at + 4, size, text: field.text };
      at += 4 + size * field.array_of * bytes;
    }
  }
  if (at !== data.byteLength) throw new Error("a message is longer than its layout");
  return message;
}

function element(array, index, part) {
  return number(array.view, array.scalar, array.at + (index * array.width + part) * scalars[array.scalar][0]);
}

/// By topic: the messages of the export, in their order.
function readExport() {
  const topics = new Map(), messages = new Map();
  forEachRecord(exportFile, (record) => {
    if (record.type === "Channel") topics.set(record.id, record.topic);
    if (record.type !== "Message") return;
    const topic = topics.get(record.channelId);
    if (!messages.has(topic)) messages.set(topic, []);
    messages.get(topic).push(record.data);
  });
  return messages;
}

const exported = readExport(), taken = new Map(), compared = {};

function next(topic) {
  const index = taken.get(topic) ?? 0;
  taken.set(topic, index + 1);
  const data = exported.get(topic)?.[index];
  if (!data) throw new Error(`${topic}: the export has no message ${index}`);
  return JSON.parse(new TextDecoder().decode(data));
}

function same(topic, what, got, wanted) {
  if (!Object.is(got, wanted)) throw new Error(`${topic}: ${what} is ${got} instead of ${wanted}`);
  compared[topic] = (compared[topic] ?? 0) + 1;
}

/// Packed elements of an exported message as a function of element and field.
function packedElements(json, stride, fields) {
  const data = Buffer.from(json.data, "base64");
  const view = new DataView(data.buffer, data.byteOffset, data.byteLength);
  const read = (index, name) => {
    const field = fields.find((f) => f.name === name);
    return number(view, foxgloveNumbers[field.type], index * stride + field.offset);
  };
  return { count: data.byteLength / stride, read };
}

function image(topic, width, height, array, bytesEach) {
  const json = next(topic);
  same(topic, "width", json.width, width);
  same(topic, "height", json.height, height);
  const type = bytesEach === 2 ? 3 : 1;
  const pixels = packedElements(json, bytesEach, [{ name: "value", offset: 0, type }]);
  same(topic, "number of pixels", pixels.count, array.size * array.width);
  for (let i = 0; i < pixels.count; ++i) same(topic, `pixel ${i}`, pixels.read(i, "value"), element(array, i, 0) & (bytesEach === 2 ? 0xffff : 0xff));
}

const forms = {
  "takt.image": (topic, m) => image(topic, m.width, m.height, { ...m.pixels, width: 1 }, 1),
  "takt.stereo_pair": (topic, m) => {
    image(`${topic}.left`, m.width, m.height, { ...m.left, width: 1 }, 1);
    image(`${topic}.right`, m.width, m.height, { ...m.right, width: 1 }, 1);
  },
  "takt.disparity": (topic, m) => image(topic, m.width, m.height, m.disparity, 2),
  "takt.point_cloud": (topic, m) => {
    const json = next(topic);
    const points = packedElements(json, json.point_stride, json.fields);
    same(topic, "number of points", points.count, m.points.size);
    for (let i = 0; i < points.count; ++i) {
      ["x", "y", "z"].forEach((name, part) => same(topic, `point ${i}.${name}`, points.read(i, name), element(m.points, i, part)));
      if (i < m.colours.size)
        ["blue", "green", "red"].forEach((name, part) => same(topic, `point ${i}.${name}`, points.read(i, name), element(m.colours, i, part)));
    }
  },
  "takt.grid": (topic, m) => {
    const json = next(topic);
    same(topic, "width", json.column_count, m.width);
    same(topic, "cell", json.cell_size.x, m.cell_m);
    same(topic, "origin", json.pose.position.x, m.origin_x_m);
    const cells = packedElements(json, json.cell_stride, json.fields);
    same(topic, "number of cells", cells.count, m.cells.size);
    for (let i = 0; i < cells.count; ++i) same(topic, `cell ${i}`, cells.read(i, "occupancy"), element(m.cells, i, 0));
  },
  "takt.laser_scan": (topic, m) => {
    const json = next(topic);
    same(topic, "beams", json.ranges.length, m.range_m.size);
    json.ranges.forEach((range, i) => same(topic, `beam ${i}`, Math.fround(range), element(m.range_m, i, 0)));
  },
};

/// Poses and texts: what Foxglove's schemas say of them is more, and less, than the fields.
const onlyThere = new Set(["takt.pose", "takt.motion", "takt.odometry", "takt.text_status"]);

/// A number of JSON, which has no infinity and no NaN, against one of the record.
function sameNumber(topic, what, got, wanted) {
  const number = Number(wanted);
  same(topic, what, got, Number.isFinite(number) ? number : null);
}

/// A message by its own fields.
function ownFields(topic, message) {
  const json = next(topic);
  for (const [name, field] of Object.entries(message)) {
    const value = json[name];
    if (typeof field !== "object") sameNumber(topic, name, value, field);
    else if (field.text) {
      same(topic, name, value, new TextDecoder().decode(new Uint8Array(field.view.buffer, field.view.byteOffset + field.at, field.size)));
    } else {
      if (!field.fixed) same(topic, `${name}.size`, value.size, field.size);
      const elements = (field.fixed ? value : value.first).flat();
      same(topic, `numbers of ${name}`, elements.length, field.size * field.width);
      elements.forEach((got, i) => sameNumber(topic, `${name} ${i}`, got, element(field, Math.floor(i / field.width), i % field.width)));
    }
  }
}

const channels = new Map(), schemas = new Map();
forEachRecord(recordFile, (record) => {
  if (record.type === "Schema") schemas.set(record.id, record);
  if (record.type === "Channel") channels.set(record.id, record);
  if (record.type !== "Message") return;
  const channel = channels.get(record.channelId), schema = schemas.get(channel.schemaId);
  if (schema.encoding !== "json" || record.data[kWholeAt] === 0) return;  // jobs and events; by its hash
  if (schema.name === "takt.node_state") return;  // no export has it
  if (onlyThere.has(schema.name)) return void next(channel.topic);
  (forms[schema.name] ?? ownFields)(channel.topic, unpack(JSON.parse(new TextDecoder().decode(schema.data)), record.data));
});
for (const [topic, count] of taken)
  if (exported.get(topic).length !== count) throw new Error(`${topic}: the export has messages that the record has not`);
console.log(JSON.stringify(compared));
