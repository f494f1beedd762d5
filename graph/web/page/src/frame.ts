// SPDX-License-Identifier: Apache-2.0
// Reads a binary frame: length of the header (u32, little-endian), header as JSON, bytes.
import type { Frame, FrameHeader } from "./protocol.ts";

const decoder = new TextDecoder();

/** Null if the frame is damaged: then it is dropped and counted by the caller. */
export function read_frame(data: ArrayBuffer, received_ms: number): Frame | null {
  if (data.byteLength < 4) return null;
  const length = new DataView(data).getUint32(0, true);
  if (length > data.byteLength - 4) return null;
  try {
    const header = JSON.parse(decoder.decode(new Uint8Array(data, 4, length))) as FrameHeader;
    if (typeof header.port !== "string" || typeof header.kind !== "string") return null;
    return { header, bytes: new Uint8Array(data, 4 + length), received_ms };
  } catch {
    return null;
  }
}

/** A whole number of the header, 0 if it is missing or absurd. */
export function count_of(frame: Frame, name: string, most = 1 << 24): number {
  const value = frame.header[name];
  return typeof value === "number" && Number.isFinite(value) && value >= 0 && value <= most ? Math.floor(value) : 0;
}

export function number_of(frame: Frame, name: string, otherwise = 0): number {
  const value = frame.header[name];
  return typeof value === "number" && Number.isFinite(value) ? value : otherwise;
}

/** The bytes as numbers; the copy aligns them. */
export function floats_of(frame: Frame): Float32Array {
  const whole = frame.bytes.byteLength - (frame.bytes.byteLength % 4);
  return new Float32Array(frame.bytes.slice(0, whole).buffer);
}

export function cells_of(frame: Frame): Int16Array {
  const whole = frame.bytes.byteLength - (frame.bytes.byteLength % 2);
  return new Int16Array(frame.bytes.slice(0, whole).buffer);
}
