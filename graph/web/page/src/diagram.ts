// SPDX-License-Identifier: Apache-2.0
// The graph as an SVG picture: boxes in layers, edges, and the figures of each node, changed in place twice a second.
import { set_attribute, set_class, set_text, svg } from "./dom.ts";
import { fixed, hertz, known } from "./format.ts";
import { process_colour } from "./hues.ts";
import { arrange, type Edge, type Layout, mark_back_edges, type Sizes } from "./layers.ts";
import { above_proof, health } from "./node_health.ts";
import type { Graph, GraphNode, NodeState } from "./protocol.ts";

const kSizes: Sizes = { box_width: 188, box_height: 92, gap_x: 44, gap_y: 15 };
const kMargin = 14;
const kBar = { x: 12, y: 29, width: 164, height: 5 };

interface Box {
  group: SVGGElement;
  level: SVGTextElement;
  bar: SVGRectElement;
  exec: SVGTextElement;
  response: SVGTextElement;
  deadline: SVGTextElement;
  misses: SVGTextElement;
}

interface Line {
  edge: Edge;
  path: SVGPathElement;
}

export class Diagram {
  readonly root = svg("svg", {
    class: "diagram",
    role: "group",
    "aria-label": "Graph: nodes from left to right by data flow",
  });
  width = 0;
  height = 0;
  private boxes: Box[] = [];
  private lines: Line[] = [];
  private graph: Graph | null = null;
  private selected = -1;
  private all_edges = false;

  constructor(private readonly select: (node: number) => void) {}

  build(graph: Graph): void {
    this.graph = graph;
    const edges = edges_of(graph);
    const layout = arrange(graph.nodes.length, edges, kSizes);
    this.width = layout.width + 2 * kMargin;
    this.height = layout.height + 2 * kMargin + 20;
    this.root.setAttribute("viewBox", `0 0 ${this.width} ${this.height}`);
    this.lines = edges.map((edge, i) => ({ edge, path: svg("path", { d: way(edge, layout, i) }) }));
    this.boxes = graph.nodes.map((node, i) => this.box(node, i));
    layout.nodes.forEach((place, i) =>
      this.boxes[i]!.group.setAttribute("transform", `translate(${place.x + kMargin} ${place.y + kMargin})`),
    );
    this.root.replaceChildren(...this.lines.map((line) => line.path), ...this.boxes.map((box) => box.group));
    this.mark();
  }

  private box(node: GraphNode, index: number): Box {
    const text = (x: number, y: number, name: string, content = "") => svg("text", { x, y, class: name }, content);
    const end = (y: number, name: string, content = "") =>
      svg("text", { x: 176, y, class: name, "text-anchor": "end" }, content);
    const bar = svg("rect", { ...kBar, width: 0, rx: 2, class: "bar" });
    const exec = text(12, 48, "figure");
    const response = text(12, 64, "figure");
    const deadline = text(12, 80, "figure");
    const level = end(48, "figure");
    const misses = end(80, "figure");
    const strip = svg("rect", { width: 4, height: kSizes.box_height, rx: 2 });
    strip.setAttribute("fill", process_colour(this.graph!, node.process));
    const choose = () => this.select(index);
    const group = svg(
      "g",
      {
        role: "button",
        tabindex: 0,
        click: choose,
        keydown: (event: KeyboardEvent) => {
          if (event.key !== "Enter" && event.key !== " ") return;
          event.preventDefault();
          choose();
        },
      },
      ...spaced(
        svg("rect", { width: kSizes.box_width, height: kSizes.box_height, rx: node.device ? 14 : 5, class: "frame" }),
        strip,
        text(12, 19, node.name.length > 17 ? "name long" : "name", node.name),
        end(19, "rate", hertz(node.rate_hz)),
        svg("rect", { ...kBar, rx: 2, class: "bar-ground" }),
        bar,
        exec,
        response,
        deadline,
        level,
        misses,
      ),
    );
    return { group, level, bar, exec, response, deadline, misses };
  }

  update(states: NodeState[]): void {
    this.graph?.nodes.forEach((node, i) => {
      const box = this.boxes[i];
      const state = states[i];
      if (box && state) show_figures(box, node, state);
    });
    this.mark_boxes(states);
  }

