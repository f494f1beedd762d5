// SPDX-License-Identifier: Apache-2.0
// What the scripts that drive the page in Chromium share.
import { chromium } from "playwright-core";

const flags = ["--no-sandbox", "--disable-gpu", "--disable-background-networking"];

/** A page of a fresh browser; `page.context().browser()` is it. */
export async function fresh_page() {
  const browser = await chromium.launch({ executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium", args: flags });
  return (await browser.newContext({ viewport: { width: 1280, height: 800 } })).newPage();
}

export const wait = (ms) => new Promise((done) => setTimeout(done, ms));

/** Until the condition holds, half a minute at most. */
export async function until(condition, what) {
  for (let i = 0; i < 600; ++i) {
    if (await condition()) return;
    await wait(50);
  }
  throw new Error(`this has not come: ${what}`);
}
