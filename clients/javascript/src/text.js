/**
 * What a voice is given of a text: Markdown, stage directions, emoji and numbers as people mean them.
 *
 *   import { spokenText } from "bml-realizer-client/text";
 *
 *   spokenText("**Well** [nod] it costs $5.").text; // "Well it costs five dollars."
 *
 * It gives what `realizer.spoken_text` of Python gives. The service reads the text of speeches in the same way by itself.
 */
import MarkdownIt from "markdown-it";
import { numbersInWords } from "./text-numbers.js";
import { elements as names, lexemes, marks } from "./text-tables.js";

const BEFORE = 80; // characters of what was spoken before
const LONGEST_PARAGRAPH = 2000; // characters; longer ones are read in pieces
const LONGEST_DIRECTION = 8; // words
const VALUE = "(?:\"[^\"<]*\"|'[^'<]*'|[^\\s\"'<>=/]+)";
const TAG = new RegExp(`<!--[^]*?-->|</?[A-Za-z_][\\w.-]*(?::[\\w.-]+)?(?:\\s+[\\w:.-]+\\s*=\\s*${VALUE})*\\s*/?>`, "y");
const BEGINNING = /^(?:[ \t#>*+_~`=|:.)•‣◦▪●○-]|[0-9])*/u;
const LABEL = /\[(\^?)[^\]\n]+\]:/y;
const DEFINITION = /\[[^\]\n]+\]:\s*<?(?:[a-z]+:|www\.|\/|#|\.)/iy;
const ENDED = /[.!?…:;,。！？、，；：۔؟।]["'”’»)\]]*\s*$/;
const ADDRESS =
  /(?:https?:\/\/(?:[^\s/@<>]*@)?(?:www\.)?|(?<![\p{L}\p{N}_])www\.)([^\s/?#:<>"'`()[\]*_]*[\p{L}\p{N}_])(?:[:/?#][^\s<>"'`]*[^\s<>"'`.,;:!?)\]*_])?/giu;
const REFERENCE = /\[([^[\]]+)\]\[[^[\]]*\]/g; // a link whose address is elsewhere
const CITATION = /^(?:\^[^\]]*|[0-9]+(?:\s*[,–-]\s*[0-9]+)*)$/;
const BRACKETS = /\[([^[\]]{1,60})\]|\(([^()]{1,60})\)/g;
const UNSAID = /(?<!\S)\|(?!\S)|[→⇒➜]|(?<!\S)(?:-{1,2}|=)>(?!\S)|#(?=\p{L})|\\/gu;
const PICTURES =
  /(?:[0-9#*]\ufe0f?\u20e3|[©®™‼⁉]\ufe0f|[\u{1f000}-\u{1faff}\u2600-\u27bf\u2b00-\u2bff\u2300-\u23ff\ufe0f\u200d\u{e0020}-\u{e007f}])+/gu;
const WORD = /\p{L}+(?:['’]\p{L}+)*/gu;
const SENTENCE_END = /[.!?…。！？؟।]["'”’»)\]]*\s*$/;
const SPEECH = /^([^:"“„«]+)(?::|(?=["“„«]))([^]*[\p{L}\p{N}_][^]*)$/u; // a direction, and what is said in it
const WORD_END = /^[\p{L}\p{N}_.,;:!?…][\p{L}\p{N}_]/u; // words that only a behaviour keeps apart
const VOWELS = "aeiou";

const words = (text) => new Set(text.split(" ").filter(Boolean));
const words_ = Object.fromEntries(Object.entries(marks.context).map(([kind, all]) => [kind, words(all)]));
const elements = Object.fromEntries(Object.entries(names).map(([kind, all]) => [kind, words(all)]));
const feelings = { pause: "pause" };
for (const [name, alike] of Object.entries(marks.emotions.alike)) for (const word of words(alike)) feelings[word] = name;
for (const name of words(marks.emotions.names)) feelings[name] = name;
const signs = Object.keys(marks.emoticons).sort((a, b) => b.length - a.length);
const EMOTICONS = new RegExp(`(?<!\\S)(?:${signs.map((sign) => sign.replace(/[$.*+?^(){}|[\]\\/]/g, "\\$&")).join("|")})(?=[\\s.,!?]|$)`, "g");

const parser = new MarkdownIt("commonmark", { html: false }).enable(["strikethrough", "table"]);
parser.disable(["code", "lheading", "reference", "html_block"]);
parser.inline.ruler.before("autolink", "tag", (state, silent) => {
  if (state.src[state.pos] !== "<") return false;
  TAG.lastIndex = state.pos;
  const found = TAG.exec(state.src);
  if (!found) return false;
  if (!silent) state.push("tag", "", 0).content = found[0].startsWith("<!") ? "" : found[0];
  state.pos += found[0].length;
  return true;
});

const verbs = new Map(); // form of a verb -> [[word that must follow or "", name]]
for (const language of ["en", "de", "fr", "es", "nl"]) {
  for (const [name, phrases] of Object.entries(marks[language])) {
    for (const phrase of phrases.split(" ")) {
      const [verb, follows = ""] = phrase.split("+");
      for (const form of language === "en" ? inflections(verb) : [verb]) verbs.set(form, [...(verbs.get(form) ?? []), [follows, name]]);
    }
  }
}

const bare = new Set(); // forms of English verbs that are no third person and no participle
for (const phrases of Object.values(marks.en)) {
  for (const phrase of phrases.split(" ")) {
    const [verb, , , past] = inflections(phrase.split("+")[0]);
    bare.add(verb).add(past);
  }
}

/**
 * What a voice is given of a text.
 * @param {string} text
 * @param {string} [language] BCP-47, for numbers
 * @param {object} [options] emoji: whether emoji and emoticons that are known become behaviours. code: "skip" leaves blocks of code out, "say" says "code" for each
 * @returns {{text: string, markup: string, behaviours: [number, string][], warnings: string[]}} the words; the words with SSML and
 *   behaviours; each behaviour with the number of characters before it; sentences about what is left out
 */
export function spokenText(text, language = "en", { emoji = true, code = "skip" } = {}) {
  if (typeof text !== "string") throw new TypeError(`text: wanted a text, got ${typeof text}`);
  const reader = new Reader(emoji, code);
  const parts = tidy(inWords(joined(reader.read(text)), language));
  let said = "";
  const behaviours = [];
  for (const part of parts) {
    if (typeof part === "string") said += part;
    else if (part.shows) behaviours.push([said.length, part.source]);
  }
  return { text: said, markup: parts.map(markup).join(""), behaviours, warnings: [...new Set(reader.warnings)] };
}

/** A reader of one text: its parts are words, and tags { source, shows }. */
class Reader {
  warnings = [];
  #parts = [];
  #open = ""; // words of a paragraph
  #kind = null; // of the block that is read
  #before = ""; // the last words of the paragraph

  constructor(emoji, code) {
    this.emoji = emoji;
    this.code = code;
  }

  read(text) {
    let fence = null;
    for (const line of text.replaceAll("\r\n", "\n").replaceAll("\r", "\n").split("\n")) {
      if (fence) {
        if (fence.test(line)) fence = null;
      } else fence = this.#line(line);
    }
    this.#end(true);
    return this.#parts;
  }

  /** Read a line; return what ends the block of code that it begins, or null. */
  #line(line) {
    const begin = BEGINNING.exec(line)[0];
    LABEL.lastIndex = DEFINITION.lastIndex = begin.length;
    const label = LABEL.exec(line);
    if (/```|~~~/.test(begin)) {
      const token = parser.parse(line, {}).find((one) => one.type === "fence");
      if (token) {
        this.#end();
        if (this.code === "say") this.#parts.push("code. ");
        else this.warnings.push("a block of code is not spoken");
        return new RegExp(`^[\\s>]*${token.markup[0]}{${token.markup.length},}\\s*$`);
      }
    }
    if (begin.length >= line.length && !parser.parse(line, {}).some((one) => one.type === "inline" && /[\p{L}\p{N}]/u.test(one.content))) {
      this.#end();
      return null;
    }
    if (label) {
      this.#end();
      if (label[1] || !DEFINITION.test(line)) {
        this.#kind = "paragraph";
        this.#open += line.slice(begin.length + (label[1] ? label[0].length : 0));
      }
      return null;
    }
    const { kind, length, says } = lineStart(begin.length < line.length ? begin : line.slice(0, lastBlank(line.trimEnd())));
    if (kind === "row") {
      this.#end();
      this.#kind = "row";
      this.#open = cells(line.slice(length)).filter((cell, place) => cell || !place).join(", ");
      this.#end();
      return null;
    }
    // As in CommonMark, a number begins a list inside of a paragraph only if it is 1.
    const isNumber = says && this.#kind === "paragraph" && says !== "1: ";
    if ((isNumber || kind === "paragraph" || kind === "quote") && this.#kind && this.#kind !== "row") this.#open += " ";
    else {
      this.#end();
      this.#kind = isNumber ? "paragraph" : kind;
      this.#open = isNumber ? "" : says;
    }
    const rest = line.slice(isNumber ? 0 : length).replace(/^[ \t]+/, "");
    this.#open += kind === "item" ? rest.replace(/^\[[ xX]\]\s/, "") : rest;
    if (this.#kind === "heading") this.#end();
    return null;
  }

  /** End a paragraph; a heading, an item and a row end like a sentence. */
  #end(isLast = false) {
    for (const piece of this.#open.match(new RegExp(`[^]{1,${LONGEST_PARAGRAPH}}(?:\\s|$)|[^]{1,${LONGEST_PARAGRAPH}}`, "g")) ?? []) this.#say(readInline(piece));
    this.#open = "";
    if (this.#kind) {
      const isSentence = !this.#before.trim() || ENDED.test(this.#before);
      if (!isSentence && (!["paragraph", "quote"].includes(this.#kind) || !isLast)) this.#parts.push(".");
      if (!isLast) this.#parts.push("\n\n");
      this.#before = "";
    }
    this.#kind = null;
  }

  #say(pieces) {
    for (const [place, { kind, text }] of pieces.entries()) {
      const parts = kind === "em" ? this.#emphasised(text, pieces.slice(place + 1)) : kind === "tag" ? element(text) : kind === "code" ? [text] : this.#words(text);
      for (const part of parts) if (typeof part === "string") this.#before = (this.#before + part).slice(-BEFORE);
      this.#parts.push(...parts);
    }
  }

  /** The behaviours of a stage direction, or else emphasised words. */
  #emphasised(text, following) {
    const last = this.#before.slice(-40).match(WORD)?.at(-1);
    if (last && /\p{L}$/u.test(this.#before.trimEnd()) && words_.before.has(last.toLowerCase())) return this.#words(text);
    const speech = SPEECH.exec(text);
    if (speech) {
      const head = direction(speech[1]);
      if (head ? !head.isBare : isThirdPerson(speech[1])) return [...this.#emphasised(speech[1], []), " ", ...this.#words(speech[2])];
    }
    const known = direction(text);
    if (known && !isDirection(known, this.#before, wordsAfter(following))) return this.#words(text);
    if (known?.unknown) this.warnings.push(`the stage direction '${known.unknown}' is not known: it is left out`);
    if (known) return known.shows;
    const standsAlone = !this.#before.trim() || ENDED.test(this.#before);
    const after = following.map((piece) => (piece.kind === "tag" ? "" : piece.text)).join("");
    if (standsAlone && isThirdPerson(text) && !/^\p{Ll}/u.test(after.trimStart())) {
      this.warnings.push(`the stage direction '${text.slice(0, 60)}' is not known: it is left out`);
      return [];
    }
    return this.#words(text);
  }

  #words(text) {
    text = text.replace(ADDRESS, "$1").replace(REFERENCE, "$1");
    const parts = [];
    let at = 0;
    for (const found of text.matchAll(BRACKETS)) {
      const shown = found[1] !== undefined ? inBrackets(found[1]) : inParentheses(found[2]);
      if (shown && found[1] !== undefined && isNamed(this.#before + text.slice(0, found.index))) continue;
      if (!shown && !(found[1] !== undefined && CITATION.test(found[1]))) continue;
      parts.push(...this.#signs(text.slice(at, found.index)), ...(shown ? [shown] : []));
      at = found.index + found[0].length;
    }
    return [...parts, ...this.#signs(text.slice(at))];
  }

  #signs(text) {
    const found = [
      ...[...text.matchAll(PICTURES)].map((one) => [one.index, one[0], [...one[0]].map((sign) => marks.emoji[sign]).find(Boolean)]),
      ...[...text.matchAll(EMOTICONS)].map((one) => [one.index, one[0], marks.emoticons[one[0]]]),
    ].sort(([one], [other]) => one - other);
    const parts = [];
    let at = 0;
    for (const [index, sign, name] of found) {
      parts.push(withoutSigns(text.slice(at, index)));
      const unknown = name ? "" : sign.replace(/^[\ufe0f\u200d]+|[\ufe0f\u200d]+$/gu, "");
      if (unknown && this.emoji) this.warnings.push(`the emoji '${[...unknown].slice(0, 8).join("")}' is not known: it is left out`);
      parts.push(name && this.emoji ? behaviour(name) : " ");
      at = index + sign.length;
    }
    return [...parts, withoutSigns(text.slice(at))];
  }
}

function lineStart(begin) {
  begin = begin.replace(/^(\s*(?:>\s*)*)[•‣◦▪●○](?=\s)/, "$1-");
  const tokens = parser.parse(`${begin}x`, {});
  const kinds = tokens.map((token) => token.type.replace(/_open$/, ""));
  const content = tokens.find((token) => token.type === "inline")?.content ?? "";
  const length = begin.length + 1 - content.length;
  if (kinds.includes("fence")) return { kind: "fence", length: 0, says: "" };
  if (begin[length] === "|") return { kind: "row", length, says: "" };
  if (kinds.includes("heading")) return { kind: "heading", length, says: "" };
  if (kinds.includes("list_item")) {
    const number = tokens.findLast((token) => token.type === "list_item_open").info;
    return { kind: "item", length, says: number ? `${number}: ` : "" };
  }
  return { kind: kinds.includes("blockquote") ? "quote" : "paragraph", length, says: "" };
}

function cells(row) {
  const count = (row.match(/(?<!\\)\|/g) ?? []).length;
  for (const columns of [count - 1, count, count + 1]) {
    const tokens = columns > 0 ? parser.parse(`${row}\n${"|-".repeat(columns)}|\n`, {}) : [];
    if (tokens[0]?.type === "table_open") return tokens.filter((token) => token.type === "inline").map((token) => token.content);
  }
  return [row.replaceAll("|", " ")];
}

function readInline(text) {
  const tokens = [];
  const state = new parser.inline.State(text, parser, {}, tokens);
  parser.inline.tokenize(state);
  for (const rule of parser.inline.ruler2.getRules("")) rule(state);
  return piecesOf(tokens);
}

function piecesOf(tokens) {
  const pieces = [];
  const emphasis = []; // where open emphasis begins
  for (const token of tokens) {
    if (token.type === "text" || token.type === "text_special") pieces.push({ kind: "text", text: token.content });
    else if (token.type === "softbreak" || token.type === "hardbreak") pieces.push({ kind: "text", text: " " });
    else if (token.type === "code_inline") pieces.push({ kind: "code", text: token.content });
    else if (token.type === "image") pieces.push(...piecesOf(token.children ?? []));
    else if (token.type === "tag") pieces.push({ kind: "tag", text: token.content });
    else if (token.type === "em_open") emphasis.push(pieces.length);
    else if (token.type === "em_close") {
      const begin = emphasis.pop();
      const inside = pieces.slice(begin);
      if (inside.length && inside.every((piece) => piece.kind === "text")) {
        pieces.splice(begin, inside.length, { kind: "em", text: inside.map((piece) => piece.text).join("") });
      }
    }
  }
  return pieces;
}

function element(source) {
  const name = /^<\/?([\w-]+)(:?)/.exec(source);
  if (!name) return [];
  const lower = name[1].toLowerCase();
  if (!name[2] && elements.html.has(lower)) return elements.lines.has(lower) ? ["\n"] : [];
  return [{ source, shows: !elements.ssml.has(name[1]) && !source.startsWith("</") }];
}

function behaviour(name) {
  if (name === "pause") return { source: '<break time="500ms"/>', shows: false };
  if (lexemes.head.includes(name)) return { source: `<head lexeme="${name}"/>`, shows: true };
  if (lexemes.face.includes(name)) return { source: `<faceLexeme lexeme="${name}"/>`, shows: true };
  return { source: `<realizer:emotion name="${name}"/>`, shows: true };
}

function direction(text) {
  const shows = [];
  const unknown = [];
  let isPlain = true; // whether each act is a verb with an adverb or a short known tail at most
  let isBare = false; // whether an act is in the form of a command or of the past
  for (const act of text.replace(/^[ .!…]+|[ .!…]+$/g, "").toLowerCase().split(/,| and | und | et | y | en /)) {
    const said = act.match(WORD) ?? [];
    const found = said.length <= LONGEST_DIRECTION ? shownBy(said) : null;
    if (found) {
      shows.push(behaviour(found.name));
      isPlain &&= found.tail.every((word) => word.endsWith("ly") || words_.tail.has(word));
      isBare ||= bare.has(found.verb);
    } else if (said.length) unknown.push(act.trim());
  }
  return shows.length ? { shows, unknown: unknown.join(", "), isPlain, isBare } : null;
}

/** Whether emphasised words are a direction: a bare verb is one between sentences only. */
function isDirection(found, before, after) {
  const ends = !before.trim() || SENTENCE_END.test(before);
  return !found.isBare || (found.isPlain && ends && !/^\s*[\p{Ll},;:)'’–—-]/u.test(after));
}

/** The words after a direction; another direction ends them. */
function wordsAfter(following) {
  const end = following.findIndex((piece) => piece.kind === "em" && direction(piece.text));
  return following.slice(0, end < 0 ? undefined : end).map((piece) => (piece.kind === "tag" ? "" : piece.text)).join("");
}

/** Whether a word in brackets after this text is named by it: "the word [sob]". */
function isNamed(before) {
  const last = before.slice(-40).match(WORD)?.at(-1);
  return last !== undefined && words_.names.has(last.toLowerCase());
}

function shownBy(said) {
  while (said.length > 1 && (words_.subjects.has(said[0]) || said[0].endsWith("ly"))) said = said.slice(1);
  const found = (verbs.get(said[0]) ?? []).find(([follows]) => !follows || said.slice(1).includes(follows));
  return found ? { name: found[1], verb: said[0], tail: said.slice(1).filter((word) => word !== found[0]) } : null;
}

function inBrackets(text) {
  const name = text.trim().replaceAll(" ", "_");
  const upper = name.toUpperCase();
  if (lexemes.head.includes(upper) || lexemes.face.includes(upper)) return behaviour(upper);
  const feeling = Object.hasOwn(feelings, name.toLowerCase()) ? feelings[name.toLowerCase()] : null;
  return feeling ? behaviour(feeling) : inParentheses(text);
}

function inParentheses(text) {
  const found = direction(text);
  return found && found.shows.length === 1 && !found.unknown && found.isPlain ? found.shows[0] : null;
}

function isThirdPerson(text) {
  const first = text.match(WORD)?.[0] ?? "";
  return /^\p{Ll}/u.test(text) && /(?:s|ing)$/.test(first) && !first.endsWith("ss") && !words_.never.has(first);
}

function inflections(verb) {
  if (verb.endsWith("y") && !VOWELS.includes(verb.at(-2))) return [verb, `${verb.slice(0, -1)}ies`, `${verb}ing`, `${verb.slice(0, -1)}ied`];
  let stem = verb.replace(/e$/, "");
  if (verb === stem && !`${VOWELS}wxy`.includes(verb.at(-1)) && VOWELS.includes(verb.at(-2)) && !VOWELS.includes(verb.at(-3))) stem += verb.at(-1);
  return [verb, verb + (/(?:s|sh|ch|x)$/.test(verb) ? "es" : "s"), `${stem}ing`, `${stem}ed`];
}

const withoutSigns = (text) =>
  text
    .replace(UNSAID, (sign) => ("#\\".includes(sign) ? "" : ","))
    .replace(/(?<=[\p{L}\p{N}_])_+(?=[\p{L}\p{N}_])/gu, " ")
    .replaceAll("_", " ");

const lastBlank = (text) => /(?:^|\s)\S*$/.exec(text).index + (/\s\S*$/.test(text) ? 1 : 0);

const ESCAPES = { "&": "&amp;", "<": "&lt;", ">": "&gt;" };
const markup = (part) => (typeof part === "string" ? part.replace(/[&<>]/g, (sign) => ESCAPES[sign]) : part.source);

function joined(parts) {
  const found = [];
  for (const part of parts) {
    if (typeof part === "string" && typeof found.at(-1) === "string") found[found.length - 1] += part;
    else if (part) found.push(part);
  }
  return found;
}

function inWords(parts, language) {
  let before = "";
  return parts.map((part) => {
    if (typeof part !== "string") return part;
    const said = numbersInWords(part, language, before);
    before = (before + said).slice(-BEFORE);
    return said;
  });
}

/** Parts with single blanks, none at the ends and none before punctuation; empty lines stay. */
function tidy(parts) {
  const found = [];
  let end = "\n"; // of the words so far
  for (let part of joined(parts)) {
    if (typeof part === "string") {
      part = part.replace(/\s{2,}|[^\S ]/g, (blanks) => ["", "\n"][blanks.split("\n").length - 1] || (blanks.includes("\n") ? "\n\n" : " "));
      part = part.replace(/[ \n]+([.,;!?](?![\p{L}\p{N}_.]))/gu, "$1");
      if (/^\s$/.test(end)) part = part.trimStart();
      if (found.at(-1)?.shows && WORD_END.test(end + part)) part = ` ${part}`;
      if (end === " " && /^[.,;:!?]/.test(part)) {
        const place = found.findLastIndex((one) => typeof one === "string");
        found[place] = found[place].replace(/ +$/, "");
      }
      end = part.at(-1) ?? end;
    }
    if (part) found.push(part);
  }
  const place = found.findLastIndex((one) => typeof one === "string");
  if (place >= 0) found[place] = found[place].trimEnd();
  return joined(found);
}
