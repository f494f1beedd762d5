// SPDX-License-Identifier: Apache-2.0
// One parameter: its value, unit, range, where the value is from, and the field that sets it.
import { type App, guard } from "./app.ts";
import { h, set_text } from "./dom.ts";
import { known, plain, seconds, with_unit } from "./format.ts";
import type { Given, Parameter } from "./protocol.ts";

const kUnitless = new Set(["", "1", "px", "path"]);

export class ParameterRow {
  readonly root: HTMLElement;
  readonly key: string;
  readonly searched: string;
  changed = false;
  private readonly value = h("span", { class: "value num" });
  private readonly from = h("span", { class: "from" });
  private readonly error = h("p", { class: "error", role: "alert" });
  private readonly note = h("p", { class: "quiet", role: "status" });
  private readonly keep = h("input", { type: "checkbox" });
  private readonly forget_button: HTMLButtonElement;
  private field: HTMLInputElement | HTMLSelectElement | null = null;
  private edited = false;
  private shown = "";

  constructor(
    private readonly app: App,
    readonly parameter: Parameter,
    private readonly ask_again: () => void,
  ) {
    this.key = `${parameter.node}.${parameter.param}`;
    this.searched = `${this.key} ${parameter.help} ${parameter.unit}`.toLowerCase();
    this.forget_button = h(
      "button",
      {
        class: "small",
        hidden: true,
        title: "Later runs use the value of the graph's file again",
        click: () => void this.forget(),
      },
      "Forget",
    );
    guard(app.store, this.forget_button);
    this.root = h(
      "div",
      { class: "parameter", "data-param": this.key },
      h(
        "div",
        { class: "what" },
        h("span", { class: "param-name" }, parameter.param),
        h("span", { class: "quiet help" }, parameter.help),
      ),
      h("div", { class: "now" }, this.value, this.from),
      h("div", { class: "range quiet num" }, range_text(parameter)),
      this.editor(),
    );
    this.show(null, false);
  }

  private editor(): HTMLElement {
    if (!this.parameter.live)
      return h("div", { class: "edit quiet" }, "read at startup", this.forget_button, this.error, this.note);
    const field = this.make_field();
    this.field = field;
    field.addEventListener("input", () => (this.edited = true));
    const set = h("button", { class: "small main", type: "submit" }, "Set");
    guard(this.app.store, field, set, this.keep);
    const submit = (event: Event) => {
      event.preventDefault();
      void this.set();
    };
    const unit = kUnitless.has(this.parameter.unit) ? null : h("span", { class: "unit" }, this.parameter.unit);
    const keep = h("label", { class: "keep", title: "Later runs have the value too" }, this.keep, " keep");
    const form = h("form", { submit }, field, unit, keep, set, this.forget_button);
    return h("div", { class: "edit" }, form, this.error, this.note);
  }

  private make_field(): HTMLInputElement | HTMLSelectElement {
    const { kind, choices } = this.parameter;
    const label = { "aria-label": `New value of ${this.key}`, class: "field" };
    const words = kind === "flag" ? ["true", "false"] : choices;
    if (words) return h("select", label, ...words.map((word) => h("option", { value: word }, word)));
    const number = kind === "number" || kind === "integer";
    return h("input", {
      ...label,
      type: "text",
      inputmode: number ? "decimal" : "text",
      size: number ? 8 : 16,
      autocomplete: "off",
      spellcheck: "false",
    });
  }

  /** Null: not known yet; then the default is shown as such. */
  show(given: Given | null, changed: boolean): void {
    this.changed = changed;
    const now = JSON.stringify([given, changed]);
    if (now === this.shown) return;
    this.shown = now;
    const value = given ? given.value : this.parameter.default;
    set_text(this.value, with_unit(value, this.parameter.unit) || "(empty)");
    const when = given && known(given.at_s) ? ` at ${seconds(given.at_s)}` : "";
    set_text(this.from, given ? given.from + when : "default of the type");
    this.from.className = changed ? "pill warn from" : "from quiet";
    this.root.classList.toggle("changed", changed);
    this.forget_button.hidden = given?.from !== "kept" && this.forget_button.dataset["kept"] === undefined;
    if (this.field && !this.edited) this.field.value = plain(value) === "–" ? "" : plain(value);
  }

  unknown_because(problem: string): void {
    if (problem !== "") set_text(this.note, `value not known: ${problem}`);
  }

  /** A bare number gets the parameter's unit: Takt refuses a dimension without one. */
  private text(): string {
    const typed = (this.field?.value ?? "").trim();
    const { unit, kind } = this.parameter;
    const bare = /^[-+]?[\d.]+(e[-+]?\d+)?$/i.test(typed);
    return bare && kind === "number" && !kUnitless.has(unit) ? `${typed} ${unit}` : typed;
  }

  private async set(): Promise<void> {
    const keep = this.keep.checked;
    set_text(this.error, "");
    set_text(this.note, "…");
    const answer = await this.app.link.ask({ do: "set", param: this.key, value: this.text(), keep });
    set_text(this.error, answer.error ?? "");
    this.field?.setAttribute("aria-invalid", String(answer.error !== undefined));
    set_text(
      this.note,
      answer.error !== undefined
        ? ""
        : typeof answer["kept"] === "string"
          ? `set, and kept in ${answer["kept"]}`
          : "set until the run ends",
    );
    if (answer.error !== undefined) return;
    this.edited = false;
    this.shown = "";
    if (keep) {
      this.forget_button.dataset["kept"] = "";
      this.forget_button.hidden = false;
    }
  }

  private async forget(): Promise<void> {
    const answer = await this.app.link.ask({ do: "forget", param: this.key });
    set_text(this.error, answer.error ?? "");
    set_text(this.note, answer.error !== undefined ? "" : "forgotten: later runs use the value of the graph's file");
    if (answer.error !== undefined) return;
    delete this.forget_button.dataset["kept"];
    this.forget_button.hidden = true;
    this.ask_again();
  }
}

function range_text(parameter: Parameter): string {
  const { least, most, kind, choices } = parameter;
  if (choices) return choices.join(" | ");
  if (known(least) && known(most)) return `${plain(least)} … ${plain(most)}`;
  if (known(least)) return `at least ${plain(least)}`;
  if (known(most)) return `at most ${plain(most)}`;
  return kind;
}
