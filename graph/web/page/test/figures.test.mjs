// SPDX-License-Identifier: Apache-2.0
// What the page shows is what the server sent: figures of nodes, chains, processes, devices, jobs, events, frames.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { launch, open, until } from "./browser.mjs";
import { FakeServer } from "./fake_server.mjs";
import { pictures } from "./pictures.mjs";

let browser;
let server;
let drawn;
before(async () => {
  browser = await launch();
  drawn = await pictures(browser);
});
after(() => browser?.close());

/** A server and a page of its own for each test. */
function check(name, options, body) {
  test(name, async () => {
    server = await new FakeServer({ pictures: drawn }).start();
    try {
      const opened = await open(browser, server, options);
      await body(opened.page, opened);
      assert.deepEqual(opened.troubles, []);
      await opened.close();
    } finally {
      await server.stop();
    }
  });
}

const plain = (text) => text.replace(/\u202f/g, "");
const row = async (page, selector) => (await page.locator(`${selector} > *`).allTextContents()).map(plain);
const one = (value) => (value === null || value === undefined ? "–" : value.toFixed(1));
const hertz = (value) => (value === null ? "on data" : `${value} Hz`);

/** From now on the page gets one state again and again; returns once it has drawn it. */
async function hold(page) {
  const state = server.hold_state();
  state.running_s = 3599;
  await until(async () => (await page.locator(".head > .num").textContent()) === "59:59", "the state that is held");
  await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
  return state;
}

check("overview: nodes", { width: 1600, height: 900 }, async (page) => {
  const state = await hold(page);
  for (const [i, node] of server.graph.nodes.entries()) {
    const seen = state.nodes[i];
    const high = node.criticality === "high" ? "high" : "";
    const level = node.levels > 1 ? `${seen.level}/${node.levels - 1}` : "–";
    const counts = [seen.completed, seen.deadline_misses, seen.skipped, seen.overruns].map(String);
    const expected = [
      node.name + high,
      node.process,
      hertz(node.rate_hz),
      one(node.deadline_ms),
      one(node.budget_ms),
      one(seen.exec_ms),
      one(seen.response_ms),
      one(seen.response_max_ms),
      one(node.proven_ms),
      ...counts,
      level,
    ];
    assert.deepEqual(await row(page, `tr[data-node="${node.name}"]`), expected);
    const box = await page.locator("g.node").nth(i).textContent();
    for (const text of [
      node.name,
      `exec ${one(seen.exec_ms)} of ${one(node.budget_ms)} ms`,
      `resp ${one(seen.response_ms)}, max ${one(seen.response_max_ms)} of ${one(node.proven_ms)}`,
    ])
      assert.ok(box.includes(text), `${text} in ${box}`);
  }
});

check("overview: run, chains, processes", { width: 1600, height: 900 }, async (page) => {
  const state = await hold(page);
  const figures = (await page.locator(".figures dd").allTextContents()).map(plain);
  const sum = (name) => state.nodes.reduce((total, node) => total + node[name], 0);
  assert.deepEqual(figures, [
    "full",
    "59:59",
    `${state.cpu.toFixed(2)} of 2 cores`,
    "921 MB",
    "10 ms",
    String(sum("deadline_misses")),
    String(sum("skipped")),
    "0",
  ]);
  for (const [i, chain] of server.graph.chains.entries()) {
    const expected = [
      chain.name,
      one(state.chains[i].age_ms),
      one(state.chains[i].age_max_ms),
      one(chain.proven_ms),
      one(chain.bound_ms),
      "",
    ];
    assert.deepEqual(await row(page, `tr[data-chain="${chain.name}"]`), expected);
  }
  for (const process of state.processes)
    assert.deepEqual(await row(page, `tr[data-process="${process.name}"]`), [
      process.name,
      process.state,
      String(process.pid),
      String(process.restarts),
    ]);
});

