// SPDX-License-Identifier: Apache-2.0
// One calm colour for each process, the same in the diagram, the timeline and the tables.
import type { Graph } from "./protocol.ts";

// Told apart by most people with a colour deficiency too (after Okabe and Ito), darker on light ground.
const kLight = ["#4f7cac", "#c07f2d", "#3f8f6b", "#9c6196", "#8a7a2b", "#5a8fa3", "#b0604f", "#6d6fb0"];
const kDark = ["#7aa5d3", "#dda45b", "#6fbf97", "#c390bd", "#bfae5c", "#86bccf", "#d98f7e", "#9c9edb"];

export function is_dark(): boolean {
  return matchMedia("(prefers-color-scheme: dark)").matches;
}

export function process_colour(graph: Graph, process: string): string {
  const index = Math.max(0, graph.processes.indexOf(process));
  const colours = is_dark() ? kDark : kLight;
  return colours[index % colours.length]!;
}

/** A colour of the style sheet: theme("--ink"). */
export function theme(name: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}
