// SPDX-License-Identifier: Apache-2.0
// Log: events by kind and node, the newest at the end. It stays at the end while it is there.
import type { App, View } from "./app.ts";
import { card, h, set_text } from "./dom.ts";
import { count } from "./format.ts";
import type { LogEvent } from "./protocol.ts";
import { repaint } from "./repaint.ts";
import { kMostEvents } from "./store.ts";

const kKinds = ["fault", "mode", "mark", "outage", "parameter", "frozen", "log"];
const kMostRows = 500;

export class Log implements View {
  readonly name = "log";
  readonly title = "Log";
  readonly root: HTMLElement;
  private readonly list = h("ol", { class: "log", tabindex: 0, "aria-label": "Events" });
  private readonly node = h("select", { "aria-label": "Node", change: () => repaint(this.draw) });
  private readonly summary = h("p", { class: "quiet", role: "status" });
  private readonly off = new Set<string>();
  private visible = false;
  private readonly draw = () => this.update();

  constructor(private readonly app: App) {
    const chips = kKinds.map((kind) => {
      const box = h("input", { type: "checkbox", checked: true, change: () => this.switch_kind(kind, box.checked) });
      return h("label", { class: "chip" }, box, ` ${kind}`);
    });
    this.root = h(
      "div",
      { class: "view" },
      card("Log", h("div", { class: "tools" }, ...chips, h("label", {}, "Node ", this.node)), this.summary, this.list),
    );
    app.store.hello.on(() => this.build());
    app.store.events_came.on(() => this.visible && repaint(this.draw));
  }

  show(): void {
    this.visible = true;
    repaint(this.draw);
  }

  hide(): void {
    this.visible = false;
  }

  private build(): void {
    const chosen = this.node.value;
    const names = this.app.store.graph?.nodes.map((node) => node.name) ?? [];
    this.node.replaceChildren(
      h("option", { value: "" }, "all"),
      ...names.map((name) => h("option", { value: name, selected: name === chosen }, name)),
    );
    if (this.visible) repaint(this.draw);
  }

  private switch_kind(kind: string, on: boolean): void {
    if (on) this.off.delete(kind);
    else this.off.add(kind);
    repaint(this.draw);
  }

  private update(): void {
    const { events, events_dropped } = this.app.store;
    const fits = (event: LogEvent) =>
      !this.off.has(event.kind) && (this.node.value === "" || event.node === this.node.value);
    const chosen = events.filter(fits);
    const rows = chosen.slice(-kMostRows);
    const at_end = this.list.scrollHeight - this.list.scrollTop - this.list.clientHeight < 40;
    this.list.replaceChildren(...rows.map(row_of));
    if (rows.length === 0) this.list.append(h("li", { class: "quiet" }, "No such event yet."));
    if (at_end) this.list.scrollTop = this.list.scrollHeight;
    const hidden = chosen.length > rows.length ? `, the newest ${rows.length} of them shown` : "";
    const dropped =
      events_dropped > 0
        ? ` ${count(events_dropped)} older events were dropped: the page keeps ${count(kMostEvents)}.`
        : "";
    set_text(this.summary, `${count(chosen.length)} of ${count(events.length)} events${hidden}.${dropped}`);
  }
}

function row_of(event: LogEvent): HTMLElement {
  return h(
    "li",
    { class: `event ${event.kind} ${event.level ?? ""}` },
    h("span", { class: "num at" }, `${event.at_s.toFixed(2)} s`),
    h("span", { class: "event-kind" }, event.level ?? event.kind),
    h("span", { class: "event-node" }, event.node ?? ""),
    h("span", { class: "event-text" }, event.text),
  );
}
