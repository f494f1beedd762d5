// SPDX-License-Identifier: Apache-2.0
// A run of ACE as the fake server plays it: jobs, counts and events that fit the graph in ace_graph.json.
import { chance } from "./world.mjs";

const kLateEvery = 50; // jobs of stereo

export class RunModel {
  constructor(graph) {
    this.frozen_files = [
      { file: "ace-2-mark.mcap", mb: 241.04, at: 1.7e9 },
      { file: "ace-1-miss.mcap", mb: 3.2, at: 1.6e9 },
    ];
    this.replayed = [];
    this.replay_end = { state: "ended", why: "the record is damaged" };
    this.graph = graph;
    this.mode = graph.modes[0];
    this.parameters = [
      { node: "obstacle_stop", param: "deceleration", value: 0.8, unit: "m/s2", from: "kept", at_s: null },
    ];
    this.frozen = [];
    this.counts = graph.nodes.map(() => ({
      completed: 0,
      deadline_misses: 0,
      skipped: 0,
      paused: 0,
      overruns: 0,
      level: 0,
      exec_ms: 0,
      response_ms: 0,
      response_max_ms: 0,
    }));
    this.next = graph.nodes.map(() => 0);
    this.events = [{ at_s: 0, kind: "mode", node: null, text: "mode full: start" }];
    this.faults = new Map(
      graph.nodes.filter((node) => node.device && node.type !== "interaction").map((node) => [node.name, "none"]),
    );
  }

  /** Jobs that finished in (from, to]. */
  advance(from_s, to_s) {
    const jobs = [];
    const free = this.graph.cores.map(() => 0);
    const due = [];
    this.graph.nodes.forEach((node, i) => {
      const rate = node.rate_hz ?? 1;
      for (let k = Math.ceil(from_s * rate - 1e-9); k / rate < to_s; ++k)
        due.push({ node, i, release: k / rate + 0.004 * (i % 9), k });
    });
    due.sort((a, b) => a.release - b.release);
    for (const { node, i, release, k } of due) {
      const job = this.job(node, i, release, k, free);
      if (job) jobs.push(job);
    }
    return jobs;
  }

  job(node, i, release, k, free) {
    const counts = this.counts[i];
    if (node.name === "laser_fusion") {
      counts.paused++;
      return null;
    }
    const cpu = free[0] <= free[1] ? 0 : 1;
    const late = node.name === "stereo" && k % kLateEvery === kLateEvery - 1;
    const exec = (node.budget_ms ?? 1) * (0.25 + 0.3 * chance(k * 31 + i)) * (late ? 2.4 : 1);
    const start = Math.max(release, free[cpu]) + (late ? 0.052 : 0);
    const finish = start + exec / 1000;
    free[cpu] = finish;
    const response = (finish - release) * 1000;
    counts.completed++;
    counts.exec_ms = exec;
    counts.response_ms = response;
    counts.response_max_ms = Math.max(counts.response_max_ms, response);
    if (exec > (node.budget_ms ?? Infinity)) counts.overruns++;
    if (node.deadline_ms !== null && response > node.deadline_ms)
      this.miss(node, counts, finish, response - node.deadline_ms);
    if (node.name === "traffic_signs" && k % 37 === 36) counts.skipped++;
    counts.level = node.name === "stereo_wide" ? 1 : 0;
    return [i, release, start, finish, this.graph.cores[cpu]];
  }

  miss(node, counts, at_s, by_ms) {
    counts.deadline_misses++;
    const text = `${node.name} missed its deadline by ${by_ms.toFixed(1)} ms: 52.0 ms waiting for a CPU, ${counts.exec_ms.toFixed(1)} ms executing`;
    this.frozen.push(`${at_s.toFixed(1)} s: ${text}`);
    this.events.push({ at_s, kind: "frozen", node: node.name, text });
  }

