// SPDX-License-Identifier: Apache-2.0
// end.mjs ADDRESS PROCESS: a process of the run is killed and is seen to come back on the page of takt web; then the page
// stops the run. Prints one JSON object: `restarts` of the process, `done`: jobs of each node that stood still before the
// stop, as the page shows them. Exit 1 if something does not come.
import { fresh_page, until, wait } from "./browser.mjs";

const [address, name] = process.argv.slice(2);

const page = await fresh_page();
await page.goto(address);
await until(async () => !(await page.locator("[data-control=stop]").isDisabled()), "the right to change");
await page.keyboard.press("1");

const seen = async () => {
  const cells = await page.locator(`[data-process="${name}"] td`).allTextContents();
  return { state: cells[0], pid: Number(cells[1]), restarts: Number(cells[2]) };
};
await until(async () => (await seen()).state === "running", `process ${name}`);
const before = await seen();
process.kill(before.pid, "SIGKILL");
await until(async () => {
  const now = await seen();
  return now.restarts === before.restarts + 1 && now.pid !== before.pid && now.state === "running";
}, `process ${name}, started again`);
await page.keyboard.press("7");
await until(async () => (await page.locator("#panel-log").textContent()).includes(`process ${name} is back`), "its return in the log");
await page.keyboard.press("1");

const kDone = 8; // the column of the table of nodes, its head not counted
const counts = () =>
  page.evaluate(
    (column) => Object.fromEntries([...document.querySelectorAll("tr[data-node]")].map((row) => [row.dataset.node, row.querySelectorAll("td")[column].textContent])),
    kDone,
  );
const first = await counts();
await wait(2000);
const second = await counts();
await page.locator("[data-control=stop]").click();
await page.getByRole("button", { name: "Stop the run" }).click();
await until(async () => /The run has ended/.test(await page.locator("body").textContent()), "the end of the run");
const third = await counts();
const stood = Object.keys(first).filter((node) => first[node] === second[node] && second[node] === third[node]);
console.log(JSON.stringify({ restarts: (await seen()).restarts, done: Object.fromEntries(stood.map((node) => [node, Number(third[node].replace(/\D/g, ""))])) }));
await page.context().browser().close();
