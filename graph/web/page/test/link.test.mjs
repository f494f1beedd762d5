// SPDX-License-Identifier: Apache-2.0
// The connection: the page comes back by itself, says that a run has ended, bounds what it keeps, survives damaged data.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { launch, open, until } from "./browser.mjs";
import { FakeServer } from "./fake_server.mjs";
import { pictures } from "./pictures.mjs";

let browser;
let drawn;
before(async () => {
  browser = await launch();
  drawn = await pictures(browser);
});
after(() => browser?.close());

async function with_page(options, body) {
  const server = await new FakeServer({ pictures: drawn }).start();
  const opened = await open(browser, server, options);
  try {
    await body(opened.page, server, opened);
  } finally {
    await opened.close();
    await server.stop();
  }
}

const total = (page, key) => page.evaluate((name) => window.takt.drawn[name] ?? 0, key);

test("a closed connection: a banner, then all is there again, looks and token included", async () => {
  await with_page({ view: "robot" }, async (page, server) => {
    await until(async () => (await total(page, "front_laser.scan/scan")) > 2, "scans");
    server.drop_connections();
    await until(
      async () => /No connection to takt web/.test(await page.locator(".banner").textContent()),
      "the banner",
    );
    assert.equal(await page.locator("[data-control=stop]").isDisabled(), true);
    await until(() => page.locator(".light.good").count(), "the connection");
    assert.equal(await page.locator(".banner").isVisible(), false);
    await until(() => server.tokens.length === 2, "the token again");
    const before = await total(page, "front_laser.scan/scan");
    await until(async () => (await total(page, "front_laser.scan/scan")) > before + 2, "scans again");
    await until(async () => !(await page.locator("[data-control=stop]").isDisabled()), "the right to change again");
  });
});

test("the pauses between tries grow", async () => {
  await with_page({}, async (page, server) => {
    await page.evaluate(() => {
      window.pauses = [];
      const original = window.setTimeout;
      window.setTimeout = (run, pause_ms) => {
        if (pause_ms !== 10000) window.pauses.push(pause_ms); // 10 s: the patience with an answer
        return original(run, 1);
      };
    });
    server.sockets.removeAllListeners("connection");
    server.sockets.on("connection", (socket) => socket.close());
    server.drop_connections();
    await until(() => page.evaluate(() => window.pauses.length >= 7), "seven tries");
    const pauses = (await page.evaluate(() => window.pauses)).slice(0, 7);
    const expected = [500, 1000, 2000, 4000, 8000, 10000, 10000];
    pauses.forEach((pause, i) => assert.ok(pause >= 0.9 * expected[i] && pause <= 1.1 * expected[i], pauses.join(" ")));
  });
});

test("gone: the reason in a banner; the next run begins afresh", async () => {
  await with_page({ view: "log" }, async (page, server) => {
    server.event("log", "stereo", "a line of the first run", 12.2);
    await until(async () => (await page.locator("ol.log").textContent()).includes("first run"), "the line");
    server.gone("asked for by takt web");
    await until(
      async () => (await page.locator(".banner").textContent()).startsWith("The run has ended: asked for by takt web."),
      "the reason",
    );
    assert.equal(await page.locator("[data-control=mode]").getAttribute("title"), "Disabled: the run has ended");
    server.new_run(5000);
    for (const client of server.clients) server.hello(client);
    await until(async () => !(await page.locator(".banner").isVisible()), "the next run");
    await until(async () => !(await page.locator("ol.log").textContent()).includes("first run"), "its own log");
  });
});

test("events are not shown twice, though each hello brings all of them", async () => {
  await with_page({ view: "log" }, async (page, server) => {
    await page.locator(".event").first().waitFor();
    for (const client of server.clients) server.hello(client);
    server.event("log", null, "the last one", 99);
    await until(
      async () => (await page.locator(".event-text").allTextContents()).at(-1) === "the last one",
      "the last one",
    );
    assert.equal(await page.locator(".event").count(), server.model.events.length);
  });
});

