// SPDX-License-Identifier: Apache-2.0
// The fake server by itself, to look at the page: node test/fake_main.mjs [port]
import { launch } from "./browser.mjs";
import { FakeServer } from "./fake_server.mjs";
import { pictures } from "./pictures.mjs";

const browser = await launch();
const drawn = await pictures(browser);
await browser.close();
const server = await new FakeServer({ pictures: drawn }).start(Number(process.argv[2] ?? 8765));
console.log(server.address());
