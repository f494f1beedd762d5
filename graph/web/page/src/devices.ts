// SPDX-License-Identifier: Apache-2.0
// Devices: how they are, what they have sent, and the faults of simulated ones and doubles as switches.
import { type App, guard, type View } from "./app.ts";
import { card, h, set_class, set_text, table, table_box } from "./dom.ts";
import { count, fixed } from "./format.ts";
import type { DeviceState } from "./protocol.ts";
import { repaint } from "./repaint.ts";

const kAgain_ms = 3000;
const kRateOver_s = 1.9;

interface Row {
  state: HTMLElement;
  cells: HTMLElement[];
  rate: HTMLElement;
  received: number;
  at_s: number;
}

interface Switchable {
  device: string;
  on: string;
  faults: string[];
}

export class Devices implements View {
  readonly name = "devices";
  readonly title = "Devices";
  readonly root: HTMLElement;
  private readonly body = h("tbody");
  private readonly faults = h("div", { class: "faults" });
  private readonly rows = new Map<string, Row>();
  private visible = false;
  private timer = 0;
  private shown_faults = "";
  private readonly draw = () => this.update();

  constructor(private readonly app: App) {
    const columns = ["Device", "State", ">Received", ">Rate Hz", ">Damaged", ">Missing", ">Resyncs", ">Losses"];
    this.root = h(
      "div",
      { class: "view" },
      h(
        "div",
        { class: "two" },
        card("Devices", table_box("Devices", table(columns, this.body))),
        card(
          "Faults",
          h("p", { class: "quiet" }, "Simulated devices and doubles fail on request, one fault at a time."),
          this.faults,
        ),
      ),
    );
    app.store.changed.on(() => this.visible && repaint(this.draw));
    app.store.hello.on(() => this.restart());
    app.store.events_came.on(() => this.visible && void this.ask());
  }

  show(): void {
    this.visible = true;
    repaint(this.draw);
    void this.ask();
    this.timer = setInterval(() => void this.ask(), kAgain_ms);
  }

  hide(): void {
    this.visible = false;
    clearInterval(this.timer);
  }

  private restart(): void {
    this.rows.clear();
    this.body.replaceChildren();
    this.shown_faults = "";
    if (this.visible) void this.ask();
  }

  private update(): void {
    const state = this.app.store.state;
    if (!state) return;
    for (const device of state.devices) this.show_device(device, state.running_s);
  }

  private show_device(device: DeviceState, now_s: number): void {
    const row = this.rows.get(device.name) ?? this.add_row(device, now_s);
    set_text(row.state, device.state);
    set_class(row.state, device.state === "ok" ? "pill good" : "pill bad");
    if (now_s - row.at_s >= kRateOver_s) {
      set_text(row.rate, fixed((device.received - row.received) / (now_s - row.at_s), 1));
      [row.received, row.at_s] = [device.received, now_s];
    }
    [device.received, device.damaged, device.missing, device.resyncs, device.losses].forEach((value, i) => {
      set_text(row.cells[i]!, count(value));
      set_class(row.cells[i]!, i === 0 ? "num" : value > 0 ? "num warn" : "num zero");
    });
  }

  private add_row(device: DeviceState, now_s: number): Row {
    const cells = Array.from({ length: 5 }, () => h("td", { class: "num" }));
    const row: Row = {
      state: h("span"),
      cells,
      rate: h("td", { class: "num" }, "–"),
      received: device.received,
      at_s: now_s,
    };
    const name = h("th", { scope: "row" }, device.name);
    this.body.append(
      h("tr", { "data-device": device.name }, name, h("td", {}, row.state), cells[0], row.rate, ...cells.slice(1)),
    );
    this.rows.set(device.name, row);
    return row;
  }

  /** An empty fault lists what there is. */
  private async ask(): Promise<void> {
    const answer = await this.app.link.ask({ do: "fault", device: "" });
    if (answer.error !== undefined) return this.say(answer.error);
    this.show_faults((answer["devices"] ?? []) as Switchable[]);
  }

  private say(text: string): void {
    this.shown_faults = "";
    this.faults.replaceChildren(h("p", { class: "quiet" }, text));
  }

  private show_faults(devices: Switchable[]): void {
    const now = JSON.stringify(devices);
    if (now === this.shown_faults) return;
    if (devices.length === 0) return this.say("No device of this run has faults to switch.");
    const focused = (document.activeElement as HTMLElement | null)?.dataset["fault"];
    this.faults.replaceChildren(...devices.map((device) => this.fault_row(device)));
    this.shown_faults = now;
    if (focused) this.faults.querySelector<HTMLElement>(`[data-fault="${focused}"]`)?.focus();
  }

  private fault_row(device: Switchable): HTMLElement {
    const error = h("p", { class: "error", role: "alert" });
    const switches = device.faults.map((fault) => {
      const on = device.on === fault;
      const toggle = h(
        "button",
        {
          class: "switch",
          role: "switch",
          "aria-checked": String(on),
          "data-fault": `${device.device}.${fault}`,
          click: async () => {
            const answer = await this.app.link.ask({ do: "fault", device: device.device, fault, on: !on });
            error.textContent = answer.error ?? "";
            void this.ask();
          },
        },
        h("span", { class: "knob", "aria-hidden": "true" }),
        fault.replace(/_/g, " "),
      );
      guard(this.app.store, toggle);
      return toggle;
    });
    return h(
      "div",
      { class: "fault-row", role: "group", "aria-label": `Faults of ${device.device}` },
      h("h3", {}, device.device),
      h("div", { class: "switches" }, ...switches),
      error,
    );
  }
}
