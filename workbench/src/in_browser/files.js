// @ts-check
// Files that a visitor chose or dropped.

// Longest file that is read, bytes: a table of two hundred thousand rows, which take minutes. Of half a million, the
// memory is not enough.
const LONGEST_FILE = 24 << 20;

const OF_DATASET = ["dataset.toml", "samples.csv", "robot.toml", "campaign.journal", "iterations.csv", "probings.csv"];

/**
 * The files of a dataset that come without their folder get one.
 * @param {NamedFile[]} files
 * @returns {NamedFile[]}
 */
export function inTheirFolder(files) {
  if (!files.some(({ path }) => path === OF_DATASET[0])) return files;
  return files.map(({ path, file }) => ({ path: OF_DATASET.includes(path) ? `dataset/${path}` : path, file }));
}

/**
 * Why these files cannot be opened; null if they can.
 * @param {NamedFile[]} files
 */
export function objection(files) {
  if (files.filter(({ path }) => path === "dataset/dataset.toml").length > 1) {
    return (
      "Two of these files are called dataset.toml: drop the folders of the datasets instead, so that each keeps its " +
      "files."
    );
  }
  if (!files.length) return "Choose files, or drop them on this page.";
  const long = files.find(({ file }) => file.size > LONGEST_FILE);
  if (!long) return null;
  return (
    `${long.path}: is longer than ${LONGEST_FILE >> 20} MiB, and this page reads no longer ones; take a part of the ` +
    "rows, or use the program"
  );
}

/**
 * Files and, in folders, what is in them.
 * @param {DataTransfer} transfer
 * @returns {Promise<NamedFile[]>}
 */
export async function dropped(transfer) {
  const entries = [...transfer.items].flatMap((item) => item.webkitGetAsEntry() ?? []);
  return (await Promise.all(entries.map(inside))).flat();
}

/**
 * @param {FileSystemEntry} entry
 * @returns {Promise<NamedFile[]>}
 */
async function inside(entry) {
  if (entry.isFile) {
    const { file } = /** @type {FileSystemFileEntry} */ (entry);
    return [{ path: entry.fullPath.replace(/^\//, ""), file: await new Promise(file.bind(entry)) }];
  }
  const reader = /** @type {FileSystemDirectoryEntry} */ (entry).createReader();
  /** @type {FileSystemEntry[]} */
  const all = [];
  for (;;) {
    /** @type {FileSystemEntry[]} */
    const some = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
    if (!some.length) break;
    all.push(...some);
  }
  const shown = all.filter((one) => !one.name.startsWith("."));
  return (await Promise.all(shown.map(inside))).flat();
}
