// Numbers and signs in words: money, dates, times, units, versions, Roman numbers. As realizer/text/numbers.py.
import { numbers, spellout } from "./text-tables.js";

const AROUND = 40; // characters
const LONGEST_NAME = 12; // characters; with a Roman number behind it
const LARGEST = 1e15;
const ROMAN = "(?:(?=[IVXL])(?:XL|L?X{0,3})(?:IX|IV|V?I{0,3}))";
const W = "[\\p{L}\\p{N}_]";
const LEFT = `(?<!${W})`;
const BUSY = new RegExp(
  "[0-9$€£¥₹¢%‰°#§½¼¾⅓⅔⅛*×·÷=<>≤≥≈~±№℃]" +
    `|${LEFT}(?:[VXL]|[IVXL]{2,})(?:e|ème)?(?!${W})|${LEFT}Ier(?!${W})` +
    `|${LEFT}(?:War|[Cc]hapter|[Pp]art|[Vv]olume|[Aa]ct|[Ss]cene|Elizabeth|Charles|James|Francis|Kapitel) I(?!${W})`,
  "gu",
);
const VALUES = { I: 1, V: 5, X: 10, L: 50 };
const FRACTIONS = { "½": "1/2", "¼": "1/4", "¾": "3/4", "⅓": "1/3", "⅔": "2/3", "⅛": "1/8" };
const SLOT = /\{(\w+)(?::(\w+))?\}/g;

/** The language of a BCP-47 tag whose numbers are known, or null. */
export function languageOf(tag) {
  const language = tag.toLowerCase().replaceAll("_", "-").split("-")[0];
  return language in numbers && language !== "shared" ? language : null;
}

/** A text with its numbers as people say them; whole numbers alone are left to the voice. */
export function numbersInWords(text, tag, before = "") {
  if ((before.slice(-LONGEST_NAME) + text).search(BUSY) < 0) return text;
  const language = languageOf(tag);
  if (language) {
    const whole = applied(before + text, language);
    text = whole.startsWith(before) ? whole.slice(before.length) : applied(text, language);
  }
  return text.replaceAll("*", "");
}

/** A number in words, such as "twenty-first". */
export function spelled(number, language, kind = "cardinal") {
  const table = spellout[language][kind];
  const other = () => (kind === "cardinal" ? String(number) : spelled(number, language));
  if (!table) return other();
  if (table.endings) {
    const words = spelled(number, language, kind.startsWith("ordinal") ? "ordinal" : "cardinal");
    const end = Object.keys(table.endings).find((one) => words.endsWith(one));
    return end === undefined ? words : words.slice(0, words.length - end.length) + table.endings[end];
  }
  const small = (table.small ?? "").split(" ").filter(Boolean);
  if (number < small.length) return small[number];
  const rule = rules(language, kind).findLast(([base]) => base <= number);
  if (!rule || number >= LARGEST) return other();
  const [, divisor, words] = rule;
  const quotient = Math.floor(number / divisor);
  const rest = number % divisor;
  const choice = words[!rest ? 0 : rest < 100 && words.length > 2 ? 2 : Math.min(1, words.length - 1)];
  return choice.replace(/\{([qr])(?::(\w+))?\}/g, (_, of, other) => spelled(of === "q" ? quotient : rest, language, other ?? kind));
}

const cached = (make) => {
  const known = new Map();
  return (...keys) => {
    const key = keys.join(" ");
    if (!known.has(key)) known.set(key, make(...keys));
    return known.get(key);
  };
};

const rules = cached((language, kind) =>
  (spellout[language][kind].rules ?? []).map((row) => {
    const at = row.indexOf(" ");
    const [base, divisor] = row.slice(0, at).split("/");
    return [Number(base), Number(divisor ?? 10 ** (base.length - 1)), row.slice(at + 1).split("|")];
  }),
);

const frames = cached((language) => {
  const row = numbers[language];
  const anyOf = (name) =>
    Object.keys(row[name])
      .sort((a, b) => b.length - a.length)
      .map((one) => one.replace(/[$.*+?^(){}|[\]\\/]/g, "\\$&"))
      .join("|");
  const macros = {
    NUM: row.number, SIGNED: `[-−]?${row.number}`, CUR: `(?:${anyOf("currencies")})`,
    UNIT: `(?:${anyOf("units")})(?![\\p{L}\\p{N}_/²³])`, MAG: `(?:${anyOf("magnitudes")})(?!${W})`,
    FRACTION: `(?:${anyOf("fractions")})`, ROMAN, Y: "(?:1[0-9]|20)[0-9]{2}", T: numbers.shared.time,
    MONTH: `(?:${[...row.months.split(" "), ...row.short.split(" ")].map((month) => `${month}(?!${W})\\.?`).join("|")})`,
    W, B: "(?<![\\p{L}\\p{N}_.,:/])", E: `(?!${W})(?![.,:/][0-9])`,
  }; // prettier-ignore
  const at = row.frames.findIndex(([pattern]) => pattern === "shared");
  return [...row.frames.slice(0, at), ...numbers.shared.frames, ...row.frames.slice(at + 1)].map(([pattern, words]) => {
    for (const [name, macro] of Object.entries(macros)) pattern = pattern.replaceAll(`{${name}}`, macro);
    return [new RegExp(pattern, "gu"), words];
  });
});

