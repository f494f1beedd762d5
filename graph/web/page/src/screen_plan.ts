// SPDX-License-Identifier: Apache-2.0
// What is seen from above: grids with the robot in them, laser scans, poses with their track.
import type { App } from "./app.ts";
import { h } from "./dom.ts";
import { cells_of, count_of, floats_of, number_of } from "./frame.ts";
import { theme } from "./hues.ts";
import type { Seen } from "./link.ts";
import { yaw_of } from "./messages.ts";
import type { Screen } from "./panel.ts";
import type { Frame } from "./protocol.ts";

const kMostTrack = 600;

/** A canvas that is as large as its box, in CSS pixels. */
class PlanCanvas {
  readonly canvas: HTMLCanvasElement;
  readonly root: HTMLElement;

  constructor(label: string) {
    this.canvas = h("canvas", { role: "img", "aria-label": label });
    this.root = h("div", { class: "screen plan" }, this.canvas);
  }

  begin(): { context: CanvasRenderingContext2D; width: number; height: number } | null {
    const context = this.canvas.getContext("2d");
    const { clientWidth: width, clientHeight: height } = this.root;
    if (!context || width < 10 || height < 10) return null;
    const ratio = devicePixelRatio;
    const [w, t] = [Math.round(width * ratio), Math.round(height * ratio)];
    if (this.canvas.width !== w || this.canvas.height !== t) {
      this.canvas.width = w;
      this.canvas.height = t;
    }
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, height);
    context.font = "12px system-ui, sans-serif";
    return { context, width, height };
  }
}

/** The robot: an arrow to where it drives. `heading` from the x axis, counter-clockwise; y is up. */
function draw_robot(context: CanvasRenderingContext2D, x: number, y: number, heading: number, size: number): void {
  context.save();
  context.translate(x, y);
  context.rotate(-heading);
  context.beginPath();
  context.moveTo(size, 0);
  context.lineTo(-0.7 * size, 0.65 * size);
  context.lineTo(-0.35 * size, 0);
  context.lineTo(-0.7 * size, -0.65 * size);
  context.closePath();
  context.fillStyle = theme("--accent");
  context.strokeStyle = theme("--card");
  context.lineWidth = 1.5;
  context.fill();
  context.stroke();
  context.restore();
}

/** A bar of 1, 2 or 5 m times a power of ten, so that lengths can be read. */
function draw_scale(context: CanvasRenderingContext2D, px_per_m: number, height: number): void {
  const rough = 90 / px_per_m;
  const power = 10 ** Math.floor(Math.log10(rough));
  const length = ([5, 2, 1].find((factor) => factor * power <= rough) ?? 1) * power;
  context.fillStyle = theme("--ink");
  context.fillRect(10, height - 10, length * px_per_m, 2);
  context.fillText(`${Number(length.toPrecision(1))} m`, 10, height - 15);
}

export class GridScreen implements Screen {
  private readonly plan = new PlanCanvas("Grid from above");
  readonly root = this.plan.root;
  readonly tools = h("span", { class: "panel-tools" });
  private readonly poses = h("select", {
    "aria-label": "Pose that gives the robot's direction",
    change: () => this.follow(),
  });
  private readonly cells = document.createElement("canvas");
  private frame: Frame | null = null;
  private heading = Math.PI / 2;
  private leave: (() => void) | null = null;
  private running = false;

  constructor(private readonly app: App) {
    const ports = app.store.ports_showing("pose");
    this.poses.append(h("option", { value: "" }, "heading up"));
    for (const port of ports)
      this.poses.append(h("option", { value: port.name, selected: port.name === "robot_pose.odometry" }, port.name));
    if (ports.length > 0) this.tools.append(this.poses);
  }

  start(): void {
    this.running = true;
    this.follow();
  }

  stop(): void {
    this.running = false;
    this.leave?.();
    this.leave = null;
  }

