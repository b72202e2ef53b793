"use strict";
// One page: consent, then each kind of question with its introduction, then the answers as a file.
const { TEXTS, STUDY } = window;
const ANSWERS = STUDY.answers;
const MAIN = document.querySelector("main");
const SECONDS = { visual: 12, emotional: 14, naming: 14, displacements: 7, films: 30 }; // of a question
const COLUMNS = ["study", "judge", "by", "item", "kind", "answer", "text", "angle", "strength", "seconds", "position"];
const fill = (text, values) => text.replace(/\{(\w+)\}/g, (whole, name) => values[name] ?? whole);

// A browser may keep nothing for files; then answers live as long as the page.
const storage = (() => {
  try {
    localStorage.setItem("study", "1");
    return localStorage;
  } catch {
    return null;
  }
})();
const kept = (name) => JSON.parse(storage?.getItem(`study ${STUDY.study} ${name}`) ?? "null");
const keep = (name, value) => storage?.setItem(`study ${STUDY.study} ${name}`, JSON.stringify(value));

let language = kept("language") ?? STUDY.language;
let judge = null; // number, place, answers: item -> answer
let steps = [];
let since = 0;
const say = (name, values = {}) => fill(TEXTS[language][name], values);

function make(tag, attributes = {}, ...children) {
  const svg = ["svg", "circle", "line", "text"].includes(tag);
  const node = svg ? document.createElementNS("http://www.w3.org/2000/svg", tag) : document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
    else if (value === true || value === false) node.toggleAttribute(name, value);
    else if (value !== null) node.setAttribute(name, value);
  }
  node.append(...children);
  return node;
}

function show(...nodes) {
  document.documentElement.lang = language;
  document.title = say("title");
  MAIN.replaceChildren(...nodes);
  scrollTo(0, 0);
  since = performance.now();
}

// A row of a balanced Latin square (Williams 1949): 0, 1, n-1, 2, n-2, ..., shifted.
function latin(items, row) {
  const order = items.map((_, k) => (k % 2 ? (k + 1) / 2 : (items.length - k / 2) % items.length));
  return order.map((place) => items[(place + row) % items.length]);
}

function planned(number) {
  const spread = (count) => Math.floor(((number - 1) * Math.max(1, count / STUDY.judges)) % count);
  return latin(STUDY.kinds, number - 1).flatMap((kind) => {
    const items = STUDY.items.filter((item) => item.kind === kind);
    return [{ kind }, ...latin(items, spread(items.length)).map((item, k) => ({ kind, item, row: number - 1 + k }))];
  });
}

function consent() {
  const seconds = STUDY.items.reduce((sum, item) => sum + SECONDS[item.kind], 0);
  const judges = STUDY.judges;
  const choice = make("select", { "aria-label": "Language", onchange: () => {
    language = choice.value;
    keep("language", language);
    consent();
  } });
  for (const [name, texts] of Object.entries(TEXTS)) {
    choice.append(make("option", { value: name, selected: name === language }, texts.language));
  }
  const number = make("input", { type: "number", min: 1, max: judges, required: true, name: "judge" });
  const hint = make("p", { role: "status" }, storage ? "" : say("unkept"));
  const look = () => {
    const count = Object.keys(kept(number.value)?.answers ?? {}).length;
    if (storage) hint.textContent = count ? say("resume", { count }) : "";
  };
  number.addEventListener("input", look);
  number.value = location.hash.slice(1) || (kept("last") ?? "");
  const form = make("form", { onsubmit: (event) => {
    event.preventDefault();
    judge = kept(number.value) ?? { number: Number(number.value), place: 0, answers: {} };
    steps = planned(judge.number);
    keep("last", judge.number);
    step(0);
  } });
  form.append(make("label", {}, say("number", { judges }), " ", number), hint, make("button", { class: "main" }, say("agree")));
  const text = say("consent", { minutes: Math.max(1, Math.round(seconds / 60)) });
  show(make("div", { class: "row" }, choice), make("h1", {}, say("title")), make("p", {}, text), form);
  look();
}