  state(running_s) {
    const { graph } = this;
    const round = (value, digits = 3) => Number(value.toFixed(digits));
    return {
      running_s: round(running_s),
      mode: this.mode,
      cpu: round(0.61 + 0.05 * Math.sin(running_s), 2),
      memory_mb: 921,
      host_stall_ms: 10,
      nodes: this.counts.map((counts) => ({
        ...counts,
        exec_ms: round(counts.exec_ms),
        response_ms: round(counts.response_ms),
        response_max_ms: round(counts.response_max_ms),
      })),
      devices: graph.nodes.filter((node) => node.device).map((node) => this.device(node, running_s)),
      chains: graph.chains.map((chain, i) => ({
        age_ms: round(chain.proven_ms * (0.3 + 0.1 * chance(i + Math.floor(running_s * 2)))),
        age_max_ms: round(chain.proven_ms * 0.55),
      })),
      processes: graph.processes.map((name, i) => ({
        name,
        pid: graph.pid + 1 + i,
        state: "running",
        restarts: name === "detection" ? 1 : 0,
      })),
      parameters: this.parameters,
      frozen: this.frozen.slice(-20),
    };
  }

  device(node, running_s) {
    const fault = this.faults.get(node.name) ?? "none";
    const ill = fault !== "none";
    return {
      name: node.name,
      state: ill ? fault : "ok",
      losses: ill ? 1 : 0,
      received: Math.floor(running_s * (node.rate_hz ?? 1)),
      damaged: node.name === "front_laser" ? 2 : 0,
      resyncs: node.name === "front_laser" ? 1 : 0,
      missing: 0,
    };
  }

  /** The answer to a question of the page, as the run would give it. */
  answer(question) {
    const { do: what, param, mode } = question;
    if (what === "get") return this.get(param);
    if (what === "set") return this.set(question);
    if (what === "forget") return { ok: true, forgotten: "overlays/ace.yaml" };
    if (what === "mark") return { ok: true, at_s: 1 };
    if (what === "stop") return { ok: true };
    if (what === "answer" || what === "task") return { ok: true };
    if (what === "fault") return this.fault(question);
    if (what === "frozen") return { ok: true, folder: "/out/flight/frozen", files: this.frozen_files };
    if (what === "download") return { ok: true, path: `/frozen/${question.file}?ticket=abc` };
    if (what === "replay") return ((this.replayed = [{ state: "starting" }, { state: "starting" }]), { ok: true });
    if (what === "replayed")
      return { ok: true, file: this.frozen_files[0].file, ...(this.replayed.shift() ?? this.replay_end) };
    if (what !== "mode") return { error: `unknown question ${what}` };
    if (!this.graph.modes.includes(mode)) return { error: `this run cannot change to \`${mode}\`` };
    this.mode = mode;
    return { ok: true };
  }

  declared(param) {
    return this.graph.parameters.find((parameter) => `${parameter.node}.${parameter.param}` === param);
  }

  get(param) {
    if (param === "") return { ok: true, parameters: this.parameters };
    const declared = this.declared(param);
    if (!declared) return { error: `there is no parameter \`${param}\`` };
    const changed = this.parameters.find((given) => given.node === declared.node && given.param === declared.param);
    const file = {
      node: declared.node,
      param: declared.param,
      value: declared.default,
      unit: declared.unit,
      from: declared.param === "disparities" ? "file" : "default",
      at_s: null,
    };
    return { ok: true, parameters: [changed ?? file] };
  }

  set({ param, value, keep }) {
    const declared = this.declared(param);
    if (!declared) return { error: `there is no parameter \`${param}\`` };
    const number = Number.parseFloat(value);
    if (declared.most !== null && !(number >= declared.least && number <= declared.most))
      return { error: `parameter \`${param}\` is ${number}, must lie in ${declared.least}..${declared.most}` };
    this.parameters = this.parameters.filter((given) => given.node !== declared.node || given.param !== declared.param);
    this.parameters.push({
      node: declared.node,
      param: declared.param,
      value: declared.most === null ? value : number,
      unit: declared.unit,
      from: "set",
      at_s: 3.1,
    });
    return keep ? { ok: true, kept: "overlays/ace.yaml" } : { ok: true };
  }

  fault({ device, fault, on }) {
    const known = ["silent", "unplugged", "garbage", "frozen"];
    if (fault) this.faults.set(device, on ? fault : "none");
    if (fault) return { ok: true };
    return { ok: true, devices: [...this.faults].map(([name, now]) => ({ device: name, on: now, faults: known })) };
  }
}
