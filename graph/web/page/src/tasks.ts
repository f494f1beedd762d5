// SPDX-License-Identifier: Apache-2.0
// What the robot is to do: its task in words, the plan, and what it knows of objects, which can be corrected. A click in
// the plan of objects names the place of a task. For graphs with a node of type robot_client; the words are those of its
// README.
import { type App, guard } from "./app.ts";
import { h, set_text, table, table_box } from "./dom.ts";
import { fixed } from "./format.ts";
import { text_of, type Thing, things_of } from "./messages.ts";
import { NetworkPlan, type Spot, title_of } from "./network.ts";

const kMost_hz = 2;
const kRobot_hz = 5;
interface Kind {
  verb: string;
  label: string;
  hint: string;
  named?: number; // words that stand before a place
}
const kVerbs: Kind[] = [
  { verb: "goal", label: "Make it so", hint: "cup_1.level=full" },
  { verb: "do", label: "Do", hint: "fill cup_1 bottle_2" },
  { verb: "drive", label: "Drive to x, y", hint: "3 1.5", named: 0 },
  { verb: "rotate", label: "Turn by", hint: "90deg" },
  { verb: "ahead", label: "Drive ahead", hint: "0.5" },
  { verb: "explore", label: "Explore", hint: "" },
  { verb: "tell", label: "Correct what it knows", hint: "cup_1.level=empty" },
  { verb: "add", label: "There is", hint: "cup cup_3 1.5 2", named: 2 },
  { verb: "move", label: "It is at x, y", hint: "cup_3 1.5 2", named: 1 },
  { verb: "remove", label: "There is no", hint: "cup_3" },
  { verb: "stop", label: "Stop", hint: "" },
];

export class Tasks {
  readonly root: HTMLDetailsElement;
  private readonly client = h("select", { "aria-label": "Robot", change: () => this.restart() });
  private readonly verb = h("select", { "aria-label": "What it is to do", change: () => this.choose() });
  private readonly rest = h("input", { type: "text", "aria-label": "Of what", maxlength: 190, autocomplete: "off" });
  private readonly reply = h("p", { class: "quiet", role: "status" });
  private readonly said = h("p", { class: "words spoken", role: "status" });
  private readonly status = h("p", { class: "words" });
  private readonly plan = h("pre", { class: "words" });
  private readonly network = new NetworkPlan((spot) => this.pick(spot));
  private readonly listed = h("div", { class: "known-list" });
  private readonly known = h("div", { class: "known", hidden: true }, this.network.root, this.listed);
  private readonly clients_of_graph = () =>
    (this.app.store.graph?.nodes ?? []).filter((node) => node.type === "robot_client").map((node) => node.name);
  private leaves: (() => void)[] = [];
  private shown = "";

  constructor(private readonly app: App) {
    for (const { verb, label } of kVerbs) this.verb.append(h("option", { value: verb }, label));
    const hand_in = h("button", { type: "submit" }, "Hand over");
    guard(app.store, hand_in);
    const submit = (event: Event) => {
      event.preventDefault();
      void this.hand_in();
    };
    this.root = h(
      "details",
      { class: "card tasks", open: true, hidden: true },
      h("summary", {}, "What the robot is to do"),
      h("form", { class: "tools", submit }, this.client, this.verb, this.rest, hand_in),
      this.reply,
      this.said,
      this.status,
      this.plan,
      this.known,
    );
    this.choose();
  }

  /** Anew for another graph. */
  build(): void {
    const clients = this.clients_of_graph();
    this.root.hidden = clients.length === 0;
    this.client.hidden = clients.length < 2;
    this.client.replaceChildren(...clients.map((name) => h("option", { value: name }, name)));
  }

