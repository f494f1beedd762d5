// SPDX-License-Identifier: Apache-2.0
// touch.mjs ADDRESS PICTURE: somebody before the robot's own screen, the view Touch of takt web, answers a mission that seeks its
// way: left; no; left; yes. Prints one JSON object: `said`, what the screen showed of the robot's words, and `status`, what it did
// then. Exit 1 if something does not come, or does not fit the screen of the robot.
import { fresh_page, until } from "./browser.mjs";

const [address, picture] = process.argv.slice(2);
const out = { said: [], troubles: [] };

const page = await fresh_page();
page.on("console", (message) => message.type() === "error" && out.troubles.push(message.text()));
page.on("pageerror", (error) => out.troubles.push(error.message));
await page.setViewportSize({ width: 1024, height: 600 });
await page.goto(`${address}&view=touch`);
const answer = (name) => page.locator(`[data-answer=${name}]`);
await until(async () => !(await answer("yes").isDisabled()), "the right to answer");

async function hears(words) {
  await until(async () => (await page.locator(".speech").textContent()) === words, `"${words}" on the screen`);
  out.said.push(words);
}

await answer("left").click();
await hears("Do I go to the left?");
await page.screenshot({ path: picture });
await answer("no").click();
await hears("Which way, then?");
await page.getByRole("button", { name: "Deutsch" }).click();
await page.getByRole("button", { name: "Links" }).click();
await hears("Do I go to the left?");
await page.getByRole("button", { name: "Ja" }).click();
await hears("Thank you. I go to the left.");
const status = () => page.locator(".touch-status").textContent();
await until(async () => (await status()).includes("drive"), "the robot on its way");
out.status = await status();
for (const name of ["yes", "no", "left", "ahead", "right", "stop"]) {
  const box = await answer(name).boundingBox();
  if (box === null || box.x < 0 || box.y < 0 || box.x + box.width > 1024 || box.y + box.height > 600)
    out.troubles.push(`${name} does not lie on a screen of 1024 x 600: ${JSON.stringify(box)}`);
}
await page.context().browser().close();
console.log(JSON.stringify(out));
process.exit(out.troubles.length > 0 ? 1 : 0);
