// SPDX-License-Identifier: Apache-2.0
// Objects that the robot knows, and itself, where they are: seen from above, x to the right, y up, a line each metre. A
// click in it names a place.
import { h, svg } from "./dom.ts";
import { fixed } from "./format.ts";
import type { Thing } from "./messages.ts";

const kMargin_m = 0.6;
const kRoom_m = 1.5; // about the robot
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

export interface Spot {
  x: number;
  y: number;
}

interface Frame {
  left: number;
  bottom: number;
  width: number;
  height: number;
}

export class NetworkPlan {
  readonly root = h("div", { class: "network-box" });
  private things: Thing[] = [];
  private robot: (Spot & { heading: number }) | null = null;
  private frame: Frame = { left: 0, bottom: 0, width: 1, height: 1 };
  private readonly mark = svg("path", { class: "robot", d: "M11 0L-7 7L-4 0L-7 -7Z" });

  /** Without `pick` it is looked at only. */
  constructor(private readonly pick: ((spot: Spot) => void) | null = null) {}

  show(things: Thing[]): void {
    this.things = things.filter((thing) => Number.isFinite(thing.x) && Number.isFinite(thing.y));
    this.draw();
  }

  /** `heading` from the x axis, counter-clockwise, in rad. Drawn anew only where it has left the picture. */
  move_robot(x: number, y: number, heading: number): void {
    if (![x, y, heading].every(Number.isFinite)) return;
    const known = this.robot !== null;
    this.robot = { x, y, heading };
    const { left, bottom, width, height } = this.frame;
    const inside = x > left && x < left + width && y > bottom && y < bottom + height;
    if (known && inside) this.place_robot();
    else this.draw();
  }

  private draw(): void {
    const room = this.robot ? [-kRoom_m, kRoom_m] : [];
    const [left, width] = span([...this.things.map((thing) => thing.x), ...room.map((m) => this.robot!.x + m)]);
    const [bottom, height] = span([...this.things.map((thing) => thing.y), ...room.map((m) => this.robot!.y + m)]);
    this.frame = { left, bottom, width, height };
    const scale = kWidth / width;
    const x = (m: number) => (m - left) * scale;
    const y = (m: number) => (bottom + height - m) * scale;
    const lines = [
      ...metres(left, width).map((m) => svg("path", { d: `M${x(m)} 0V${height * scale}` })),
      ...metres(bottom, height).map((m) => svg("path", { d: `M0 ${y(m)}H${kWidth}` })),
    ];
    const texts: Spot[] = [];
    const marks = this.things.map((thing) => mark_of(thing, x(thing.x), y(thing.y), texts));
    const picture = svg(
      "svg",
      {
        class: this.pick ? "network picks" : "network",
        viewBox: `0 0 ${kWidth} ${Math.max(height * scale, ...texts.map((text) => text.y + 2 * kText))}`,
        role: "img",
        "aria-label": `Where ${this.things.length} objects${this.robot ? " and the robot" : ""} are; the table has their places`,
        click: (event: MouseEvent) => this.choose(picture, event),
      },
      this.pick && svg("title", {}, "A click puts the place into the task"),
      svg("g", { class: "metres" }, ...lines),
      ...marks,
      this.robot && this.mark,
    );
    this.place_robot();
    this.root.replaceChildren(picture);
  }

  private place_robot(): void {
    if (!this.robot) return;
    const { left, bottom, width, height } = this.frame;
    const scale = kWidth / width;
    const degrees = (-this.robot.heading * 180) / Math.PI;
    const at = `${(this.robot.x - left) * scale} ${(bottom + height - this.robot.y) * scale}`;
    this.mark.setAttribute("transform", `translate(${at}) rotate(${degrees})`);
  }

  private choose(picture: SVGSVGElement, event: MouseEvent): void {
    const to_picture = picture.getScreenCTM()?.inverse();
    if (!to_picture) return;
    const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(to_picture);
    const { left, bottom, width, height } = this.frame;
    const spot = { x: left + (at.x * width) / kWidth, y: bottom + height - (at.y * width) / kWidth };
    if (at.x >= 0 && at.x <= kWidth && spot.y >= bottom) this.pick?.(spot);
  }
}

/** `texts`: where texts stand already; the new one goes below those that it would cover. */
function mark_of(thing: Thing, x: number, y: number, texts: Spot[]): SVGGElement {
  const right = x > 0.65 * kWidth;
  const at = { x: x + (right ? -8 : 8), "text-anchor": right ? "end" : "start" };
  let line = y + 4;
  while (texts.some((text) => Math.abs(text.x - at.x) < kWidth / 3 && Math.abs(text.y - line) < 2 * kText))
    line += kText;
  texts.push({ x: at.x, y: line });
  return svg(
    "g",
    {},
    svg("title", {}, `${title_of(thing)}, ${thing.type}, at ${fixed(thing.x, 2)} m, ${fixed(thing.y, 2)} m`),
    svg("circle", { cx: x, cy: y, r: 4.5 }),
    svg("text", { ...at, y: line }, title_of(thing)),
    svg("text", { ...at, y: line + kText, class: "state" }, states_of(thing).join(" ")),
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
