// SPDX-License-Identifier: Apache-2.0
// One panel of the robot view: looks at a port while it is shown, keeps the newest frame, draws at most once a frame.
import type { App } from "./app.ts";
import { count_drawn } from "./counters.ts";
import { h, set_text } from "./dom.ts";
import { fixed } from "./format.ts";
import type { Port, Way } from "./protocol.ts";
import { repaint } from "./repaint.ts";
import type { Seen } from "./link.ts";

/** What a kind of panel draws. */
export interface Screen {
  root: HTMLElement;
  /** Extra controls for the panel's head; may be absent. */
  tools?: HTMLElement;
  /** Takes the newest frame; false: it is not for this screen. */
  take(seen: Seen): boolean;
  /** Draws what was taken. A promise: the next drawing waits for it. */
  draw(): void | Promise<void>;
  start?(): void;
  stop?(): void;
}

const kMost_hz: Record<Way, number> = { picture: 15, disparity: 8, cloud: 5, scan: 15, grid: 5, pose: 15, value: 4 };

export class Panel {
  readonly root: HTMLElement;
  private readonly foot = h("p", { class: "panel-foot num" }, "nothing yet");
  private readonly choice: HTMLSelectElement;
  private leave: (() => void) | null = null;
  private newest: Seen | null = null;
  private dirty = false;
  private drawing = false;
  private shown = 0;
  private shown_since = performance.now();
  private rate = 0;
  private readonly paint = () => void this.draw();

  constructor(
    private readonly app: App,
    readonly way: Way,
    public port: string,
    private readonly screen: Screen,
    ports: Port[],
    close: (panel: Panel) => void,
  ) {
    this.choice = h("select", { "aria-label": `Port shown as ${way}`, change: () => this.change(this.choice.value) });
    for (const candidate of ports)
      this.choice.append(h("option", { value: candidate.name, selected: candidate.name === port }, candidate.name));
    const off = h(
      "button",
      { class: "small", "aria-label": `Close ${way} of ${port}`, title: "Close", click: () => close(this) },
      "×",
    );
    const head = h("header", {}, h("span", { class: "kind" }, way), this.choice, screen.tools, off);
    this.root = h(
      "section",
      { class: `panel ${way}`, "aria-label": `${way} of ${port}`, "data-way": way },
      head,
      screen.root,
      this.foot,
    );
  }

  private change(port: string): void {
    const running = this.leave !== null;
    this.stop();
    this.port = port;
    this.root.setAttribute("aria-label", `${this.way} of ${port}`);
    this.newest = null;
    set_text(this.foot, "nothing yet");
    if (running) this.start();
  }

  start(): void {
    if (this.leave) return;
    this.leave = this.app.link.look(this.port, this.way, kMost_hz[this.way], (seen) => this.take(seen));
    this.screen.start?.();
  }

  stop(): void {
    this.leave?.();
    this.leave = null;
    this.screen.stop?.();
  }

  private take(seen: Seen): void {
    if (!this.screen.take(seen)) return;
    this.newest = seen;
    this.dirty = true;
    repaint(this.paint);
  }

  /** One drawing at a time. What came meanwhile is drawn next: the newest, nothing in between. */
  private async draw(): Promise<void> {
    if (this.drawing || !this.dirty || !this.newest) return;
    this.dirty = false;
    this.drawing = true;
    const seen = this.newest;
    try {
      await this.screen.draw();
      this.tell(seen);
    } catch (problem) {
      set_text(this.foot, `cannot be shown: ${problem instanceof Error ? problem.message : String(problem)}`);
    } finally {
      this.drawing = false;
      if (this.dirty) repaint(this.paint);
    }
  }

  private tell(seen: Seen): void {
    const head = "frame" in seen ? seen.frame.header : seen.value;
    const received = "frame" in seen ? seen.frame.received_ms : seen.received_ms;
    const age = count_drawn(`${this.port}/${this.way}`, head.age_ms, received);
    ++this.shown;
    const since = performance.now() - this.shown_since;
    if (since > 1000) {
      this.rate = (1000 * this.shown) / since;
      this.shown = 0;
      this.shown_since = performance.now();
    }
    const level = head.level > 0 ? `, level ${head.level}` : "";
    set_text(
      this.foot,
      `${fixed(head.stamp_s, 2)} s, ${fixed(age, 0)} ms old, ${fixed(this.rate, 0)} a second${level}`,
    );
  }
}
