// SPDX-License-Identifier: Apache-2.0
// Places the nodes of a graph in layers from left to right by data flow. Pure geometry: knows no SVG.
//
// Steps: edges that close a cycle are set apart ("back"); a node's layer is its longest way from a source; an edge over
// several layers gets one passing point in each, shared by all edges of one output; barycentres order each layer; then
// everything moves towards its neighbours as far as the gaps allow.

export interface Edge {
  port: string;
  from: number;
  to: number;
  back: boolean;
}

export interface Place {
  x: number;
  y: number;
}

export interface Layout {
  nodes: Place[];
  /** Points that an edge runs through, its ends included; in the order of the edges. */
  ways: Place[][];
  width: number;
  height: number;
}

export interface Sizes {
  box_width: number;
  box_height: number;
  gap_x: number;
  gap_y: number;
}

interface Item {
  node: number; // -1: a passing point
  layer: number;
  height: number;
  y: number;
  before: Item[];
  after: Item[];
}

/** Marks edges that close a cycle, met in a search from the sources on. `pinned` nodes take no edge: devices stay left. */
export function mark_back_edges(count: number, edges: Edge[], pinned: (node: number) => boolean): void {
  const state = new Uint8Array(count); // 1: on the current way, 2: done
  const leaving: Edge[][] = Array.from({ length: count }, () => []);
  for (const edge of edges) {
    if (edge.back) continue;
    if (pinned(edge.to) || edge.from === edge.to) edge.back = true;
    else leaving[edge.from]!.push(edge);
  }
  const visit = (node: number): void => {
    state[node] = 1;
    for (const edge of leaving[node]!) {
      if (state[edge.to] === 1) edge.back = true;
      else if (state[edge.to] === 0) visit(edge.to);
    }
    state[node] = 2;
  };
  for (let node = 0; node < count; ++node) if (state[node] === 0) visit(node);
}

function layers_of(count: number, edges: Edge[]): number[] {
  const layer = new Array<number>(count).fill(0);
  for (let round = 0, moved = true; moved && round <= count; ++round) {
    moved = false;
    for (const edge of edges) {
      if (edge.back || layer[edge.to]! > layer[edge.from]!) continue;
      layer[edge.to] = layer[edge.from]! + 1;
      moved = true;
    }
  }
  return pull_sources(layer, edges);
}

/** A source stands right before the first node that reads it: its edge need not pass the layers between. */
function pull_sources(layer: number[], edges: Edge[]): number[] {
  const first_reader = new Map<number, number>();
  const fed = new Set<number>();
  for (const edge of edges) {
    if (edge.back) continue;
    fed.add(edge.to);
    first_reader.set(edge.from, Math.min(first_reader.get(edge.from) ?? Infinity, layer[edge.to]!));
  }
  return layer.map((at, node) => (fed.has(node) ? at : (first_reader.get(node) ?? 1) - 1));
}

function join(before: Item, after: Item): void {
  if (!before.after.includes(after)) before.after.push(after);
  if (!after.before.includes(before)) after.before.push(before);
}

/** Boxes and passing points, and for each edge the items it runs through. */
function items_of(count: number, edges: Edge[], sizes: Sizes): { items: Item[]; runs: Item[][] } {
  const layer = layers_of(count, edges);
  const items: Item[] = layer.map((at, node) => ({
    node,
    layer: at,
    height: sizes.box_height,
    y: 0,
    before: [],
    after: [],
  }));
  const passing = new Map<string, Item>();
  const runs = edges.map((edge) => {
    const run = [items[edge.from]!];
    for (let at = layer[edge.from]! + 1; !edge.back && at < layer[edge.to]!; ++at) {
      const key = `${edge.port} ${at}`;
      let item = passing.get(key);
      if (!item) {
        item = { node: -1, layer: at, height: 2, y: 0, before: [], after: [] };
        passing.set(key, item);
        items.push(item);
      }
      run.push(item);
    }
    run.push(items[edge.to]!);
    if (!edge.back) for (let i = 1; i < run.length; ++i) join(run[i - 1]!, run[i]!);
    return run;
  });
  return { items, runs };
}

function stack(layer: Item[], gap: number): void {
  let y = 0;
  for (const item of layer) {
    item.y = y + item.height / 2;
    y += item.height + (item.node < 0 ? gap / 2 : gap);
  }
}

