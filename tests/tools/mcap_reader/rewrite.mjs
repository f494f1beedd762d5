// SPDX-License-Identifier: Apache-2.0
// rewrite.mjs RECORD FOLDER: the record once more for each way in which the reference writer of the format can write it,
// as FOLDER/CONTAINER-INDEX-SUMMARY-IDS-CRC.mcap; prints how many. Nothing of takt takes part.
import { writeFileSync } from "node:fs";
import { McapWriter } from "@mcap/core";
import zstd from "@foxglove/wasm-zstd";
import lz4 from "lz4js";
import { forEachRecord } from "./mcap_file.mjs";

const [source, folder] = process.argv.slice(2);
const containers = {
  loose: { useChunks: false },
  plain: {},
  lz4: { compressChunk: (data) => ({ compression: "lz4", compressedData: Uint8Array.from(lz4.compress(data)) }) },
  zstd: { compressChunk: (data) => ({ compression: "zstd", compressedData: zstd.compress(data) }) },
};
const none = { useMessageIndex: false, useChunkIndex: false, useAttachmentIndex: false, useMetadataIndex: false, useSummaryOffsets: false };
const indexes = { indexed: {}, bare: none };
const summaries = { full: {}, thin: { repeatSchemas: false, repeatChannels: false, useStatistics: false }, gone: {} };
const firstIds = { from0: 0, from9: 9 };
const kMagic = 8, kHead = 9, kChunk = 6, kAttachment = 9, kDataEnd = 15, kFooter = 2;

const records = [];
forEachRecord(source, (record) => records.push(record));

async function write(options) {
  const parts = [];
  let position = 0n;
  const writable = {
    position: () => position,
    write: async (bytes) => (parts.push(Buffer.from(bytes)), (position += BigInt(bytes.length))),
  };
  const writer = new McapWriter({ writable, chunkSize: 16384, ...options });
  await writer.start({ profile: "", library: "rewrite" });
  const schemas = new Map([[0, 0]]), channels = new Map();
  for (const record of records) {
    if (record.type === "Schema" && !schemas.has(record.id)) schemas.set(record.id, await writer.registerSchema(record));
    if (record.type === "Channel" && !channels.has(record.id))
      channels.set(record.id, await writer.registerChannel({ ...record, schemaId: schemas.get(record.schemaId) }));
    if (record.type === "Message") await writer.addMessage({ ...record, channelId: channels.get(record.channelId) });
    if (record.type === "Attachment") await writer.addAttachment(record);
    if (record.type === "Metadata") await writer.addMetadata(record);
  }
  await writer.addMetadata({ name: "of another program", metadata: new Map([["format", "77"]]) });
  await writer.addAttachment({ name: "note.txt", logTime: 0n, createTime: 0n, mediaType: "text/plain", data: Buffer.from("a note") });
  await writer.end();
  return Buffer.concat(parts);
}

/// Calls each(opcode, start, end) for every record of the file itself.
function walk(bytes, each) {
  for (let at = kMagic; at < bytes.length - kMagic; ) {
    const end = at + kHead + Number(bytes.readBigUInt64LE(at + 1));
    each(bytes[at], at, end);
    at = end;
  }
}

/// A CRC of 0 says that there is none.
function withoutCrcs(bytes) {
  walk(bytes, (op, at, end) => {
    if (op === kChunk) bytes.writeUInt32LE(0, at + kHead + 24);
    if (op === kAttachment || op === kDataEnd || op === kFooter) bytes.writeUInt32LE(0, end - 4);
  });
  return bytes;
}

function withoutSummary(bytes) {
  let dataEnd = 0;
  walk(bytes, (op, at, end) => (dataEnd = op === kDataEnd ? end : dataEnd));
  const footer = Buffer.alloc(kHead + 20);
  footer[0] = kFooter;
  footer.writeBigUInt64LE(20n, 1);
  return Buffer.concat([bytes.subarray(0, dataEnd), footer, bytes.subarray(0, kMagic)]);
}

/// Records of a kind that version 0 does not have, behind the header. (The CRC of the data section no longer fits.)
function withUnknown(bytes) {
  let header = 0;
  walk(bytes, (op, at, end) => (header ||= end));
  const unknown = Buffer.from([0x90, 3, 0, 0, 0, 0, 0, 0, 0, 1, 2, 3]);
  return Buffer.concat([bytes.subarray(0, header), unknown, unknown, bytes.subarray(header)]);
}

let count = 0;
for (const container of Object.keys(containers))
  for (const index of Object.keys(indexes))
    for (const summary of Object.keys(summaries))
      for (const ids of Object.keys(firstIds)) {
        const options = { ...containers[container], ...indexes[index], ...summaries[summary], startChannelId: firstIds[ids] };
        let bytes = await write(options);
        if (summary === "gone") bytes = withoutSummary(bytes);
        const name = `${folder}/${container}-${index}-${summary}-${ids}`;
        writeFileSync(`${name}-crc.mcap`, bytes);
        writeFileSync(`${name}-nocrc.mcap`, withoutCrcs(bytes));
        count += 2;
      }
writeFileSync(`${folder}/unknown.mcap`, withUnknown(withoutSummary(withoutCrcs(await write(containers.zstd)))));
console.log(count);
