// The few helpers that make elements.

type Attributes = Record<string, string | number | boolean | ((event: Event) => void)>;

export function element<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  attributes: Attributes = {},
  ...children: (Node | string)[]
): HTMLElementTagNameMap[K] {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === 'function') made.addEventListener(name, value);
    else if (typeof value === 'boolean') made.toggleAttribute(name, value);
    else made.setAttribute(name, String(value));
  }
  made.append(...children);
  return made;
}

export function byId(id: string): HTMLElement {
  const found = document.getElementById(id);
  if (!found) throw new Error(`the page has no #${id}`);
  return found;
}

/** A colour of the style sheet as it stands now: light, dark or print. */
export function themeColour(name: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

/** Calls when the page turns light or dark, to paper or back. */
export function onThemeChange(call: () => void): void {
  for (const query of ['(prefers-color-scheme: dark)', 'print']) {
    matchMedia(query).addEventListener('change', call);
  }
}

/** A number for people: four significant digits. */
export function shown(value: number | null | undefined, digits = 4): string {
  if (value === null || value === undefined || !Number.isFinite(value)) return '–';
  if (Number.isInteger(value) && Math.abs(value) < 1e6) return String(value);
  return String(Number(value.toPrecision(digits)));
}

type Choice = (label: string, id: string, options: string[], chosen: string, change: (value: string) => void,
  name?: (option: string) => string) => HTMLLabelElement;
/** A labelled list to choose from. */
export const choice: Choice = (label, id, options, chosen, change, name = (option) => option) => {
  const select = element('select', { id, change: () => change(select.value) });
  for (const option of options) select.append(element('option', { value: option, selected: option === chosen }, name(option)));
  return element('label', {}, label, select);
};