function step(by) {
  judge.place = Math.max(0, judge.place + by);
  keep(judge.number, judge);
  const now = steps[judge.place];
  if (!now) finish();
  else if (now.item) question(now);
  else introduction(now.kind);
}

function bar() {
  const [done, all] = [Object.keys(judge.answers).length, STUDY.items.length];
  const meter = make("progress", { value: done, max: all, "aria-label": say("progress", { done, all }) });
  const save = make("button", { class: "push", type: "button", onclick: download }, say("save"));
  return make("div", { class: "row" }, meter, make("span", { class: "hint" }, say("progress", { done, all })), save);
}

const back = () => make("button", { type: "button", onclick: () => step(-1) }, say("back"));

function introduction(kind) {
  const { title, intro } = TEXTS[language].kinds[kind];
  const points = kind === "displacements" ? ANSWERS[kind].map((name) => make("li", {}, TEXTS[language].answers[name])) : [];
  const go = make("button", { class: "main push", onclick: () => step(1) }, say("begin"));
  show(bar(), make("h1", {}, title), make("p", {}, intro), make("ul", {}, ...points), make("div", { class: "row" }, back(), go));
  go.focus();
}

function question({ kind, item, row }) {
  const { answers, kinds } = TEXTS[language];
  const answer = { answer: null, text: "", angle: "", strength: "", ...judge.answers[item.id] };
  const first = answer.seconds ?? 0; // seconds of an earlier visit
  const isFilm = kind === "films";
  const names = [...latin(item.options, row), ...ANSWERS[kind]];
  const keys = names.map((name, k) => (kind === "displacements" ? name : String(k + 1)));
  const label = (name, k) => (answers[name] ?? "").replace(/^\d: /, "") || say(isFilm ? "film" : "picture", { number: k + 1 });
  const media = (file, alt) => (isFilm
    ? make("video", { src: file, controls: true, playsinline: true, preload: "auto", "aria-label": alt })
    : make("img", { src: file, alt }));
  const next = make("button", { class: "main push", type: "button", onclick: () => leave(1) }, say("next"));
  const buttons = names.map((name, k) => make("button", { class: "choice", type: "button", onclick: () => choose(name) },
    ...(item.options.includes(name) && !isFilm ? [media(name, label(name, k))] : []), item.options.includes(name) ? label(name, k) : `${keys[k]}: ${label(name, k)}`));
  const wanted = item.check && label(item.check, names.indexOf(item.check));
  const ask = item.check ? say("check", { answer: wanted }) : fill(kinds[kind].ask, item.text);
  const figures = Object.entries(item.shown).map(([role, file]) =>
    make("figure", {}, media(file, say(role)), make("figcaption", {}, say(role))));
  if (isFilm) figures.push(...item.options.map((_, k) => make("figure", {}, media(names[k], label(names[k], k)))));
  const free = make("input", { value: answer.text, maxlength: 80, oninput: () => { answer.text = free.value; } });
  const words = make("label", {}, say(kind === "naming" ? "which" : "label"), free);
  const extras = [...(["naming", "emotional"].includes(kind) ? [words] : []), ...(kind === "naming" ? wheel(answer, ready) : [])];

  function ready() {
    names.forEach((name, k) => buttons[k].setAttribute("aria-pressed", String(name === answer.answer)));
    next.disabled = answer.answer === null;
    words.hidden = kind === "naming" && answer.answer !== "other";
  }
  function choose(name) {
    answer.answer = name;
    ready();
  }
  function leave(by) {
    if (answer.answer !== null) {
      const seconds = Math.round(10 * first + (performance.now() - since) / 100) / 10;
      judge.answers[item.id] = { ...answer, kind, seconds, position: judge.place + 1 };
    }
    step(by);
  }
  question.keys = (event) => {
    if (event.target.matches("input:not([type=range]), video")) return event.key === "Enter" && !next.disabled && leave(1);
    const chosen = keys.indexOf(event.key);
    if (chosen >= 0) choose(names[chosen]);
    else if (event.key === "Enter" && !event.target.matches("button:not(.choice)") && !next.disabled) leave(1);
    else if (event.key === "Backspace") leave(-1);
    else return;
    event.preventDefault();
  };
  const style = kind === "displacements" ? "points" : kind === "naming" ? "words" : "";
  const skip = make("button", { type: "button", onclick: () => step(1) }, say("skip"));
  const earlier = make("button", { type: "button", onclick: () => leave(-1) }, say("back"));
  show(bar(), make("h1", {}, ask), make("div", { class: `grid ${isFilm ? "" : "shown"}` }, ...figures),
    make("div", { class: `grid ${style}` }, ...buttons), ...extras, make("div", { class: "row" }, earlier, skip, next),
    make("p", { class: "hint keys" }, say("keys", { keys: keys.join(" ") })));
  ready();
}

