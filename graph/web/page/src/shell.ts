// SPDX-License-Identifier: Apache-2.0
// Around the views: head with the run's name and controls, tabs, banner. Digits choose a tab, arrows move in the list.
import type { App, View } from "./app.ts";
import { Controls } from "./controls.ts";
import { h, set_class, set_text } from "./dom.ts";
import { clock, count } from "./format.ts";

export class Shell {
  private readonly tabs: HTMLButtonElement[];
  private readonly panels: HTMLElement[];
  private readonly banner = h("div", { class: "banner", role: "alert", hidden: true });
  private readonly run = h("span", { class: "run" }, "connecting");
  private readonly light = h("span", { class: "light" });
  private readonly time = h("span", { class: "num quiet" });
  private shown = -1;

  constructor(
    private readonly app: App,
    private readonly views: View[],
  ) {
    this.tabs = views.map((view, i) =>
      h(
        "button",
        {
          role: "tab",
          id: `tab-${view.name}`,
          "aria-controls": `panel-${view.name}`,
          click: () => this.open(i, false),
        },
        h("span", { class: "digit", "aria-hidden": "true" }, i + 1),
        view.title,
      ),
    );
    this.panels = views.map((view) =>
      h(
        "div",
        {
          role: "tabpanel",
          id: `panel-${view.name}`,
          "aria-labelledby": `tab-${view.name}`,
          hidden: true,
          tabindex: -1,
        },
        view.root,
      ),
    );
    const list = h(
      "nav",
      { class: "tabs", "aria-label": "Views" },
      h(
        "div",
        { role: "tablist", "aria-label": "Views", keydown: (event: KeyboardEvent) => this.arrow(event) },
        ...this.tabs,
      ),
    );
    const head = h(
      "header",
      { class: "head" },
      h("h1", {}, "Takt"),
      this.light,
      this.run,
      this.time,
      new Controls(app).root,
    );
    document.body.append(head, list, this.banner, h("main", {}, ...this.panels));
    document.addEventListener("keydown", (event) => this.digit(event));
    app.store.status.on(() => this.tell());
    app.store.changed.on(() => this.tick());
    setInterval(() => this.tell(), 1000);
  }

  open_named(name: string): boolean {
    const index = this.views.findIndex((view) => view.name === name);
    if (index >= 0) this.open(index, false);
    return index >= 0;
  }

  open(index: number, focus: boolean): void {
    if (index !== this.shown) {
      this.views[this.shown]?.hide();
      this.shown = index;
      this.tabs.forEach((tab, i) => {
        tab.setAttribute("aria-selected", String(i === index));
        tab.tabIndex = i === index ? 0 : -1;
        this.panels[i]!.hidden = i !== index;
      });
      this.views[index]!.show();
      remember_view(this.views[index]!.name);
      this.tabs[index]!.scrollIntoView({ block: "nearest", inline: "nearest" });
      scrollTo(0, 0);
    }
    if (focus) this.tabs[index]!.focus();
  }

  private arrow(event: KeyboardEvent): void {
    const last = this.tabs.length - 1;
    const next: Record<string, number> = {
      ArrowRight: this.shown === last ? 0 : this.shown + 1,
      ArrowLeft: this.shown === 0 ? last : this.shown - 1,
      Home: 0,
      End: last,
    };
    const index = next[event.key];
    if (index === undefined) return;
    event.preventDefault();
    this.open(index, true);
  }

  private digit(event: KeyboardEvent): void {
    const target = event.target as HTMLElement;
    const typing =
      target.matches("input:not([type=checkbox]):not([type=radio]), select, textarea") || target.closest("dialog");
    const index = Number.parseInt(event.key, 10) - 1;
    if (typing || event.ctrlKey || event.altKey || event.metaKey || !(index >= 0 && index < this.tabs.length)) return;
    this.open(index, true);
  }

  private tick(): void {
    const state = this.app.store.state;
    if (state) set_text(this.time, clock(state.running_s));
  }

  private tell(): void {
    const { store } = this.app;
    const { graph } = store;
    const replay = graph?.replay_of ? `Replay of ${graph.replay_of}: ` : "";
    if (graph) set_text(this.run, `${replay}${graph.name}, ${graph.profile}, ${graph.schedule}, ${graph.policy}`);
    this.run.title = graph ? `${graph.version}, process ${graph.pid}` : "";
    const trouble = this.trouble();
    set_class(this.light, trouble === "" ? "light good" : "light bad");
    this.light.title = trouble === "" ? "connected" : trouble;
    document.body.classList.toggle("stale", trouble !== "");
    this.banner.hidden = trouble === "";
    set_text(this.banner, trouble);
    document.title = graph ? `${replay}${graph.name} – Takt` : "Takt";
  }

  private trouble(): string {
    const { store } = this.app;
    if (store.connection === "open")
      return store.gone === ""
        ? ""
        : `The run has ended: ${store.gone}. The figures below are its last ones. The page waits for the next run.`;
    const wait_s = Math.max(0, Math.ceil((store.next_try_ms - performance.now()) / 1000));
    if (store.connection === "closed" && wait_s > 0)
      return `No connection to takt web. The next try is in ${count(wait_s)} s.`;
    return store.graph ? "No connection to takt web. Trying again." : "Connecting to takt web.";
  }
}

/** The fragment of the address keeps token and view: a reload shows the same. */
export function fragment(): URLSearchParams {
  return new URLSearchParams(location.hash.slice(1));
}

function remember_view(name: string): void {
  const parts = fragment();
  if (parts.get("view") === name) return;
  parts.set("view", name);
  history.replaceState(null, "", `#${parts.toString()}`);
}
