// SPDX-License-Identifier: Apache-2.0
// A camera that orbits a point: drag turns, wheel and +/- go nearer, Shift with drag moves, arrows turn.
import { clamp } from "./format.ts";

export type Matrix = Float32Array; // 4 x 4, column by column

export class Orbit {
  yaw = 0.4;
  pitch = 0.4;
  distance_m = 5.5;
  centre: [number, number, number] = [0, 0.2, 3.2]; // of the sensor's frame: x right, y down, z ahead

  constructor(
    private readonly element: HTMLElement,
    private readonly moved: () => void,
  ) {
    element.addEventListener("pointerdown", (event) => element.setPointerCapture(event.pointerId));
    element.addEventListener("pointermove", (event) => this.drag(event));
    element.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    element.addEventListener("keydown", (event) => this.key(event));
    element.addEventListener("dblclick", () => this.reset());
  }

  private drag(event: PointerEvent): void {
    if (event.buttons === 0) return;
    const scale = 3 / Math.max(200, this.element.clientWidth);
    if (event.shiftKey || event.buttons === 2) this.shift(-event.movementX * scale, -event.movementY * scale);
    else this.turn(event.movementX * scale, event.movementY * scale);
  }

  private turn(by_yaw: number, by_pitch: number): void {
    this.yaw += by_yaw;
    this.pitch = clamp(this.pitch + by_pitch, -1.5, 1.5);
    this.moved();
  }

  private shift(right: number, down: number): void {
    const step = this.distance_m * 0.5;
    this.centre[0] += right * step * Math.cos(this.yaw);
    this.centre[2] -= right * step * Math.sin(this.yaw);
    this.centre[1] += down * step;
    this.moved();
  }

  private nearer(factor: number): void {
    this.distance_m = clamp(this.distance_m * factor, 0.2, 200);
    this.moved();
  }

  private wheel(event: WheelEvent): void {
    event.preventDefault();
    this.nearer(Math.exp(event.deltaY * 0.001));
  }

  private reset(): void {
    [this.yaw, this.pitch, this.distance_m] = [0.4, 0.4, 5.5];
    this.centre = [0, 0.2, 3.2];
    this.moved();
  }

  private key(event: KeyboardEvent): void {
    const keys: Record<string, () => void> = {
      ArrowLeft: () => this.turn(-0.1, 0),
      ArrowRight: () => this.turn(0.1, 0),
      ArrowUp: () => this.turn(0, 0.1),
      ArrowDown: () => this.turn(0, -0.1),
      "+": () => this.nearer(0.8),
      "-": () => this.nearer(1.25),
      Home: () => this.reset(),
    };
    const action = keys[event.key];
    if (!action) return;
    event.preventDefault();
    action();
  }

  /** From the sensor's frame to clip space. */
  matrix(aspect: number): Matrix {
    const [sy, cy] = [Math.sin(this.yaw), Math.cos(this.yaw)];
    const [sp, cp] = [Math.sin(this.pitch), Math.cos(this.pitch)];
    const [x, y, z] = this.centre;
    // Rows: right, up and depth of the turned camera, on (x, -y, z) of the sensor.
    const right = [cy, 0, -sy];
    const up = [sp * sy, -cp, sp * cy];
    const depth = [cp * sy, sp, cp * cy];
    const dot = (row: number[]) => row[0]! * x + row[1]! * y + row[2]! * z;
    const focal = 1.6;
    const [near, far] = [0.05, 500];
    const a = (far + near) / (far - near);
    const b = (-2 * far * near) / (far - near);
    const offset = this.distance_m - dot(depth);
    const columns = [0, 1, 2].flatMap((i) => [(focal / aspect) * right[i]!, focal * up[i]!, a * depth[i]!, depth[i]!]);
    return new Float32Array([...columns, (-focal / aspect) * dot(right), -focal * dot(up), a * offset + b, offset]);
  }
}