function wheel(answer, changed) {
  const radius = 100;
  const at = (degrees, share) => [Math.cos(degrees * Math.PI / 180) * radius * share, -Math.sin(degrees * Math.PI / 180) * radius * share];
  const svg = make("svg", { viewBox: "-190 -125 380 250", class: "wheel", onclick: (event) => {
    const place = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
    angle.value = Math.round((Math.atan2(-place.y, place.x) * 180 / Math.PI + 360) % 360);
    strength.value = Math.min(1, Math.hypot(place.x, place.y) / radius).toFixed(2);
    put();
  } });
  for (const share of [1 / 3, 2 / 3, 1]) svg.append(make("circle", { r: radius * share }));
  for (const [name, degrees] of Object.entries(STUDY.wheel)) {
    const [[x2, y2], [x, y]] = [at(degrees, 1), at(degrees, 1.12)];
    const anchor = Math.abs(x) < 1 ? "middle" : x > 0 ? "start" : "end";
    svg.append(make("line", { x2, y2 }), make("text", { x, y, "text-anchor": anchor }, TEXTS[language].answers[name]));
  }
  const dot = make("circle", { class: "dot", r: 8, visibility: "hidden" });
  svg.append(dot);
  const slider = (max, step, value) => make("input", { type: "range", min: 0, max, step, value, oninput: () => put() });
  const angle = slider(359, 1, answer.angle === "" ? 0 : answer.angle);
  const strength = slider(1, 0.05, answer.strength === "" ? 0.5 : answer.strength);
  function put() {
    [answer.angle, answer.strength] = [Number(angle.value), Number(strength.value)];
    draw();
    changed();
  }
  function draw() {
    const [cx, cy] = at(answer.angle, answer.strength);
    if (answer.angle !== "") for (const [name, value] of Object.entries({ cx, cy, visibility: "visible" })) dot.setAttribute(name, value);
  }
  draw();
  return [svg, make("label", {}, say("angle"), angle), make("label", {}, say("strength"), strength)];
}

function csv() {
  const cell = (value) => (/[",\n\r]/.test(value) ? `"${String(value).replaceAll('"', '""')}"` : String(value));
  const rows = Object.entries(judge.answers).map(([item, answer]) => {
    const found = { study: STUDY.study, judge: judge.number, by: "person", item, ...answer };
    return COLUMNS.map((name) => cell(found[name] ?? "")).join(",");
  });
  return [COLUMNS.join(","), ...rows].join("\n") + "\n";
}

function download() {
  const url = URL.createObjectURL(new Blob([csv()], { type: "text/csv" }));
  make("a", { href: url, download: `answers-${STUDY.study}-${judge.number}.csv` }).click();
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}

function finish() {
  const another = make("button", { onclick: () => {
    storage?.removeItem(`study ${STUDY.study} last`);
    judge = null;
    consent();
  } }, say("another"));
  show(bar(), make("h1", {}, say("done")), make("div", { class: "row" }, back(), another));
  MAIN.querySelector(".push").classList.add("main");
  MAIN.querySelector(".push").focus();
}

addEventListener("keydown", (event) => {
  if (judge && steps[judge.place]?.item && !event.ctrlKey && !event.metaKey && !event.altKey) question.keys(event);
});
consent();
