// SPDX-License-Identifier: Apache-2.0
// Tables of the overview: chains, processes, nodes. Rows are made once, cells are changed in place.
import { h, set_attribute, set_class, set_text, table, table_box } from "./dom.ts";
import { count, fixed, hertz, known } from "./format.ts";
import { process_colour } from "./hues.ts";
import { above_proof, health } from "./node_health.ts";
import type { Graph, Maybe, State } from "./protocol.ts";

const number_cell = () => h("td", { class: "num" });

/** A bar of `value` against `most`, with a tick at `proof`. */
class Gauge {
  readonly root = h("span", { class: "gauge", "aria-hidden": "true" });
  private readonly bar = h("span", { class: "gauge-bar" });
  private readonly tick = h("span", { class: "gauge-tick" });

  constructor() {
    this.root.append(this.bar, this.tick);
  }

  show(value: Maybe<number>, most: Maybe<number>, proof: Maybe<number>): void {
    const share = (of: Maybe<number>) => (known(of) && known(most) && most > 0 ? Math.min(1, of / most) : 0);
    this.bar.style.width = `${(100 * share(value)).toFixed(1)}%`;
    this.tick.style.left = `${(100 * share(proof)).toFixed(1)}%`;
    this.tick.hidden = !known(proof) || !known(most);
    set_class(this.bar, known(value) && known(most) && value > most ? "gauge-bar over" : "gauge-bar");
  }
}

export class ChainTable {
  private readonly body = h("tbody");
  readonly root = table_box("Chains", table(["Chain", ">Age ms", ">Max", ">Proven", ">Bound", ""], this.body));
  private rows: { age: HTMLElement; max: HTMLElement; gauge: Gauge }[] = [];

  build(graph: Graph): void {
    this.rows = [];
    this.body.replaceChildren(
      ...graph.chains.map((chain) => {
        const row = { age: number_cell(), max: number_cell(), gauge: new Gauge() };
        this.rows.push(row);
        const name = h("th", { scope: "row", title: `${chain.from} to ${chain.to}` }, chain.name);
        const proven = h("td", { class: "num" }, fixed(chain.proven_ms));
        const bound = h("td", { class: "num" }, fixed(chain.bound_ms));
        return h(
          "tr",
          { "data-chain": chain.name },
          name,
          row.age,
          row.max,
          proven,
          bound,
          h("td", {}, row.gauge.root),
        );
      }),
    );
  }

  update(graph: Graph, state: State): void {
    this.rows.forEach((row, i) => {
      const chain = graph.chains[i];
      const seen = state.chains[i];
      if (!chain || !seen) return;
      set_text(row.age, fixed(seen.age_ms));
      set_text(row.max, fixed(seen.age_max_ms));
      const late = known(seen.age_max_ms) && known(chain.bound_ms) && seen.age_max_ms > chain.bound_ms;
      const above = known(seen.age_max_ms) && known(chain.proven_ms) && seen.age_max_ms > chain.proven_ms;
      set_class(row.max, late ? "num bad" : above ? "num warn" : "num");
      row.gauge.show(seen.age_max_ms, chain.bound_ms, chain.proven_ms);
    });
  }
}

export class ProcessTable {
  private readonly body = h("tbody");
  readonly root = table_box("Processes", table(["Process", "State", ">PID", ">Restarts"], this.body));
  private shown = "";

  update(state: State): void {
    const now = JSON.stringify(state.processes);
    if (now === this.shown) return;
    this.shown = now;
    this.body.replaceChildren(
      ...state.processes.map((process) =>
        h(
          "tr",
          { "data-process": process.name },
          h("th", { scope: "row" }, process.name),
          h("td", {}, h("span", { class: process.state === "running" ? "pill good" : "pill bad" }, process.state)),
          h("td", { class: "num" }, known(process.pid) ? String(process.pid) : "–"),
          h("td", { class: process.restarts > 0 ? "num warn" : "num" }, count(process.restarts)),
        ),
      ),
    );
    if (state.processes.length === 0)
      this.body.append(h("tr", {}, h("td", { colspan: 4, class: "quiet" }, "all in one process")));
  }
}

const kColumns = [
  "Node",
  "Process",
  ">Rate",
  ">Deadline",
  ">Budget",
  ">Exec",
  ">Resp",
  ">Max",
  ">Proven",
  ">Done",
  ">Missed",
  ">Skipped",
  ">Overrun",
  ">Level",
];

export class NodeTable {
  private readonly body = h("tbody");
  readonly root = table_box("Nodes, times in ms", table(kColumns, this.body));
  private rows: { row: HTMLElement; cells: HTMLElement[] }[] = [];

  constructor(private readonly select: (node: number) => void) {}

  build(graph: Graph): void {
    this.rows = [];
    this.body.replaceChildren(
      ...graph.nodes.map((node, i) => {
        const cells = Array.from({ length: 9 }, number_cell);
        const dot = h("span", { class: "dot" });
        dot.style.background = process_colour(graph, node.process);
        const name = h("button", { class: "link", click: () => this.select(i), "aria-pressed": "false" }, node.name);
        const high =
          node.criticality === "high" ? h("abbr", { class: "high", title: "high criticality" }, "high") : null;
        const fixed_cell = (text: string) => h("td", { class: "num" }, text);
        const row = h(
          "tr",
          { "data-node": node.name },
          h("th", { scope: "row" }, name, high),
          h("td", { class: "process" }, dot, node.process),
          fixed_cell(hertz(node.rate_hz)),
          fixed_cell(fixed(node.deadline_ms)),
          fixed_cell(fixed(node.budget_ms)),
          ...cells.slice(0, 3),
          fixed_cell(fixed(node.proven_ms)),
          ...cells.slice(3, 8),
        );
        this.rows.push({ row, cells });
        return row;
      }),
    );
  }

  choose(selected: number): void {
    this.rows.forEach(({ row }, i) => {
      row.classList.toggle("selected", i === selected);
      set_attribute(row.querySelector("button")!, "aria-pressed", String(i === selected));
    });
  }

  update(graph: Graph, state: State): void {
    this.rows.forEach(({ cells }, i) => {
      const node = graph.nodes[i];
      const seen = state.nodes[i];
      if (!node || !seen) return;
      const over = known(seen.exec_ms) && known(node.budget_ms) && seen.exec_ms > node.budget_ms;
      const put = (cell: number, text: string, kind: string) => {
        set_text(cells[cell]!, text);
        set_class(cells[cell]!, kind === "" ? "num" : `num ${kind}`);
      };
      put(0, fixed(seen.exec_ms), over ? "warn" : "");
      put(1, fixed(seen.response_ms), "");
      put(2, fixed(seen.response_max_ms), above_proof(node, seen) ? "bad" : "");
      put(3, count(seen.completed), health(node, seen) === "paused" ? "quiet" : "");
      put(4, count(seen.deadline_misses), seen.deadline_misses > 0 ? "bad" : "zero");
      put(5, count(seen.skipped), seen.skipped > 0 ? "warn" : "zero");
      put(6, count(seen.overruns), seen.overruns > 0 ? "warn" : "zero");
      put(7, node.levels > 1 ? `${seen.level}/${node.levels - 1}` : "–", seen.level > 0 ? "warn" : "zero");
    });
  }
}
