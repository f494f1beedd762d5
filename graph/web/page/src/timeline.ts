// SPDX-License-Identifier: Apache-2.0
// Timeline: the jobs of the last 10 s for each CPU and node. Wheel and +/- zoom, drag and arrows move, a click shows a job.
import type { App, View } from "./app.ts";
import { card, h } from "./dom.ts";
import { clamp, fixed } from "./format.ts";
import { JobPanel } from "./job_panel.ts";
import type { JobRow } from "./protocol.ts";
import { repaint } from "./repaint.ts";
import { draw_timeline, kAxis, type Sheet, time_at } from "./timeline_draw.ts";
import { job_at, neighbour, panned, type Row, rows_of, type Window, zoomed } from "./timeline_model.ts";

const kTallestRow = 22;
const kLowestRow = 14;
const kAround = 190; // px above and below the rows, so that a screen shows all of them

export class Timeline implements View {
  readonly name = "timeline";
  readonly title = "Timeline";
  readonly root: HTMLElement;
  private readonly canvas = h("canvas", {
    tabindex: 0,
    role: "application",
    "aria-label":
      "Jobs of the last 10 s. Plus and minus zoom, left and right move, up and down choose a row, comma and full stop choose a job, space follows.",
  });
  private readonly follow_box = h("input", { type: "checkbox", checked: true });
  private readonly span = h("output", { class: "quiet num" });
  private readonly panel: JobPanel;
  private rows: Row[] = [];
  private window: Window = { from_s: 0, to_s: 10 };
  private sheet: Sheet | null = null;
  private row = -1;
  private job: JobRow | null = null;
  private visible = false;
  /** The jobs as they were when following ended: what one looks at does not run away. */
  private held: JobRow[] | null = null;
  private drag: { x: number; moved: boolean } | null = null;
  private readonly pointers = new Map<number, number>();
  private readonly draw = () => this.paint();

  constructor(private readonly app: App) {
    this.panel = new JobPanel(app, (job) => this.choose(job, true));
    const box = h("div", { class: "timeline-box" }, this.canvas);
    this.root = h(
      "div",
      { class: "view" },
      card("Jobs", this.tools(), h("div", { class: "with-side" }, box, this.panel.root)),
    );
    app.store.hello.on(() => this.build());
    app.store.jobs_came.on(() => this.visible && repaint(this.draw));
    new ResizeObserver(() => this.visible && repaint(this.draw)).observe(box);
    this.listen();
  }

  private tools(): HTMLElement {
    const button = (text: string, title: string, click: () => void) =>
      h("button", { class: "small", title, "aria-label": title, click }, text);
    this.follow_box.addEventListener("change", () => this.follow(this.follow_box.checked));
    return h(
      "div",
      { class: "tools" },
      this.span,
      h("label", {}, this.follow_box, " follow"),
      button("−", "Zoom out", () => this.zoom(1.5)),
      button("+", "Zoom in", () => this.zoom(1 / 1.5)),
      button("10 s", "Show all 10 s", () => this.zoom(1000)),
    );
  }

  show(): void {
    this.visible = true;
    repaint(this.draw);
  }

  hide(): void {
    this.visible = false;
  }

  private build(): void {
    if (this.app.store.graph) this.rows = rows_of(this.app.store.graph);
    this.job = null;
    this.panel.show(null);
    this.follow(true);
  }

  private follow(on: boolean): void {
    this.follow_box.checked = on;
    if (on) this.held = null;
    else this.held ??= [...this.app.store.jobs];
    repaint(this.draw);
  }

  private jobs(): JobRow[] {
    return this.held ?? this.app.store.jobs;
  }

  private newest(): number {
    return this.jobs().at(-1)?.[3] ?? 0;
  }

  private size(): Sheet | null {
    const context = this.canvas.getContext("2d");
    const width = this.canvas.parentElement?.clientWidth ?? 0;
    if (!context || width < 40) return null;
    const fitting = Math.floor((innerHeight - kAround - kAxis) / Math.max(1, this.rows.length));
    const row_height = clamp(fitting, kLowestRow, kTallestRow);
    const height = kAxis + this.rows.length * row_height;
    const ratio = devicePixelRatio;
    if (this.canvas.width !== Math.round(width * ratio) || this.canvas.height !== Math.round(height * ratio)) {
      this.canvas.width = Math.round(width * ratio);
      this.canvas.height = Math.round(height * ratio);
      this.canvas.style.width = `${width}px`;
      this.canvas.style.height = `${height}px`;
    }
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    return { context, width, height, gutter: Math.min(132, width * 0.3), row_height };
  }

  private paint(): void {
    const graph = this.app.store.graph;
    this.sheet = this.size();
    if (!graph || !this.sheet || !this.visible) return;
    if (this.follow_box.checked) {
      const newest = this.newest();
      this.window = { from_s: newest - (this.window.to_s - this.window.from_s), to_s: newest };
    }
    draw_timeline(this.sheet, graph, this.jobs(), this.rows, this.window, { row: this.row, job: this.job });
    const span = this.window.to_s - this.window.from_s;
    this.span.textContent = `${fixed(this.window.from_s, 2)} to ${fixed(this.window.to_s, 2)} s (${span >= 1 ? `${fixed(span)} s` : `${fixed(span * 1000, 0)} ms`})`;
    this.panel.list_late();
  }