  start(): void {
    const client = this.client.value;
    if (client === "" || this.leaves.length > 0) return;
    this.watch(`${client}.status`, (message) => set_text(this.status, text_of(message["text"])));
    this.watch(`${client}.plan`, (message) => set_text(this.plan, text_of(message["text"])));
    this.watch(`${client}.speech`, (message) => set_text(this.said, text_of(message["text"])));
    this.watch(`${client}.map`, (message) => this.show_known(message));
    const robot = this.app.store.graph?.nodes
      .find((node) => node.name === client)
      ?.inputs.find((input) => input.name === "odometry")?.from;
    if (robot !== undefined) this.watch(robot, (message) => this.show_robot(message), kRobot_hz);
  }

  stop(): void {
    for (const leave of this.leaves) leave();
    this.leaves = [];
  }

  private restart(): void {
    this.stop();
    this.start();
  }

  private watch(port: string, take: (message: Record<string, unknown>) => void, most_hz = kMost_hz): void {
    this.leaves.push(
      this.app.link.look(port, "value", most_hz, (seen) => {
        if ("value" in seen) take(seen.value.message);
      }),
    );
  }

  private choose(verb = this.verb.value, rest = ""): void {
    this.verb.value = verb;
    this.rest.value = rest;
    const { hint } = this.kind();
    this.rest.hidden = hint === "";
    this.rest.placeholder = hint;
    if (rest !== "") this.rest.focus();
  }

  private kind(): Kind {
    return kVerbs.find((known) => known.verb === this.verb.value)!;
  }

  /** The place into the task that is being written; where that needs none, the robot is to drive there. */
  private pick({ x, y }: Spot): void {
    const { verb, named } = this.kind();
    const words = this.rest.value
      .trim()
      .split(/\s+/)
      .slice(0, named ?? 0);
    this.choose(named === undefined ? "drive" : verb, [...words, fixed(x, 2), fixed(y, 2)].join(" ").trim());
  }

  private show_robot(message: Record<string, unknown>): void {
    this.network.move_robot(Number(message["x_m"]), Number(message["y_m"]), Number(message["theta_rad"]));
    this.known.hidden = false;
  }

  private async hand_in(): Promise<void> {
    const words = `${this.verb.value} ${this.rest.hidden ? "" : this.rest.value.trim()}`.trim();
    const answer = await this.app.link.ask({ do: "task", client: this.client.value, words });
    this.reply.classList.toggle("error", answer.error !== undefined);
    set_text(this.reply, answer.error ?? `Handed over: ${words}`);
  }

  private show_known(message: Record<string, unknown>): void {
    const now = JSON.stringify([message["names"], message["places"], message["attributes"]]);
    if (now === this.shown) return; // what has the focus keeps it
    this.shown = now;
    const { things, of } = things_of(message);
    const body = h("tbody", {}, ...things.map((thing) => this.row(thing)));
    this.network.show(things);
    this.listed.replaceChildren(
      table_box("What it knows", table(["Object", "Type", ">x m", ">y m", "State", "Change"], body)),
      h(
        "p",
        { class: "quiet" },
        `${things.length} of ${of} objects; a name asks for a state, a state can be corrected, a click in the plan names a place`,
      ),
    );
    this.known.hidden = false;
  }

  private row(thing: Thing): HTMLTableRowElement {
    const word = (text: string, verb: string, rest: string) =>
      h("button", { class: "small word", click: () => this.choose(verb, rest) }, text);
    const states = thing.attributes.map(({ name, value }) =>
      word(`${name}=${value}`, "tell", `${thing.name}.${name}=`),
    );
    return h(
      "tr",
      {},
      h("th", { scope: "row" }, word(title_of(thing), "goal", `${thing.name}.`)),
      h("td", {}, thing.type),
      h("td", { class: "num" }, fixed(thing.x, 2)),
      h("td", { class: "num" }, fixed(thing.y, 2)),
      h("td", {}, ...states),
      h("td", {}, word("Move", "move", `${thing.name} `), word("Remove", "remove", thing.name)),
    );
  }
}
