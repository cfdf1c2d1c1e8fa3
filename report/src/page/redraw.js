// @ts-check
// Drawn again where colours or the width change; on paper in the colours and at the width of paper.

import { draw } from "./drawing.js";
import { byId } from "./elements.js";
import { chooseTheme, followSystem, themeNow } from "./theme.js";

/** @param {boolean} paper */
function onPaper(paper) {
  if (document.documentElement.hasAttribute("data-print") === paper) return;
  document.documentElement.toggleAttribute("data-print", paper);
  /** @type {NodeListOf<HTMLDetailsElement>} */
  const foldable = document.querySelectorAll("details:not([data-long])");
  for (const unfolded of foldable) {
    if (paper && !unfolded.open) unfolded.dataset.closed = "";
    if (paper || "closed" in unfolded.dataset) unfolded.open = paper;
    if (!paper) delete unfolded.dataset.closed;
  }
  draw();
}

function nameTheme() {
  byId("theme").textContent = themeNow() === "dark" ? "Light page" : "Dark page";
}

// Once, when the page begins.
export function redrawOnChange() {
  byId("theme").hidden = false;
  byId("theme").addEventListener("click", () => chooseTheme(themeNow() === "dark" ? "light" : "dark"));
  nameTheme();
  followSystem();
  document.addEventListener("theme", () => {
    nameTheme();
    draw();
  });
  matchMedia("print").addEventListener("change", ({ matches }) => onPaper(matches));
  addEventListener("beforeprint", () => onPaper(true));
  addEventListener("afterprint", () => onPaper(false));
  let width = 0;
  new ResizeObserver(([{ contentRect }]) => {
    if (width && Math.abs(contentRect.width - width) > 1) draw();
    width = contentRect.width;
  }).observe(document.body);
}
