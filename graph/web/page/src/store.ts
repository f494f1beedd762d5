// SPDX-License-Identifier: Apache-2.0
// What the page knows of the run: the newest graph and state, and bounded lists of jobs and events.
import type { Graph, GraphNode, JobRow, LogEvent, NodeState, Port, State, Way } from "./protocol.ts";
import { Signal } from "./signal.ts";

export const kJobsFor_s = 10;
export const kMostJobs = 20000;
export const kMostEvents = 2000;

export type Connection = "connecting" | "open" | "closed";

export class Store {
  graph: Graph | null = null;
  state: State | null = null;
  may_change = false;
  connection: Connection = "connecting";
  /** When the next try begins, in ms of performance.now(). */
  next_try_ms = 0;
  gone = "";
  jobs: JobRow[] = [];
  events: LogEvent[] = [];
  events_dropped = 0;

  readonly hello = new Signal();
  readonly changed = new Signal();
  readonly jobs_came = new Signal();
  readonly events_came = new Signal();
  readonly status = new Signal();

  private event_keys = new Set<string>();
  private run = "";

  take_hello(graph: Graph, may_change: boolean): void {
    const run = `${graph.name} ${graph.pid}`;
    if (run !== this.run) this.forget_run();
    this.run = run;
    this.graph = graph;
    this.may_change = may_change;
    this.gone = "";
    this.hello.emit();
    this.status.emit();
  }

  take_state(state: State): void {
    this.state = state;
    this.changed.emit();
  }

  /** Keeps the jobs of the last 10 s, and at most 20,000. */
  take_jobs(rows: JobRow[]): void {
    const sound = rows.filter((row) => Array.isArray(row) && this.graph?.nodes[row[0]] && Number.isFinite(row[3]));
    this.jobs = [...this.jobs, ...sound].sort((a, b) => a[3] - b[3]);
    const newest = this.jobs.at(-1)?.[3] ?? 0;
    const first = this.jobs.findIndex((row) => row[3] >= newest - kJobsFor_s);
    this.jobs = this.jobs.slice(Math.max(first, this.jobs.length - kMostJobs, 0));
    this.jobs_came.emit();
  }

  /** The server sends all events again after each hello: those that are known already are left out. */
  take_events(events: LogEvent[]): void {
    for (const event of events) {
      const key = `${event.at_s} ${event.kind} ${event.node ?? ""} ${event.text}`;
      if (this.event_keys.has(key)) continue;
      this.event_keys.add(key);
      this.events.push(event);
    }
    this.bound_events();
    this.events_came.emit();
  }

  private bound_events(): void {
    const over = this.events.length - kMostEvents;
    if (over > 0) {
      this.events.splice(0, over);
      this.events_dropped += over;
    }
    // Keys of dropped events stay for a while: otherwise the next hello would bring those events again.
    const spare = this.event_keys.size - 4 * kMostEvents;
    if (spare <= 0) return;
    for (const key of [...this.event_keys].slice(0, spare)) this.event_keys.delete(key);
  }

  private forget_run(): void {
    this.state = null;
    this.jobs = [];
    this.events = [];
    this.events_dropped = 0;
    this.event_keys.clear();
  }

  set_connection(connection: Connection, next_try_ms = 0): void {
    this.connection = connection;
    this.next_try_ms = next_try_ms;
    if (connection !== "open") this.may_change = false;
    this.status.emit();
  }

  set_gone(why: string): void {
    this.gone = why || "no reason given";
    this.may_change = false;
    this.status.emit();
  }

  /** Why controls that change the run are disabled; empty: they are not. */
  why_not(): string {
    if (this.connection !== "open") return "no connection to takt web";
    if (this.gone !== "") return "the run has ended";
    if (this.graph?.replay_of) return "this is a replay";
    return this.may_change ? "" : "open the address that takt web printed";
  }

  node_index(name: string): number {
    return this.graph?.nodes.findIndex((node) => node.name === name) ?? -1;
  }

  node_state(index: number): NodeState | undefined {
    return this.state?.nodes[index];
  }

  ports_showing(way: Way): Port[] {
    return this.graph?.ports.filter((port) => port.shows.includes(way)) ?? [];
  }

  producer(port: string): GraphNode | undefined {
    return this.graph?.nodes.find((node) => node.outputs.includes(port));
  }
}
