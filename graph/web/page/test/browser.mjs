// SPDX-License-Identifier: Apache-2.0
// Debian's Chromium under playwright-core, and pages that note errors and requests to elsewhere.
import { chromium } from "playwright-core";

const kFlags = ["--no-sandbox", "--disable-gpu", "--disable-background-networking"];

/** `webgl`: a renderer in software, or no WebGL at all. */
export function launch({ webgl = false } = {}) {
  const flags = [
    ...kFlags,
    ...(webgl ? ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"] : ["--disable-3d-apis"]),
  ];
  return chromium.launch({ executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium", args: flags });
}

/** A page at an address; `troubles` gets each console error, uncaught exception and request to another place. */
export async function open(
  browser,
  server,
  { width = 1024, height = 600, scheme = "light", token = server.token, view = "", locale = "en" } = {},
) {
  const context = await browser.newContext({
    viewport: { width, height },
    colorScheme: scheme,
    locale,
    hasTouch: width < 500,
  });
  const page = await context.newPage();
  const troubles = [];
  page.on("console", (message) => message.type() === "error" && troubles.push(`console: ${message.text()}`));
  page.on("pageerror", (error) => troubles.push(`exception: ${error.message}`));
  page.on("request", (request) => {
    const own = [`http://127.0.0.1:${server.port}/`, "data:", "blob:"].some((start) => request.url().startsWith(start));
    if (!own) troubles.push(`request to ${request.url()}`);
  });
  page.on(
    "websocket",
    (socket) => socket.url() !== `ws://127.0.0.1:${server.port}/` && troubles.push(`socket to ${socket.url()}`),
  );
  await page.goto(server.address(token, view));
  await page.waitForFunction(() => document.querySelector(".light.good") !== null);
  return { page, troubles, close: () => context.close() };
}

/** Waits until `condition` gives true; it may be asynchronous. */
export async function until(condition, what) {
  for (let i = 0; i < 400; ++i) {
    if (await condition()) return;
    await new Promise((done) => setTimeout(done, 25));
  }
  throw new Error(`this has not come: ${what}`);
}
