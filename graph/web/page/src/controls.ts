// SPDX-License-Identifier: Apache-2.0
// Mode, mark and stop: the buttons at the top of every view.
import { type App, guard } from "./app.ts";
import { ask_in_dialog } from "./dialog.ts";
import { h, set_text } from "./dom.ts";

const kMostMarkBytes = 199;

export class Controls {
  readonly root: HTMLElement;
  private readonly mode = h(
    "button",
    { class: "control", "data-control": "mode", click: () => this.change_mode() },
    "Mode",
  );

  constructor(private readonly app: App) {
    const mark = h(
      "button",
      { class: "control", "data-control": "mark", title: "Marks this instant in the record", click: () => this.mark() },
      "Mark",
    );
    const stop = h(
      "button",
      { class: "control danger", "data-control": "stop", title: "Ends the run", click: () => this.stop() },
      "Stop",
    );
    this.root = h(
      "div",
      { class: "controls" },
      h("span", { class: "quiet why", "data-why": "" }),
      this.mode,
      mark,
      stop,
    );
    guard(app.store, this.mode, mark, stop);
    app.store.changed.on(() => set_text(this.mode, `Mode: ${app.store.state?.mode ?? "–"}`));
  }

  private change_mode(): void {
    const now = this.app.store.state?.mode ?? "";
    let chosen = now;
    const modes = (this.app.store.graph?.modes ?? []).map((mode) =>
      h(
        "label",
        { class: "choice" },
        h("input", { type: "radio", name: "mode", value: mode, checked: mode === now, change: () => (chosen = mode) }),
        mode,
      ),
    );
    const list = h("fieldset", {}, h("legend", {}, "The nodes of a mode run, the others pause."), ...modes);
    ask_in_dialog(
      "Change the mode",
      [list],
      "Change",
      async () => (await this.app.link.ask({ do: "mode", mode: chosen })).error ?? "",
    );
  }

  private mark(): void {
    const words = h("input", { type: "text", required: true, "aria-label": "Words of the mark", autofocus: true });
    ask_in_dialog(
      "Mark this instant",
      [h("p", {}, "The words go into the log and the record, which keeps the seconds around it."), words],
      "Mark",
      () => send_mark(this.app, words.value),
    );
  }

  private stop(): void {
    const name = this.app.store.graph?.name ?? "the graph";
    const text = `All processes of ${name} end, the robot stops. This page cannot start it again.`;
    ask_in_dialog(
      "Stop the run?",
      [h("p", {}, text)],
      "Stop the run",
      async () => (await this.app.link.ask({ do: "stop" })).error ?? "",
      "danger",
    );
  }
}

/** Gives what is wrong, or nothing. */
export async function send_mark(app: App, words: string): Promise<string> {
  const bytes = new TextEncoder().encode(words.trim()).length;
  if (bytes === 0) return "a mark needs words";
  if (bytes > kMostMarkBytes) return `a mark has at most ${kMostMarkBytes} bytes, this one has ${bytes}`;
  return (await app.link.ask({ do: "mark", words: words.trim() })).error ?? "";
}
