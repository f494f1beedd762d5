// SPDX-License-Identifier: Apache-2.0
// Runs drawing functions once per animation frame, however often they were asked for.
const waiting = new Set<() => void>();
let asked = false;

function run_all(): void {
  asked = false;
  const now = [...waiting];
  waiting.clear();
  for (const draw of now) {
    try {
      draw();
    } catch (problem) {
      console.error(problem); // one view that fails leaves the others alone
    }
  }
}

/** `draw` has to be the same function object each time: it is the key. */
export function repaint(draw: () => void): void {
  waiting.add(draw);
  if (asked) return;
  asked = true;
  requestAnimationFrame(run_all);
}
