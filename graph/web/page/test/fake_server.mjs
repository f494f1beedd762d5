// SPDX-License-Identifier: Apache-2.0
// Plays takt web for tests: serves the bundle under its content policy and speaks takt.v1 (graph/web/README.md).
import { readFileSync } from "node:fs";
import { createServer } from "node:http";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { WebSocketServer } from "ws";
import { kSecondsBetween } from "./pictures.mjs";
import { RunModel } from "./run_model.mjs";
import { value_of } from "./values.mjs";
import { cloud, grid, robot_at, scan } from "./world.mjs";

const here = dirname(fileURLToPath(import.meta.url));
export const kPolicy =
  "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; connect-src 'self'";
const kTypes = { "index.html": "text/html", "page.js": "text/javascript", "page.css": "text/css" };
const kChanges = ["set", "forget", "mode", "mark", "stop", "answer", "task", "download", "replay", "replayed"];

export class FakeServer {
  /** `pictures`: from pictures.mjs. `running_s`: how long the run has lasted at the first hello. */
  constructor({ token = "secret", pictures = [], running_s = 12 } = {}) {
    this.token = token;
    this.pictures = pictures;
    this.asks = [];
    this.requests = [];
    this.tokens = [];
    this.clients = new Set();
    this.frozen_state = null;
    this.sent = {};
    this.latest_state = null;
    this.begun = running_s;
    this.new_run();
  }

  new_run(pid = 4711) {
    this.graph = JSON.parse(readFileSync(join(here, "ace_graph.json"), "utf8"));
    this.graph.pid = pid;
    this.model = new RunModel(this.graph);
    this.zero = Date.now() - 1000 * this.begun;
    this.history = this.model.advance(Math.max(0, this.begun - 10.5), this.begun);
    this.known_s = this.begun;
  }

  now_s() {
    return (Date.now() - this.zero) / 1000;
  }

  async start(port = 0) {
    this.http = createServer((request, response) => this.serve(request, response));
    this.sockets = new WebSocketServer({
      server: this.http,
      handleProtocols: (protocols) => (protocols.has("takt.v1") ? "takt.v1" : false),
    });
    this.sockets.on("connection", (socket) => this.welcome(socket));
    await new Promise((done) => this.http.listen(port, "127.0.0.1", done));
    this.port = this.http.address().port;
    this.timers = [setInterval(() => this.tick(), 500), setInterval(() => this.frames(), 66)];
    return this;
  }

  async stop() {
    this.timers.forEach(clearInterval);
    for (const { socket } of this.clients) socket.terminate();
    this.sockets.close();
    this.http.closeAllConnections();
    await new Promise((done) => this.http.close(done));
  }

  address(token = this.token, view = "") {
    const parts = [token && `token=${token}`, view && `view=${view}`].filter(Boolean).join("&");
    return `http://127.0.0.1:${this.port}/${parts ? "#" + parts : ""}`;
  }

  serve(request, response) {
    this.requests.push(request.url);
    if (request.url.startsWith("/frozen/"))
      return response.writeHead(200, { "Content-Type": "application/octet-stream" }).end("a record");
    const file = request.url === "/" ? "index.html" : request.url.slice(1);
    if (!kTypes[file]) return response.writeHead(404).end();
    response.writeHead(200, {
      "Content-Type": kTypes[file],
      "Content-Security-Policy": kPolicy,
      "X-Content-Type-Options": "nosniff",
    });
    response.end(readFileSync(join(here, "../bundle", file)));
  }

  welcome(socket) {
    const client = { socket, looks: new Map(), may_change: false };
    this.clients.add(client);
    socket.on("close", () => this.clients.delete(client));
    socket.on("message", (data) => this.receive(client, JSON.parse(data.toString())));
    this.hello(client);
  }

  hello(client) {
    this.send(client, { op: "hello", may_change: client.may_change, graph: this.graph });
    this.send(client, { op: "events", events: this.model.events });
    if (!client.welcomed) this.send(client, { op: "jobs", jobs: this.history });
    client.welcomed = true;
    this.send_state(client);
  }

  send(client, message) {
    if (client.socket.readyState === 1) client.socket.send(JSON.stringify(message));
  }

  receive(client, message) {
    if (message.op === "token") {
      this.tokens.push(message.token);
      client.may_change = message.token === this.token;
      this.hello(client);
    } else if (message.op === "look") {
      client.looks.set(`${message.port}/${message.as}`, { ...message, last: 0, sequence: 0 });
    } else if (message.op === "leave") {
      client.looks.delete(`${message.port}/${message.as}`);
    } else if (message.op === "ask") {
      this.answer(client, message);
    }
  }

