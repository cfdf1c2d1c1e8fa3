// @ts-check
// What was understood of files.

import { byId, element, list, present, sentence, unfold } from "calibench-report/elements.js";

/** @param {string[]} lines */
const sentences = (lines) => list(lines.map(sentence));

/** @param {string} text */
const verbatim = (text) => element("pre", { tabindex: "0" }, text);

/**
 * How a table was understood.
 * @param {Guess} guess
 * @param {string[]} nominal
 */
export function toldGuess({ reasons, rows, map }, nominal = []) {
  const first = element("p", {}, "The first rows are understood as");
  const how = [sentences(reasons), first, sentences(rows), nominal.length > 0 && sentences(nominal)];
  return [
    unfold("How the table was understood, and why", element("div", {}, how)),
    unfold("The column map", verbatim(map)),
  ];
}

/**
 * What was understood of the files, or measured.
 * @param {Opened} opened
 * @param {boolean} isTold what was hidden
 */
export function tellOpened(opened, isTold) {
  const { guess, scenario, samples, validation, robot, nominal, misfit, warnings } = opened;
  const count = `Opened: ${samples} samples of ${robot}${validation ? `, ${validation} of them for validation` : ""}.`;
  const content = [
    element("p", {}, element("b", {}, count)),
    misfit && element("p", { class: "warning" }, sentence(misfit)),
    warnings.length > 0 && sentences(warnings.map((line) => `warning: ${line}`)),
    guess && toldGuess(guess, nominal),
    opened.import && unfold("What was imported", verbatim(opened.import)),
    scenario && [hidden(opened, isTold), onCommandLine(scenario)],
  ];
  byId("understood").replaceChildren(...present(content));
  byId("understood").hidden = false;
}

/**
 * What was hidden in a simulated robot.
 * @param {Opened} opened
 * @param {boolean} isTold
 */
function hidden({ hidden: words, effect, times }, isTold) {
  const size = `${times} times its plausible size`;
  if (!isTold) return unfold("What was hidden", element("p", {}, words ? `${words} (${effect}), ${size}` : "nothing"));
  if (!words) return element("p", {}, "Nothing was hidden.");
  const task = `), ${size}. Which candidate is it? Switch it on, and watch the error fall.`;
  return element("p", {}, `Hidden: ${words} (`, element("code", {}, effect), task);
}

/** @param {string} scenario */
function onCommandLine(scenario) {
  const how =
    "Save this as simulated.toml in the folder scenarios of calibench, which holds the file that it extends, and " +
    "measure there: ";
  const command = element("code", {}, "calibench measure simulated.toml -o simulated");
  return unfold("The same on the command line", element("div", {}, element("p", {}, how, command), verbatim(scenario)));
}
