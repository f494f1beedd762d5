// SPDX-License-Identifier: Apache-2.0
// page.mjs ADDRESS FOLDER [PARAM VALUE]: the page of takt web in Chromium, against a running graph. Opens each view, keeps
// pictures of them in FOLDER, looks at a port until pictures are drawn, sets and keeps a parameter, sets a mark, changes the mode.
// Prints one JSON object with what it saw; exit 1 on a console error, a request to elsewhere, or what does not come.
import { fresh_page, until, wait } from "./browser.mjs";

const [address, folder, param = "", value = ""] = process.argv.slice(2);
const views = ["overview", "timeline", "robot", "devices", "parameters", "records", "log", "touch"];
const out = { views: [], troubles: [] };

const origin = new URL(address).origin;
const page = await fresh_page();
page.on("console", (message) => message.type() === "error" && out.troubles.push(message.text()));
page.on("pageerror", (error) => out.troubles.push(error.message));
page.on("request", (request) => {
  if (![origin, "data:", "blob:"].some((start) => request.url().startsWith(start))) out.troubles.push(request.url());
});

await page.goto(address);
await until(async () => (await page.locator(".light.good").count()) > 0, "the state of the run");
await until(async () => !(await page.locator("[data-control=mode]").isDisabled()), "the right to change");
for (const [i, view] of views.entries()) {
  await page.keyboard.press(String(i + 1));
  await until(() => page.locator(`#panel-${view}`).isVisible(), view);
  await wait(view === "timeline" || view === "robot" ? 4000 : 1200);
  await page.screenshot({ path: `${folder}/${view}.png` });
  out.views.push(view);
  if (view === "robot") {
    const counts = () => page.evaluate(() => structuredClone({ drawn: window.takt.drawn, received: window.takt.received }));
    const before = await counts();
    await wait(3000);
    const after = await counts();
    out.received = {};
    out.drawn = {};
    for (const key of Object.keys(after.drawn)) out.drawn[key] = after.drawn[key] - (before.drawn[key] ?? 0);
    for (const key of Object.keys(after.received)) out.received[key] = after.received[key] - (before.received[key] ?? 0);
    out.latency_ms = await page.evaluate(() => structuredClone(window.takt.latency_ms));
  }
}

await page.keyboard.press("5");
if (param !== "") {
  const node = param.split(".")[0];
  await page.locator(`details[data-node="${node}"] summary`).click();
  const row = page.locator(`[data-param="${param}"]`);
  await row.locator(".field").fill(value);
  await row.locator(".keep input").check();
  await row.getByRole("button", { name: "Set" }).click();
  await until(async () => (await row.evaluate((element) => element.classList.contains("changed"))), "the new value");
  out.value = await row.locator(".value").textContent();
}
await page.locator("[data-control=mark]").click();
await page.locator("dialog input").fill("seen in the page");
await page.keyboard.press("Enter");
await until(async () => (await page.locator("dialog").count()) === 0, "the mark");
await page.locator("[data-control=mode]").click();
await page.getByRole("radio", { name: "safe_stop" }).check();
await page.getByRole("button", { name: "Change" }).click();
await until(async () => (await page.locator("[data-control=mode]").textContent()) === "Mode: safe_stop", "the new mode");
await page.keyboard.press("7");
await until(async () => /seen in the page/.test(await page.locator("#panel-log").textContent()), "the mark in the log");
out.mode = "safe_stop";
await page.context().browser().close();
console.log(JSON.stringify(out));
process.exit(out.troubles.length > 0 ? 1 : 0);
