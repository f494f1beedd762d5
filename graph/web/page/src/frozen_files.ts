// SPDX-License-Identifier: Apache-2.0
// The frozen records on the robot's disk: fetched, or replayed in a page of their own.
import { type App, guard } from "./app.ts";
import { h, set_text } from "./dom.ts";
import type { Answer } from "./protocol.ts";

const kLook_ms = 3000;
const kReplayLook_ms = 500;

interface FrozenFile {
  file: string;
  mb: number;
  at: number;
}

export class FrozenFiles {
  readonly root: HTMLElement;
  private readonly list = h("ol", { class: "entries", "data-list": "frozen-files" });
  private readonly said = h("p", { class: "quiet", role: "status" });
  private timer = 0;
  private shown = "";

  /** `error`: where problems are told. */
  constructor(
    private readonly app: App,
    private readonly error: HTMLElement,
  ) {
    this.root = h("div", {}, this.list, this.said);
  }

  show(): void {
    this.hide();
    void this.look();
    this.timer = window.setInterval(() => void this.look(), kLook_ms);
  }

  hide(): void {
    window.clearInterval(this.timer);
  }

  private async look(): Promise<void> {
    const answer = await this.app.link.ask({ do: "frozen" });
    const files = (answer["files"] as FrozenFile[] | undefined) ?? [];
    const now = JSON.stringify(files);
    if (answer.error || now === this.shown) return;
    this.shown = now;
    this.list.replaceChildren(...files.map((file) => this.row(file)));
    if (files.length === 0) this.list.append(h("li", { class: "quiet" }, "No frozen record lies on the disk."));
  }

  private row(file: FrozenFile): HTMLElement {
    const fetch = h(
      "button",
      { title: "Saves the record on this machine", click: () => void this.fetch(file.file) },
      "Download",
    );
    const replay = h(
      "button",
      { title: "Shows the record in a page of its own, at its own pace", click: () => void this.replay(file.file) },
      "Replay",
    );
    guard(this.app.store, fetch, replay);
    const when = new Date(file.at * 1000).toLocaleTimeString();
    return h(
      "li",
      { "data-file": file.file },
      h("span", { class: "num at" }, when),
      h("span", { class: "file" }, file.file),
      h("span", { class: "num" }, `${file.mb.toFixed(1)} MB`),
      fetch,
      replay,
    );
  }

  private failed(answer: Answer): boolean {
    set_text(this.error, answer.error ?? "");
    return answer.error !== undefined;
  }

  private async fetch(file: string): Promise<void> {
    const answer = await this.app.link.ask({ do: "download", file });
    if (this.failed(answer)) return;
    const link = h("a", { href: String(answer["path"]), download: file });
    document.body.append(link);
    link.click();
    link.remove();
  }

  /** The new page is opened at once, as browsers let a click do, and is told where to go once the replay is there. */
  private async replay(file: string): Promise<void> {
    const page = window.open("about:blank", "takt-replay");
    if (this.failed(await this.app.link.ask({ do: "replay", file }))) return page?.close();
    set_text(this.said, `${file} is being read ...`);
    for (;;) {
      const told = await this.app.link.ask({ do: "replayed" });
      const state = told["state"];
      if (this.failed(told) || told["file"] !== file || state === "ended") {
        set_text(this.said, "");
        set_text(this.error, told.error ?? `${file} is not replayed: ${String(told["why"] ?? "it has ended")}`);
        return page?.close();
      }
      if (state === "shown") {
        const address = String(told["address"]);
        set_text(this.said, page ? `${file} is replayed in the other page.` : `${file} is replayed at ${address}`);
        if (page) page.location.href = address;
        return;
      }
      await new Promise((done) => setTimeout(done, kReplayLook_ms));
    }
  }
}
