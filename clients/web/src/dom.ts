/** The page's elements by their ids; a missing one is our own mistake. */
export function byId<T extends HTMLElement>(id: string): T {
  const element = document.getElementById(id);
  if (element === null) throw new Error(`the page has no #${id}`);
  return element as T;
}

type Child = Node | string | undefined;

export function make<K extends keyof HTMLElementTagNameMap>(tag: K, className = "", ...children: Child[]): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  if (className !== "") element.className = className;
  for (const child of children) if (child !== undefined) element.append(child);
  return element;
}

/** Says something in its place, or nothing. */
export function say(element: HTMLElement, text: string, kind: "" | "good" | "bad" | "warn" = ""): void {
  if (element.textContent !== text) element.textContent = text;
  element.dataset["kind"] = kind;
  element.hidden = text === "";
}

/** Says that the gateway was not told of a service, and by which option it would be. */
export function sayMissing(element: HTMLElement, service: string, option: string, rest = "."): void {
  const text = `No ${service} is behind this gateway (${option})${rest}`;
  if (element.textContent !== text) element.replaceChildren(`No ${service} is behind this gateway (`, make("code", "", option), `)${rest}`);
  element.dataset["kind"] = "";
  element.hidden = false;
}

export function setText(element: HTMLElement, text: string): void {
  if (element.textContent !== text) element.textContent = text;
}

export function table(head: readonly string[], rows: readonly { cells: readonly string[]; mark?: string }[]): HTMLTableElement {
  const header = make("tr", "", ...head.map((text) => {
    const cell = make("th", "", text);
    cell.scope = "col";
    return cell;
  }));
  const body = make("tbody", "", ...rows.map((row) => make("tr", row.mark ?? "", ...row.cells.map((text) => make("td", "", text)))));
  return make("table", "", make("thead", "", header), body);
}