  private follow(): void {
    this.leave?.();
    this.leave = null;
    this.heading = Math.PI / 2; // the robot's y axis points ahead
    const port = this.poses.value;
    if (!this.running || port === "") return;
    const type = this.app.store.graph?.ports.find((candidate) => candidate.name === port)?.type;
    this.leave = this.app.link.look(port, "pose", 5, (seen) => {
      if ("frame" in seen) this.heading = heading_of(seen.frame, type ?? "");
    });
  }

  take(seen: Seen): boolean {
    if (!("frame" in seen)) return false;
    this.frame = seen.frame;
    return true;
  }

  draw(): void {
    const sheet = this.plan.begin();
    if (!this.frame || !sheet) return;
    const columns = count_of(this.frame, "width", 8192);
    const rows = count_of(this.frame, "height", 8192);
    const cell_m = number_of(this.frame, "cell_m");
    const cells = cells_of(this.frame);
    if (columns * rows === 0 || cell_m <= 0 || cells.length < columns * rows) throw new Error("the grid is damaged");
    this.colour(cells, columns, rows);
    const scale = Math.min(sheet.width / columns, sheet.height / rows);
    const [left, top] = [(sheet.width - columns * scale) / 2, (sheet.height - rows * scale) / 2];
    sheet.context.imageSmoothingEnabled = false;
    sheet.context.drawImage(this.cells, left, top, columns * scale, rows * scale);
    const x = left + (-number_of(this.frame, "origin_x_m") / cell_m) * scale;
    const y = top + (rows + number_of(this.frame, "origin_y_m") / cell_m) * scale;
    if (x >= 0 && x <= sheet.width && y >= 0 && y <= sheet.height) draw_robot(sheet.context, x, y, this.heading, 11);
    draw_scale(sheet.context, scale / cell_m, sheet.height);
  }

  /** Row 0 is the lowest: it goes to the bottom. */
  private colour(cells: Int16Array, columns: number, rows: number): void {
    if (this.cells.width !== columns) this.cells.width = columns;
    if (this.cells.height !== rows) this.cells.height = rows;
    const context = this.cells.getContext("2d")!;
    const image = context.createImageData(columns, rows);
    const free = rgb(theme("--free"));
    const occupied = rgb(theme("--occupied"));
    const unknown = rgb(theme("--unknown"));
    for (let row = 0; row < rows; ++row) {
      for (let column = 0; column < columns; ++column) {
        const value = cells[row * columns + column]!;
        const at = 4 * ((rows - 1 - row) * columns + column);
        const share = Math.min(1, value / 1000);
        for (let channel = 0; channel < 3; ++channel)
          image.data[at + channel] =
            value < 0 ? unknown[channel]! : free[channel]! + share * (occupied[channel]! - free[channel]!);
        image.data[at + 3] = 255;
      }
    }
    context.putImageData(image, 0, 0);
  }
}

function rgb(colour: string): [number, number, number] {
  const value = Number.parseInt(colour.replace("#", ""), 16);
  return [(value >> 16) & 255, (value >> 8) & 255, value & 255];
}

/** Odometry says where the robot drives to; a pose has the robot's x axis, to the right of it. */
function heading_of(frame: Frame, type: string): number {
  const yaw = yaw_of(number_of(frame, "qx"), number_of(frame, "qy"), number_of(frame, "qz"), number_of(frame, "qw", 1));
  return type === "odometry" ? yaw : yaw + Math.PI / 2;
}

/** Laser ranges around the sensor, whose forward axis points up. */
export class ScanScreen implements Screen {
  private readonly plan = new PlanCanvas("Laser scan from above");
  readonly root = this.plan.root;
  private frame: Frame | null = null;
  private reach_m = 1;

  take(seen: Seen): boolean {
    if (!("frame" in seen)) return false;
    this.frame = seen.frame;
    return true;
  }

