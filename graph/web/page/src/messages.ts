// SPDX-License-Identifier: Apache-2.0
// Reads fields of messages that the page knows more about. Arrays come as {"size", "first": [...]}, a struct in them as
// the list of its scalars.
import type { ValueMessage } from "./protocol.ts";

export interface List {
  size: number;
  first: unknown[];
}

export function list_of(value: unknown): List {
  if (Array.isArray(value)) return { size: value.length, first: value };
  if (value === null || typeof value !== "object") return { size: 0, first: [] };
  const { size, first } = value as { size?: unknown; first?: unknown };
  const items = Array.isArray(first) ? first : [];
  return { size: typeof size === "number" ? size : items.length, first: items };
}

export function numbers_of(value: unknown): number[] {
  return Array.isArray(value) ? value.filter((item): item is number => typeof item === "number") : [];
}

/** Characters that came as their numbers, up to the first 0. */
export function text_of(value: unknown): string {
  if (typeof value === "string") return value.replace(/\0[^]*$/, "");
  const codes = numbers_of(value);
  const end = codes.indexOf(0);
  const bytes = Uint8Array.from(end < 0 ? codes : codes.slice(0, end));
  return new TextDecoder().decode(bytes);
}

/** Texts of `length` characters each that stand one after another. */
export function texts_of(value: unknown, length: number): string[] {
  if (typeof value === "string") return [text_of(value)];
  const codes = numbers_of(value);
  const texts: string[] = [];
  for (let at = 0; at < codes.length; at += length) texts.push(text_of(codes.slice(at, at + length)));
  return texts;
}

export interface Boxes {
  width: number;
  height: number;
  boxes: { class_id: number; x: number; y: number; width: number; height: number; score: number }[];
}

export function boxes_of(value: ValueMessage): Boxes {
  const message = value.message ?? {};
  const boxes = list_of(message["boxes"]).first.map((item) => {
    const [class_id = 0, x = 0, y = 0, width = 0, height = 0, score = 0] = numbers_of(item);
    return { class_id, x, y, width, height, score };
  });
  return { width: Number(message["image_width"] ?? 0), height: Number(message["image_height"] ?? 0), boxes };
}

export interface Thing {
  name: string;
  type: string;
  x: number;
  y: number;
  z: number;
  score: number;
  attributes: { name: string; value: string }[];
}

/** Objects of a semantic map (object_reports). Attributes of an object follow those of the object before. */
export function things_of(message: Record<string, unknown>): { things: Thing[]; of: number; in_map: boolean } {
  const names = list_of(message["names"]);
  const places = list_of(message["places"]).first;
  const attributes = list_of(message["attributes"]).first.map((item) => {
    const [name = "", value = ""] = texts_of(item, 32);
    return { name, value };
  });
  let at = 0;
  const things = names.first.map((item, i) => {
    const [name = "", type = ""] = texts_of(item, 32);
    const [x = 0, y = 0, z = 0, , score = 0, own = 0] = numbers_of(places[i]);
    const mine = attributes.slice(at, at + own);
    at += own;
    return { name, type, x, y, z, score, attributes: mine };
  });
  return { things, of: names.size, in_map: message["in_map"] === 1 };
}

/** Yaw of a pose about the vertical, counter-clockwise. */
export function yaw_of(qx: number, qy: number, qz: number, qw: number): number {
  return Math.atan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz));
}