function applied(text, language) {
  let said = "";
  let at = 0;
  for (const [begin, end] of windows(text)) {
    let piece = text.slice(begin, end);
    for (const [pattern, words] of frames(language)) {
      piece = piece.replace(pattern, (found, ...rest) => fill(found, rest.at(-1), words, language));
    }
    said += text.slice(at, begin) + piece;
    at = end;
  }
  return said + text.slice(at);
}

function* windows(text) {
  let begin = 0;
  let end = 0;
  for (const found of text.matchAll(BUSY)) {
    if (found.index >= end) {
      if (end) yield [begin, end];
      const until = Math.max(end, found.index - AROUND);
      const blank = text.slice(end, until).lastIndexOf(" ");
      begin = blank < 0 ? end : end + blank;
    }
    const blank = text.indexOf(" ", found.index + found[0].length + AROUND);
    end = blank < 0 ? text.length : blank;
  }
  if (end) yield [begin, end];
}

function fill(found, all, words, language) {
  const groups = Object.fromEntries(Object.entries(all ?? {}).filter(([, text]) => text !== undefined));
  if (groups.r === "" || groups.R === "" || (groups.n ?? "").length > 24) return found;
  const kept = words.replace(/\[([^[\]]*)\]/g, (_, option) =>
    [...option.matchAll(SLOT)].every(([, name]) => name in groups) ? option : "",
  );
  return kept.replace(SLOT, (_, name, kind) => (name === "money" ? money(groups, language) : said(name, kind, groups, language)));
}

function said(group, kind, groups, language) {
  const text = groups[group];
  const row = numbers[language];
  const words = spellout[language];
  const digits = (one) => Number(one.replace(/[^0-9]/g, ""));
  switch (group[0]) {
    case "n": return numberOf(text, language, kind ?? genderOf(groups, row));
    case "o": return spelled(digits(text), language, kind ?? "ordinal");
    case "y": return spelled(Number(text), language, kind ?? "year");
    case "d": return digitByDigit(text, language);
    case "v": return text.split(".").map((one) => spelled(Number(one), language)).join(` ${words.point} `);
    case "r": return spelled(roman(text), language, kind ?? "ordinal");
    case "R": return spelled(roman(text), language);
    case "c": return row.currencies[text].split("|")[1];
    case "u": {
      const [one, many] = row.units[text].split("|");
      return (groups.n2 ?? groups.n ?? "").replace(/^[-−]+/, "") === "1" ? one : many;
    }
    case "m": return row.magnitudes[text];
    case "M": {
      const place = row.short.split(" ").indexOf(text.replace(/\.$/, ""));
      return place < 0 ? text : row.months.split(" ")[place];
    }
    case "k": return row.months.split(" ")[Number(text) - 1];
    case "f": return row.fractions[FRACTIONS[text] ?? text];
    case "D": return row.decades.split(" ")[Number(text)];
    case "a": return `${text.toUpperCase()} M`;
    case "s": return words.minus;
  } // prettier-ignore
  return text;
}

function numberOf(text, language, kind) {
  const words = spellout[language];
  const bare = text.replace(/^[-−]+/, "");
  const at = bare.indexOf(numbers[language].decimal);
  const decimals = at < 0 ? "" : bare.slice(at + 1);
  const whole = (at < 0 ? bare : bare.slice(0, at)).replace(/[^0-9]/g, "");
  const said = (/^[-−]/.test(text) ? `${words.minus} ` : "") + spelled(Number(whole), language, decimals ? "cardinal" : kind);
  if (!decimals) return said;
  const isPair = words.pairs && decimals.length < 3 && decimals[0] !== "0";
  const after = isPair ? spelled(Number(decimals), language) : [...decimals].map((one) => spelled(Number(one), language)).join(" ");
  return `${said} ${words.point} ${after}`;
}

function money(groups, language) {
  const row = numbers[language];
  const [one, many, gender, cent, cents] = row.currencies[groups.c].split("|");
  const [whole, withCents, centsAlone, large] = row.money;
  if ("m" in groups) {
    const words = { m: row.magnitudes[groups.m], c: language === "nl" ? one : many };
    const isOne = ["Million", "million", "millón"].includes(groups.m) && language !== "en";
    const said = large.replace(SLOT, (_, name) => words[name] || numberOf(groups.n, language, isOne ? gender || "m" : "cardinal"));
    return language === "fr" ? said.replaceAll("de euro", "d’euro") : said;
  }
  const [amount, small = ""] = groups.n.split(row.decimal);
  if (small && small.length !== 2) return `${numberOf(groups.n, language, "cardinal")} ${many}`;
  const count = Number(amount.replace(/[^0-9]/g, ""));
  const few = Number(small || 0);
  const parts = {
    n: spelled(count, language, gender || "cardinal"),
    c: count === 1 ? one : many,
    cents: `${spelled(few, language, gender ? "m" : "cardinal")} ${few === 1 ? cent : cents}`,
  };
  return (!few ? whole : !count ? centsAlone : withCents).replace(SLOT, (_, name) => parts[name]);
}

const genderOf = (groups, row) => ("u" in groups && row.units[groups.u].split("|")[2]) || "cardinal";

function digitByDigit(text, language) {
  const groups = text.match(/[0-9]+/g).map((group) => [...group].map((one) => spelled(Number(one), language)).join(" "));
  return (text.startsWith("+") ? "plus " : "") + groups.join(", ");
}

function roman(text) {
  const values = [...text].map((letter) => VALUES[letter]);
  return values.reduce((sum, value, place) => sum + (value < (values[place + 1] ?? 0) ? -value : value), 0);
}
