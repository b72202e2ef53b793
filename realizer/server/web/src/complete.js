// Completions at the cursor of a BML document: elements, attributes, words, ids and their sync points.

const STROKES = /^(start|ready|strokeStart|stroke(:\d+)?|strokeEnd|attackPeak|relax|end)$/;
const TAG = /<([\w.-]+:)?([\w.-]+)((?:\s+[\w:.-]+\s*=\s*(?:"[^"]*"|'[^']*'))*)\s*(\/?)>|<\/[\w:.-]+\s*>|<!--[\s\S]*?-->/g;

export function completer(vocabulary) {
  const elements = new Map(vocabulary.elements.map((element) => [element.name, element]));
  return (context) => {
    const text = context.state.sliceDoc();
    const before = text.slice(0, context.pos);
    const open = before.lastIndexOf("<");
    if (open < 0 || before.lastIndexOf(">") > open) return null;
    const tag = before.slice(open);
    if (tag.startsWith("<!--") || tag.startsWith("<?")) return null;
    let found = /^<(\/?)([\w:.-]*)$/.exec(tag);
    if (found) return found[1] ? closing(before, open) : opening(text, before, open, elements);
    const name = /^<(?:[\w.-]+:)?([\w.-]+)/.exec(tag)?.[1];
    const element = elements.get(name);
    if (!element) return null;
    found = /([\w:.-]+)\s*=\s*(["'])([^"']*)$/.exec(tag);
    if (found && insideValue(tag)) return values(text, open, element, found[1], found[3], context.pos, vocabulary);
    found = /\s([\w:.-]*)$/.exec(tag);
    return found && !insideValue(tag) ? attributes(text, tag, element, context.pos - found[1].length) : null;
  };
}

// Whether the incomplete tag ends inside a quoted value.
function insideValue(tag) {
  let quote = null;
  for (const c of tag) {
    if (quote) quote = c === quote ? null : quote;
    else if (c === '"' || c === "'") quote = c;
  }
  return quote !== null;
}

// Names of the elements that are open at `open`, outermost first.
function stack(text) {
  const names = [];
  for (const [whole, , name, , empty] of text.matchAll(TAG)) {
    if (whole.startsWith("</")) names.pop();
    else if (name && !empty) names.push(whole.slice(1).match(/^[\w:.-]+/)[0]);
  }
  return names;
}

function closing(before, open) {
  const name = stack(before.slice(0, open)).at(-1);
  return name ? { from: open + 2, options: [{ label: name, apply: `${name}>`, type: "type" }] } : null;
}

function opening(text, before, open, elements) {
  const parent = stack(before.slice(0, open)).at(-1);
  const inside = parent === undefined ? ["bml"] : elements.get(parent.split(":").at(-1))?.children ?? [];
  const options = inside.map((name, k) => {
    const element = elements.get(name);
    return {
      label: element.prefix ? `${prefixIn(text, element) ?? element.prefix}:${name}` : name,
      type: "type",
      detail: element.syncs.length ? "behaviour" : "",
      info: element.about || undefined,
      boost: 50 - k, // in the order of the vocabulary: the standard's first
      apply: (view, option, from, to) => {
        const insert = `${option.label}${parent === undefined ? "" : " "}`;
        const changes = [{ from, to, insert }];
        const declared = !element.prefix || prefixIn(text, element);
        const root = /<(?:\w+:)?bml\b/.exec(text);
        if (!declared && root) {
          const place = root.index + root[0].length;
          changes.unshift({ from: place, insert: ` xmlns:${element.prefix}="${element.namespace}"` });
        }
        const shift = declared || !root ? 0 : changes[0].insert.length;
        view.dispatch({ changes, selection: { anchor: from + shift + insert.length }, userEvent: "input.complete" });
      },
    };
  });
  return { from: open + 1, options, validFor: /^[\w:.-]*$/ };
}

// The document's prefix for an element's namespace; core extensions are read without one too.
function prefixIn(text, { namespace }) {
  const escaped = namespace.replace(/[.*+?^${}()|[\]\\/]/g, "\\$&");
  return text.match(new RegExp(`xmlns:([\\w.-]+)\\s*=\\s*["']${escaped}["']`))?.[1];
}

function attributes(text, tag, element, from) {
  const given = new Set([...tag.matchAll(/\s([\w:.-]+)\s*=/g)].map(([, name]) => name));
  const known = element.attributes.filter((a) => !a.namespace || prefixIn(text, a));
  const named = known.map((a) => ({ label: a.name, detail: a.required ? "required" : "", info: a.wanted, type: "property", boost: a.required ? 2 : 1 }));
  const timed = element.syncs.map((name) => ({ label: name, detail: "sync point", type: "keyword" }));
  const options = [...named, ...timed]
    .filter(({ label }) => !given.has(label))
    .map((option) => ({
      ...option,
      apply: (view, { label }, start, end) => {
        view.dispatch({ changes: { from: start, to: end, insert: `${label}=""` }, selection: { anchor: start + label.length + 2 }, userEvent: "input.complete" });
      },
    }));
  return { from, options, validFor: /^[\w:.-]*$/ };
}

function values(text, open, element, attribute, typed, pos, vocabulary) {
  const from = pos - typed.length;
  const spec = element.attributes.find((a) => a.name === attribute);
  const words = vocabulary.values[`${element.name} ${attribute}`] ?? spec?.words ?? [];
  if (words.length) {
    const about = attribute === "au" ? new Map(vocabulary.aus.map((a) => [String(a.au), a.name])) : attribute === "number" ? new Map(vocabulary.faps.map((f) => [String(f.fap), f.name])) : new Map();
    return { from, options: words.map((label) => ({ label, type: "enum", detail: about.get(label) })), validFor: /^[^"']*$/ };
  }
  const refers = attribute === "ref" || (element.syncs.length && STROKES.test(attribute));
  if (refers) return { from, options: syncPoints(text, open, vocabulary), validFor: /^[\w:.-]*$/ };
  if (attribute === "id" && !typed) return { from, options: [{ label: freeId(text, element.name), type: "variable" }] };
  return null;
}

// "id:sync" of every behaviour of the document except the one that begins at `open`.
function syncPoints(text, open, vocabulary) {
  const elements = new Map(vocabulary.elements.map((element) => [element.name, element]));
  const found = [];
  let speech = null;
  for (const tag of text.matchAll(TAG)) {
    const [, , name, given = ""] = tag;
    if (!name) continue;
    const id = given.match(/\sid\s*=\s*["']([^"']+)["']/)?.[1];
    if (name === "sync" && id && speech) found.push({ label: `${speech}:${id}`, detail: "mark in speech", type: "variable", boost: 1 });
    if (!id || !elements.get(name)?.syncs.length) continue;
    if (name === "speech") speech = id;
    if (tag.index === open) continue;
    found.push(...elements.get(name).syncs.map((sync) => ({ label: `${id}:${sync}`, detail: name, type: "variable" })));
  }
  return found;
}

function freeId(text, name) {
  const word = name.replace(/^face(Lexeme|Facs)$/, "face").toLowerCase();
  for (let n = 1; ; n++) if (!new RegExp(`\\bid\\s*=\\s*["']${word}${n}["']`).test(text)) return `${word}${n}`;
}
