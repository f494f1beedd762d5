// SPDX-License-Identifier: Apache-2.0
// Overview: the run in figures, the graph as it is drawn, the chosen node, chains, processes, all nodes.
import type { App, View } from "./app.ts";
import { Diagram } from "./diagram.ts";
import { card, h, set_class, set_text } from "./dom.ts";
import { clock, count, fixed, known } from "./format.ts";
import { NodePanel } from "./node_panel.ts";
import { ChainTable, NodeTable, ProcessTable } from "./overview_tables.ts";
import type { Graph, State } from "./protocol.ts";
import { repaint } from "./repaint.ts";

const kSteps = [0.5, 0.7, 0.85, 1, 1.25, 1.6];

export class Overview implements View {
  readonly name = "overview";
  readonly title = "Overview";
  readonly root: HTMLElement;
  private readonly figures = new Figures();
  private readonly diagram = new Diagram((node) => this.choose(node));
  private readonly panel: NodePanel;
  private readonly chains = new ChainTable();
  private readonly processes = new ProcessTable();
  private readonly nodes = new NodeTable((node) => this.choose(node));
  private readonly scroller: HTMLElement;
  private visible = false;
  private selected = -1;
  private zoom = 0; // 0: fits the width
  private readonly draw = () => this.update();

  constructor(private readonly app: App) {
    this.panel = new NodePanel(app);
    this.scroller = h("div", {
      class: "diagram-box",
      tabindex: 0,
      role: "region",
      "aria-label": "Picture of the graph",
    });
    this.scroller.append(this.diagram.root);
    const picture = card("Graph", this.tools(), h("div", { class: "with-side" }, this.scroller, this.panel.root));
    picture.classList.add("graph-card");
    this.root = h(
      "div",
      { class: "view" },
      this.figures.root,
      picture,
      h("div", { class: "two" }, card("Chains", this.chains.root), card("Processes", this.processes.root)),
      card("Nodes", this.nodes.root),
    );
    app.store.hello.on(() => this.build());
    app.store.changed.on(() => this.visible && repaint(this.draw));
    new ResizeObserver(() => this.scale()).observe(this.scroller);
  }

  private tools(): HTMLElement {
    const back = h("input", { type: "checkbox", change: () => this.diagram.show_all_edges(back.checked) });
    const tool = (label: string, title: string, click: () => void) =>
      h("button", { class: "small", title, "aria-label": title, click }, label);
    return h(
      "div",
      { class: "tools" },
      h(
        "label",
        { title: "Requests and edges that run from right to left; those of the chosen node are always drawn" },
        back,
        " feedback edges",
      ),
      tool("−", "Smaller", () => this.step(-1)),
      tool("+", "Larger", () => this.step(1)),
      tool("Fit", "Fit the width", () => this.fit()),
    );
  }

  show(): void {
    this.visible = true;
    repaint(this.draw);
  }

  hide(): void {
    this.visible = false;
  }

  private build(): void {
    const graph = this.app.store.graph;
    if (!graph) return;
    this.diagram.build(graph);
    this.chains.build(graph);
    this.nodes.build(graph);
    this.choose(this.selected < graph.nodes.length ? this.selected : -1);
    this.scale();
    repaint(this.draw);
  }

  private choose(node: number): void {
    this.selected = node === this.selected ? -1 : node;
    const states = this.app.store.state?.nodes ?? [];
    this.diagram.choose(this.selected, states);
    this.nodes.choose(this.selected);
    this.panel.choose(this.selected);
  }

  private fit(): void {
    this.zoom = 0;
    this.scale();
  }

  private step(by: number): void {
    const now = this.diagram.root.clientWidth / this.diagram.width;
    const wider = kSteps.find((step) => step > now + 0.01) ?? kSteps[kSteps.length - 1]!;
    const narrower = [...kSteps].reverse().find((step) => step < now - 0.01) ?? kSteps[0]!;
    this.zoom = by > 0 ? wider : narrower;
    this.scale();
  }

  /** Fits the width as long as the text stays readable; below that the box scrolls. */
  private scale(): void {
    if (this.diagram.width === 0) return;
    const room = this.scroller.clientWidth;
    const scale = this.zoom > 0 ? this.zoom : Math.min(1.15, Math.max(0.76, room / this.diagram.width));
    this.diagram.root.style.width = `${Math.floor(this.diagram.width * scale)}px`;
    this.diagram.root.style.height = `${Math.floor(this.diagram.height * scale)}px`;
  }

  private update(): void {
    const { graph, state } = this.app.store;
    if (!graph || !state) return;
    this.figures.update(graph, state);
    this.diagram.update(state.nodes);
    this.panel.update();
    this.chains.update(graph, state);
    this.processes.update(state);
    this.nodes.update(graph, state);
  }
}

/** The run in one line. */
class Figures {
  readonly root = h("dl", { class: "figures" });
  private readonly values = new Map<string, HTMLElement>();

  constructor() {
    for (const name of ["Mode", "Running", "CPU", "Memory", "Host stall", "Missed", "Skipped", "Late chains"]) {
      const value = h("dd", {}, "–");
      this.values.set(name, value);
      this.root.append(h("div", {}, h("dt", {}, name), value));
    }
  }

  private put(name: string, text: string, kind = ""): void {
    const value = this.values.get(name)!;
    set_text(value, text);
    set_class(value, kind);
  }

  update(graph: Graph, state: State): void {
    const sum = (of: (node: State["nodes"][number]) => number) =>
      state.nodes.reduce((total, node) => total + of(node), 0);
    const missed = sum((node) => node.deadline_misses);
    const skipped = sum((node) => node.skipped);
    const late = state.chains.filter((chain, i) => {
      const bound = graph.chains[i]?.bound_ms;
      return known(bound) && known(chain.age_max_ms) && chain.age_max_ms > bound;
    }).length;
    this.put("Mode", state.mode, state.mode === graph.modes[0] ? "" : "warn");
    this.put("Running", clock(state.running_s));
    this.put("CPU", `${fixed(state.cpu, 2)} of ${graph.cores.length} cores`);
    this.put("Memory", known(state.memory_mb) ? `${count(Math.round(state.memory_mb))} MB` : "–");
    this.put("Host stall", known(state.host_stall_ms) ? `${state.host_stall_ms} ms` : "–");
    this.put("Missed", count(missed), missed > 0 ? "bad" : "");
    this.put("Skipped", count(skipped), skipped > 0 ? "warn" : "");
    this.put("Late chains", String(late), late > 0 ? "bad" : "");
  }
}
