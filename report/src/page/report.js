// @ts-check
// The page of a report: it carries its document.

import { byId } from "./elements.js";
import { redrawOnChange } from "./redraw.js";
import { render } from "./render.js";

redrawOnChange();
render(JSON.parse(byId("data").textContent));
