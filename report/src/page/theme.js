// @ts-check
// Light or dark, as the system has it or as chosen on the page.

const KEPT = "calibench-theme";
const system = matchMedia("(prefers-color-scheme: dark)");

function kept() {
  try {
    return localStorage.getItem(KEPT);
  } catch {
    return null;
  }
}

let chosen = kept();

export const themeNow = () => document.documentElement.dataset.theme;

// Sets the theme, and announces one that is new.
export function settleTheme() {
  const theme = chosen === "light" || chosen === "dark" ? chosen : system.matches ? "dark" : "light";
  if (themeNow() === theme) return;
  document.documentElement.dataset.theme = theme;
  document.dispatchEvent(new Event("theme"));
}

/** @param {string} theme */
export function chooseTheme(theme) {
  chosen = theme;
  try {
    localStorage.setItem(KEPT, theme);
  } catch {
    /* A page may be denied a memory; it then follows the system when opened again. */
  }
  settleTheme();
}

export const followSystem = () => system.addEventListener("change", settleTheme);
