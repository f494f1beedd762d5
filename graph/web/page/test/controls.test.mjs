// SPDX-License-Identifier: Apache-2.0
// What changes the run: the right question goes out, its answer is shown where it belongs, and without the token nothing
// of it can be used.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { launch, open, until } from "./browser.mjs";
import { FakeServer } from "./fake_server.mjs";

let browser;
let server;
before(async () => (browser = await launch()));
after(() => browser?.close());

function check(name, options, body) {
  test(name, async () => {
    server = await new FakeServer().start();
    try {
      const opened = await open(browser, server, options);
      await until(
        async () => options.token === "" || !(await opened.page.locator("[data-control=mode]").isDisabled()),
        "the right to change",
      );
      await body(opened.page, opened);
      assert.deepEqual(opened.troubles, []);
      await opened.close();
    } finally {
      await server.stop();
    }
  });
}

const asked = (what) => server.asks.filter((question) => question.do === what);

check("mode", {}, async (page) => {
  await page.locator("[data-control=mode]").click();
  await page.getByRole("radio", { name: "safe_stop" }).check();
  await page.getByRole("button", { name: "Change" }).click();
  await until(
    async () => (await page.locator("[data-control=mode]").textContent()) === "Mode: safe_stop",
    "the new mode",
  );
  assert.deepEqual(asked("mode"), [{ do: "mode", mode: "safe_stop" }]);
  assert.equal(await page.locator("dialog").count(), 0);
});

check("mode: an error stays in the dialog", {}, async (page) => {
  server.model.answer = () => ({ error: "the mode of this run has been changed too often" });
  await page.locator("[data-control=mode]").click();
  await page.getByRole("button", { name: "Change" }).click();
  await until(
    async () =>
      (await page.locator("dialog .error").textContent()) === "the mode of this run has been changed too often",
    "the error",
  );
  await page.keyboard.press("Escape");
  await until(async () => (await page.locator("dialog").count()) === 0, "the dialog's end");
});

check("stop asks first", {}, async (page) => {
  await page.locator("[data-control=stop]").click();
  await page.getByRole("button", { name: "Cancel" }).click();
  assert.deepEqual(asked("stop"), []);
  await page.locator("[data-control=stop]").click();
  await page.getByRole("button", { name: "Stop the run" }).click();
  await until(() => asked("stop").length === 1, "the question");
});

check("mark, in the dialog and in the records", { view: "records" }, async (page) => {
  await page.locator("[data-control=mark]").click();
  await page.locator("dialog input").fill("door opened");
  await page.keyboard.press("Enter");
  await until(() => asked("mark").length === 1, "the mark");
  const words = page.locator(".mark-form input");
  await words.fill("ä".repeat(120));
  await page.keyboard.press("Enter");
  await until(
    async () => /at most 199 bytes, this one has 240/.test(await page.locator("#panel-records .error").textContent()),
    "the bound",
  );
  await words.fill("it slipped");
  await page.locator(".mark-form button").click();
  await until(() => asked("mark").length === 2, "the second mark");
  assert.deepEqual(
    asked("mark").map((question) => question.words),
    ["door opened", "it slipped"],
  );
});

check("frozen records: fetched, replayed in a page of its own, and why not", { view: "records" }, async (page) => {
  const row = page.locator('[data-file="ace-2-mark.mcap"]');
  await until(async () => /241\.0 MB/.test(await row.textContent()), "the list");
  assert.equal(await page.locator("[data-file]").count(), 2);
  const saved = page.waitForEvent("download");
  await row.getByRole("button", { name: "Download" }).click();
  assert.equal((await saved).suggestedFilename(), "ace-2-mark.mcap");
  assert.deepEqual(asked("download"), [{ do: "download", file: "ace-2-mark.mcap" }]);
  assert.ok(server.requests.includes("/frozen/ace-2-mark.mcap?ticket=abc"), server.requests);

  const address = server.address("replay", "overview");
  server.model.replay_end = { state: "shown", address };
  const opened = page.waitForEvent("popup");
  await row.getByRole("button", { name: "Replay" }).click();
  const other = await opened;
  await other.waitForURL(address);
  await until(
    async () => /is replayed in the other page/.test(await page.locator("#panel-records").textContent()),
    "where it is",
  );
  await other.close();
  server.model.replay_end = { state: "ended", why: "the record is damaged" };
  await row.getByRole("button", { name: "Replay" }).click();
  await until(
    async () =>
      /is not replayed: the record is damaged/.test(await page.locator("#panel-records .error").textContent()),
    "why not",
  );
});

check("a replay says so and changes nothing", {}, async (page) => {
  server.graph.replay_of = "ace-2-mark.mcap";
  for (const client of server.clients) server.hello(client);
  await until(async () => (await page.title()).startsWith("Replay of ace-2-mark.mcap: ace"), "the title");
  await until(async () => page.locator("[data-control=stop]").isDisabled(), "the button");
  assert.match(await page.locator("[data-control=stop]").getAttribute("title"), /this is a replay/);
});

