"use strict";
// Light or dark, as the system has it or as chosen on the page; settled before anything is drawn.
const appearance = (() => {
  const system = matchMedia("(prefers-color-scheme: dark)");
  const KEPT = "calibench-theme";
  const read = () => { try { return localStorage.getItem(KEPT); } catch { return null; } };
  const keep = (name) => { try { localStorage.setItem(KEPT, name); } catch { /* A page may be denied a memory; it then follows the system when opened again. */ } };
  const now = () => document.documentElement.dataset.theme;
  const set = (name) => {
    if (now() === name) return;
    document.documentElement.dataset.theme = name;
    document.dispatchEvent(new Event("theme"));
  };
  const kept = read();
  let chosen = kept === "light" || kept === "dark" ? kept : null;
  const follow = () => set(chosen ?? (system.matches ? "dark" : "light"));
  follow();
  system.addEventListener("change", follow);
  return { now, choose: (name) => { chosen = name; keep(name); follow(); } };
})();
