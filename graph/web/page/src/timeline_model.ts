// SPDX-License-Identifier: Apache-2.0
// Which jobs lie in which row of the timeline, where, and which one is at a point. Knows no canvas.
import { clamp, known } from "./format.ts";
import type { Graph, JobRow, LogEvent } from "./protocol.ts";
import { kJobsFor_s } from "./store.ts";

export interface Row {
  label: string;
  node: number; // -1: a CPU
  cpu: number;
}

export interface Window {
  from_s: number;
  to_s: number;
}

export const kNarrowest_s = 0.02;

export function rows_of(graph: Graph): Row[] {
  const nodes = graph.nodes.map((node, i) => ({ label: node.name, node: i, cpu: -1 }));
  return [...graph.cores.map((cpu) => ({ label: `CPU ${cpu}`, node: -1, cpu })), ...nodes];
}

/** By how many ms a job was past its deadline; at most 0: it was not. Null: the node has no deadline. */
export function late_ms(graph: Graph, job: JobRow): number | null {
  const deadline = graph.nodes[job[0]]?.deadline_ms;
  return known(deadline) ? (job[3] - job[1]) * 1000 - deadline : null;
}

export function is_late(graph: Graph, job: JobRow): boolean {
  return (late_ms(graph, job) ?? 0) > 0.0005; // less is rounding
}

export function belongs(row: Row, job: JobRow): boolean {
  return row.node >= 0 ? job[0] === row.node : job[4] === row.cpu;
}

/** The job of a row at an instant, or the nearest one within `slack_s`. */
export function job_at(jobs: JobRow[], row: Row, at_s: number, slack_s: number): JobRow | null {
  let best: JobRow | null = null;
  let least = slack_s;
  for (const job of jobs) {
    if (!belongs(row, job)) continue;
    const away = at_s < job[2] ? job[2] - at_s : at_s > job[3] ? at_s - job[3] : 0;
    if (away <= least && (best === null || away < least)) {
      best = job;
      least = away;
    }
  }
  return best;
}

export function neighbour(jobs: JobRow[], of: JobRow, step: 1 | -1): JobRow | null {
  const own = jobs.filter((job) => job[0] === of[0]).sort((a, b) => a[2] - b[2]);
  const at = own.findIndex((job) => job[2] === of[2]);
  return at < 0 ? null : (own[at + step] ?? null);
}

export function zoomed(window: Window, factor: number, about_s: number, newest_s: number): Window {
  const width = clamp((window.to_s - window.from_s) * factor, kNarrowest_s, kJobsFor_s);
  const share = (about_s - window.from_s) / (window.to_s - window.from_s);
  return bounded({ from_s: about_s - share * width, to_s: about_s + (1 - share) * width }, newest_s);
}

export function panned(window: Window, by_s: number, newest_s: number): Window {
  return bounded({ from_s: window.from_s + by_s, to_s: window.to_s + by_s }, newest_s);
}

/** Keeps a window where jobs are known. */
function bounded(window: Window, newest_s: number): Window {
  const width = window.to_s - window.from_s;
  const from_s = clamp(window.from_s, newest_s - kJobsFor_s, Math.max(newest_s - kJobsFor_s, newest_s - width));
  return { from_s, to_s: from_s + width };
}

/** 1, 2 or 5 times a power of ten, so that about `count` of them fill the window. */
export function tick_step(window: Window, count: number): number {
  const rough = (window.to_s - window.from_s) / Math.max(1, count);
  const power = 10 ** Math.floor(Math.log10(rough));
  return ([1, 2, 5, 10].find((factor) => factor * power >= rough) ?? 10) * power;
}

/** What was said of a node near an instant: events, and sentences of frozen records ("11.2 s: stereo missed ..."). */
export function said_near(events: LogEvent[], frozen: string[], node: string, at_s: number): string[] {
  const near = (other: number) => Math.abs(other - at_s) <= 0.5;
  const word = new RegExp(`(^|[^\\w])${node.replace(/[.*+?^${}()|[\]\\]/g, "\\$&")}([^\\w]|$)`);
  const sentences = frozen.filter((text) => near(Number.parseFloat(text)) && word.test(text));
  const own = events.filter(
    (event) => event.node === node && near(event.at_s) && !sentences.some((text) => text.includes(event.text)),
  );
  return [...sentences, ...own.map((event) => `${event.at_s.toFixed(2)} s ${event.kind}: ${event.text}`)];
}