  draw(): void {
    const sheet = this.plan.begin();
    if (!this.frame || !sheet) return;
    const { context, width, height } = sheet;
    const ranges = floats_of(this.frame);
    const first = number_of(this.frame, "first_angle_rad");
    const step = number_of(this.frame, "step_rad");
    const farthest = ranges.reduce((most, range) => (Number.isFinite(range) ? Math.max(most, range) : most), 1);
    // Grows at once, shrinks slowly: the picture does not jump.
    this.reach_m = farthest > this.reach_m ? farthest : Math.max(farthest, this.reach_m * 0.995);
    const scale = Math.min(width / 2 - 8, height * 0.78) / this.reach_m;
    const [x, y] = [width / 2, height * 0.86];
    draw_rings(context, x, y, scale, this.reach_m);
    context.fillStyle = theme("--accent-soft");
    context.beginPath();
    context.moveTo(x, y);
    const points: [number, number][] = [];
    ranges.forEach((range, i) => {
      const angle = first + i * step;
      const length = Number.isFinite(range) ? range * scale : 0;
      const point: [number, number] = [x - Math.sin(angle) * length, y - Math.cos(angle) * length];
      context.lineTo(...point);
      if (range > 0) points.push(point);
    });
    context.closePath();
    context.fill();
    context.fillStyle = theme("--ink");
    for (const [px, py] of points) context.fillRect(px - 1, py - 1, 2, 2);
    draw_robot(context, x, y, Math.PI / 2, 9);
    draw_scale(context, scale, height);
  }
}

function draw_rings(context: CanvasRenderingContext2D, x: number, y: number, scale: number, reach_m: number): void {
  const step = reach_m > 20 ? 10 : reach_m > 8 ? 5 : reach_m > 3 ? 2 : 1;
  context.strokeStyle = theme("--line");
  context.fillStyle = theme("--muted");
  context.lineWidth = 1;
  for (let ring = step; ring <= reach_m; ring += step) {
    context.beginPath();
    context.arc(x, y, ring * scale, 0, 2 * Math.PI);
    context.stroke();
    context.fillText(`${ring} m`, x + 4, y - ring * scale + 12);
  }
}

/** A pose in its frame, with the track of the newest poses. */
export class PoseScreen implements Screen {
  private readonly plan = new PlanCanvas("Pose from above");
  readonly root = this.plan.root;
  private frame: Frame | null = null;
  private track: [number, number][] = [];

  constructor(private readonly type: string) {}

  take(seen: Seen): boolean {
    if (!("frame" in seen)) return false;
    if (this.frame && this.frame.header.port !== seen.frame.header.port) this.track = [];
    this.frame = seen.frame;
    this.track.push([number_of(seen.frame, "x"), number_of(seen.frame, "y")]);
    if (this.track.length > kMostTrack) this.track.shift();
    return true;
  }

  draw(): void {
    const sheet = this.plan.begin();
    if (!this.frame || !sheet) return;
    const { context, width, height } = sheet;
    const [here_x, here_y] = this.track[this.track.length - 1]!;
    const reach = this.track.reduce((most, [x, y]) => Math.max(most, Math.abs(x - here_x), Math.abs(y - here_y)), 1.5);
    const scale = (Math.min(width, height) / 2 - 16) / reach;
    const place = ([x, y]: [number, number]): [number, number] => [
      width / 2 + (x - here_x) * scale,
      height / 2 - (y - here_y) * scale,
    ];
    context.strokeStyle = theme("--muted");
    context.lineWidth = 2;
    context.beginPath();
    this.track.forEach((point) => context.lineTo(...place(point)));
    context.stroke();
    const heading = heading_of(this.frame, this.type);
    draw_robot(context, width / 2, height / 2, heading, 11);
    draw_scale(context, scale, height);
    context.fillStyle = theme("--ink");
    const degrees = ((heading * 180) / Math.PI).toFixed(1);
    context.fillText(
      `x ${here_x.toFixed(2)} m   y ${here_y.toFixed(2)} m   heading ${degrees}°   in ${String(this.frame.header["frame"] ?? "")}`,
      10,
      18,
    );
  }
}
