// SPDX-License-Identifier: Apache-2.0
// The chosen node: its schedule, its figures, its inputs and outputs, with buttons that look at an output.
import type { App } from "./app.ts";
import { h, set_class, set_text } from "./dom.ts";
import { count, hertz, known, ms } from "./format.ts";
import { above_proof, health, level_text } from "./node_health.ts";
import type { GraphNode, NodeState, Way } from "./protocol.ts";

export class NodePanel {
  readonly root = h("aside", { class: "node-panel", "aria-label": "Chosen node", "aria-live": "off" });
  private index = -1;
  private values = new Map<string, HTMLElement>();

  constructor(private readonly app: App) {
    this.choose(-1);
  }

  choose(index: number): void {
    this.index = index;
    this.values = new Map();
    const node = this.app.store.graph?.nodes[index];
    this.root.classList.toggle("empty", !node);
    if (!node) {
      this.root.replaceChildren(h("p", { class: "quiet" }, "Choose a node to see its ports and figures."));
      return;
    }
    this.root.replaceChildren(
      h("h3", {}, node.name),
      h(
        "p",
        { class: "quiet" },
        `${node.device ? "device, " : ""}${node.type === node.name ? "" : `${node.type}, `}process ${node.process}, ${node.criticality} criticality`,
      ),
      this.figures(),
      h("h4", {}, "Inputs"),
      this.inputs(node),
      h("h4", {}, "Outputs"),
      this.outputs(node),
      h("button", { class: "small", click: () => this.app.open("parameters") }, "Parameters"),
    );
    this.update();
  }

  private figures(): HTMLElement {
    const list = h("dl", { class: "pairs" });
    for (const name of [
      "Rate",
      "Deadline",
      "Execution",
      "Budget",
      "Response",
      "Longest",
      "Proven",
      "Completed",
      "Missed",
      "Skipped",
      "Paused",
      "Overruns",
      "Level",
    ]) {
      const value = h("dd", {}, "–");
      this.values.set(name, value);
      list.append(h("dt", {}, name), value);
    }
    return list;
  }

  private inputs(node: GraphNode): HTMLElement {
    if (node.inputs.length === 0) return h("p", { class: "quiet" }, "none");
    const rows = node.inputs.map((input) =>
      h(
        "li",
        {},
        h("span", { class: "port" }, input.name),
        h("span", { class: "quiet" }, " from "),
        this.port_row(input.from),
      ),
    );
    return h("ul", { class: "ports" }, ...rows);
  }

  private outputs(node: GraphNode): HTMLElement {
    if (node.outputs.length === 0) return h("p", { class: "quiet" }, "none");
    return h("ul", { class: "ports" }, ...node.outputs.map((port) => h("li", {}, this.port_row(port))));
  }

  private port_row(name: string): HTMLElement {
    const port = this.app.store.graph?.ports.find((candidate) => candidate.name === name);
    const ways = (port?.shows ?? []).filter((way) => way !== "value" || port!.shows.length === 1);
    const buttons = ways.map((way) =>
      h(
        "button",
        {
          class: "small look",
          "aria-label": `look: ${way} of ${name}`,
          click: () => this.app.look_at(name, way as Way),
        },
        `look: ${way}`,
      ),
    );
    return h("span", { class: "port-row" }, h("span", { class: "port" }, name), ...buttons);
  }

  update(): void {
    const node = this.app.store.graph?.nodes[this.index];
    const state = this.app.store.node_state(this.index);
    if (node && state) this.show(node, state);
  }

  private show(node: GraphNode, state: NodeState): void {
    const put = (name: string, text: string, kind = "") => {
      set_text(this.values.get(name)!, text);
      set_class(this.values.get(name)!, kind);
    };
    const over = known(state.exec_ms) && known(node.budget_ms) && state.exec_ms > node.budget_ms;
    put("Rate", hertz(node.rate_hz));
    put("Deadline", ms(node.deadline_ms));
    put("Execution", ms(state.exec_ms), over ? "warn" : "");
    put("Budget", ms(node.budget_ms));
    put("Response", ms(state.response_ms));
    put("Longest", ms(state.response_max_ms), above_proof(node, state) ? "bad" : "");
    put("Proven", known(node.proven_ms) ? ms(node.proven_ms) : "not proven");
    put("Completed", count(state.completed), health(node, state) === "paused" ? "quiet" : "");
    put("Missed", count(state.deadline_misses), state.deadline_misses > 0 ? "bad" : "");
    put("Skipped", count(state.skipped), state.skipped > 0 ? "warn" : "");
    put("Paused", count(state.paused));
    put("Overruns", count(state.overruns), state.overruns > 0 ? "warn" : "");
    put("Level", level_text(node, state) || "–", state.level > 0 ? "warn" : "");
  }
}
