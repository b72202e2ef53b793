// The editor of texts and BML: CodeMirror with our colours, completion from the vocabulary, faults from the service.
import { autocompletion, closeBrackets, closeBracketsKeymap, completionKeymap } from "@codemirror/autocomplete";
import { defaultKeymap, history, historyKeymap, indentWithTab } from "@codemirror/commands";
import { xml } from "@codemirror/lang-xml";
import { bracketMatching, foldGutter, foldKeymap, HighlightStyle, indentOnInput, syntaxHighlighting } from "@codemirror/language";
import { forceLinting, lintGutter, linter, lintKeymap } from "@codemirror/lint";
import { highlightSelectionMatches, searchKeymap } from "@codemirror/search";
import { Compartment, EditorState } from "@codemirror/state";
import { drawSelection, EditorView, highlightActiveLine, highlightActiveLineGutter, keymap, lineNumbers, placeholder, tooltips } from "@codemirror/view";
import { tags } from "@lezer/highlight";
import { completer } from "./complete.js";

const PAUSE = 300; // ms between the last key and a check
const EXAMPLE = "Hello there. *smiles* How are you?";

const colours = HighlightStyle.define([
  { tag: tags.tagName, color: "var(--code-tag)" },
  { tag: tags.attributeName, color: "var(--code-name)" },
  { tag: [tags.attributeValue, tags.string], color: "var(--code-value)" },
  { tag: [tags.comment, tags.blockComment], color: "var(--code-comment)", fontStyle: "italic" },
  { tag: [tags.angleBracket, tags.definitionOperator], color: "var(--code-mark)" },
  { tag: [tags.processingInstruction, tags.documentMeta], color: "var(--code-comment)" },
]);

export class Editor {
  // changed(faults): after each check; null if the service could not be reached.
  constructor(parent, checker, changed) {
    this.completion = new Compartment();
    const lint = async (view) => {
      const text = view.state.sliceDoc();
      if (!text.trim()) {
        changed([]);
        return [];
      }
      try {
        const faults = await checker.ask(text);
        // Check again what was typed in the meantime.
        if (view.state.sliceDoc() === text) changed(faults);
        return faults.flatMap((fault) => diagnostics(view.state.doc, fault));
      } catch {
        changed(null);
        return [];
      }
    };
    this.view = new EditorView({
      parent,
      state: EditorState.create({
        extensions: [
          lineNumbers(), foldGutter({ openText: "⌄", closedText: "›" }), highlightActiveLineGutter(), lintGutter(),
          history(), drawSelection(), indentOnInput(), bracketMatching(), closeBrackets(), highlightActiveLine(), highlightSelectionMatches(),
          EditorState.tabSize.of(2), EditorView.lineWrapping,
          xml({ autoCloseTags: true }), placeholder(EXAMPLE),
          syntaxHighlighting(colours),
          this.completion.of([]),
          linter(lint, { delay: PAUSE, needsRefresh: null }),
          tooltips({ parent: document.body }),
          EditorView.contentAttributes.of({ id: "document", "aria-label": "Text or BML", "aria-describedby": "editor-help", tabindex: "0", spellcheck: "false", autocapitalize: "off" }),
          keymap.of([...closeBracketsKeymap, ...defaultKeymap.filter(({ key }) => key !== "Mod-Enter"), ...searchKeymap, ...historyKeymap, ...foldKeymap, ...completionKeymap, ...lintKeymap, indentWithTab]),
        ],
      }),
    });
  }

  know(vocabulary) {
    this.view.dispatch({ effects: this.completion.reconfigure(autocompletion({ override: [completer(vocabulary)], icons: false })) });
  }

  get text() {
    return this.view.state.sliceDoc();
  }

  set text(text) {
    this.view.dispatch({ changes: { from: 0, to: this.view.state.doc.length, insert: text }, selection: { anchor: 0 }, scrollIntoView: true });
    forceLinting(this.view);
  }

  // Put the cursor on the place of a fault.
  show(fault) {
    const [first] = diagnostics(this.view.state.doc, fault);
    if (!first) return;
    this.view.dispatch({ selection: { anchor: first.from, head: first.to }, scrollIntoView: true });
    this.view.focus();
  }
}

// A mark for each place of a fault; places that only explain it are hints. Advice without a place is about a whole text.
function diagnostics(doc, fault) {
  if (!fault.spots.length && fault.type === "ADVICE") return [];
  const serious = fault.type === "ADVICE" ? "warning" : "error";
  const spots = fault.spots.length ? fault.spots : [{ line: 1, column: 1, length: 1, text: "", primary: true }];
  return spots.map((spot) => {
    const line = doc.line(Math.min(Math.max(1, spot.line), doc.lines));
    // Our columns count characters, CodeMirror's count UTF-16 units.
    const characters = [...line.text];
    const from = line.from + characters.slice(0, spot.column - 1).join("").length;
    const to = from + characters.slice(spot.column - 1, spot.column - 1 + Math.max(1, spot.length)).join("").length;
    return {
      from,
      to: Math.max(to, Math.min(from + 1, line.to)),
      severity: spot.primary ? serious : "info",
      message: spot.primary ? [fault.text, ...fault.notes].join("\n") : spot.text,
      source: spot.primary ? fault.type : undefined,
    };
  });
}
