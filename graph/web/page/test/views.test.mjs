// SPDX-License-Identifier: Apache-2.0
// Every view at three sizes in light and dark: no error, no request to elsewhere, nothing wider than the screen, no
// serious finding of axe-core. Screenshots go into $TAKT_PAGE_SHOTS or a temporary folder.
import assert from "node:assert/strict";
import { mkdirSync, mkdtempSync, readFileSync, statSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { launch, open, until } from "./browser.mjs";
import { FakeServer } from "./fake_server.mjs";
import { pictures } from "./pictures.mjs";

const kViews = ["overview", "timeline", "robot", "devices", "parameters", "records", "log", "touch"];
const kSizes = [
  [1024, 600],
  [360, 740],
  [1600, 900],
];
const axe = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");
const shots = process.env.TAKT_PAGE_SHOTS ?? mkdtempSync(join(tmpdir(), "takt-page-shots-"));

let browser;
let server;
before(async () => {
  mkdirSync(shots, { recursive: true });
  browser = await launch();
  server = await new FakeServer({ pictures: await pictures(browser) }).start();
});
after(async () => {
  await server?.stop();
  await browser?.close();
  console.log(`screenshots: ${shots}`);
});

/** What a view shows once it has everything; a view that never gets there fails the test. */
const kReady = {
  overview: () =>
    document.querySelectorAll("[data-node] td").length > 100 &&
    document.querySelectorAll("g.node.unknown").length === 0,
  timeline: () => document.querySelectorAll(".late-jobs button").length > 0,
  robot: () => Object.keys(window.takt.drawn).length >= 8,
  devices: () =>
    document.querySelectorAll(".switch").length > 20 && document.querySelectorAll("[data-device]").length > 6,
  parameters: () => document.querySelectorAll("details").length > 15,
  records: () => document.querySelectorAll(".entries .at").length > 0,
  log: () => document.querySelectorAll(".event").length > 1,
  touch: () => document.querySelector(".speech").textContent.includes("Shall I go on?"),
};

/** axe-core runs outside the page's content policy, as a tool of the browser. */
async function serious_findings(page) {
  await page.evaluate(axe);
  const found = await page.evaluate(() => window.axe.run(document, { resultTypes: ["violations"] }));
  return found.violations
    .filter(({ impact }) => ["serious", "critical"].includes(impact))
    .map(
      ({ id, nodes }) =>
        `${id}: ${nodes
          .map((node) => node.html)
          .slice(0, 3)
          .join(" ")}`,
    );
}

for (const [width, height] of kSizes) {
  for (const scheme of ["light", "dark"]) {
    for (const [i, view] of kViews.entries()) {
      test(`${view} at ${width}x${height}, ${scheme}`, async () => {
        const { page, troubles, close } = await open(browser, server, { width, height, scheme });
        await page.keyboard.press(String(i + 1));
        assert.equal(await page.locator(`#panel-${view}`).isVisible(), true, "the digit opens the view");
        await until(() => page.evaluate(kReady[view]), `all of ${view}`);
        if (view === "overview") await page.locator("g.node", { hasText: "ego_motion" }).press("Enter");
        if (view === "parameters") await page.locator("#panel-parameters summary").first().click();
        if (view === "timeline") await page.locator(".late-jobs button").first().click();
        await page.screenshot({ path: join(shots, `${view}-${width}x${height}-${scheme}.png`) });
        assert.deepEqual(await serious_findings(page), []);
        assert.ok((await page.evaluate(() => document.documentElement.scrollWidth)) <= width, "wider than the screen");
        assert.deepEqual(troubles, []);
        await close();
      });
    }
  }
}

test("arrows move in the list of tabs, and the view stays over a reload", async () => {
  const { page, close } = await open(browser, server);
  await page.locator("#tab-overview").focus();
  for (const key of ["ArrowRight", "ArrowRight", "ArrowLeft"]) await page.keyboard.press(key);
  assert.equal(await page.evaluate(() => document.activeElement.id), "tab-timeline");
  await page.keyboard.press("End");
  assert.equal(await page.locator("#panel-touch").isVisible(), true);
  await page.keyboard.press("7");
  await page.reload();
  assert.equal(await page.locator("#panel-log").isVisible(), true);
  await close();
});

test("a page without a token, read only, has no serious finding either", async () => {
  const { page, troubles, close } = await open(browser, server, { token: "", view: "devices" });
  await until(() => page.evaluate(kReady.devices), "devices");
  assert.deepEqual(await serious_findings(page), []);
  assert.deepEqual(troubles, []);
  await close();
});

test("the bundle is small and asks for nothing else", async () => {
  const bundle = join(import.meta.dirname, "../bundle");
  const bytes = ["index.html", "page.js", "page.css"].reduce((sum, file) => sum + statSync(join(bundle, file)).size, 0);
  assert.ok(bytes < 300_000, `${bytes} bytes`);
  server.requests = [];
  const { close } = await open(browser, server);
  assert.deepEqual([...server.requests].sort(), ["/", "/page.css", "/page.js"]);
  await close();
});
