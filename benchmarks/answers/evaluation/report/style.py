"""The report's style: on a light and a dark screen, and on paper."""

from __future__ import annotations

from typing import Final

CSS: Final = """
:root { color-scheme: light dark; --text: #1d1d1f; --dim: #66666c; --rule: #d8d8dc;
  --ground: #fff; --soft: #f5f5f6; --good: #2f7d4f; --bad: #b8371f; }
@media (prefers-color-scheme: dark) { :root { --text: #ececee; --dim: #a0a0a8; --rule: #3a3a40;
  --ground: #161618; --soft: #202024; --good: #6cc38c; --bad: #ef8a70; } }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 3rem 1.5rem 5rem; max-width: 62rem; color: var(--text);
  background: var(--ground); font: 16px/1.55 Inter, "Helvetica Neue", Arial, sans-serif;
  font-feature-settings: "tnum", "ss03"; }
h1 { font-size: 2rem; line-height: 1.15; letter-spacing: -0.02em; margin: 0 0 .3rem; }
h2 { font-size: 1.3rem; letter-spacing: -0.01em; margin: 3.2rem 0 .6rem; }
h3 { font-size: 1rem; margin: 1.8rem 0 .4rem; }
p, li { max-width: 44rem; } .lead { color: var(--dim); font-size: 1.06rem; margin-top: 0; }
table { border-collapse: collapse; margin: .8rem 0 1.2rem; font-size: .92rem; }
th { text-align: left; font-weight: 600; vertical-align: bottom; }
th, td { padding: .32rem .9rem .32rem 0; border-bottom: 1px solid var(--rule); }
td.n, th.n { text-align: right; white-space: nowrap; } td.paper, .dim { color: var(--dim); }
.met { color: var(--good); font-weight: 600; } .missed { color: var(--bad); font-weight: 600; }
figure { margin: 1.2rem 0; } figcaption { color: var(--dim); font-size: .88rem; max-width: 44rem; }
svg { max-width: 100%; height: auto; display: block; }
.key { font-size: .85rem; color: var(--dim); margin: .2rem 0 0; }
.key span { margin-right: 1.1rem; white-space: nowrap; }
.key i { display: inline-block; width: .7em; height: .7em; margin-right: .4em; }
.wide { overflow-x: auto; } .wide table { font-size: .78rem; }
.wide th, .wide td { padding: .25rem .5rem .25rem 0; } td.out { color: var(--dim); }
td.in { font-weight: 600; } .turned th { height: 7.5rem; white-space: nowrap; }
.turned th div { writing-mode: vertical-rl; transform: rotate(180deg); }
.sheet { display: grid; gap: 3px; font-size: .62rem; line-height: 1.2; color: var(--dim);
  overflow-x: auto; } .sheet img { width: 100%; display: block; border-radius: 2px; }
.sheet .name { align-self: center; padding-right: .4rem; font-size: .7rem; }
.sheet .words { padding: .1rem 0 .35rem; }
@media print { body { max-width: none; padding: 0; font-size: 10.5pt; } h2 { break-after: avoid; }
  figure, tr, .sheet > * { break-inside: avoid; } .wide, .sheet { overflow: visible; } }
"""
