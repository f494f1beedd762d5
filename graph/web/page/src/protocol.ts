// SPDX-License-Identifier: Apache-2.0
// What page and server say to each other, as types. graph/web/README.md is the binding text.

export type Maybe<T> = T | null | undefined;
export type Way = "picture" | "disparity" | "cloud" | "scan" | "grid" | "pose" | "value";

export interface GraphNode {
  name: string;
  type: string;
  device: boolean;
  process: string;
  rate_hz: Maybe<number>;
  deadline_ms: Maybe<number>;
  budget_ms: Maybe<number>;
  criticality: string;
  proven_ms: Maybe<number>;
  levels: number;
  inputs: { name: string; from: string }[];
  outputs: string[];
}

export interface Port {
  name: string;
  type: string;
  shows: string[];
}

export interface Chain {
  name: string;
  from: string;
  to: string;
  bound_ms: Maybe<number>;
  proven_ms: Maybe<number>;
}

export interface Parameter {
  node: string;
  param: string;
  unit: string;
  kind: string;
  least: Maybe<number>;
  most: Maybe<number>;
  live: boolean;
  help: string;
  default: string;
  choices?: string[];
}

export interface Graph {
  name: string;
  profile: string;
  policy: string;
  schedule: string;
  version: string;
  pid: number;
  /** Of a replay the name of its record. */
  replay_of?: string;
  cores: number[];
  modes: string[];
  processes: string[];
  nodes: GraphNode[];
  ports: Port[];
  chains: Chain[];
  parameters: Parameter[];
}

export interface NodeState {
  completed: number;
  deadline_misses: number;
  skipped: number;
  paused: number;
  overruns: number;
  level: number;
  exec_ms: Maybe<number>;
  response_ms: Maybe<number>;
  response_max_ms: Maybe<number>;
}

export interface DeviceState {
  name: string;
  state: string;
  losses: number;
  received: number;
  damaged: number;
  resyncs: number;
  missing: number;
}

export interface ProcessState {
  name: string;
  pid: Maybe<number>;
  state: string;
  restarts: number;
}

/** A parameter's value and who gave it: "file", "set", "kept", "command line", "default". */
export interface Given {
  node: string;
  param: string;
  value: unknown;
  unit: string;
  from: string;
  at_s: Maybe<number>;
}

export interface State {
  running_s: number;
  mode: string;
  cpu: Maybe<number>;
  memory_mb: Maybe<number>;
  host_stall_ms: Maybe<number>;
  nodes: NodeState[];
  devices: DeviceState[];
  chains: { age_ms: Maybe<number>; age_max_ms: Maybe<number> }[];
  processes: ProcessState[];
  parameters: Given[];
  frozen: string[];
}

export interface LogEvent {
  at_s: number;
  kind: string;
  node: Maybe<string>;
  text: string;
  /** Of kind "log": debug, info, warning or error. */
  level?: string;
}

/** One job: node (index into graph.nodes), release, start and finish in s since the start of the run, CPU. */
export type JobRow = [number, number, number, number, number];

export interface ValueMessage {
  port: string;
  sequence: number;
  stamp_s: number;
  age_ms: number;
  level: number;
  message: Record<string, unknown>;
}

export interface FrameHeader {
  port: string;
  part?: string;
  kind: string;
  sequence: number;
  stamp_s: number;
  age_ms: number;
  level: number;
  [more: string]: unknown;
}

/** A binary frame; `received_ms` is performance.now() at its receipt. */
export interface Frame {
  header: FrameHeader;
  bytes: Uint8Array<ArrayBuffer>;
  received_ms: number;
}

export interface Answer {
  ok?: boolean;
  error?: string;
  [more: string]: unknown;
}

export type Question = { do: string } & Record<string, unknown>;
