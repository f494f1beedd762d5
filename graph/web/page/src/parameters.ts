// SPDX-License-Identifier: Apache-2.0
// Parameters: all of the graph, by node. Values that differ come with the state; the others are asked for when their
// node is opened.
import type { App, View } from "./app.ts";
import { card, h, set_text } from "./dom.ts";
import { ParameterRow } from "./parameter_row.ts";
import type { Given, Parameter } from "./protocol.ts";
import { repaint } from "./repaint.ts";

const kAtOnce = 4;

interface Group {
  box: HTMLDetailsElement;
  note: HTMLElement;
  rows: ParameterRow[];
  asked: boolean;
}

export class Parameters implements View {
  readonly name = "parameters";
  readonly title = "Parameters";
  readonly root: HTMLElement;
  private readonly list = h("div", { class: "parameter-groups" });
  private readonly filter = h("input", {
    type: "search",
    placeholder: "Filter",
    "aria-label": "Filter by name or meaning",
    input: () => this.apply_filter(),
  });
  private readonly live_only = h("input", { type: "checkbox", change: () => this.apply_filter() });
  private readonly changed_only = h("input", { type: "checkbox", change: () => this.apply_filter() });
  private readonly summary = h("p", { class: "quiet", role: "status" });
  private groups: Group[] = [];
  private given = new Map<string, Given>();
  private waiting: ParameterRow[] = [];
  private asking = 0;
  private visible = false;
  private built_for = "";
  private readonly draw = () => this.update();

  constructor(private readonly app: App) {
    const tools = h(
      "div",
      { class: "tools" },
      this.filter,
      h("label", {}, this.live_only, " live"),
      h("label", {}, this.changed_only, " changed"),
    );
    this.root = h("div", { class: "view" }, card("Parameters", tools, this.summary, this.list));
    app.store.hello.on(() => this.build());
    app.store.changed.on(() => this.visible && repaint(this.draw));
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
    const key = `${graph.pid} ${JSON.stringify(graph.parameters)}`;
    if (key === this.built_for) return;
    this.built_for = key;
    this.given.clear();
    this.waiting = [];
    const by_node = new Map<string, Parameter[]>();
    for (const parameter of graph.parameters)
      by_node.set(parameter.node, [...(by_node.get(parameter.node) ?? []), parameter]);
    this.groups = [...by_node].map(([node, parameters]) => this.group(node, parameters));
    this.list.replaceChildren(...this.groups.map((group) => group.box));
    this.apply_filter();
    repaint(this.draw);
  }

  private group(node: string, parameters: Parameter[]): Group {
    const rows = parameters.map(
      (parameter) => new ParameterRow(this.app, parameter, () => this.asked_again(parameter)),
    );
    const note = h("span", { class: "quiet" });
    const live = parameters.filter((parameter) => parameter.live).length;
    const type = this.app.store.graph?.nodes.find((candidate) => candidate.name === node)?.type ?? "";
    const head = h(
      "summary",
      {},
      h("span", { class: "group-name" }, node),
      h("span", { class: "quiet" }, type === node ? "" : type),
      h("span", { class: "quiet" }, `${parameters.length} parameters, ${live} live`),
      note,
    );
    const box = h("details", { "data-node": node }, head, ...rows.map((row) => row.root));
    const group: Group = { box, note, rows, asked: false };
    box.addEventListener("toggle", () => box.open && this.opened(group));
    return group;
  }

  private opened(group: Group): void {
    if (!group.asked) {
      group.asked = true;
      this.waiting.push(...group.rows);
      this.ask_next();
    }
    repaint(this.draw);
  }

  /** Asks for values that the state does not list, a few at a time. */
  private ask_next(): void {
    while (this.asking < kAtOnce && this.waiting.length > 0) {
      const row = this.waiting.shift()!;
      ++this.asking;
      void this.app.link.ask({ do: "get", param: row.key }).then((answer) => {
        --this.asking;
        const [first] = (answer["parameters"] ?? []) as Given[];
        if (first) this.given.set(row.key, first);
        row.unknown_because(answer.error ?? "");
        repaint(this.draw);
        this.ask_next();
      });
    }
  }

  private asked_again(parameter: Parameter): void {
    const row = this.groups
      .flatMap((group) => group.rows)
      .find((candidate) => candidate.key === `${parameter.node}.${parameter.param}`);
    if (row) this.waiting.push(row);
    this.ask_next();
  }

  private apply_filter(): void {
    const words = this.filter.value.toLowerCase().split(/\s+/).filter(Boolean);
    const searching = words.length > 0 || this.changed_only.checked || this.live_only.checked;
    let shown = 0;
    for (const group of this.groups) {
      let any = 0;
      for (const row of group.rows) {
        const fits =
          words.every((word) => row.searched.includes(word)) &&
          (!this.live_only.checked || row.parameter.live) &&
          (!this.changed_only.checked || row.changed);
        row.root.hidden = !fits;
        if (fits) ++any;
      }
      group.box.hidden = any === 0;
      if (searching && any > 0) group.box.open = true;
      shown += any;
    }
    const all = this.app.store.graph?.parameters.length ?? 0;
    set_text(
      this.summary,
      `${shown} of ${all} parameters. Live ones can be set while the graph runs; the others are read at startup.`,
    );
  }

  private update(): void {
    const different = new Map(
      (this.app.store.state?.parameters ?? []).map((given) => [`${given.node}.${given.param}`, given]),
    );
    for (const group of this.groups) {
      let changed = 0;
      for (const row of group.rows) {
        const given = different.get(row.key);
        if (row.changed && !given) this.given.delete(row.key);
        row.show(given ?? this.given.get(row.key) ?? null, given !== undefined);
        if (given) ++changed;
      }
      set_text(group.note, changed > 0 ? `${changed} changed` : "");
      group.note.className = changed > 0 ? "pill warn" : "quiet";
    }
    if (this.changed_only.checked) this.apply_filter();
  }
}