check("overview: figures that are not known are dashes", { width: 1600, height: 900 }, async (page) => {
  const state = await hold(page);
  Object.assign(state, { cpu: null, memory_mb: null, host_stall_ms: null });
  Object.assign(state.nodes[0], { exec_ms: null, response_ms: null, response_max_ms: null });
  state.chains[0] = { age_ms: null, age_max_ms: null };
  await until(async () => (await row(page, 'tr[data-node="head_camera"]'))[5] === "–", "a dash");
  assert.equal((await page.locator(".figures dd").allTextContents())[3], "–");
});

check("the chosen node shows its ports, and a look opens its panel", {}, async (page) => {
  await page.locator('tr[data-node="stereo"] button').click();
  await page.locator(".node-panel h3", { hasText: "stereo" }).first().waitFor();
  await page.getByRole("button", { name: "look: cloud of stereo.cloud" }).click();
  assert.equal(await page.locator("#panel-robot").isVisible(), true);
  await until(() => page.evaluate(() => (window.takt.drawn["stereo.cloud/cloud"] ?? 0) > 1), "a cloud");
});

check(
  "timeline: a click shows the numbers of a late job, with its sentence",
  { width: 1600, height: 900, view: "timeline" },
  async (page) => {
    const late = page.locator(".late-jobs button").first();
    await late.waitFor();
    await late.click();
    const index = server.graph.nodes.findIndex((node) => node.name === "stereo");
    const shown = await page.locator(".job dd").allTextContents();
    const release = Number.parseFloat(shown[0]);
    const job = server.history.find((entry) => entry[0] === index && Math.abs(entry[1] - release) < 0.0001);
    assert.ok(job, `a job released at ${release}`);
    const ms = (value) => `${(value * 1000).toFixed(1)} ms`;
    assert.deepEqual(shown.slice(1, 6), [
      `${ms(job[2] - job[1])} after`,
      ms(job[3] - job[2]),
      "16.0 ms",
      ms(job[3] - job[1]),
      "66.0 ms",
    ]);
    assert.match(shown[6], / ms late$/);
    assert.match(await page.locator(".said").first().textContent(), /stereo missed its deadline/);
    assert.equal(await page.locator(".said").count(), 1, "the event of the same sentence is not shown twice");
    // A click into the picture finds the same job: it stands in the middle.
    await page.locator("#panel-timeline canvas").focus();
    for (let i = 0; i < 12; ++i) await page.keyboard.press("+");
    await page.keyboard.press(".");
    assert.notEqual((await page.locator(".job dd").allTextContents())[0], shown[0]);
    await page.keyboard.press(",");
    assert.equal((await page.locator(".job dd").allTextContents())[0], shown[0]);
  },
);

check(
  "timeline: wheel zooms, drag moves, a click chooses",
  { width: 1600, height: 900, view: "timeline" },
  async (page) => {
    await page.locator(".late-jobs button").first().waitFor();
    const canvas = page.locator("#panel-timeline canvas");
    const span = async () => await page.locator("#panel-timeline output").textContent();
    const box = await canvas.boundingBox();
    const whole = await span();
    await page.mouse.move(box.x + 700, box.y + 60);
    await page.mouse.wheel(0, -900);
    await until(async () => (await span()) !== whole, "zoomed in");
    const zoomed = await span();
    await page.mouse.down();
    await page.mouse.move(box.x + 900, box.y + 60, { steps: 4 });
    await page.mouse.up();
    await until(async () => (await span()) !== zoomed, "moved");
    assert.equal(await page.locator("#panel-timeline input[type=checkbox]").isChecked(), false, "following ends");
    const row_of_stereo = 24 + 22 * (2 + server.graph.nodes.findIndex((node) => node.name === "stereo")) + 11;
    for (let x = 200; x < 1000 && !(await page.locator(".job h3").count()); x += 5)
      await page.mouse.click(box.x + x, box.y + row_of_stereo);
    assert.equal(await page.locator(".job h3").textContent(), "stereo");
  },
);

check("devices", { view: "devices" }, async (page) => {
  const state = await hold(page);
  for (const device of state.devices) {
    const cells = await row(page, `tr[data-device="${device.name}"]`);
    cells.splice(3, 1); // the rate is the page's own figure
    assert.deepEqual(cells, [
      device.name,
      device.state,
      ...[device.received, device.damaged, device.missing, device.resyncs, device.losses].map(String),
    ]);
  }
});

