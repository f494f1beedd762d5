// SPDX-License-Identifier: Apache-2.0
// Objects that the robot knows, where they lie: seen from above, x to the right, y up, a line each metre.
import { svg } from "./dom.ts";
import { fixed } from "./format.ts";
import type { Thing } from "./messages.ts";

const kMargin_m = 0.6;
const kLeast_m = 2;
const kMostLines = 60;
const kWidth = 360; // of the picture; texts have their size in its units
const kText = 11;

/** What a thing is called beside its place. */
export function title_of(thing: Thing): string {
  return thing.name || `unnamed ${thing.type}`;
}

export function states_of(thing: Thing): string[] {
  return thing.attributes.map((attribute) => `${attribute.name}=${attribute.value}`);
}

export function network(things: Thing[]): SVGSVGElement {
  const placed = things.filter((thing) => Number.isFinite(thing.x) && Number.isFinite(thing.y));
  const [left, width] = span(placed.map((thing) => thing.x));
  const [bottom, height] = span(placed.map((thing) => thing.y));
  const scale = kWidth / width;
  const x = (m: number) => (m - left) * scale;
  const y = (m: number) => (bottom + height - m) * scale;
  const lines = [
    ...metres(left, width).map((m) => svg("path", { d: `M${x(m)} 0V${height * scale}` })),
    ...metres(bottom, height).map((m) => svg("path", { d: `M0 ${y(m)}H${kWidth}` })),
  ];
  const texts: { x: number; y: number }[] = [];
  const marks = placed.map((thing) => {
    const right = x(thing.x) > 0.65 * kWidth;
    const at = { x: x(thing.x) + (right ? -8 : 8), "text-anchor": right ? "end" : "start" };
    let line = y(thing.y) + 4;
    while (texts.some((text) => Math.abs(text.x - at.x) < kWidth / 3 && Math.abs(text.y - line) < 2 * kText))
      line += kText;
    texts.push({ x: at.x, y: line });
    return svg(
      "g",
      {},
      svg("title", {}, `${title_of(thing)}, ${thing.type}, at ${fixed(thing.x, 2)} m, ${fixed(thing.y, 2)} m`),
      svg("circle", { cx: x(thing.x), cy: y(thing.y), r: 4.5 }),
      svg("text", { ...at, y: line }, title_of(thing)),
      svg("text", { ...at, y: line + kText, class: "state" }, states_of(thing).join(" ")),
    );
  });
  return svg(
    "svg",
    {
      class: "network",
      viewBox: `0 0 ${kWidth} ${Math.max(height * scale, ...texts.map((text) => text.y + 2 * kText))}`,
      role: "img",
      "aria-label": `Where ${placed.length} objects lie; the table has their places`,
    },
    svg("g", { class: "metres" }, ...lines),
    ...marks,
  );
}

/** Where it begins and how much it is, with a margin. */
function span(values: number[]): [number, number] {
  if (values.length === 0) return [-kLeast_m / 2, kLeast_m];
  const least = Math.min(...values);
  const most = Math.max(...values);
  const wanted = Math.max(kLeast_m, most - least + 2 * kMargin_m);
  return [(least + most - wanted) / 2, wanted];
}

function metres(from: number, length: number): number[] {
  const step = Math.max(1, Math.ceil(length / kMostLines));
  const first = Math.ceil(from / step) * step;
  return Array.from(
    { length: Math.max(0, Math.floor((from + length - first) / step) + 1) },
    (_, i) => first + i * step,
  );
}
