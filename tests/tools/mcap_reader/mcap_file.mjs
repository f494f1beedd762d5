// SPDX-License-Identifier: Apache-2.0
// Every record of an MCAP file, by the reference reader of the format, with every CRC checked.
import { readFileSync } from "node:fs";
import { McapStreamReader } from "@mcap/core";
import zstd from "@foxglove/wasm-zstd";

await zstd.isLoaded;

/// Calls take(record) for each; an error if the file has no end or a CRC does not fit.
export function forEachRecord(file, take) {
  const reader = new McapStreamReader({
    validateCrcs: true,
    decompressHandlers: { zstd: (data, size) => zstd.decompress(data, Number(size)) },
  });
  const bytes = readFileSync(file);
  const step = 1 << 20;
  let ended = false;
  for (let at = 0; at < bytes.length; at += step) {
    reader.append(bytes.subarray(at, at + step));
    for (let record; (record = reader.nextRecord()); ) {
      ended ||= record.type === "Footer";
      take(record);
    }
  }
  if (!ended || !reader.done()) throw new Error(`${file} has no end`);
}
