// SPDX-License-Identifier: Apache-2.0
// Messages as readable values: known types as sentences, lists and tables, all others as a tree of their fields.
import { h, table, table_box } from "./dom.ts";
import { fixed, plain } from "./format.ts";
import type { Seen } from "./link.ts";
import { boxes_of, list_of, text_of, things_of } from "./messages.ts";
import { NetworkPlan, states_of, title_of } from "./network.ts";
import type { Screen } from "./panel.ts";
import type { ValueMessage } from "./protocol.ts";

const kDeepest = 6;
const kStopReasons = ["obstacle", "emergency-stop line", "scan lost", "line lost", "safe stop"];
const kActionStates = ["none", "under way", "done", "refused", "failed"];

export class ValueScreen implements Screen {
  readonly root = h("div", { class: "screen value-screen", tabindex: 0, role: "region", "aria-label": "Value" });
  private value: ValueMessage | null = null;
  private shown = "";

  constructor(private readonly type_of: (port: string) => string) {}

  take(seen: Seen): boolean {
    if (!("value" in seen)) return false;
    this.value = seen.value;
    return true;
  }

  draw(): void {
    if (!this.value) return;
    const now = JSON.stringify(this.value.message);
    if (now === this.shown) return; // what is selected in it stays selected
    this.shown = now;
    this.root.replaceChildren(show_message(this.type_of(this.value.port), this.value));
  }
}

export function show_message(type: string, value: ValueMessage): HTMLElement {
  const message = value.message ?? {};
  switch (type) {
    case "text_status":
      return h("pre", { class: "words" }, text_of(message["text"]) || "–");
    case "task":
      return h("pre", { class: "words" }, `${plain(message["number"])}: ${text_of(message["text"]) || "–"}`);
    case "object_reports":
      return show_things(message);
    case "stop_command":
      return show_stop(message);
    case "action_outcome":
      return h(
        "p",
        {},
        `action ${plain(message["number"])}: ${kActionStates[Number(message["state"])] ?? "?"} ${text_of(message["reason"])}`,
      );
    case "requests":
      return show_requests(message);
    case "detections":
      return show_boxes(value);
    default:
      return tree(message, 0);
  }
}

function show_things(message: Record<string, unknown>): HTMLElement {
  const { things, of, in_map } = things_of(message);
  const body = h("tbody");
  for (const thing of things) {
    body.append(
      h(
        "tr",
        {},
        h("th", { scope: "row" }, title_of(thing)),
        h("td", {}, thing.type),
        h("td", { class: "num" }, fixed(thing.x, 2)),
        h("td", { class: "num" }, fixed(thing.y, 2)),
        h("td", { class: "num" }, fixed(thing.z, 2)),
        h("td", { class: "num" }, `${fixed(100 * thing.score, 0)} %`),
        h("td", {}, states_of(thing).join(" ")),
      ),
    );
  }
  const plan = new NetworkPlan();
  plan.show(things);
  const note = `${things.length} of ${of} objects, in the frame of the ${in_map ? "map" : "robot"}`;
  return h(
    "div",
    {},
    plan.root,
    table_box("Objects", table(["Object", "Type", ">x m", ">y m", ">z m", ">Sure", "State"], body)),
    h("p", { class: "quiet" }, note),
  );
}

function show_stop(message: Record<string, unknown>): HTMLElement {
  const bits = Number(message["reasons"] ?? 0);
  const reasons = kStopReasons.filter((_, i) => ((bits >> i) & 1) === 1);
  const nearest = Number(message["nearest_m"] ?? 0);
  return h(
    "div",
    {},
    h(
      "p",
      {},
      h(
        "span",
        { class: bits === 0 ? "pill good" : "pill bad" },
        bits === 0 ? "drive on" : `stop: ${reasons.join(", ")}`,
      ),
    ),
    h("p", {}, nearest > 0 ? `nearest ${fixed(nearest, 2)} m` : "nothing in the protected area"),
    h("p", { class: "quiet" }, `scan ${fixed(Number(message["scan_age_s"] ?? 0) * 1000, 0)} ms old`),
  );
}

function show_requests(message: Record<string, unknown>): HTMLElement {
  const { first, size } = list_of(message["wanted"]);
  const rows = first.map((item) => {
    const codes = Array.isArray(item) ? (item as unknown[]) : [];
    const run = codes[30] === 1;
    const every = Number(codes[31] ?? 1);
    return h(
      "li",
      {},
      text_of(codes.slice(0, 30)),
      h("span", { class: "quiet" }, run ? (every > 1 ? ` every ${every}th release` : " runs") : " stopped"),
    );
  });
  return h(
    "div",
    {},
    h("ul", { class: "tree" }, ...rows),
    h("p", { class: "quiet" }, `${rows.length} of ${size} requests`),
  );
}

function show_boxes(value: ValueMessage): HTMLElement {
  const { boxes } = boxes_of(value);
  const rows = boxes.map((box) =>
    h(
      "li",
      {},
      `class ${box.class_id}, ${fixed(100 * box.score, 0)} %, at ${fixed(box.x, 0)} ${fixed(box.y, 0)}, ${fixed(box.width, 0)} × ${fixed(box.height, 0)} px`,
    ),
  );
  const all = list_of(value.message?.["boxes"]).size;
  return h(
    "div",
    {},
    h("ul", { class: "tree" }, ...rows),
    h("p", { class: "quiet" }, `${rows.length} of ${all} boxes`),
  );
}

/** Fields as a definition list; lists with how many there are. */
function tree(value: unknown, depth: number): HTMLElement {
  if (value === null || typeof value !== "object") return h("span", { class: "num" }, plain(value));
  if (depth >= kDeepest) return h("span", { class: "quiet" }, "…");
  if (Array.isArray(value)) {
    if (value.every((item) => typeof item !== "object"))
      return h("span", { class: "num" }, value.map(plain).join("  "));
    return h("ol", { class: "tree" }, ...value.map((item) => h("li", {}, tree(item, depth + 1))));
  }
  const record = value as Record<string, unknown>;
  if (typeof record["size"] === "number" && Array.isArray(record["first"]))
    return tree_list(record["size"], record["first"], depth);
  const rows = Object.entries(record).flatMap(([name, item]) => [
    h("dt", {}, name),
    h("dd", {}, tree(item, depth + 1)),
  ]);
  return h("dl", { class: "pairs tree" }, ...rows);
}

function tree_list(size: number, first: unknown[], depth: number): HTMLElement {
  const more = size > first.length ? h("span", { class: "quiet" }, ` first ${first.length} of ${size}`) : null;
  return h("span", {}, tree(first, depth + 1), more);
}