check(
  "parameters: set with the unit, kept, refused, forgotten",
  { width: 1600, height: 900, view: "parameters" },
  async (page) => {
    await page.locator('details[data-node="robot_client"] summary').click();
    const row = page.locator('[data-param="robot_client.speed"]');
    await until(async () => (await row.locator(".value").textContent()) === "0.8 m/s", "the value");
    await row.locator(".field").fill("9");
    await row.getByRole("button", { name: "Set" }).click();
    await until(
      async () =>
        (await row.locator(".error").textContent()) === "parameter `robot_client.speed` is 9, must lie in 0.05..3",
      "the error at the field",
    );
    assert.equal(await row.locator(".field").getAttribute("aria-invalid"), "true");
    await row.locator(".field").fill("0.2");
    await row.locator(".keep input").check();
    await page.keyboard.press("Tab");
    await row.getByRole("button", { name: "Set" }).click();
    await until(async () => (await row.locator(".value").textContent()) === "0.2 m/s", "the new value");
    assert.equal(await row.locator(".error").textContent(), "");
    assert.match(await row.locator(".from").textContent(), /^set at 3\.1 s$/);
    assert.equal(await row.evaluate((element) => element.classList.contains("changed")), true);
    await row.getByRole("button", { name: "Forget" }).click();
    await until(() => asked("forget").length === 1, "forget");
    assert.deepEqual(asked("set"), [
      { do: "set", param: "robot_client.speed", value: "9 m/s", keep: false },
      { do: "set", param: "robot_client.speed", value: "0.2 m/s", keep: true },
    ]);
    assert.deepEqual(asked("forget"), [{ do: "forget", param: "robot_client.speed" }]);
  },
);

check(
  "parameters: all of them, with values, units, ranges; only live ones have a field",
  { width: 1600, height: 900, view: "parameters" },
  async (page) => {
    assert.equal(await page.locator(".parameter").count(), server.graph.parameters.length);
    assert.equal(
      await page.locator(".parameter .field").count(),
      server.graph.parameters.filter((parameter) => parameter.live).length,
    );
    await page.locator('details[data-node="stereo"] summary').click();
    const disparities = page.locator('[data-param="stereo.disparities"]');
    await until(async () => (await disparities.locator(".from").textContent()) === "file", "where the value is from");
    assert.equal(await disparities.locator(".value").textContent(), "150 px");
    assert.equal(await disparities.locator(".range").textContent(), "1 … 512");
    await page.locator("#panel-parameters input[type=search]").fill("deceler");
    const shown = await page.locator(".parameter:visible .param-name").allTextContents();
    assert.deepEqual(shown, ["deceleration", "turn_deceleration"]);
    assert.equal(
      await page.locator('[data-param="obstacle_stop.deceleration"]').getAttribute("class"),
      "parameter changed",
    );
  },
);

check("faults: listed, switched on and off", { view: "devices" }, async (page) => {
  const silent = page.locator('[data-fault="front_laser.silent"]');
  await silent.click();
  await until(async () => (await silent.getAttribute("aria-checked")) === "true", "on");
  await until(
    async () => (await page.locator('tr[data-device="front_laser"] .pill').textContent()) === "silent",
    "the state",
  );
  await silent.click();
  await until(async () => (await silent.getAttribute("aria-checked")) === "false", "off");
  const switched = asked("fault").filter((question) => question.fault);
  assert.deepEqual(switched, [
    { do: "fault", device: "front_laser", fault: "silent", on: true },
    { do: "fault", device: "front_laser", fault: "silent", on: false },
  ]);
});

check("touch: answers go to the device of the dialogue, in two languages", { view: "touch" }, async (page) => {
  await page.getByRole("button", { name: "Deutsch" }).click();
  await page.getByRole("button", { name: "Ja", exact: true }).click();
  await page.getByRole("button", { name: "Geradeaus" }).click();
  await page.locator(".answers input").fill("goal cup_1.level=full");
  await page.getByRole("button", { name: "Sagen" }).click();
  await until(() => asked("answer").length === 3, "three answers");
  assert.deepEqual(
    asked("answer").map(({ device, text }) => [device, text]),
    [
      ["person", "yes"],
      ["person", "ahead"],
      ["person", "goal cup_1.level=full"],
    ],
  );
  await until(async () => (await page.locator(".reply").textContent()).startsWith("Verstanden"), "the reply");
  await page.getByRole("button", { name: "Zurück" }).click();
  assert.equal(await page.locator("#panel-overview").isVisible(), true);
});

