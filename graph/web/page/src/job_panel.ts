// SPDX-License-Identifier: Apache-2.0
// Numbers of the chosen job, what was said of its node near that time, and the jobs that were late.
import type { App } from "./app.ts";
import { h } from "./dom.ts";
import { ms, seconds } from "./format.ts";
import type { JobRow } from "./protocol.ts";
import { is_late, late_ms, said_near } from "./timeline_model.ts";

const kMostLate = 12;

export class JobPanel {
  readonly root: HTMLElement;
  private readonly chosen = h("div", { class: "job", role: "status" });
  private readonly late = h("ul", { class: "late-jobs" });
  private readonly late_title = h("h3", {}, "Late jobs");
  private listed = "";

  constructor(
    private readonly app: App,
    private readonly choose: (job: JobRow) => void,
  ) {
    this.root = h(
      "aside",
      { class: "node-panel", "aria-label": "Chosen job" },
      this.chosen,
      this.late_title,
      this.late,
    );
    this.show(null);
  }

  show(job: JobRow | null): void {
    const graph = this.app.store.graph;
    const node = job && graph?.nodes[job[0]];
    if (!job || !graph || !node) {
      this.chosen.replaceChildren(h("p", { class: "quiet" }, "Choose a job to see its numbers."));
      return;
    }
    const late = late_ms(graph, job);
    const rows: [string, string, string][] = [
      ["Release", seconds(job[1], 4), ""],
      ["Start", `${ms((job[2] - job[1]) * 1000)} after`, ""],
      ["Started to finished", ms((job[3] - job[2]) * 1000), ""],
      ["Budget", ms(node.budget_ms), ""],
      ["Response", ms((job[3] - job[1]) * 1000), is_late(graph, job) ? "bad" : ""],
      ["Deadline", ms(node.deadline_ms), ""],
      ["Margin", late === null ? "–" : late > 0 ? `${ms(late)} late` : ms(-late), is_late(graph, job) ? "bad" : ""],
      ["CPU", job[4] < 0 ? "–" : String(job[4]), ""],
    ];
    const said = said_near(this.app.store.events, this.app.store.state?.frozen ?? [], node.name, job[3]);
    this.chosen.replaceChildren(
      h("h3", {}, node.name),
      h(
        "dl",
        { class: "pairs" },
        ...rows.flatMap(([name, value, kind]) => [h("dt", {}, name), h("dd", { class: kind }, value)]),
      ),
      ...said.map((text) => h("p", { class: "said" }, text)),
    );
  }

  /** Late jobs as buttons: so the keyboard finds them. */
  list_late(): void {
    const { graph, jobs } = this.app.store;
    if (!graph) return;
    const all = jobs.filter((job) => is_late(graph, job));
    const key = all.map((job) => `${job[0]} ${job[2]}`).join();
    if (key === this.listed) return;
    this.listed = key;
    this.late_title.textContent = all.length === 0 ? "No late job in 10 s" : `Late jobs: ${all.length} in 10 s`;
    const shown = all.slice(-kMostLate).reverse();
    this.late.replaceChildren(
      ...shown.map((job) => {
        const text = `${graph.nodes[job[0]]!.name} at ${seconds(job[3], 2)}, ${ms(late_ms(graph, job))}`;
        return h("li", {}, h("button", { class: "link", click: () => this.choose(job) }, text));
      }),
    );
  }
}
