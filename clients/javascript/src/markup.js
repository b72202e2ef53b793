import { elements } from "./text-tables.js";

// The rule of `is_markup` of realizer/sources.py; test/markup-cases.json is what Python gives.
const NAME = "[\\p{L}\\p{N}_.-]";
const BEGINNING = new RegExp(`^[\\s\\ufeff]*<(?:[?!]|(?:${NAME}+:)?([A-Za-z_]${NAME}*)(?=[\\s/>]|$))`, "u");
const DOCUMENT = new RegExp(`<(?:${NAME}+:)?(?:bml|speak|act|fml-apml)(?=[\\s/>]|$)`, "u");
const inside = new Set(`${elements.html} ${elements.ssml}`.split(" "));

/** Whether a text is BML or another document, for `play`, and not words with some markup in them, for `speak`. */
export function isMarkup(text) {
  const begin = BEGINNING.exec(text);
  if (begin && (begin[1] === undefined || !inside.has(begin[1].toLowerCase()))) return true;
  return DOCUMENT.test(text);
}
