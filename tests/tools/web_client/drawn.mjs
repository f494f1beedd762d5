// SPDX-License-Identifier: Apache-2.0
// drawn.mjs ADDRESS SECONDS [KIND]: Chromium at the robot's view of takt web, with all its panels or the first one of a kind. Prints how
// many frames of each port were received and drawn in that time, and their ages when they were drawn, as one JSON object.
import { fresh_page } from "./browser.mjs";

const [address, seconds, kind = ""] = process.argv.slice(2);
const page = await fresh_page();
await page.goto(`${address}&view=robot`);
await page.waitForFunction(() => Object.keys(window.takt?.drawn ?? {}).length > 0);
if (kind !== "") await page.evaluate((kind) => document.querySelectorAll(`.panel:not(.${kind}) [title=Close]`).forEach((close) => close.click()), kind);
await page.waitForTimeout(2000);
await page.evaluate(() => (window.takt.latency_ms = {}));
const look = () => page.evaluate(() => structuredClone({ drawn: window.takt.drawn, received: window.takt.received, at: performance.now() }));
const before = await look();
await page.waitForTimeout(Number(seconds) * 1000);
const after = await look();
const since = (name) => Object.fromEntries(Object.entries(after[name]).map(([key, count]) => [key, count - (before[name][key] ?? 0)]));
const latency_ms = await page.evaluate(() => structuredClone(window.takt.latency_ms));
console.log(JSON.stringify({ seconds: (after.at - before.at) / 1000, drawn: since("drawn"), received: since("received"), latency_ms }));
await page.context().browser().close();
process.exit(0);