check(
  "robot: a task is handed over in words, and what it knows is corrected by a click",
  { view: "robot" },
  async (page) => {
    const tasks = page.locator(".tasks");
    await tasks.getByRole("button", { name: "level=full" }).waitFor();
    await tasks.getByLabel("Of what").fill("cup_1.level=full");
    await tasks.getByRole("button", { name: "Hand over" }).click();
    await until(
      async () => (await tasks.locator(".quiet[role=status]").textContent()) === "Handed over: goal cup_1.level=full",
      "the reply",
    );
    await tasks.getByRole("button", { name: "level=full" }).click();
    assert.equal(await tasks.getByLabel("What it is to do").inputValue(), "tell");
    assert.equal(await tasks.getByLabel("Of what").inputValue(), "cup_1.level=");
    server.model.answer = () => ({ error: "`cup_1.level=` has no value" });
    await page.keyboard.press("Enter");
    await until(
      async () => (await tasks.locator(".error").textContent()) === "`cup_1.level=` has no value",
      "the error",
    );
    await tasks.getByRole("button", { name: "table_1" }).click();
    assert.equal(await tasks.getByLabel("Of what").inputValue(), "table_1.");
    await tasks.locator(".spoken", { hasText: "fetch the cup" }).waitFor();
    await tasks.getByLabel("What it is to do").selectOption("explore");
    assert.equal(await tasks.getByLabel("Of what").isVisible(), false);
    await tasks.getByRole("button", { name: "Hand over" }).click();
    await until(() => asked("task").length === 3, "three tasks");
    assert.deepEqual(
      asked("task").map(({ client, words }) => [client, words]),
      [
        ["robot_client", "goal cup_1.level=full"],
        ["robot_client", "tell cup_1.level="],
        ["robot_client", "explore"],
      ],
    );
  },
);

check(
  "robot: a click in the plan names where to drive, where something is and where it lies; it can be removed",
  { view: "robot" },
  async (page) => {
    const tasks = page.locator(".tasks");
    const [verb, rest] = [tasks.getByLabel("What it is to do"), tasks.getByLabel("Of what")];
    await tasks.locator(".network .robot").waitFor();
    // On the mark of an object, whose place is in its title.
    const click_on = async (name) => {
      const box = await tasks.locator(".network g", { hasText: name }).locator("circle").boundingBox();
      await page.mouse.click(box.x + box.width / 2, box.y + box.height / 2);
    };
    const near = (text, wanted) => {
      const numbers = text.split(" ").slice(-2).map(Number);
      assert.ok(Math.hypot(numbers[0] - wanted[0], numbers[1] - wanted[1]) < 0.05, `${text} is not ${wanted}`);
    };
    await click_on("cup_1");
    assert.equal(await verb.inputValue(), "drive");
    near(await rest.inputValue(), [-1.8, 3.3]);
    await verb.selectOption("add");
    await rest.fill("cup cup_3");
    await click_on("carton_1");
    assert.match(await rest.inputValue(), /^cup cup_3 /);
    near(await rest.inputValue(), [1.35, 2.65]);
    await page.keyboard.press("Enter");
    const row = tasks.locator("tr", { hasText: "table_1" });
    await row.getByRole("button", { name: "Move", exact: true }).click();
    assert.equal(await verb.inputValue(), "move");
    await click_on("cup_1");
    assert.match(await rest.inputValue(), /^table_1 -/);
    await page.keyboard.press("Enter");
    await row.getByRole("button", { name: "Remove" }).click();
    await page.keyboard.press("Enter");
    await until(() => asked("task").length === 3, "three tasks");
    const words = asked("task").map((question) => question.words);
    assert.match(words[0], /^add cup cup_3 1\.3\d 2\.6\d$/);
    assert.match(words[1], /^move table_1 -1\.[78]\d 3\.[23]\d$/);
    assert.equal(words[2], "remove table_1");
  },
);

test("a graph without a robot client has no tasks", async () => {
  server = await new FakeServer().start();
  server.graph.nodes.find((node) => node.type === "robot_client").type = "mission";
  const { page, troubles, close } = await open(browser, server, { view: "robot" });
  await page.locator(".panel").first().waitFor();
  assert.equal(await page.locator(".tasks").isVisible(), false);
  assert.deepEqual(troubles, []);
  await close();
  await server.stop();
});

for (const token of ["", "wrong"]) {
  test(`without the right token (${token || "none"}) all controls are disabled and say why`, async () => {
    server = await new FakeServer().start();
    const { page, troubles, close } = await open(browser, server, { token, width: 1600, height: 900 });
    try {
      if (token !== "") await until(() => server.tokens.includes("wrong"), "the token");
      await page.keyboard.press("4");
      await page.locator(".switch").first().waitFor();
      const controls = page.locator("[data-changes]");
      assert.ok((await controls.count()) > 80, "mode, mark, stop, faults, parameters, records, touch");
      const usable = await controls.evaluateAll((all) =>
        all
          .filter((control) => !control.disabled || !control.title.includes("open the address that takt web printed"))
          .map((control) => control.outerHTML),
      );
      assert.deepEqual(usable, []);
      assert.equal(
        await page.locator(".controls .why").textContent(),
        "Read only: open the address that takt web printed.",
      );
      assert.deepEqual(
        server.asks.filter((question) => question.do !== "fault" || question.fault),
        [],
      );
      assert.deepEqual(troubles, []);
    } finally {
      await close();
      await server.stop();
    }
  });
}
