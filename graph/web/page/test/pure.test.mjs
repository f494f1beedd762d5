// SPDX-License-Identifier: Apache-2.0
// Parts without a page: the layout on generated graphs, the reader of frames on damaged bytes, the timeline's arithmetic.
import { build } from "esbuild";
import assert from "node:assert/strict";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { chance } from "./world.mjs";

const folder = mkdtempSync(join(tmpdir(), "takt-page-pure-"));
const part = {};
before(async () => {
  for (const name of ["layers", "frame", "timeline_model", "format", "messages", "store"]) {
    const outfile = join(folder, `${name}.mjs`);
    await build({
      entryPoints: [join(import.meta.dirname, `../src/${name}.ts`)],
      bundle: true,
      format: "esm",
      outfile,
      logLevel: "error",
    });
    part[name] = await import(outfile);
  }
});
after(() => rmSync(folder, { recursive: true }));

const kSizes = { box_width: 180, box_height: 90, gap_x: 40, gap_y: 15 };

function generated(seed) {
  const random = (i) => chance(seed * 1009 + i);
  const count = 1 + Math.floor(random(0) * 40);
  const edges = [];
  for (let i = 0; i < count * 2; ++i) {
    const from = Math.floor(random(3 * i + 1) * count);
    edges.push({
      port: `${from}.${Math.floor(random(3 * i + 2) * 2)}`,
      from,
      to: Math.floor(random(3 * i + 3) * count),
      back: false,
    });
  }
  return { count, edges };
}

test("layout: boxes never overlap, edges run to the right, ways begin and end at their boxes", () => {
  for (let seed = 1; seed <= 150; ++seed) {
    const { count, edges } = generated(seed);
    part.layers.mark_back_edges(count, edges, () => false);
    const { nodes, ways, width, height } = part.layers.arrange(count, edges, kSizes);
    for (let a = 0; a < count; ++a) {
      assert.ok(
        nodes[a].x >= 0 && nodes[a].x + 180 <= width + 1e-6 && nodes[a].y >= -1e-6 && nodes[a].y + 90 <= height + 1e-6,
        `seed ${seed}: inside`,
      );
      for (let b = a + 1; b < count; ++b)
        if (nodes[a].x === nodes[b].x)
          assert.ok(Math.abs(nodes[a].y - nodes[b].y) >= 90 + 15 - 1e-6, `seed ${seed}: ${a} and ${b} overlap`);
    }
    edges.forEach((edge, i) => {
      const [first, last] = [ways[i][0], ways[i].at(-1)];
      assert.deepEqual([first.x, last.x], [nodes[edge.from].x + 180, nodes[edge.to].x]);
      if (!edge.back)
        assert.ok(
          ways[i].every((point, k) => k === 0 || point.x >= ways[i][k - 1].x),
          `seed ${seed}: runs right`,
        );
    });
  }
});

test("layout: without the marked edges no cycle is left, and a graph without cycles has none marked", () => {
  for (let seed = 1; seed <= 150; ++seed) {
    const { count, edges } = generated(seed);
    const acyclic = edges
      .map((edge) => ({
        ...edge,
        from: Math.min(edge.from, edge.to),
        to: Math.max(edge.from, edge.to) + (edge.from === edge.to ? 1 : 0),
      }))
      .filter((edge) => edge.to < count);
    part.layers.mark_back_edges(count, acyclic, () => false);
    assert.ok(acyclic.every((edge) => !edge.back));
    part.layers.mark_back_edges(count, edges, () => false);
    let left = edges.filter((edge) => !edge.back);
    for (let removed = true; removed;) {
      const fed = new Set(left.map((edge) => edge.to));
      const rest = left.filter((edge) => fed.has(edge.from));
      removed = rest.length < left.length;
      left = rest;
    }
    assert.deepEqual(left, [], `seed ${seed}`);
  }
});

test("frames: what is written is read; damaged bytes are none and never throw", () => {
  const header = Buffer.from(JSON.stringify({ port: "a.b", kind: "scan", age_ms: 3 }));
  const length = Buffer.alloc(4);
  length.writeUInt32LE(header.length);
  const whole = Buffer.concat([length, header, Buffer.from(new Float32Array([1, 2.5]).buffer)]);
  const read = (bytes) => part.frame.read_frame(Uint8Array.from(bytes).buffer, 7);
  const frame = read(whole);
  assert.equal(frame.header.port, "a.b");
  assert.deepEqual([...part.frame.floats_of(frame)], [1, 2.5]);
  let none = 0;
  for (let i = 0; i < 3000; ++i) {
    const cut = whole.subarray(0, Math.floor(chance(i) * whole.length));
    const bytes = Buffer.from(i % 2 ? cut : whole);
    if (bytes.length > 0) bytes[Math.floor(chance(i + 7) * bytes.length)] ^= 1 << (i % 8);
    const damaged = read(bytes);
    if (damaged === null) ++none;
    else part.frame.floats_of(damaged);
  }
  assert.ok(none > 1000);
});

