// SPDX-License-Identifier: Apache-2.0
// Draws the timeline: one row for each CPU and node, a bar from start to finish of a job, a thin line from its release.
import { is_dark, process_colour, theme } from "./hues.ts";
import type { Graph, JobRow } from "./protocol.ts";
import { belongs, is_late, late_ms, type Row, tick_step, type Window } from "./timeline_model.ts";

export const kAxis = 24;

export interface Sheet {
  context: CanvasRenderingContext2D;
  width: number;
  height: number;
  gutter: number;
  row_height: number;
}

export interface Marked {
  row: number;
  job: JobRow | null;
}

interface Ink {
  ink: string;
  muted: string;
  line: string;
  bad: string;
  stripe: string;
  accent: string;
  card: string;
}

function inks(): Ink {
  return {
    ink: theme("--ink"),
    muted: theme("--muted"),
    line: theme("--line"),
    bad: theme("--bad"),
    stripe: theme("--stripe"),
    accent: theme("--accent"),
    card: theme("--card"),
  };
}

export function x_of(sheet: Sheet, window: Window, at_s: number): number {
  return sheet.gutter + ((at_s - window.from_s) / (window.to_s - window.from_s)) * (sheet.width - sheet.gutter);
}

export function time_at(sheet: Sheet, window: Window, x: number): number {
  return window.from_s + ((x - sheet.gutter) / (sheet.width - sheet.gutter)) * (window.to_s - window.from_s);
}

export function draw_timeline(
  sheet: Sheet,
  graph: Graph,
  jobs: JobRow[],
  rows: Row[],
  window: Window,
  marked: Marked,
): void {
  const ink = inks();
  const { context } = sheet;
  context.clearRect(0, 0, sheet.width, sheet.height);
  context.font = `${sheet.row_height < 18 ? 11 : 12}px system-ui, sans-serif`;
  context.textBaseline = "middle";
  draw_rows(sheet, graph, rows, marked, ink);
  draw_axis(sheet, window, ink);
  context.save();
  context.beginPath();
  context.rect(sheet.gutter, kAxis, sheet.width - sheet.gutter, sheet.height - kAxis);
  context.clip();
  const seen = jobs.filter((job) => job[3] >= window.from_s && Math.min(job[1], job[2]) <= window.to_s);
  rows.forEach((row, i) => {
    for (const job of seen) if (belongs(row, job)) draw_job(sheet, graph, job, row, i, window, ink);
  });
  if (marked.job) draw_mark(sheet, rows, marked.job, window, ink);
  context.restore();
}

function draw_rows(sheet: Sheet, graph: Graph, rows: Row[], marked: Marked, ink: Ink): void {
  const { context } = sheet;
  rows.forEach((row, i) => {
    const y = kAxis + i * sheet.row_height;
    context.fillStyle = i === marked.row ? ink.line : i % 2 === 0 ? ink.stripe : ink.card;
    context.fillRect(0, y, sheet.width, sheet.row_height);
    const node = graph.nodes[row.node];
    if (node) {
      context.fillStyle = process_colour(graph, node.process);
      context.fillRect(0, y + 3, 3, sheet.row_height - 6);
    }
    context.fillStyle = row.node < 0 ? ink.ink : ink.muted;
    context.fillText(row.label, 9, y + sheet.row_height / 2 + 0.5, sheet.gutter - 14);
  });
}

function draw_axis(sheet: Sheet, window: Window, ink: Ink): void {
  const { context } = sheet;
  const step = tick_step(window, (sheet.width - sheet.gutter) / 90);
  const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  context.textAlign = "center";
  for (let at = Math.ceil(window.from_s / step) * step; at <= window.to_s; at += step) {
    const x = Math.round(x_of(sheet, window, at)) + 0.5;
    context.fillStyle = ink.line;
    context.fillRect(x - 0.5, kAxis - 5, 1, sheet.height);
    context.fillStyle = ink.muted;
    const half = 24;
    if (x > sheet.gutter + half && x < sheet.width - half) context.fillText(`${at.toFixed(digits)} s`, x, 10);
  }
  context.textAlign = "left";
}

function draw_job(sheet: Sheet, graph: Graph, job: JobRow, row: Row, index: number, window: Window, ink: Ink): void {
  const { context } = sheet;
  const y = kAxis + index * sheet.row_height + Math.round(sheet.row_height / 6);
  const height = sheet.row_height - 2 * Math.round(sheet.row_height / 6);
  const left = x_of(sheet, window, job[2]);
  const width = Math.max(1.5, x_of(sheet, window, job[3]) - left);
  const late = is_late(graph, job);
  const node = graph.nodes[job[0]]!;
  context.fillStyle = late ? ink.bad : process_colour(graph, node.process);
  if (row.node >= 0) {
    const release = x_of(sheet, window, job[1]);
    if (left - release > 1) context.fillRect(release, y + height / 2 - 0.5, left - release, 1);
    if (late) draw_deadline(sheet, graph, job, y, height, window, ink);
  }
  context.fillStyle = late ? ink.bad : process_colour(graph, node.process);
  context.fillRect(left, y, width, height);
  if (row.node < 0 && width > 46) {
    context.fillStyle = is_dark() ? "#10151a" : "#ffffff";
    context.fillText(node.name, left + 4, y + height / 2 + 0.5, width - 8);
  }
}

/** A late job: a tick where its deadline was, a triangle above its end, so that colour is not all that tells. */
function draw_deadline(
  sheet: Sheet,
  graph: Graph,
  job: JobRow,
  y: number,
  height: number,
  window: Window,
  ink: Ink,
): void {
  const { context } = sheet;
  const deadline = x_of(sheet, window, job[3] - (late_ms(graph, job) ?? 0) / 1000);
  const end = x_of(sheet, window, job[3]);
  context.fillStyle = ink.ink;
  context.fillRect(deadline, y - 3, 1.5, height + 6);
  context.beginPath();
  context.moveTo(end - 4, y - 4);
  context.lineTo(end + 4, y - 4);
  context.lineTo(end, y + 3);
  context.fill();
}

function draw_mark(sheet: Sheet, rows: Row[], job: JobRow, window: Window, ink: Ink): void {
  rows.forEach((row, i) => {
    if (!belongs(row, job)) return;
    const left = x_of(sheet, window, job[2]);
    const width = Math.max(1.5, x_of(sheet, window, job[3]) - left);
    sheet.context.strokeStyle = ink.ink;
    sheet.context.lineWidth = 2;
    sheet.context.strokeRect(left - 2, kAxis + i * sheet.row_height + 2, width + 4, sheet.row_height - 4);
  });
}
