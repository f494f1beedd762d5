// SPDX-License-Identifier: Apache-2.0
#include "graph/view/html_parts.hpp"

namespace takt::view {

const char* page_style() {
  return R"(
:root { --ink: #1c2733; --soft: #5b6876; --page: #ffffff; --panel: #f3f5f8; --rule: #d5dce4; --good: #1d7a43;
  --bad: #c22f22; --bad-panel: #fbe6e3; --bar: #2f7ed8; color-scheme: light dark; }
@media screen and (prefers-color-scheme: dark) {
:root { --ink: #e3e8ee; --soft: #9aa7b5; --page: #14181d; --panel: #1b2128; --rule: #37424e; --good: #5cc98a;
  --bad: #ff8273; --bad-panel: #46211e; --bar: #5b9fe8; } }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 20px 24px 60px; max-width: 1500px; background: var(--page); color: var(--ink);
  font: 15px/1.45 Helvetica, Arial, "DejaVu Sans", sans-serif; }
h1 { font-size: 26px; margin: 8px 0 2px; } h2 { font-size: 18px; margin: 34px 0 8px; } h3 { font-size: 14px; margin: 0 0 4px; }
p { margin: 4px 0 8px; } .note { color: var(--soft); font-size: 13px; }
.verdict { display: inline-block; padding: 1px 12px; border-radius: 4px; color: #ffffff; background: #1d7a43; }
.verdict.broken { background: #c22f22; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: 3px 18px; margin: 12px 0; }
dt { color: var(--soft); } dd { margin: 0; overflow-wrap: anywhere; } dd ul { margin: 0; padding-left: 18px; }
.scroll { overflow-x: auto; max-width: 100%; }
.scroll > svg { display: block; } .scroll > .takt-graph { max-width: 100%; height: auto; }
table { border-collapse: collapse; font-size: 13px; font-variant-numeric: tabular-nums; }
th, td { padding: 3px 9px; text-align: left; white-space: nowrap; border-bottom: 1px solid var(--rule); }
th { color: var(--soft); font-weight: normal; vertical-align: bottom; }
th.group { text-align: center; border-bottom: none; padding-bottom: 0; }
td:first-child, th:first-child { position: sticky; left: 0; background: var(--page); }
.n { text-align: right; } .bad { color: var(--bad); background: var(--bad-panel); font-weight: bold; }
.charts { display: grid; grid-template-columns: repeat(auto-fill, minmax(330px, 1fr)); gap: 18px; }
.chart { background: var(--panel); border: 1px solid var(--rule); border-radius: 6px; padding: 10px 12px; min-width: 0; }
.chart svg { width: 100%; height: auto; display: block; }
.plot text { font-size: 11px; fill: var(--soft); } .plot .name { fill: var(--ink); font-size: 12px; }
.plot .grid { stroke: var(--rule); } .plot .axis { stroke: var(--soft); } .plot .bar { fill: var(--bar); }
.plot .lane { fill: var(--panel); } .plot .on-bar { fill: #ffffff; font-size: 10px; } .plot .quantile { stroke: var(--bad); }
.plot .release { stroke: var(--ink); fill: var(--ink); } .plot .late { stroke: var(--bad); stroke-width: 2; }
.plot .deadline { stroke: var(--soft); fill: var(--soft); }
.swatch { display: inline-block; width: 11px; height: 11px; border-radius: 2px; margin: 0 5px 0 12px; }
.stack { display: flex; height: 26px; border-radius: 4px; overflow: hidden; background: var(--panel);
  border: 1px solid var(--rule); max-width: 760px; margin: 6px 0; }
.stack i { display: block; height: 100%; }
figure { margin: 0; background: var(--panel); border: 1px solid var(--rule); border-radius: 6px; padding: 10px; min-width: 0; }
figure img { max-width: 100%; height: auto; display: block; margin: 0 auto; } figcaption { margin-top: 6px; font-size: 13px; }
@media (max-width: 600px) { body { padding: 10px 10px 40px; } h1 { font-size: 21px; }
  dl { grid-template-columns: 1fr; gap: 0; } dt { margin-top: 6px; } .charts { grid-template-columns: 1fr; } }
@media print { @page { size: A4 landscape; margin: 12mm; } body { padding: 0; max-width: none; font-size: 11px; }
  :root { color-scheme: light; } .scroll { overflow: visible; } .scroll > svg { max-width: 100%; min-width: 0 !important; height: auto; }
  h2 { font-size: 15px; margin-top: 18px; } .note, figcaption { font-size: 10px; }
  table { font-size: 10px; } th, td { padding: 1px 5px; } figure, .chart, tr { break-inside: avoid; } h2 { break-after: avoid; }
  .charts { grid-template-columns: repeat(3, 1fr); }
  * { print-color-adjust: exact; -webkit-print-color-adjust: exact; } }
)";
}

}  // namespace takt::view