test("timeline: late jobs, the job at a point, windows that stay where jobs are", () => {
  const model = part.timeline_model;
  const graph = {
    nodes: [
      { name: "a", deadline_ms: 10 },
      { name: "b", deadline_ms: null },
    ],
    cores: [0],
  };
  assert.equal(model.is_late(graph, [0, 1, 1, 1.01, 0]), false);
  assert.equal(model.is_late(graph, [0, 1, 1, 1.0101, 0]), true);
  assert.equal(model.is_late(graph, [1, 1, 1, 9, 0]), false);
  const jobs = [
    [0, 1, 1, 1.01, 0],
    [0, 2, 2, 2.01, 0],
    [1, 2, 2.02, 2.03, 0],
  ];
  assert.equal(model.job_at(jobs, { node: 0, cpu: -1 }, 2.005, 0), jobs[1]);
  assert.equal(model.job_at(jobs, { node: 0, cpu: -1 }, 1.5, 0.1), null);
  assert.equal(model.job_at(jobs, { node: -1, cpu: 0 }, 2.025, 0), jobs[2]);
  for (let i = 0; i < 2000; ++i) {
    let window = { from_s: 90, to_s: 100 };
    for (let k = 0; k < 6; ++k)
      window =
        chance(i * 13 + k) < 0.5
          ? model.zoomed(window, 0.2 + 2 * chance(i + k), 90 + 10 * chance(i * 7 + k), 100)
          : model.panned(window, 20 * chance(i * 3 + k) - 10, 100);
    assert.ok(
      window.from_s >= 90 - 1e-9 && window.to_s <= 100 + 1e-9 && window.to_s > window.from_s,
      JSON.stringify(window),
    );
  }
});

test("what was said near a job: its own node, within half a second, each sentence once", () => {
  const frozen = [
    "11.2 s: stereo missed its deadline",
    "11.2 s: stereo_wide missed its deadline",
    "15.0 s: stereo missed its deadline",
  ];
  const events = [
    { at_s: 11.21, kind: "frozen", node: "stereo", text: "stereo missed its deadline" },
    { at_s: 11.3, kind: "fault", node: "stereo", text: "killed" },
  ];
  assert.deepEqual(part.timeline_model.said_near(events, frozen, "stereo", 11.25), [
    frozen[0],
    "11.30 s fault: killed",
  ]);
});

test("the store keeps ten seconds of jobs, at most 20,000, and 2,000 events", () => {
  const store = new part.store.Store();
  store.take_hello({ name: "g", pid: 1, nodes: [{ name: "a" }] }, false);
  for (let i = 0; i < 60; ++i)
    store.take_jobs(Array.from({ length: 1000 }, (_, k) => [0, i + k / 1000, i + k / 1000, i + k / 1000, 0]));
  assert.ok(store.jobs.length <= 10_001 && store.jobs[0][3] >= 49.9);
  store.take_jobs(Array.from({ length: 50_000 }, () => [0, 60, 60, 60, 0]));
  assert.equal(store.jobs.length, 20_000);
  store.take_jobs([[7, 1, 1, 1, 0], null, [0, 1, 1, null, 0]]);
  assert.equal(store.jobs.length, 20_000);
  store.take_events(Array.from({ length: 5000 }, (_, i) => ({ at_s: i, kind: "log", node: null, text: "" })));
  assert.deepEqual([store.events.length, store.events_dropped, store.events.at(-1).at_s], [2000, 3000, 4999]);
});

test("figures as text", () => {
  const { clock, count, hertz, plain, with_unit } = part.format;
  assert.deepEqual([clock(59.9), clock(3725), clock(null)], ["0:59", "1:02:05", "–"]);
  assert.equal(count(1234567), "1\u202f234\u202f567");
  assert.deepEqual([hertz(15), hertz(6.6667), hertz(null)], ["15 Hz", "6.67 Hz", "on data"]);
  assert.deepEqual(
    [plain(0.1 + 0.2), with_unit(0.2, "m/s"), with_unit(3, "1"), with_unit("a.yaml", "path")],
    ["0.3", "0.2 m/s", "3", "a.yaml"],
  );
});
