"use strict";
// The contents list: it stays in sight and marks the section that is being read.

const in_sight = new Set();
let watcher = null;
let sizes = null;

function contents() {
  const sections = [...document.querySelectorAll("main > section, main > .first > section")].filter((s) => !s.hidden && s.dataset.short);
  const links = sections.map((s) => element("a", { href: `#${s.id}` }, s.dataset.short));
  const bar = element("ul", {}, links.map((link) => element("li", {}, link)));
  const nav = document.getElementById("contents");
  nav.replaceChildren(bar);
  const hint = () => {
    const more = [bar.scrollLeft > 4 && "left", bar.scrollLeft + bar.clientWidth < bar.scrollWidth - 4 && "right"].filter(Boolean);
    nav.dataset.more = more.join(" ");
    // A heading that is jumped to must not end up under the bar.
    document.documentElement.style.setProperty("--bar", `${nav.offsetHeight}px`);
  };
  bar.addEventListener("scroll", hint);
  sizes?.disconnect();
  sizes = new ResizeObserver(hint);
  sizes.observe(bar);
  watcher?.disconnect();
  in_sight.clear();
  const mark = () => {
    const at = sections.findIndex((s) => in_sight.has(s));
    if (at < 0) return;
    for (const [k, link] of links.entries()) {
      if (k === at) link.setAttribute("aria-current", "true");
      else link.removeAttribute("aria-current");
    }
    // The bar itself is scrolled, never the page.
    const { offsetLeft, offsetWidth } = links[at];
    if (offsetLeft < bar.scrollLeft || offsetLeft + offsetWidth > bar.scrollLeft + bar.clientWidth) bar.scrollLeft = offsetLeft - 24;
  };
  watcher = new IntersectionObserver((changes) => {
    for (const { target, isIntersecting } of changes) {
      if (isIntersecting) in_sight.add(target);
      else in_sight.delete(target);
    }
    mark();
  }, { rootMargin: "-64px 0px -50% 0px" });
  for (const section of sections) watcher.observe(section);
}
