// SPDX-License-Identifier: Apache-2.0
// How a node does, in one word for colours and sorting.
import { known } from "./format.ts";
import type { GraphNode, NodeState } from "./protocol.ts";

export type Health = "good" | "warn" | "bad" | "paused";

export function above_proof(node: GraphNode, state: NodeState): boolean {
  return known(state.response_max_ms) && known(node.proven_ms) && state.response_max_ms > node.proven_ms;
}

/** bad: a deadline was missed or a response was above its proof; warn: skipped, degraded, or over its budget. */
export function health(node: GraphNode, state: NodeState): Health {
  if (state.deadline_misses > 0 || above_proof(node, state)) return "bad";
  if (state.skipped > 0 || state.overruns > 0 || state.level > 0) return "warn";
  if (state.completed === 0 && state.paused > 0) return "paused";
  return "good";
}

/** Level 0 is full quality. */
export function level_text(node: GraphNode, state: NodeState): string {
  return node.levels > 1 ? `level ${state.level} of ${node.levels - 1}` : "";
}
