// SPDX-License-Identifier: Apache-2.0
// Records: marks set and to be set, the sentences of what was frozen, and the records of it.
import { type App, guard, type View } from "./app.ts";
import { send_mark } from "./controls.ts";
import { card, h, set_text } from "./dom.ts";
import { seconds } from "./format.ts";
import { FrozenFiles } from "./frozen_files.ts";
import { repaint } from "./repaint.ts";

const kMostShown = 300;

export class Records implements View {
  readonly name = "records";
  readonly title = "Records";
  readonly root: HTMLElement;
  private readonly words = h("input", {
    type: "text",
    "aria-label": "Words of the mark",
    placeholder: "what happens now",
  });
  private readonly error = h("p", { class: "error", role: "alert" });
  private readonly said = h("p", { class: "quiet", role: "status" });
  private readonly marks = h("ol", { class: "entries" });
  private readonly frozen = h("ol", { class: "entries" });
  private readonly files: FrozenFiles;
  private visible = false;
  private shown = "";
  private readonly draw = () => this.update();

  constructor(private readonly app: App) {
    this.files = new FrozenFiles(app, this.error);
    const send = h("button", { class: "main", type: "submit" }, "Mark");
    guard(app.store, send, this.words);
    const form = h("form", { class: "mark-form", submit: (event: Event) => void this.mark(event) }, this.words, send);
    const why = h("p", { class: "quiet", "data-why": "" });
    this.root = h(
      "div",
      { class: "view" },
      card(
        "Mark",
        h("p", { class: "quiet" }, "A mark freezes the seconds around this instant, with your words."),
        form,
        why,
        this.error,
        this.said,
      ),
      h("div", { class: "two" }, card("Frozen", this.frozen), card("Marks", this.marks)),
      card("Frozen records", this.files.root),
    );
    app.store.changed.on(() => this.visible && repaint(this.draw));
    app.store.events_came.on(() => this.visible && repaint(this.draw));
  }

  show(): void {
    this.visible = true;
    this.files.show();
    repaint(this.draw);
  }

  hide(): void {
    this.visible = false;
    this.files.hide();
  }

  private async mark(event: Event): Promise<void> {
    event.preventDefault();
    const problem = await send_mark(this.app, this.words.value);
    set_text(this.error, problem);
    set_text(this.said, problem === "" ? `marked: ${this.words.value.trim()}` : "");
    if (problem === "") this.words.value = "";
  }

  private update(): void {
    const frozen = this.app.store.state?.frozen ?? [];
    const marks = this.app.store.events
      .filter((event) => event.kind === "mark")
      .map((event) => `${seconds(event.at_s)}: ${event.text}`);
    const now = JSON.stringify([frozen, marks]);
    if (now === this.shown) return;
    this.shown = now;
    fill(this.frozen, frozen, "Nothing has been frozen.");
    fill(this.marks, marks, "No marks yet.");
  }
}

/** "11.2 s: words" with its time in a column of its own; the newest on top. */
function fill(list: HTMLElement, texts: string[], none: string): void {
  const rows = texts.slice(-kMostShown).reverse();
  list.replaceChildren(
    ...rows.map((text) => {
      const parts = /^([\d.]+ s): ([^]*)$/.exec(text);
      return h("li", {}, h("span", { class: "num at" }, parts?.[1] ?? ""), h("span", {}, parts?.[2] ?? text));
    }),
  );
  if (rows.length === 0) list.append(h("li", { class: "quiet" }, none));
  if (texts.length > rows.length)
    list.append(h("li", { class: "quiet" }, `${texts.length - rows.length} older ones are not shown`));
}
