"use strict";
// Drawn again where colours or the width change; on paper in the colours and at the width of paper.
function on_paper(paper) {
  if (document.documentElement.hasAttribute("data-print") === paper) return;
  document.documentElement.toggleAttribute("data-print", paper);
  for (const unfolded of document.querySelectorAll("details:not([data-long])")) {
    if (paper && !unfolded.open) unfolded.dataset.closed = "";
    if (paper || "closed" in unfolded.dataset) unfolded.open = paper;
    if (!paper) delete unfolded.dataset.closed;
  }
  draw();
}

const theme_button = document.getElementById("theme");
function name_theme() {
  theme_button.textContent = appearance.now() === "dark" ? "Light page" : "Dark page";
}
theme_button.hidden = false;
theme_button.addEventListener("click", () => appearance.choose(appearance.now() === "dark" ? "light" : "dark"));
name_theme();
document.addEventListener("theme", () => { name_theme(); draw(); });
matchMedia("print").addEventListener("change", ({ matches }) => on_paper(matches));
addEventListener("beforeprint", () => on_paper(true));
addEventListener("afterprint", () => on_paper(false));
let width = 0;
new ResizeObserver(([{ contentRect }]) => {
  if (width && Math.abs(contentRect.width - width) > 1) draw();
  width = contentRect.width;
}).observe(document.body);
