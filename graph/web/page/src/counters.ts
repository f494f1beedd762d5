// SPDX-License-Identifier: Apache-2.0
// Counts frames received and drawn, and how old they were when drawn. Tests and benchmarks read window.takt.
const kLatencies = 1000;

export interface Counters {
  received: Record<string, number>;
  drawn: Record<string, number>;
  latency_ms: number[];
  damaged: number;
}

export const counters: Counters = { received: {}, drawn: {}, latency_ms: [], damaged: 0 };

declare global {
  interface Window {
    takt: Counters;
  }
}
window.takt = counters;

export function count_received(key: string): void {
  counters.received[key] = (counters.received[key] ?? 0) + 1;
}

/** `age_ms` is the age when the server sent it, `received_ms` when it came. The newest 1000 ages are kept. */
export function count_drawn(key: string, age_ms: number, received_ms: number): number {
  const age = age_ms + (performance.now() - received_ms);
  counters.drawn[key] = (counters.drawn[key] ?? 0) + 1;
  counters.latency_ms.push(age);
  if (counters.latency_ms.length > kLatencies) counters.latency_ms.splice(0, counters.latency_ms.length - kLatencies);
  return age;
}
