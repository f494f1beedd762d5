// SPDX-License-Identifier: Apache-2.0
// Robot: whatever the graph's ports can show, each in a panel of its own. Looks only while it is in front.
import type { App, View } from "./app.ts";
import { h } from "./dom.ts";
import { Panel, type Screen } from "./panel.ts";
import type { Port, Way } from "./protocol.ts";
import { CloudScreen } from "./screen_cloud.ts";
import { PictureScreen } from "./screen_picture.ts";
import { GridScreen, PoseScreen, ScanScreen } from "./screen_plan.ts";
import { ValueScreen } from "./screen_value.ts";
import { Tasks } from "./tasks.ts";

const kMostPanels = 12;
const kWays: Way[] = ["picture", "disparity", "grid", "scan", "cloud", "pose", "value"];
// What one wants to see first as a value, by type of the message.
const kTelling = ["object_reports", "text_status", "stop_command"];

export class Robot implements View {
  readonly name = "robot";
  readonly title = "Robot";
  readonly root: HTMLElement;
  private readonly grid = h("div", { class: "panels" });
  private readonly more = h("select", { "aria-label": "Port to add" });
  private readonly note = h("span", { class: "quiet", role: "status" });
  private readonly tasks: Tasks;
  private panels: Panel[] = [];
  private visible = false;
  private built_for = "";

  constructor(private readonly app: App) {
    const add = h("button", { class: "small", click: () => this.add_chosen() }, "Add");
    this.tasks = new Tasks(app);
    this.root = h(
      "div",
      { class: "view" },
      this.tasks.root,
      h("div", { class: "tools add-panel" }, this.note, h("label", {}, "Panel ", this.more), add),
      this.grid,
    );
    app.store.hello.on(() => this.build());
    document.addEventListener("visibilitychange", () => this.run());
  }

  show(): void {
    this.visible = true;
    this.run();
  }

  hide(): void {
    this.visible = false;
    this.run();
  }

  /** Nobody looks: nothing is sent. */
  private run(): void {
    const on = this.visible && !document.hidden;
    on ? this.tasks.start() : this.tasks.stop();
    for (const panel of this.panels) on ? panel.start() : panel.stop();
  }

  /** The panels stay if the graph is the same one, also over a new run of it. */
  private build(): void {
    const graph = this.app.store.graph;
    if (!graph) return;
    const key = JSON.stringify(graph.ports);
    if (key === this.built_for) return;
    this.built_for = key;
    this.tasks.build();
    for (const panel of this.panels) panel.stop();
    this.panels = [];
    this.grid.replaceChildren();
    this.more.replaceChildren();
    for (const way of kWays) {
      const ports = this.app.store.ports_showing(way);
      if (ports.length === 0) continue;
      const [first] = this.by_rate(ports);
      this.more.append(
        h("optgroup", { label: way }, ...ports.map((port) => h("option", { value: `${way} ${port.name}` }, port.name))),
      );
      if (way !== "pose" && way !== "value") this.add(first!.name, way);
    }
    for (const type of kTelling) {
      const ports = this.by_rate(graph.ports.filter((port) => port.type === type && port.shows.includes("value")));
      const port = ports.find((candidate) => candidate.name.endsWith(".status")) ?? ports[0];
      if (port) this.add(port.name, "value");
    }
    this.run();
  }

  /** What comes most often is what the robot lives by. */
  private by_rate(ports: Port[]): Port[] {
    const rate = (port: Port) => this.app.store.producer(port.name)?.rate_hz ?? 0;
    return [...ports].sort((a, b) => rate(b) - rate(a));
  }

  private add_chosen(): void {
    const [way, port] = this.more.value.split(" ");
    if (way && port) this.open(port, way as Way);
  }

  /** Adds the panel, or moves to it if it is there. */
  open(port: string, way: Way): void {
    const there = this.panels.find((panel) => panel.port === port && panel.way === way);
    const panel = there ?? this.add(port, way);
    this.run();
    panel?.root.scrollIntoView({ block: "nearest" });
  }

  private add(port: string, way: Way): Panel | null {
    if (this.panels.length >= kMostPanels) {
      this.note.textContent = `At most ${kMostPanels} panels: close one first.`;
      return null;
    }
    const panel = new Panel(this.app, way, port, this.screen(port, way), this.app.store.ports_showing(way), (old) =>
      this.close(old),
    );
    this.panels.push(panel);
    this.grid.append(panel.root);
    return panel;
  }

  private close(panel: Panel): void {
    panel.stop();
    panel.root.remove();
    this.panels = this.panels.filter((other) => other !== panel);
    this.note.textContent = "";
  }

  private screen(port: string, way: Way): Screen {
    const type_of = (name: string) =>
      this.app.store.graph?.ports.find((candidate) => candidate.name === name)?.type ?? "";
    switch (way) {
      case "picture":
        return new PictureScreen(this.app, true);
      case "disparity":
        return new PictureScreen(this.app, false);
      case "grid":
        return new GridScreen(this.app);
      case "scan":
        return new ScanScreen();
      case "cloud":
        return new CloudScreen();
      case "pose":
        return new PoseScreen(type_of(port));
      case "value":
        return new ValueScreen(type_of);
    }
  }
}
