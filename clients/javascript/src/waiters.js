// Which feedback is about which of the blocks that were sent.
import { RealizerError } from "./frames.js";

const NO_ID = "<no id>"; // of warnings about documents whose block has no usable id
const MADE = /^unnamed\d+$/; // ids that the service gives to blocks without one
const CORE = "http://www.bml-initiative.org/bml/bml-1.0";
const MAX_DOCUMENTS = 1000; // that the service reads in one text
const MARKS = /<!--|<!\[CDATA\[|<\?|<(?:([\w.-]+):)?bml(?=[\s/>])|<\/(?:[\w.-]+:)?bml\s*>/g;
const CLOSERS = { "<!--": "-->", "<![CDATA[": "]]>", "<?": "?>" };
const REST_OF_TAG = /(?:[^<>"']|"[^<"]*"|'[^<']*')*>/y;
// What the service does not answer without a document: SmartBody's and Greta's elements around it, too.
const UNANSWERED = /<!--[^]*?-->|<\?[^]*?\?>|<fml(?=[\s/>])[^]*?<\/fml\s*>|<\/?(?:act|fml-apml|participant)(?=[\s/>])[^<>]*>|[\s\ufeff]/g;
const ENTITIES = { amp: "&", lt: "<", gt: ">", quot: '"', apos: "'" };
const nothing = () => {};

function unescape(text) {
  return text.replace(/&(?:#x([\da-f]+)|#(\d+)|(\w+));/gi, (all, hex, decimal, name) => {
    const code = hex ? parseInt(hex, 16) : Number(decimal);
    return name ? (ENTITIES[name] ?? all) : code <= 0x10ffff ? String.fromCodePoint(code) : all;
  });
}

function attribute(tag, name) {
  const found = tag.match(new RegExp(`\\s${name}\\s*=\\s*(?:"([^"<]*)"|'([^'<]*)')`));
  return found ? (found[1] ?? found[2]) : null;
}

/** Return the start tag of each document of a text, with its prefix; documents inside others are not there. */
function startTags(text) {
  const tags = [];
  const opened = [];
  const marks = new RegExp(MARKS);
  for (let mark; (mark = marks.exec(text)); ) {
    const closer = CLOSERS[mark[0]];
    if (closer) {
      const end = text.indexOf(closer, marks.lastIndex);
      if (end >= 0) marks.lastIndex = end + closer.length;
    } else if (mark[0].startsWith("</")) {
      const open = opened.pop();
      if (open) open.end = marks.lastIndex;
    } else {
      REST_OF_TAG.lastIndex = marks.lastIndex;
      const rest = REST_OF_TAG.exec(text)?.[0] ?? "";
      marks.lastIndex += rest.length;
      const tag = { start: mark.index, end: 0, prefix: mark[1], text: mark[0] + rest };
      tags.push(tag);
      if (rest.endsWith("/>")) tag.end = marks.lastIndex;
      else opened.push(tag);
    }
  }
  let end = 0;
  return tags.filter((tag, k) => {
    if (tag.start < end) return false;
    end = tag.end || (tags[k + 1]?.start ?? text.length); // one without an end tag ends where the next one begins
    return true;
  });
}

/**
 * Find the blocks for which the service will answer a text.
 * @returns {object[]} ids: those that feedback about it may have, the first one if it plays; none if the service makes one.
 *   mayLackId: whether a warning without an id may be about it. None if there is no answer
 */
export function blocksOf(text) {
  const isOdd = /<(?:act|fml-apml)[\s>]|<!DOCTYPE/.test(text);
  const blocks = startTags(text).map(({ prefix, text }) => {
    const raw = attribute(text, "id");
    const id = raw === null ? null : unescape(raw).trim();
    const namespace = attribute(text, prefix ? `xmlns:${prefix}` : "xmlns") ?? CORE;
    const isPlain = /^[^\s:&<]{1,256}$/.test(raw ?? "") && id !== "bml" && namespace === CORE && !isOdd;
    return { ids: raw === null ? [] : [id, raw], mayLackId: !isPlain };
  });
  if (blocks.length > MAX_DOCUMENTS) return [...blocks.slice(0, MAX_DOCUMENTS), { ids: [NO_ID], mayLackId: true }];
  if (blocks.length || !text.replace(UNANSWERED, "")) return blocks;
  return [{ ids: [NO_ID], mayLackId: true }];
}

/** Those who wait for blocks, in the order in which these were sent: blocks of one id are answered in this order. */
export class Waiters {
  #all = []; // { ids, mayLackId, isSent, speech, message, acknowledged, planned, interrupted, failed, resolve, reject }

  /**
   * Wait for a block.
   * @param {object} block ids and mayLackId as in `blocksOf`; message: what was sent with it; speech: returns its
   *   OpenSpeech; isSent: whether this client sends it
   * @returns {Promise<Element>} the feedback of its end
   */
  add(block) {
    const end = new Promise((resolve, reject) => this.#all.push({ warnings: [], ...block, resolve, reject }));
    end.catch(nothing); // need not be handled
    return end;
  }

  acknowledge(id) {
    const waiting = this.#waiting().filter((one) => !one.acknowledged);
    const one = waiting.find(({ ids }) => ids[0] === id) ?? (MADE.test(id) ? waiting.find(({ ids }) => !ids[0]) : null);
    if (one) Object.assign(one, { ids: [id], acknowledged: true });
  }

  plan(id) {
    const one = this.#current(id);
    if (one) one.planned = one.acknowledged || !one.isSent;
  }

  /** Take the start of a block, or a sync of its text, for the speeches that it speaks. */
  start(id, time) {
    for (const { speech } of this.#reached(id)) if (speech) speech().progress.start ??= time;
  }

  reach(id, sync, time) {
    for (const { speech } of this.#reached(id)) speech?.().reach?.(sync, time);
  }

  end(id, element) {
    const ended = this.#reached(id);
    for (const { resolve, warnings } of ended) resolve(Object.assign(element, { warnings }));
    this.#remove(ended);
  }

  /** Keep a warning, { id, type, text }, for the block that it is about, or the speech that the block is a part of. */
  warn(warning) {
    const [block] = warning.id.split(":");
    const found = this.#reached(block);
    for (const { warnings } of found.length ? found : this.#reached(block.replace(/\.[^.]*$/, ""))) warnings.push(warning);
  }

  /**
   * Reject the block that a warning refuses: not one that was planned, from which something was dropped.
   * @param {boolean} [isInUse] whether it refuses a block of this client because its id is in use
   */
  refuse(id, text, isInUse = false) {
    const found = this.#waiting().filter(({ ids, mayLackId, isSent, acknowledged, planned }) => {
      if (id === NO_ID) return !acknowledged && mayLackId;
      return ids.includes(id) && (isInUse ? isSent : !planned);
    });
    // If all of its id are acknowledged, the last one was by the block of another client.
    const one = isInUse ? (found.find(({ acknowledged }) => !acknowledged) ?? found.at(-1)) : found[0];
    if (!one) return;
    // If a message is refused as a whole, the warning is about its last block only.
    const before = this.#waiting().slice(0, this.#waiting().indexOf(one));
    const refused = [...before.filter(({ message, acknowledged }) => message && message === one.message && !acknowledged), one];
    for (const { reject } of refused) reject(new RealizerError(text, "refused", id));
    this.#remove(refused);
  }

  /**
   * Reject the newest speech of an id, whose message has caused an error.
   * @returns {boolean} whether this is the first error about it
   */
  fail(id, error) {
    const own = this.#all.filter(({ ids }) => ids[0] === id);
    const one = own.findLast(({ speech }) => speech) ?? own.at(-1);
    if (!one || one.failed) return false;
    one.failed = true; // each of its messages causes an error, which must not reach an older speech
    one.reject(error);
    this.#remove([]);
    return true;
  }

  /** Note that the connection was lost. */
  interrupt() {
    for (const one of this.#all) one.interrupted = true;
  }

  /** Reject everything, or what waited when the connection was lost. */
  abandon(reason, { interrupted = false } = {}) {
    const lost = this.#all.filter((one) => one.interrupted || !interrupted);
    for (const one of lost) one.reject(reason(one.ids[0]));
    this.#remove(lost);
  }

  #reached(id) {
    const one = this.#current(id);
    if (!one) return [];
    // The messages of another speech that has its id continue one that is not closed.
    const isShared = one.speech && !one.speech().closing;
    const others = this.#waiting().filter(({ ids, speech, acknowledged }) => isShared && speech && ids[0] === id && !acknowledged);
    return [one, ...others];
  }

  #waiting() {
    return this.#all.filter(({ failed }) => !failed);
  }

  /** Return the one of an id whose block plays, or comes next. */
  #current(id) {
    const found = this.#waiting().filter(({ ids }) => ids[0] === id);
    return found.find(({ acknowledged }) => acknowledged) ?? found[0];
  }

  #remove(ended) {
    const left = this.#all.filter((one) => !ended.includes(one));
    const waited = new Set(left.filter(({ failed }) => !failed).map(({ ids }) => ids[0]));
    this.#all = left.filter(({ failed, ids }) => !failed || waited.has(ids[0]));
  }
}
