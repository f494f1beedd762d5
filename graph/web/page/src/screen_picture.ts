// SPDX-License-Identifier: Apache-2.0
// Pictures and disparities: JPEG, decoded by the browser beside the page's own thread; boxes of detections on top.
import type { App } from "./app.ts";
import { h } from "./dom.ts";
import { count_of } from "./frame.ts";
import { theme } from "./hues.ts";
import type { Seen } from "./link.ts";
import { boxes_of, type Boxes } from "./messages.ts";
import type { Screen } from "./panel.ts";
import type { Frame } from "./protocol.ts";

const kMostParts = 4;

export class PictureScreen implements Screen {
  readonly root: HTMLElement;
  readonly tools = h("span", { class: "panel-tools" });
  private readonly canvas = h("canvas", { role: "img", "aria-label": "Picture" });
  private readonly parts = h("select", {
    "aria-label": "Part",
    hidden: true,
    change: () => (this.wanted = this.parts.value),
  });
  private readonly overlays = h("select", { "aria-label": "Boxes drawn on top", change: () => this.overlay() });
  private readonly known = new Map<string, Frame>();
  private wanted = "";
  private boxes: Boxes | null = null;
  private leave: (() => void) | null = null;
  private running = false;

  constructor(
    private readonly app: App,
    overlay: boolean,
  ) {
    this.root = h("div", { class: "screen dark-screen" }, this.canvas);
    this.tools.append(this.parts);
    const ports = overlay ? (app.store.graph?.ports.filter((port) => port.type === "detections") ?? []) : [];
    if (ports.length === 0) return;
    this.overlays.append(
      h("option", { value: "" }, "no boxes"),
      ...ports.map((port, i) => h("option", { value: port.name, selected: i === 0 }, port.name)),
    );
    this.tools.append(this.overlays);
  }

  start(): void {
    this.running = true;
    this.overlay();
  }

  stop(): void {
    this.running = false;
    this.leave?.();
    this.leave = null;
  }

  private overlay(): void {
    this.leave?.();
    this.leave = null;
    this.boxes = null;
    const port = this.overlays.value;
    if (!this.running || port === "") return;
    this.leave = this.app.link.look(port, "value", 8, (seen) => {
      if ("value" in seen) this.boxes = boxes_of(seen.value);
    });
  }

  take(seen: Seen): boolean {
    if (!("frame" in seen)) return false;
    const part = seen.frame.header.part ?? "";
    if (!this.known.has(part)) this.add_part(part);
    if (!this.known.has(part)) return false;
    this.known.set(part, seen.frame);
    return part === this.wanted;
  }

  private add_part(part: string): void {
    if (this.known.size >= kMostParts) return;
    if (this.known.size === 0) this.wanted = part;
    this.known.set(part, null as unknown as Frame);
    this.parts.append(h("option", { value: part }, part === "" ? "whole" : part));
    this.parts.hidden = this.known.size < 2;
  }

  async draw(): Promise<void> {
    const frame = this.known.get(this.wanted);
    const context = this.canvas.getContext("2d");
    if (!frame || !context) return;
    const bitmap = await createImageBitmap(new Blob([frame.bytes], { type: "image/jpeg" }));
    if (this.canvas.width !== bitmap.width) this.canvas.width = bitmap.width;
    if (this.canvas.height !== bitmap.height) this.canvas.height = bitmap.height;
    context.drawImage(bitmap, 0, 0);
    bitmap.close();
    if (this.boxes) draw_boxes(context, this.boxes, count_of(frame, "width"), count_of(frame, "height"));
  }
}

/** Boxes are in pixels of the image that the detector saw, which need not be as large as the picture. */
function draw_boxes(context: CanvasRenderingContext2D, boxes: Boxes, width: number, height: number): void {
  const x_scale = boxes.width > 0 ? context.canvas.width / boxes.width : context.canvas.width / Math.max(1, width);
  const y_scale = boxes.height > 0 ? context.canvas.height / boxes.height : context.canvas.height / Math.max(1, height);
  const accent = theme("--on-picture");
  context.lineWidth = 2;
  context.font = "600 13px system-ui, sans-serif";
  context.textBaseline = "bottom";
  for (const box of boxes.boxes) {
    const [x, y] = [box.x * x_scale, box.y * y_scale];
    const label = `${box.class_id} ${(100 * box.score).toFixed(0)} %`;
    context.strokeStyle = accent;
    context.strokeRect(x, y, box.width * x_scale, box.height * y_scale);
    const text_width = context.measureText(label).width + 8;
    context.fillStyle = accent;
    context.fillRect(x - 1, y - 17, text_width, 17);
    context.fillStyle = "#10151a";
    context.fillText(label, x + 3, y - 1);
  }
}
