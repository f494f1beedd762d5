// SPDX-License-Identifier: Apache-2.0
// Counts frames received and drawn, and how old they were when drawn. Tests and benchmarks read window.takt.
const kLatencies = 500;

export interface Counters {
  received: Record<string, number>;
  drawn: Record<string, number>;
  latency_ms: Record<string, number[]>;
  damaged: number;
}

export const counters: Counters = { received: {}, drawn: {}, latency_ms: {}, damaged: 0 };

declare global {
  interface Window {
    takt: Counters;
  }
}
window.takt = counters;

export function count_received(key: string): void {
  counters.received[key] = (counters.received[key] ?? 0) + 1;
}

/** `age_ms` is the age when the server sent it, `received_ms` when it came. The newest 500 ages of each port are kept. */
export function count_drawn(key: string, age_ms: number, received_ms: number): number {
  const age = age_ms + (performance.now() - received_ms);
  counters.drawn[key] = (counters.drawn[key] ?? 0) + 1;
  const ages = (counters.latency_ms[key] ??= []);
  ages.push(age);
  if (ages.length > kLatencies) ages.splice(0, ages.length - kLatencies);
  return age;
}