check("robot: every kind of frame is drawn, and a hidden view looks at nothing", { view: "robot" }, async (page) => {
  const kinds = ["picture", "disparity", "cloud", "scan", "grid", "value"];
  await until(
    () =>
      page.evaluate(
        (all) =>
          all.every((kind) =>
            Object.keys(window.takt.drawn).some((key) => key.endsWith(`/${kind}`) && window.takt.drawn[key] >= 2),
          ),
        kinds,
      ),
    "frames of all kinds",
  );
  const counts = await page.evaluate(() => window.takt);
  for (const [key, times] of Object.entries(counts.drawn)) assert.ok(times <= counts.received[key], key);
  assert.ok(
    Object.values(counts.latency_ms).every((ages) => ages.length > 0 && ages.every((age) => age >= 30)),
    "ages begin with the 30 ms that the server states",
  );
  assert.equal(counts.damaged, 0);
  const pixels = await page
    .locator(".panel.picture canvas")
    .evaluate((canvas) => [canvas.width, canvas.height, ...canvas.getContext("2d").getImageData(160, 200, 1, 1).data]);
  assert.deepEqual(pixels.slice(0, 2), [320, 240]);
  assert.ok(pixels[2] > 20, "the picture is not black");
  const looks = () => [...server.clients].reduce((sum, client) => sum + client.looks.size, 0);
  assert.ok(looks() >= 8);
  await page.keyboard.press("7");
  await until(() => looks() === 0, "no look is left");
});

check("robot: values as lists and trees", { view: "robot" }, async (page) => {
  const map = page.locator(".panel.value", { has: page.locator("table") }).first();
  await map.locator("tbody tr").first().waitFor();
  assert.deepEqual(await map.locator("tbody tr").first().locator("> *").allTextContents(), [
    "cup_1",
    "mug",
    "-1.80",
    "3.30",
    "0.85",
    "94 %",
    "level=full colour=red",
  ]);
  await page.locator(".add-panel select").selectOption("value base.odometry");
  await page.getByRole("button", { name: "Add" }).click();
  const tree = page.locator('.panel[aria-label="value of base.odometry"]');
  await until(async () => (await tree.textContent()).includes("theta_rad"), "a tree");
  assert.match(await tree.textContent(), /first 8 of 40/);
});

check("records: frozen sentences and marks", { view: "records" }, async (page) => {
  server.event("mark", null, "the cup fell", 12.5);
  const entries = async (i) => page.locator(".entries").nth(i).locator("li").allTextContents();
  await until(async () => (await entries(1))[0] === "12.5 sthe cup fell", "the mark");
  const frozen = server.hold_state().frozen;
  await until(async () => (await entries(0)).length === frozen.length, "the sentences");
  assert.deepEqual(
    await entries(0),
    [...frozen].reverse().map((text) => text.replace(": ", "")),
  );
});

check("log: filters by kind and node, and says what it dropped", { view: "log" }, async (page) => {
  server.event("fault", "front_laser", "front_laser is silent", 13);
  server.event("parameter", "stereo", "stereo.search 40 px", 13.5);
  const texts = () => page.locator(".event-text").allTextContents();
  await until(async () => (await texts()).at(-1) === "stereo.search 40 px", "the newest event at the end");
  await page.locator(".chip", { hasText: "parameter" }).click();
  await until(async () => !(await texts()).includes("stereo.search 40 px"), "without parameters");
  await page.locator("#panel-log select").selectOption("front_laser");
  await until(async () => (await texts()).join() === "front_laser is silent", "one node");
  const many = Array.from({ length: 2600 }, (_, i) => ({
    at_s: 20 + i / 100,
    kind: "log",
    node: "front_laser",
    text: `line ${i}`,
  }));
  for (const client of server.clients) server.send(client, { op: "events", events: many });
  await until(async () => (await texts()).at(-1) === "line 2599", "the last line");
  assert.equal((await texts()).length, 500, "rows are bounded");
  assert.match(
    plain(await page.locator("#panel-log .card > [role=status]").textContent()),
    /6\d\d older events were dropped: the page keeps 2000/,
  );
});
