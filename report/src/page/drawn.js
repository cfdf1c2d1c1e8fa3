// @ts-check
// The charts of the page.

/** @type {Drawn[]} */
export const drawn = [];

/**
 * Forgets the charts of parts that are laid out again: they are gone with their hosts.
 * @param {Element[]} parts
 */
export function forget(...parts) {
  for (let i = drawn.length - 1; i >= 0; i -= 1) {
    if (parts.some((part) => part.contains(drawn[i].host))) drawn.splice(i, 1)[0].chart?.dispose();
  }
}
