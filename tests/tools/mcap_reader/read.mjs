// SPDX-License-Identifier: Apache-2.0
// read.mjs FILE: every channel of an MCAP file with its schema and number of messages, as JSON; ends with an error if a
// CRC does not fit, or if what the summary counts is not what is there.
import { forEachRecord } from "./mcap_file.mjs";

const channels = new Map(), schemas = new Map(), counts = new Map();
const found = { channels: {}, attachments: {}, metadata: {} };
let statistics;
forEachRecord(process.argv[2], (record) => {
  if (record.type === "Schema") schemas.set(record.id, record);
  if (record.type === "Channel") channels.set(record.id, record);
  if (record.type === "Message") counts.set(record.channelId, (counts.get(record.channelId) ?? 0) + 1);
  if (record.type === "Attachment") found.attachments[record.name] = record.data.byteLength;
  if (record.type === "Metadata") found.metadata[record.name] = record.metadata.size;
  if (record.type === "Statistics") statistics = record;
});
for (const [id, channel] of channels) {
  const count = counts.get(id) ?? 0;
  if (Number(statistics.channelMessageCounts.get(id) ?? 0n) !== count) throw new Error(`${channel.topic}: the summary is wrong`);
  found.channels[channel.topic] = { schema: schemas.get(channel.schemaId)?.name, encoding: channel.messageEncoding, messages: count };
}
console.log(JSON.stringify(found));
