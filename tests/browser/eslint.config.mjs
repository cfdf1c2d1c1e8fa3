// The rules of the page scripts, and of the checks in browsers; `lint` holds both to them.
import js from "@eslint/js";
import globals from "globals";

/** What the linker of the pages does not understand (docs/decisions/0042-page-scripts-are-modules.md). */
const unlinked = {
  "ImportDeclaration > :not(ImportSpecifier, Literal)": "Import by name.",
  "ImportExpression, ExportDefaultDeclaration, ExportAllDeclaration": "The linker of pages has no such thing.",
  "ExportNamedDeclaration[declaration=null]": "Export where it is declared.",
  "ExportNamedDeclaration > VariableDeclaration[kind!='const']": "Importers would keep the first value.",
  "ExportNamedDeclaration > VariableDeclaration > VariableDeclarator > ObjectPattern": "Export one name.",
};

export default [
  js.configs.recommended,
  {
    linterOptions: { reportUnusedDisableDirectives: "error" },
    rules: {
      camelcase: ["error", { properties: "never" }],
      "max-len": ["error", { code: 120 }],
      "no-undef": "error",
      "no-unused-vars": "error",
      eqeqeq: "error",
      "prefer-const": "error",
    },
  },
  {
    files: ["**/*.js"],
    languageOptions: { globals: { ...globals.browser, echarts: "readonly" } },
    rules: {
      "no-restricted-syntax": [
        "error",
        ...Object.entries(unlinked).map(([selector, message]) => ({ selector, message })),
      ],
    },
  },
  { files: ["**/*.mjs"], languageOptions: { globals: { ...globals.node, ...globals.browser } } },
];