  /** What stays where it is on the screen: the newest job, the chosen one, or the middle. */
  private still_s(): number {
    const { from_s, to_s } = this.window;
    if (this.follow_box.checked) return to_s;
    const inside = this.job && this.job[2] >= from_s && this.job[2] <= to_s;
    return inside ? this.job![2] : (from_s + to_s) / 2;
  }

  private zoom(factor: number, about_s = this.still_s()): void {
    this.window = zoomed(this.window, factor, about_s, this.newest());
    repaint(this.draw);
  }

  private pan(by_s: number): void {
    this.follow(false);
    this.window = panned(this.window, by_s, this.newest());
    repaint(this.draw);
  }

  private choose(job: JobRow | null, centre = false): void {
    this.job = job;
    if (job) {
      if (centre) this.held = null; // a job of the list, newer than what is held
      this.follow(false);
      this.row = this.rows.findIndex((row) => row.node === job[0]);
      const outside = job[2] < this.window.from_s || job[3] > this.window.to_s;
      const middle = (this.window.from_s + this.window.to_s) / 2;
      if (centre || outside) this.window = panned(this.window, (job[2] + job[3]) / 2 - middle, this.newest());
    }
    this.panel.show(job);
    repaint(this.draw);
  }

  private listen(): void {
    this.canvas.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    this.canvas.addEventListener("pointerdown", (event) => this.press(event));
    this.canvas.addEventListener("pointermove", (event) => this.move(event));
    this.canvas.addEventListener("pointerup", (event) => this.release(event));
    this.canvas.addEventListener("pointercancel", (event) => this.forget(event));
    this.canvas.addEventListener("keydown", (event) => this.key(event));
  }

  /** Sideways or with Shift it moves, else it zooms about the pointer. */
  private wheel(event: WheelEvent): void {
    if (!this.sheet) return;
    event.preventDefault();
    const sideways = event.shiftKey ? event.deltaY : event.deltaX;
    const span = this.window.to_s - this.window.from_s;
    if (event.shiftKey || Math.abs(event.deltaX) > Math.abs(event.deltaY))
      return this.pan((sideways / this.sheet.width) * span);
    this.zoom(
      Math.exp(event.deltaY * 0.002),
      this.follow_box.checked ? this.window.to_s : time_at(this.sheet, this.window, event.offsetX),
    );
  }

  private press(event: PointerEvent): void {
    this.canvas.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, event.offsetX);
    this.drag = { x: event.offsetX, moved: this.pointers.size > 1 };
  }

  private move(event: PointerEvent): void {
    if (!this.drag || !this.sheet || !this.pointers.has(event.pointerId)) return;
    const others = [...this.pointers].filter(([id]) => id !== event.pointerId);
    if (others.length > 0) {
      const fixed_x = others[0]![1];
      const before = Math.abs(this.pointers.get(event.pointerId)! - fixed_x);
      const now = Math.abs(event.offsetX - fixed_x);
      if (before > 8 && now > 8) this.zoom(before / now, time_at(this.sheet, this.window, fixed_x));
    } else if (this.drag.moved || Math.abs(event.offsetX - this.drag.x) > 4) {
      const span = this.window.to_s - this.window.from_s;
      this.drag.moved = true;
      this.pan(((this.drag.x - event.offsetX) / (this.sheet.width - this.sheet.gutter)) * span);
      this.drag.x = event.offsetX;
    }
    this.pointers.set(event.pointerId, event.offsetX);
  }

  private release(event: PointerEvent): void {
    if (this.drag && !this.drag.moved && this.sheet) {
      this.row = Math.floor((event.offsetY - kAxis) / this.sheet.row_height);
      const row = this.rows[this.row];
      const slack = (6 / this.sheet.width) * (this.window.to_s - this.window.from_s);
      this.choose(row ? job_at(this.jobs(), row, time_at(this.sheet, this.window, event.offsetX), slack) : null);
    }
    this.forget(event);
  }

  private forget(event: PointerEvent): void {
    this.pointers.delete(event.pointerId);
    if (this.pointers.size === 0) this.drag = null;
  }

  private key(event: KeyboardEvent): void {
    const span = this.window.to_s - this.window.from_s;
    const step = (by: 1 | -1) => this.job && this.choose(neighbour(this.jobs(), this.job, by) ?? this.job);
    const keys: Record<string, () => void> = {
      "+": () => this.zoom(1 / 1.5),
      "=": () => this.zoom(1 / 1.5),
      "-": () => this.zoom(1.5),
      ArrowLeft: () => this.pan(-span / 8),
      ArrowRight: () => this.pan(span / 8),
      ArrowUp: () => this.choose_row(this.row - 1),
      ArrowDown: () => this.choose_row(this.row + 1),
      ",": () => step(-1),
      ".": () => step(1),
      " ": () => this.follow(!this.follow_box.checked),
    };
    const action = keys[event.key];
    if (!action || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    action();
  }

  /** Chooses the newest job of a row that is in sight. */
  private choose_row(index: number): void {
    this.row = Math.min(this.rows.length - 1, Math.max(0, index));
    const row = this.rows[this.row]!;
    const jobs = this.jobs().filter((job) => job[3] <= this.window.to_s && job[2] >= this.window.from_s);
    const chosen = job_at(jobs, row, this.window.to_s, Infinity);
    const kept = this.row;
    this.choose(chosen);
    this.row = kept;
  }
}