  answer(client, { id, question }) {
    this.asks.push(question);
    const changes = kChanges.includes(question.do) || (question.do === "fault" && question.fault);
    const answer = changes && !client.may_change ? { error: "this needs the token" } : this.model.answer(question);
    this.send(client, { op: "answer", id, ...answer });
  }

  event(kind, node, text, at_s = this.now_s()) {
    const event = { at_s, kind, node, text };
    this.model.events.push(event);
    for (const client of this.clients) this.send(client, { op: "events", events: [event] });
  }

  /** What the page is shown from now on does not change any more; gives it. */
  hold_state() {
    this.frozen_state = this.latest_state ?? this.model.state(this.now_s());
    return this.frozen_state;
  }

  tick() {
    const now = this.now_s();
    const before = this.model.events.length;
    const jobs = this.model.advance(this.known_s, now);
    this.known_s = now;
    this.history = [...this.history, ...jobs].filter((job) => job[3] > now - 10.5);
    const events = this.model.events.slice(before);
    for (const client of this.clients) {
      this.send_state(client);
      this.send(client, { op: "jobs", jobs });
      if (events.length > 0) this.send(client, { op: "events", events });
    }
  }

  send_state(client) {
    this.latest_state = this.frozen_state ?? this.model.state(this.now_s());
    this.send(client, { op: "state", state: this.latest_state });
  }

  frames() {
    const now = Date.now();
    for (const client of this.clients) {
      for (const look of client.looks.values()) {
        if (now - look.last < 1000 / look.most_hz) continue;
        look.last = now;
        this.frame(client, look);
      }
    }
  }

  frame(client, look) {
    const port = this.graph.ports.find((candidate) => candidate.name === look.port);
    if (!port?.shows.includes(look.as)) return;
    const at_s = this.now_s();
    const head = {
      port: port.name,
      kind: look.as,
      sequence: ++look.sequence,
      stamp_s: at_s - 0.03,
      age_ms: 30,
      level: 0,
    };
    this.sent[`${port.name}/${look.as}`] = (this.sent[`${port.name}/${look.as}`] ?? 0) + 1;
    if (look.as === "value")
      return this.send(client, {
        op: "value",
        ...head,
        kind: undefined,
        message: value_of(port, at_s % (kSecondsBetween * Math.max(1, this.pictures.length))),
      });
    this.bytes_of(look.as, at_s).forEach(({ bytes, ...more }) => this.send_binary(client, { ...head, ...more }, bytes));
  }

  bytes_of(kind, at_s) {
    const picture = this.pictures[Math.floor(at_s / kSecondsBetween) % Math.max(1, this.pictures.length)];
    const size = { width: 320, height: 240 };
    if (kind === "picture")
      return picture
        ? [
            { part: "left", ...size, bytes: picture.left },
            { part: "right", ...size, bytes: picture.right },
          ]
        : [];
    if (kind === "disparity") return picture ? [{ ...size, bytes: picture.disparity }] : [];
    if (kind === "cloud") return [cloud(at_s)];
    if (kind === "scan") {
      const { ranges, ...more } = scan(at_s);
      return [{ ...more, bytes: Buffer.from(ranges.buffer) }];
    }
    if (kind === "grid") {
      const { cells, ...more } = grid(at_s);
      return [{ ...more, bytes: Buffer.from(cells.buffer) }];
    }
    const robot = robot_at(at_s);
    const half = (robot.yaw + Math.PI / 2) / 2;
    return [
      {
        frame: "odometry",
        x: robot.x,
        y: robot.y,
        z: 0,
        qx: 0,
        qy: 0,
        qz: Math.sin(half),
        qw: Math.cos(half),
        bytes: Buffer.alloc(0),
      },
    ];
  }

  send_binary(client, header, bytes) {
    const head = Buffer.from(JSON.stringify(header));
    const length = Buffer.alloc(4);
    length.writeUInt32LE(head.length);
    if (client.socket.readyState === 1) client.socket.send(Buffer.concat([length, head, bytes]));
  }

  gone(why) {
    for (const client of this.clients) this.send(client, { op: "gone", why });
  }

  drop_connections() {
    for (const { socket } of this.clients) socket.terminate();
  }
}
