// SPDX-License-Identifier: Apache-2.0
// What the robot says to people and what they answer: finds the ports and the device, knows no screen.
//
// The device is of kind `interaction`: it gives the port `task` and takes `speech`. Answers are words that a task may be,
// the same in every language: yes, no, left, ahead, right, explore, stop, or what was typed.
import type { App } from "./app.ts";
import { text_of } from "./messages.ts";
import { Signal } from "./signal.ts";

export class Dialogue {
  /** The device that answers go to; empty: there is none. */
  device = "";
  speech = "";
  status = "";
  readonly changed = new Signal();
  private leaves: (() => void)[] = [];

  constructor(private readonly app: App) {}

  start(): void {
    this.stop();
    const graph = this.app.store.graph;
    if (!graph) return;
    this.device = graph.nodes.find((node) => node.device && node.type === "interaction")?.name ?? "";
    const texts = graph.ports.filter((port) => port.type === "text_status" && port.shows.includes("value"));
    const into_device = graph.nodes
      .find((node) => node.name === this.device)
      ?.inputs.find((input) => input.name === "speech");
    const speech = into_device?.from ?? texts.find((port) => port.name.endsWith(".speech"))?.name;
    const client = texts.filter((port) => port.name.endsWith(".status"));
    const status =
      client.find((port) => this.type_of(port.name) === "mission") ??
      client.find((port) => this.type_of(port.name) === "robot_client");
    this.watch(speech, (text) => (this.speech = text));
    this.watch(status?.name, (text) => (this.status = text));
  }

  stop(): void {
    for (const leave of this.leaves) leave();
    this.leaves = [];
  }

  private type_of(port: string): string {
    return this.app.store.producer(port)?.type ?? "";
  }

  private watch(port: string | undefined, take: (text: string) => void): void {
    if (port === undefined) return;
    this.leaves.push(
      this.app.link.look(port, "value", 2, (seen) => {
        if (!("value" in seen)) return;
        take(text_of(seen.value.message["text"]));
        this.changed.emit();
      }),
    );
  }

  /** Gives what is wrong, or nothing. */
  async answer(text: string): Promise<string> {
    if (this.device === "") return "no device";
    return (await this.app.link.ask({ do: "answer", device: this.device, text })).error ?? "";
  }
}
