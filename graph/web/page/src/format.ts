// SPDX-License-Identifier: Apache-2.0
// Figures as text. Digits after the point do not change with the value, so that columns stay aligned.
import type { Maybe } from "./protocol.ts";

const kNone = "–";

export function known(value: Maybe<number>): value is number {
  return typeof value === "number" && Number.isFinite(value);
}

export function fixed(value: Maybe<number>, digits = 1): string {
  return known(value) ? value.toFixed(digits) : kNone;
}

export function ms(value: Maybe<number>): string {
  return known(value) ? `${value.toFixed(1)} ms` : kNone;
}

export function hertz(value: Maybe<number>): string {
  return known(value) ? `${Number(value.toFixed(2))} Hz` : "on data";
}

export function seconds(value: Maybe<number>, digits = 1): string {
  return known(value) ? `${value.toFixed(digits)} s` : kNone;
}

export function count(value: Maybe<number>): string {
  return known(value) ? String(value).replace(/\B(?=(\d{3})+(?!\d))/g, "\u202f") : kNone;
}

/** 3725 s as 1:02:05. */
export function clock(value: Maybe<number>): string {
  if (!known(value)) return kNone;
  const whole = Math.max(0, Math.floor(value));
  const two = (n: number) => String(n).padStart(2, "0");
  const hours = Math.floor(whole / 3600);
  return (
    (hours > 0 ? `${hours}:${two(Math.floor(whole / 60) % 60)}` : `${Math.floor(whole / 60)}`) + `:${two(whole % 60)}`
  );
}

/** A value of a message or parameter: up to six significant digits. */
export function plain(value: unknown): string {
  if (typeof value === "number") return Number.isInteger(value) ? String(value) : String(Number(value.toPrecision(6)));
  if (typeof value === "string") return value;
  if (value === null || value === undefined) return kNone;
  return JSON.stringify(value);
}

/** "0.2 m/s"; units that are none ("1", "path") are left out. */
export function with_unit(value: unknown, unit: string): string {
  const text = plain(value);
  return unit === "" || unit === "1" || unit === "path" ? text : `${text} ${unit}`;
}

export function clamp(value: number, least: number, most: number): number {
  return Math.min(most, Math.max(least, value));
}
