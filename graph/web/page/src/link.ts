// SPDX-License-Identifier: Apache-2.0
// The WebSocket to takt web: connects, connects again with growing pauses, asks, and looks at ports.
import { count_received, counters } from "./counters.ts";
import { read_frame } from "./frame.ts";
import type { Answer, Frame, Graph, JobRow, LogEvent, Question, State, ValueMessage, Way } from "./protocol.ts";
import type { Store } from "./store.ts";

const kFirstPause_ms = 500;
const kLongestPause_ms = 10000;
const kPatience_ms = 10000;
const kMostPending = 200;

export type Seen = { frame: Frame } | { value: ValueMessage; received_ms: number };
type Watcher = (seen: Seen) => void;

interface Look {
  port: string;
  as: Way;
  most_hz: number;
  watchers: Set<Watcher>;
}

interface Pending {
  done: (answer: Answer) => void;
  timer: number;
}

export class Link {
  private socket: WebSocket | null = null;
  private pause_ms = kFirstPause_ms;
  private next_id = 1;
  private readonly pending = new Map<number, Pending>();
  private readonly looks = new Map<string, Look>();
  private token_sent = false;

  constructor(
    private readonly store: Store,
    private readonly token: string,
  ) {}

  connect(): void {
    this.store.set_connection("connecting");
    const scheme = location.protocol === "https:" ? "wss:" : "ws:";
    const socket = new WebSocket(`${scheme}//${location.host}/`, "takt.v1");
    socket.binaryType = "arraybuffer";
    socket.onmessage = (event) => this.receive(event.data as string | ArrayBuffer);
    socket.onclose = () => this.closed(socket);
    this.socket = socket;
    this.token_sent = false;
  }

  private closed(socket: WebSocket): void {
    if (socket !== this.socket) return;
    this.socket = null;
    for (const id of [...this.pending.keys()]) this.finish(id, { error: "the connection closed before the answer" });
    // Spread by a fifth, so that many pages do not come back at one instant.
    const wait = this.pause_ms * (0.9 + 0.2 * Math.random());
    this.pause_ms = Math.min(kLongestPause_ms, this.pause_ms * 2);
    this.store.set_connection("closed", performance.now() + wait);
    setTimeout(() => this.connect(), wait);
  }

  private receive(data: string | ArrayBuffer): void {
    if (typeof data !== "string") return this.receive_frame(data);
    let message: Record<string, unknown>;
    try {
      message = JSON.parse(data) as Record<string, unknown>;
    } catch {
      counters.damaged++;
      return;
    }
    this.receive_message(message);
  }

  private receive_message(message: Record<string, unknown>): void {
    switch (message["op"]) {
      case "hello":
        return this.receive_hello(message["graph"] as Graph, message["may_change"] === true);
      case "state":
        return this.store.take_state(message["state"] as State);
      case "jobs":
        return this.store.take_jobs((message["jobs"] ?? []) as JobRow[]);
      case "events":
        return this.store.take_events((message["events"] ?? []) as LogEvent[]);
      case "value":
        return this.receive_value(message as unknown as ValueMessage);
      case "answer":
        return this.finish(Number(message["id"]), this.answer_of(message));
      case "gone":
        return this.store.set_gone(String(message["why"] ?? ""));
    }
  }

  /** The answer stands next to `id` in the message, or in its member `answer`. */
  private answer_of(message: Record<string, unknown>): Answer {
    const inner = message["answer"];
    return (inner !== null && typeof inner === "object" ? inner : message) as Answer;
  }

  private receive_hello(graph: Graph, may_change: boolean): void {
    const fresh = this.store.connection !== "open" || this.store.gone !== "" || this.store.graph?.pid !== graph.pid;
    this.pause_ms = kFirstPause_ms;
    if (this.store.connection !== "open") this.store.set_connection("open");
    this.store.take_hello(graph, may_change);
    if (fresh) this.token_sent = false;
    if (this.token !== "" && !may_change && !this.token_sent) {
      this.token_sent = true;
      this.send({ op: "token", token: this.token });
    }
    if (fresh) for (const look of this.looks.values()) this.send_look(look);
  }

  private receive_value(value: ValueMessage): void {
    count_received(`${value.port}/value`);
    const look = this.looks.get(`${value.port}/value`);
    if (look) for (const watcher of look.watchers) watcher({ value, received_ms: performance.now() });
  }

  private receive_frame(data: ArrayBuffer): void {
    const frame = read_frame(data, performance.now());
    if (frame === null) {
      counters.damaged++;
      return;
    }
    const key = `${frame.header.port}/${frame.header.kind}`;
    count_received(key);
    const look = this.looks.get(key);
    if (look) for (const watcher of look.watchers) watcher({ frame });
  }

  private send(message: unknown): boolean {
    if (this.socket?.readyState !== WebSocket.OPEN) return false;
    this.socket.send(JSON.stringify(message));
    return true;
  }

  /** Never rejects: what goes wrong is in `error`. */
  ask(question: Question): Promise<Answer> {
    return new Promise((done) => {
      if (this.pending.size >= kMostPending) return done({ error: "too many questions wait for an answer" });
      const id = this.next_id++;
      if (!this.send({ op: "ask", id, question })) return done({ error: "no connection to takt web" });
      const timer = setTimeout(() => this.finish(id, { error: "no answer within 10 s" }), kPatience_ms);
      this.pending.set(id, { done, timer });
    });
  }

  private finish(id: number, answer: Answer): void {
    const waiting = this.pending.get(id);
    if (!waiting) return;
    this.pending.delete(id);
    clearTimeout(waiting.timer);
    waiting.done(answer);
  }

  /** Looks at a port until the returned function is called. Several watchers of one port share what comes. */
  look(port: string, as: Way, most_hz: number, watcher: Watcher): () => void {
    const key = `${port}/${as}`;
    let look = this.looks.get(key);
    if (!look) {
      look = { port, as, most_hz, watchers: new Set() };
      this.looks.set(key, look);
      this.send_look(look);
    } else if (most_hz > look.most_hz) {
      look.most_hz = most_hz;
      this.send_look(look);
    }
    look.watchers.add(watcher);
    return () => this.leave(key, watcher);
  }

  private leave(key: string, watcher: Watcher): void {
    const look = this.looks.get(key);
    if (!look) return;
    look.watchers.delete(watcher);
    if (look.watchers.size > 0) return;
    this.looks.delete(key);
    this.send({ op: "leave", port: look.port, as: look.as });
  }

  private send_look(look: Look): void {
    this.send({ op: "look", port: look.port, as: look.as, most_hz: look.most_hz });
  }
}
