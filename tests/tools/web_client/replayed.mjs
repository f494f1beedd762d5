// SPDX-License-Identifier: Apache-2.0
// replayed.mjs ADDRESS FOLDER: fetches the newest frozen record in the page of takt web into FOLDER, and has it replayed: the page
// of the replay shows its pictures and moves nothing. Prints one JSON object with what it saw; exit 1 if something does not come.
import { fresh_page, until, wait } from "./browser.mjs";

const [address, folder] = process.argv.slice(2);
const out = { troubles: [] };

const page = await fresh_page();
await page.goto(address);
await until(async () => !(await page.locator("[data-control=mode]").isDisabled()), "the right to change");
await page.keyboard.press("6");
await until(async () => (await page.locator("[data-file]").count()) > 0, "a frozen record");
const row = page.locator("[data-file]").first();
out.file = await row.getAttribute("data-file");
const saved = page.waitForEvent("download");
await row.getByRole("button", { name: "Download" }).click();
await (await saved).saveAs(`${folder}/${out.file}`);

const opened = page.waitForEvent("popup");
await row.getByRole("button", { name: "Replay" }).click();
const replay = await opened;
replay.on("pageerror", (error) => out.troubles.push(error.message));
await until(() => replay.url().includes("#token="), "the address of the replay");
out.other_port = new URL(replay.url()).port !== new URL(address).port;
await until(async () => (await replay.title()).startsWith(`Replay of ${out.file}: `), "the page of the replay");
await replay.keyboard.press("3");
const drawn = () => replay.evaluate(() => Object.values(window.takt.drawn).reduce((sum, count) => sum + count, 0));
await until(async () => (await drawn()) > 5, "pictures of the replay");
out.drawn = await drawn();
if (!(await replay.locator("[data-control=stop]").isDisabled())) out.troubles.push("a replay can be changed");
await replay.screenshot({ path: `${folder}/replay.png` });
await wait(500);
out.title = await page.title();
await page.context().browser().close();
console.log(JSON.stringify(out));
process.exit(out.troubles.length > 0 || !out.other_port || out.title.startsWith("Replay") ? 1 : 0);
