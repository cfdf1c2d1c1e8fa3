// @ts-check
// The theme is settled before anything is drawn.

import { settleTheme } from "./theme.js";

settleTheme();