function mean(items: Item[], otherwise: number): number {
  return items.length === 0 ? otherwise : items.reduce((sum, item) => sum + item.y, 0) / items.length;
}

/** How many pairs of edges between neighbouring layers cross. */
function crossings(columns: Item[][]): number {
  let sum = 0;
  for (const column of columns) {
    const lines = column.flatMap((item) => item.after.map((after) => [item.y, after.y] as const));
    for (let i = 0; i < lines.length; ++i)
      for (let j = i + 1; j < lines.length; ++j)
        if ((lines[i]![0] - lines[j]![0]) * (lines[i]![1] - lines[j]![1]) < 0) ++sum;
  }
  return sum;
}

function order(columns: Item[][], gap: number): void {
  let best = columns.map((column) => [...column]);
  for (const column of columns) stack(column, gap);
  let least = crossings(columns);
  for (let sweep = 0; sweep < 24; ++sweep) {
    const forward = sweep % 2 === 0;
    for (const column of forward ? columns : [...columns].reverse()) {
      const wish = new Map(column.map((item) => [item, mean(forward ? item.before : item.after, item.y)]));
      column.sort((a, b) => wish.get(a)! - wish.get(b)!);
      stack(column, gap);
    }
    const now = crossings(columns);
    if (now >= least) continue;
    least = now;
    best = columns.map((column) => [...column]);
  }
  best.forEach((column, i) => {
    columns[i] = column;
    stack(column, gap);
  });
}

/** Moves each item towards the mean of its neighbours, as far as those above and below in its layer leave room. */
function relax(columns: Item[][], gap: number): void {
  const middle = (column: Item[]) => (column[0]!.y + column[column.length - 1]!.y) / 2;
  const tallest = columns.reduce((best, column) =>
    column.at(-1)!.y - column[0]!.y > best.at(-1)!.y - best[0]!.y ? column : best,
  );
  const between = (a: Item, b: Item) => (a.height + b.height) / 2 + (a.node < 0 || b.node < 0 ? gap / 2 : gap);
  for (let sweep = 0; sweep < 60; ++sweep) {
    for (const column of sweep % 2 === 0 ? columns : [...columns].reverse()) {
      column.forEach((item) => {
        item.y += 0.7 * (mean([...item.before, ...item.after], item.y) - item.y);
      });
      for (let i = 1; i < column.length; ++i) {
        const over = column[i - 1]!.y + between(column[i - 1]!, column[i]!) - column[i]!.y;
        if (over <= 0) continue;
        column[i - 1]!.y -= over / 2;
        column[i]!.y += over / 2;
      }
      for (let i = column.length - 2; i >= 0; --i)
        column[i]!.y = Math.min(column[i]!.y, column[i + 1]!.y - between(column[i]!, column[i + 1]!));
      for (let i = 1; i < column.length; ++i)
        column[i]!.y = Math.max(column[i]!.y, column[i - 1]!.y + between(column[i - 1]!, column[i]!));
      // Without this the picture drifts along its diagonal.
      const away = 0.5 * (middle(tallest) - middle(column));
      for (const item of column) item.y += away;
    }
  }
}

export function arrange(count: number, edges: Edge[], sizes: Sizes): Layout {
  const { items, runs } = items_of(count, edges, sizes);
  const columns: Item[][] = [];
  for (const item of items) (columns[item.layer] ??= []).push(item);
  order(columns, sizes.gap_y);
  relax(columns, sizes.gap_y);
  const top = Math.min(...items.map((item) => item.y - item.height / 2));
  const bottom = Math.max(...items.map((item) => item.y + item.height / 2));
  const step = sizes.box_width + sizes.gap_x;
  const nodes = items.slice(0, count).map((item) => ({ x: item.layer * step, y: item.y - top - sizes.box_height / 2 }));
  const ways = runs.map((run) =>
    run.flatMap((item, i) => {
      const left = item.layer * step;
      const y = item.y - top;
      if (i === 0) return [{ x: left + sizes.box_width, y }];
      if (i === run.length - 1) return [{ x: left, y }];
      return [
        { x: left, y },
        { x: left + sizes.box_width, y },
      ];
    }),
  );
  return { nodes, ways, width: columns.length * step - sizes.gap_x, height: bottom - top };
}
