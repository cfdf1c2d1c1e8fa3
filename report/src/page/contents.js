// @ts-check
// The contents list: it stays in sight and marks the section that is being read.

import { byId, element } from "./elements.js";

/** @type {Set<Element>} */
const inSight = new Set();
/** @type {IntersectionObserver | null} */
let watcher = null;
/** @type {ResizeObserver | null} */
let sizes = null;

export function contents() {
  /** @type {NodeListOf<HTMLElement>} */
  const all = document.querySelectorAll("main > section, main > .first > section");
  const sections = [...all].filter((s) => !s.hidden && s.dataset.short);
  const links = sections.map((s) => element("a", { href: `#${s.id}` }, s.dataset.short));
  const items = links.map((link) => element("li", {}, link));
  const bar = element("ul", {}, items);
  const nav = byId("contents");
  nav.replaceChildren(bar);
  const hint = () => {
    const reaches = bar.scrollLeft + bar.clientWidth;
    const more = [bar.scrollLeft > 4 && "left", reaches < bar.scrollWidth - 4 && "right"].filter(Boolean);
    nav.dataset.more = more.join(" ");
    // A heading that is jumped to must not end up under the bar.
    document.documentElement.style.setProperty("--bar", `${nav.offsetHeight}px`);
  };
  bar.addEventListener("scroll", hint);
  sizes?.disconnect();
  sizes = new ResizeObserver(hint);
  sizes.observe(bar);
  watcher?.disconnect();
  inSight.clear();
  const mark = () => {
    const at = sections.findIndex((s) => inSight.has(s));
    if (at < 0) return;
    for (const [k, link] of links.entries()) {
      if (k === at) link.setAttribute("aria-current", "true");
      else link.removeAttribute("aria-current");
    }
    // The bar itself is scrolled, never the page.
    const { offsetLeft, offsetWidth } = links[at];
    const outside = offsetLeft < bar.scrollLeft || offsetLeft + offsetWidth > bar.scrollLeft + bar.clientWidth;
    if (outside) bar.scrollLeft = offsetLeft - 24;
  };
  /** @param {IntersectionObserverEntry[]} changes */
  const changed = (changes) => {
    for (const { target, isIntersecting } of changes) {
      if (isIntersecting) inSight.add(target);
      else inSight.delete(target);
    }
    mark();
  };
  watcher = new IntersectionObserver(changed, { rootMargin: "-64px 0px -50% 0px" });
  for (const section of sections) watcher.observe(section);
}
