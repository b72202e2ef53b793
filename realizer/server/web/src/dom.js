// Elements of the page, found by id or created.

export const at = (id) => document.getElementById(id);

// make("li.point", { title: "..." }, "text", child): attributes become properties if they exist.
export function make(what, properties = {}, ...children) {
  const [tag, ...classes] = what.split(".");
  const element = document.createElement(tag);
  element.className = classes.join(" ");
  for (const [name, value] of Object.entries(properties)) {
    if (name in element) element[name] = value;
    else element.setAttribute(name, value);
  }
  element.append(...children);
  return element;
}

// A group of buttons of which one is pressed.
export function choose(place, names, pressed, take, title = (name) => name[0].toUpperCase() + name.slice(1)) {
  const buttons = names.map((name) => {
    const button = make("button", { type: "button", textContent: title(name), ariaPressed: String(name === pressed) });
    button.onclick = () => {
      for (const other of buttons) other.ariaPressed = String(other === button);
      take(name);
    };
    return button;
  });
  place.replaceChildren(...buttons);
  place.hidden = buttons.length < 2;
}

// A tab strip after WAI-ARIA: one tab stop, arrow keys between tabs. The address names the open tab, as in #aus.
export function tabs(strip, shown) {
  const all = [...strip.querySelectorAll('[role="tab"]')];
  const show = (tab) => {
    for (const one of all) {
      const here = one === tab;
      one.ariaSelected = String(here);
      one.tabIndex = here ? 0 : -1;
      at(one.getAttribute("aria-controls")).hidden = !here;
    }
    const open = tab === all[0] ? "" : `#${tab.getAttribute("aria-controls")}`;
    if (location.hash !== open) history.replaceState(null, "", location.pathname + location.search + open);
    shown(tab.id);
  };
  for (const tab of all) tab.onclick = () => show(tab);
  strip.onkeydown = (event) => {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    const here = all.filter(({ hidden }) => !hidden);
    const next = event.key === "Home" ? 0 : event.key === "End" ? here.length - 1 : step && (here.indexOf(document.activeElement) + step + here.length) % here.length;
    if (next === undefined) return;
    event.preventDefault();
    here[next].focus();
    show(here[next]);
  };
  const named = () => all.find((tab) => location.hash === `#${tab.getAttribute("aria-controls")}`) ?? all[0];
  addEventListener("hashchange", () => show(named()));
  show(named());
}