  private mark_boxes(states: NodeState[]): void {
    this.boxes.forEach((box, i) => {
      const node = this.graph!.nodes[i]!;
      const state = states[i];
      const kind = node.device ? " device" : "";
      const chosen = i === this.selected ? " selected" : "";
      set_class(box.group, `node ${state ? health(node, state) : "unknown"}${kind}${chosen}`);
      set_attribute(box.group, "aria-pressed", String(i === this.selected));
    });
  }

  choose(index: number, states: NodeState[]): void {
    this.selected = index;
    this.mark();
    this.mark_boxes(states);
  }

  show_all_edges(all: boolean): void {
    this.all_edges = all;
    this.mark();
  }

  /** Edges of the chosen node stand out. Those that run back are drawn on demand: they cross everything. */
  private mark(): void {
    for (const { edge, path } of this.lines) {
      const own = edge.from === this.selected || edge.to === this.selected;
      const hidden = edge.back && !own && !this.all_edges;
      set_class(path, `edge${edge.back ? " back" : ""}${own ? " own" : ""}${hidden ? " hidden" : ""}`);
    }
  }
}

/** Spaces are not drawn, but they keep the words apart for those who hear them. */
function spaced(...elements: SVGElement[]): (SVGElement | string)[] {
  return elements.flatMap((element) => [element, " "]);
}

function show_figures(box: Box, node: GraphNode, state: NodeState): void {
  const share =
    known(state.exec_ms) && known(node.budget_ms) && node.budget_ms > 0 ? state.exec_ms / node.budget_ms : 0;
  set_attribute(box.bar, "width", (kBar.width * Math.min(1, share)).toFixed(1));
  set_class(box.bar, share > 1 ? "bar over" : share > 0.9 ? "bar close" : "bar");
  set_text(box.exec, `exec ${fixed(state.exec_ms)} of ${fixed(node.budget_ms)} ms`);
  set_text(
    box.response,
    `resp ${fixed(state.response_ms)}, max ${fixed(state.response_max_ms)} of ${fixed(node.proven_ms)}`,
  );
  set_class(box.response, above_proof(node, state) ? "figure bad" : "figure");
  set_text(box.deadline, `deadline ${fixed(node.deadline_ms)}`);
  const missed = state.deadline_misses > 0 ? `${state.deadline_misses} missed` : "";
  const skipped = state.skipped > 0 ? `${state.skipped} skipped` : "";
  set_text(box.misses, missed && skipped ? `${state.deadline_misses} + ${skipped}` : missed || skipped);
  set_class(box.misses, missed ? "figure misses bad" : "figure misses warn");
  set_text(box.level, state.level > 0 ? `level ${state.level}` : "");
  set_class(box.level, state.level > 0 ? "figure misses warn" : "figure");
}

/** One edge for each input. Requests to nodes and edges into devices run back by their nature. */
function edges_of(graph: Graph): Edge[] {
  const owner = new Map<string, number>();
  graph.nodes.forEach((node, i) => node.outputs.forEach((port) => owner.set(port, i)));
  const requests = new Set(graph.ports.filter((port) => port.type === "requests").map((port) => port.name));
  const edges: Edge[] = [];
  graph.nodes.forEach((node, to) => {
    for (const input of node.inputs) {
      const from = owner.get(input.from);
      if (from !== undefined) edges.push({ port: input.from, from, to, back: requests.has(input.from) });
    }
  });
  mark_back_edges(graph.nodes.length, edges, (node) => graph.nodes[node]!.device);
  return edges;
}

function way(edge: Edge, layout: Layout, index: number): string {
  const points = layout.ways[index]!.map((point) => ({ x: point.x + kMargin, y: point.y + kMargin }));
  const first = points[0]!;
  let path = `M${first.x} ${first.y.toFixed(1)}`;
  if (edge.back) {
    const last = points[points.length - 1]!;
    const reach = 60;
    return `${path} C${first.x + reach} ${first.y + 50} ${last.x - reach} ${last.y + 50} ${last.x} ${last.y.toFixed(1)}`;
  }
  for (let i = 1; i < points.length; ++i) {
    const a = points[i - 1]!;
    const b = points[i]!;
    const middle = (a.x + b.x) / 2;
    path +=
      a.y === b.y
        ? ` L${b.x} ${b.y.toFixed(1)}`
        : ` C${middle} ${a.y.toFixed(1)} ${middle} ${b.y.toFixed(1)} ${b.x} ${b.y.toFixed(1)}`;
  }
  return path;
}
