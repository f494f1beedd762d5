// SPDX-License-Identifier: Apache-2.0
// Point clouds in 3-D: WebGL where the browser has it, else a 2-D canvas with fewer points.
import { h } from "./dom.ts";
import { count_of } from "./frame.ts";
import type { Seen } from "./link.ts";
import { type Matrix, Orbit } from "./orbit.ts";
import type { Screen } from "./panel.ts";
import type { Frame } from "./protocol.ts";
import { repaint } from "./repaint.ts";

const kPoint = 16; // bytes
const kMostFlat = 20000;

const kVertex = `
attribute vec3 place;
attribute vec4 colour;
uniform mat4 camera;
uniform float size;
varying vec4 tint;
void main() {
  gl_Position = camera * vec4(place, 1.0);
  gl_PointSize = clamp(size / gl_Position.w, 1.5, 8.0);
  tint = colour;
}`;
const kFragment = `
precision mediump float;
varying vec4 tint;
void main() { gl_FragColor = vec4(tint.rgb, 1.0); }`;

interface Painter {
  name: string;
  load(bytes: Uint8Array, points: number): void;
  draw(camera: Matrix, width: number, height: number): void;
}

class GlPainter implements Painter {
  readonly name = "webgl";
  private points = 0;
  private readonly camera: WebGLUniformLocation | null;
  private readonly size: WebGLUniformLocation | null;

  constructor(private readonly gl: WebGLRenderingContext) {
    const program = gl.createProgram()!;
    for (const [kind, text] of [
      [gl.VERTEX_SHADER, kVertex],
      [gl.FRAGMENT_SHADER, kFragment],
    ] as const) {
      const shader = gl.createShader(kind)!;
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program) ?? "no shader");
    gl.useProgram(program);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    const place = gl.getAttribLocation(program, "place");
    const colour = gl.getAttribLocation(program, "colour");
    gl.enableVertexAttribArray(place);
    gl.enableVertexAttribArray(colour);
    gl.vertexAttribPointer(place, 3, gl.FLOAT, false, kPoint, 0);
    gl.vertexAttribPointer(colour, 4, gl.UNSIGNED_BYTE, true, kPoint, 12);
    this.camera = gl.getUniformLocation(program, "camera");
    this.size = gl.getUniformLocation(program, "size");
    gl.enable(gl.DEPTH_TEST);
  }

  load(bytes: Uint8Array, points: number): void {
    this.points = points;
    this.gl.bufferData(this.gl.ARRAY_BUFFER, bytes, this.gl.DYNAMIC_DRAW);
  }

  draw(camera: Matrix, width: number, height: number): void {
    const { gl } = this;
    gl.viewport(0, 0, width, height);
    gl.clearColor(0.07, 0.09, 0.11, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.uniformMatrix4fv(this.camera, false, camera);
    gl.uniform1f(this.size, height / 90);
    gl.drawArrays(gl.POINTS, 0, this.points);
  }
}

/** Without WebGL: at most 20,000 points, drawn one behind the other without a depth buffer. */
class FlatPainter implements Painter {
  readonly name = "canvas";
  private view: DataView = new DataView(new ArrayBuffer(0));
  private points = 0;

  constructor(private readonly context: CanvasRenderingContext2D) {}

  load(bytes: Uint8Array, points: number): void {
    this.view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    this.points = points;
  }

  draw(camera: Matrix, width: number, height: number): void {
    const image = this.context.createImageData(width, height);
    const pixels = new Uint32Array(image.data.buffer).fill(0xff1c1712);
    const near = new Float32Array(width * height).fill(Infinity);
    const step = Math.max(1, Math.ceil(this.points / kMostFlat));
    const row = (i: number, x: number, y: number, z: number) =>
      camera[i]! * x + camera[4 + i]! * y + camera[8 + i]! * z + camera[12 + i]!;
    for (let i = 0; i < this.points; i += step) {
      const at = i * kPoint;
      const [x, y, z] = [
        this.view.getFloat32(at, true),
        this.view.getFloat32(at + 4, true),
        this.view.getFloat32(at + 8, true),
      ];
      const depth = row(3, x, y, z);
      if (!(depth > 0.05)) continue;
      const left = Math.round((row(0, x, y, z) / depth + 1) * 0.5 * width);
      const top = Math.round((1 - row(1, x, y, z) / depth) * 0.5 * height);
      const colour =
        0xff000000 |
        (this.view.getUint8(at + 14) << 16) |
        (this.view.getUint8(at + 13) << 8) |
        this.view.getUint8(at + 12);
      this.dot(pixels, near, width, height, left, top, depth, colour >>> 0);
    }
    this.context.putImageData(image, 0, 0);
  }

  private dot(
    pixels: Uint32Array,
    near: Float32Array,
    width: number,
    height: number,
    left: number,
    top: number,
    depth: number,
    colour: number,
  ): void {
    for (let y = Math.max(0, top); y < Math.min(height, top + 2); ++y) {
      for (let x = Math.max(0, left); x < Math.min(width, left + 2); ++x) {
        const at = y * width + x;
        if (depth >= near[at]!) continue;
        near[at] = depth;
        pixels[at] = colour;
      }
    }
  }
}

export class CloudScreen implements Screen {
  private readonly canvas = h("canvas", {
    tabindex: 0,
    role: "application",
    "aria-label": "Point cloud. Arrows turn, plus and minus change the distance, Home goes back.",
  });
  private readonly note = h("span", { class: "panel-note" });
  readonly root = h("div", { class: "screen dark-screen cloud-screen" }, this.canvas, this.note);
  private readonly orbit: Orbit;
  private painter: Painter | null = null;
  private frame: Frame | null = null;
  private readonly again = () => this.render();

  constructor() {
    this.orbit = new Orbit(this.canvas, () => repaint(this.again));
    this.canvas.addEventListener("webglcontextlost", (event) => {
      event.preventDefault();
      this.painter = null;
    });
  }

  take(seen: Seen): boolean {
    if (!("frame" in seen)) return false;
    this.frame = seen.frame;
    return true;
  }

  draw(): void {
    this.painter ??= this.make_painter();
    if (!this.frame || !this.painter) return;
    const points = Math.min(count_of(this.frame, "count"), Math.floor(this.frame.bytes.byteLength / kPoint));
    this.painter.load(this.frame.bytes, points);
    const all = count_of(this.frame, "of");
    this.note.textContent = all > points ? `${points} of ${all} points` : `${points} points`;
    this.render();
  }

  private make_painter(): Painter | null {
    const gl = this.canvas.getContext("webgl", { antialias: false });
    const flat = gl ? null : this.canvas.getContext("2d");
    const painter = gl ? new GlPainter(gl) : flat ? new FlatPainter(flat) : null;
    if (painter) this.root.dataset["painter"] = painter.name;
    return painter;
  }

  private render(): void {
    const ratio = this.painter?.name === "canvas" ? 1 : devicePixelRatio;
    const width = Math.round(this.root.clientWidth * ratio);
    const height = Math.round(this.root.clientHeight * ratio);
    if (!this.painter || width < 10 || height < 10) return;
    if (this.canvas.width !== width) this.canvas.width = width;
    if (this.canvas.height !== height) this.canvas.height = height;
    this.painter.draw(this.orbit.matrix(width / height), width, height);
  }
}
