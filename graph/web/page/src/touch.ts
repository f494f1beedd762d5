// SPDX-License-Identifier: Apache-2.0
// Touch: the robot's own screen. Large buttons, one question, in the language of who stands before it.
import { type App, guard, type View } from "./app.ts";
import { Dialogue } from "./dialogue.ts";
import { h, set_text } from "./dom.ts";
import { kLanguages, kWords, type Language, preferred_language, type Words } from "./words.ts";

export class Touch implements View {
  readonly name = "touch";
  readonly title = "Touch";
  readonly root = h("div", { class: "touch" });
  private readonly dialogue: Dialogue;
  private language: Language = preferred_language();
  private readonly speech = h("p", { class: "speech", role: "status" });
  private readonly status = h("p", { class: "touch-status" });
  private readonly reply = h("p", { class: "reply", role: "status" });
  private visible = false;

  constructor(private readonly app: App) {
    this.dialogue = new Dialogue(app);
    this.dialogue.changed.on(() => this.update());
    app.store.hello.on(() => {
      if (this.visible) this.dialogue.start();
      this.build();
    });
    app.store.status.on(() => this.update());
    this.build();
  }

  show(): void {
    this.visible = true;
    document.body.classList.add("touching");
    this.dialogue.start();
    this.build();
  }

  hide(): void {
    this.visible = false;
    document.body.classList.remove("touching");
    document.documentElement.lang = "en";
    this.dialogue.stop();
    if (document.fullscreenElement) void document.exitFullscreen();
  }

  private get words(): Words {
    return kWords[this.language];
  }

  private build(): void {
    const { words } = this;
    if (this.visible) document.documentElement.lang = this.language;
    this.root.lang = this.language;
    const languages = kLanguages.map((language) =>
      h(
        "button",
        {
          class: "touch-small",
          lang: language,
          "aria-pressed": String(language === this.language),
          click: () => this.speak(language),
        },
        kWords[language].language,
      ),
    );
    const full = h(
      "button",
      { class: "touch-small touch-full", click: () => void this.root.requestFullscreen?.() },
      words.full,
    );
    const back = h("button", { class: "touch-small", click: () => this.app.open("overview") }, words.back);
    this.root.replaceChildren(
      h("header", { class: "touch-head" }, back, full, h("span", { class: "space" }), ...languages),
      h("div", { class: "said-box" }, this.speech, this.status),
      this.answers(words),
      this.reply,
    );
    set_text(this.reply, "");
    this.update();
  }

  private answers(words: Words): HTMLElement {
    const button = (text: string, answer: string, kind: string) => {
      const made = h(
        "button",
        { class: `touch-button ${kind}`, "data-answer": answer, click: () => void this.send(answer, text) },
        text,
      );
      guard(this.app.store, made);
      return made;
    };
    const typed = h("input", {
      type: "text",
      placeholder: words.type,
      "aria-label": words.answer,
      maxlength: 200,
      autocomplete: "off",
    });
    const say = h("button", { class: "touch-button", type: "submit" }, words.say);
    guard(this.app.store, typed, say);
    const submit = (event: Event) => {
      event.preventDefault();
      const text = typed.value.trim();
      if (text === "") return;
      void this.send(text, text);
      typed.value = "";
    };
    return h(
      "div",
      { class: "answers" },
      h("div", { class: "answer-row" }, button(words.yes, "yes", "yes"), button(words.no, "no", "no")),
      h(
        "div",
        { class: "answer-row", role: "group", "aria-label": words.way },
        button(words.left, "left", ""),
        button(words.ahead, "ahead", ""),
        button(words.right, "right", ""),
      ),
      h(
        "div",
        { class: "answer-row" },
        button(words.explore, "explore", "quiet-button"),
        button(words.halt, "stop", "quiet-button"),
      ),
      h("form", { class: "answer-row", submit }, typed, say),
    );
  }

  private speak(language: Language): void {
    this.language = language;
    this.build();
  }

  private update(): void {
    const why = this.app.store.why_not();
    set_text(
      this.speech,
      this.dialogue.device === "" && this.dialogue.speech === ""
        ? this.words.nobody
        : this.dialogue.speech || this.words.hello,
    );
    set_text(this.status, this.dialogue.status === "" ? "" : `${this.words.status}: ${this.dialogue.status}`);
    if (why !== "") set_text(this.reply, `${this.words.locked}: ${why}`);
  }

  private async send(answer: string, shown: string): Promise<void> {
    const problem = await this.dialogue.answer(answer);
    this.reply.classList.toggle("error", problem !== "");
    set_text(this.reply, problem === "" ? `${this.words.heard}: ${shown}` : `${this.words.not_heard}: ${problem}`);
  }
}