test("damaged frames are counted and dropped, unknown messages ignored", async () => {
  await with_page({ view: "robot" }, async (page, server, { troubles }) => {
    await until(async () => (await total(page, "front_laser.scan/scan")) > 0, "scans");
    for (const { socket } of server.clients) {
      for (const bytes of [[], [1, 2], [255, 255, 255, 255], [4, 0, 0, 0, 110, 117, 108, 108], [2, 0, 0, 0, 123, 125]])
        socket.send(Buffer.from(bytes));
      socket.send("{");
      socket.send('{"op": "tomorrow", "what": 1}');
    }
    await until(() => page.evaluate(() => window.takt.damaged === 6), "six damaged ones");
    for (const client of server.clients) {
      server.send_binary(
        client,
        {
          port: "scan_matching.map",
          kind: "grid",
          sequence: 1,
          stamp_s: 1,
          age_ms: 1,
          level: 0,
          width: 5000,
          height: 5000,
          cell_m: 0.1,
        },
        Buffer.alloc(10),
      );
      server.send_binary(
        client,
        { port: "head_camera.pair", part: "left", kind: "picture", sequence: 1, stamp_s: 1, age_ms: 1, level: 0 },
        Buffer.from("no JPEG"),
      );
    }
    const before = await total(page, "head_camera.pair/picture");
    await until(async () => (await total(page, "head_camera.pair/picture")) > before + 2, "pictures go on");
    assert.deepEqual(troubles, []);
  });
});

test("a burst is drawn in one animation frame, the newest of it", async () => {
  await with_page({ view: "robot" }, async (page, server) => {
    await until(async () => (await total(page, "front_laser.scan/scan")) > 0, "scans");
    server.frames = () => {};
    await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
    await page.evaluate(() => {
      window.held = [];
      window.requestAnimationFrame = (draw) => window.held.push(draw);
    });
    const read = () =>
      page.evaluate(() => [window.takt.received["front_laser.scan/scan"], window.takt.drawn["front_laser.scan/scan"]]);
    const [received, shown] = await read();
    const [client] = server.clients;
    const head = { port: "front_laser.scan", kind: "scan", age_ms: 1, level: 0, first_angle_rad: 0, step_rad: 0.1 };
    for (let i = 1; i <= 400; ++i) server.send_binary(client, { ...head, sequence: i, stamp_s: i }, Buffer.alloc(40));
    await until(async () => (await read())[0] === received + 400, "the burst");
    assert.equal((await read())[1], shown, "nothing is drawn between frames");
    assert.equal(await page.evaluate(() => window.held.length), 1, "one frame is asked for");
    await page.evaluate(() => window.held[0]());
    await until(
      async () => (await page.locator(".panel.scan .panel-foot").textContent()).startsWith("400.00 s"),
      "the newest",
    );
    assert.equal((await read())[1], shown + 1);
  });
});

test("clouds are drawn with WebGL where there is one, else on a canvas", async () => {
  for (const [webgl, painter] of [
    [true, "webgl"],
    [false, "canvas"],
  ]) {
    const own = await launch({ webgl });
    const server = await new FakeServer().start();
    try {
      const { page, troubles } = await open(own, server, { view: "robot" });
      await until(async () => (await total(page, "stereo.cloud/cloud")) > 1, "clouds");
      const panel = page.locator(".cloud-screen");
      assert.equal(await panel.getAttribute("data-painter"), painter);
      server.frames = () => {};
      await panel.locator("canvas").focus();
      let before = await panel.screenshot();
      await until(async () => {
        const last = before;
        before = await panel.screenshot();
        return before.equals(last);
      }, "a picture that stands");
      for (let i = 0; i < 5; ++i) await page.keyboard.press("ArrowLeft");
      await until(async () => !(await panel.screenshot()).equals(before), "another view of the points");
      assert.deepEqual(troubles, []);
    } finally {
      await own.close();
      await server.stop();
    }
  }
});
