// Elements of the page. Text is always set as text: no text of a scene is ever parsed as HTML.

type Child = Node | string | null | undefined;

interface Attributes {
  class?: string;
  title?: string;
  id?: string;
  type?: string;
  role?: string;
  label?: string;
  onclick?: (event: MouseEvent) => void;
  [name: string]: unknown;
}

/** Makes an element; `label` becomes aria-label, functions become listeners, strings become text. */
export function makeElement<K extends keyof HTMLElementTagNameMap>(
  tag: K, attributes: Attributes = {}, ...children: Child[]
): HTMLElementTagNameMap[K] {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === undefined || value === false) continue;
    if (typeof value === "function") made.addEventListener(name.slice(2), value as EventListener);
    else if (name === "class") made.className = String(value);
    else if (name === "label") made.setAttribute("aria-label", String(value));
    else made.setAttribute(name, value === true ? "" : String(value));
  }
  made.append(...children.filter((child): child is Node | string => child != null));
  return made;
}

export function makeButton(text: string, onclick: () => void, attributes: Attributes = {}): HTMLButtonElement {
  return makeElement("button", { type: "button", onclick: () => onclick(), ...attributes }, text);
}

/** Terms with their descriptions, the children of a `dl`. A fact without a value is left out. */
export function makeFacts(facts: (readonly [string, string | undefined])[]): HTMLElement[] {
  return facts.flatMap(([name, value]) => (value ? [makeElement("dt", {}, name), makeElement("dd", {}, value)] : []));
}

export function makeCheck(box: HTMLInputElement, text: string): HTMLElement {
  return makeElement("label", { class: "check", for: box.id }, box, text);
}

/** Sets the text only if it differs, so that frequent updates cost no layout. */
export function setText(target: Node, text: string): void {
  if (target.textContent !== text) target.textContent = text;
}

/** True while the user types into a field: keys then belong to the field. */
export function isTyping(event: KeyboardEvent): boolean {
  const target = event.target as HTMLElement | null;
  return target instanceof HTMLInputElement && target.type !== "range" && target.type !== "checkbox"
    || target instanceof HTMLSelectElement;
}
