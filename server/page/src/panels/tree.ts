// The objects as a tree, by storey and class or by path, with search, hide, isolate and show all.
import type { App } from "../app";
import { makeButton, makeElement, setText } from "./dom";
import type { Entity } from "../world/entities";
import { getLastName, shortenPath } from "./format";

const MAX_ROWS = 300; // children shown at once; more are shown on request
const MAX_FOUND = 200;

interface Group {
  name: string;
  key: string;
  groups: Map<string, Group>;
  objects: Entity[];
}

export class Tree {
  readonly root: HTMLElement;
  #app: App;
  #hasStoreys = false;
  #grouping: "storey" | "path" = "path";
  #tree: Group = makeGroup("", "");
  #open = new Set<string>();
  #list = makeElement("div", { class: "tree", role: "tree", label: "Objects", tabindex: "0" });
  #search = makeElement("input", { type: "search", placeholder: "Search name, class or GlobalId", label: "Search objects" });
  #select = makeElement("select", { label: "Group objects by" },
    makeElement("option", { value: "storey" }, "By storey and class"), makeElement("option", { value: "path" }, "By path"));
  #count = makeElement("span", { class: "quiet" });
  #rows: { row: HTMLElement; group: Group | null; entity: Entity | null; level: number }[] = [];
  #lastRow: EventTarget | null = null; // that had the focus: a button takes the focus away
  #more = new Map<string, number>(); // further rows of a group, shown on request

  constructor(app: App) {
    this.#app = app;
    this.root = makeElement(
      "div", { class: "stack" }, this.#search,
      makeElement("div", { class: "row" }, this.#select, this.#count),
      makeElement("div", { class: "row" },
        makeButton("Isolate", () => this.#isolate(), { title: "Show only the selected object or the group with it" }),
        makeButton("Hide", () => this.#hideSelected()),
        makeButton("Show all", () => this.#showAll())),
      this.#list,
    );
    this.#search.addEventListener("input", () => this.#render());
    this.#select.addEventListener("change", () => {
      this.#grouping = this.#select.value as "storey" | "path";
      this.#build();
    });
    this.#list.addEventListener("keydown", (event) => this.#handleKey(event));
    this.#list.addEventListener("focusin", (event) => (this.#lastRow = event.target));
    app.sceneLoaded.listen(() => this.#fill());
    app.selected.listen((id) => this.#reveal(id));
    app.visibilityChanged.listen(() => {
      this.#updateRows();
      app.view.invalidate();
    });
  }

  #fill(): void {
    const entities = [...this.#app.table.byId.values()];
    this.#hasStoreys = entities.some(({ storey }) => storey);
    const hasClasses = entities.some(({ class: kind }) => kind);
    this.#grouping = this.#hasStoreys || hasClasses ? "storey" : "path";
    setText(this.#select.options[0]!, this.#hasStoreys || !hasClasses ? "By storey and class" : "By class");
    this.#select.value = this.#grouping;
    this.#build();
  }

  #build(): void {
    this.#tree = makeGroup("", "");
    this.#open.clear();
    this.#more.clear();
    for (const entity of this.#app.table.byId.values()) {
      let group = this.#tree;
      for (const name of this.#findGroups(entity)) {
        const key = `${group.key}/${name}`;
        let next = group.groups.get(name);
        if (!next) group.groups.set(name, (next = makeGroup(name, key)));
        group = next;
      }
      group.objects.push(entity);
    }
    // Open the groups that contain every object.
    let group = this.#tree;
    while (group.groups.size === 1 && group.objects.length === 0) {
      group = [...group.groups.values()][0]!;
      this.#open.add(group.key);
    }
    this.#render();
  }

  #findGroups({ path, storey, class: kind }: Entity): string[] {
    if (this.#grouping === "path") return path.split("/").slice(0, -1);
    return [...(this.#hasStoreys ? [storey || "No storey"] : []), kind || "No class"];
  }

  #render(): void {
    this.#rows = [];
    const words = this.#search.value.trim().toLowerCase().split(/\s+/).filter(Boolean);
    const { size } = this.#app.table.byId;
    if (words.length > 0) this.#renderFound(words);
    else {
      this.#renderGroup(this.#tree, 0);
      setText(this.#count, `${size.toLocaleString("en")} objects`);
    }
    this.#list.replaceChildren(...this.#rows.map(({ row }) => row));
    this.#updateRows();
  }

  #renderFound(words: string[]): void {
    let count = 0;
    for (const entity of this.#app.table.byId.values()) {
      const text = `${entity.path} ${entity.class} ${entity.globalId} ${entity.storey}`.toLowerCase();
      if (!words.every((word) => text.includes(word))) continue;
      if (++count <= MAX_FOUND) this.#addObject(entity, 1, shortenPath(entity.path));
    }
    setText(this.#count, count > MAX_FOUND ? `${count} found, ${MAX_FOUND} shown` : `${count} found`);
  }

  #renderGroup(group: Group, level: number): void {
    // Storeys from the lowest one up, all else by name.
    const { storeys } = this.#app.table;
    const order = (name: string) => (level === 0 && this.#hasStoreys ? storeys.indexOf(name) : 0);
    const groups = [...group.groups.values()].sort((a, b) => order(a.name) - order(b.name) || a.name.localeCompare(b.name, "en", { numeric: true }));
    for (const child of groups) {
      this.#addGroup(child, level + 1);
      if (this.#open.has(child.key)) this.#renderGroup(child, level + 1);
    }
    const shown = MAX_ROWS + (this.#more.get(group.key) ?? 0);
    for (const entity of group.objects.slice(0, shown)) {
      // Without the path above it, a name may name many objects.
      this.#addObject(entity, level + 1, this.#grouping === "path" ? getLastName(entity.path) : shortenPath(entity.path));
    }
    if (group.objects.length <= shown) return;
    const row = makeElement("div", { class: "leaf", role: "presentation" }, makeButton(`${group.objects.length - shown} more`, () => {
      this.#more.set(group.key, shown);
      this.#render();
    }, { class: "link" }));
    row.style.paddingLeft = `${0.9 * level + 0.4}rem`;
    this.#rows.push({ row, group: null, entity: null, level: level + 1 });
  }

  #addGroup(group: Group, level: number): void {
    const isOpen = this.#open.has(group.key);
    const row = makeElement(
      "div", { class: "group", role: "treeitem", "aria-level": level, "aria-expanded": String(isOpen), tabindex: "-1" },
      makeElement("span", { class: "arrow" }, isOpen ? "▾" : "▸"),
      makeElement("span", { class: "name", title: group.name }, group.name),
      makeElement("span", { class: "quiet" }, String(collectObjects(group).length)),
      this.#makeEye(() => collectObjects(group)),
    );
    row.addEventListener("click", () => this.#toggle(group));
    this.#push(row, group, null, level);
  }

  #addObject(entity: Entity, level: number, name: string): void {
    const row = makeElement(
      "div", { class: "leaf", role: "treeitem", "aria-level": level, tabindex: "-1" },
      makeElement("span", { class: "name", title: entity.path }, name), this.#makeEye(() => [entity]),
    );
    row.addEventListener("click", () => this.#app.select(entity.id));
    this.#push(row, null, entity, level);
  }

  #push(row: HTMLElement, group: Group | null, entity: Entity | null, level: number): void {
    row.style.paddingLeft = `${0.9 * (level - 1) + 0.4}rem`;
    this.#rows.push({ row, group, entity, level });
  }

  #makeEye(objects: () => Entity[]): HTMLElement {
    const eye = makeButton("", () => {}, { class: "eye", tabindex: "-1", label: "Hide or show" });
    eye.addEventListener("click", (event) => {
      event.stopPropagation();
      const list = objects();
      this.#setHidden(list, list.some(({ id }) => !this.#app.model?.flags.isHidden(id)));
    });
    return eye;
  }

  #toggle(group: Group): void {
    if (!this.#open.delete(group.key)) this.#open.add(group.key);
    const scroll = this.#list.scrollTop;
    this.#render();
    this.#list.scrollTop = scroll;
    this.#rows.find((row) => row.group === group)?.row.focus({ preventScroll: true });
  }

  #updateRows(): void {
    const flags = this.#app.model?.flags;
    if (!flags) return;
    for (const { row, group, entity } of this.#rows) {
      const hidden = entity ? flags.isHidden(entity.id) : group ? collectObjects(group).every(({ id }) => flags.isHidden(id)) : false;
      row.classList.toggle("hidden-object", hidden);
      row.classList.toggle("selected", entity !== null && entity.id === this.#app.selection);
      if (entity) row.setAttribute("aria-selected", String(entity.id === this.#app.selection));
    }
  }

  /** Opens the groups of a selected object and scrolls to it. */
  #reveal(id: number): void {
    const entity = this.#app.table.byId.get(id);
    if (entity && this.#search.value === "" && this.root.offsetParent !== null) {
      let key = "";
      for (const name of this.#findGroups(entity)) this.#open.add((key += `/${name}`));
      this.#render();
      this.#rows.find((row) => row.entity === entity)?.row.scrollIntoView({ block: "nearest" });
    }
    this.#updateRows();
  }

  #handleKey(event: KeyboardEvent): void {
    const at = this.#rows.findIndex(({ row }) => row === document.activeElement);
    const current = this.#rows[at];
    const go = (index: number) => this.#rows[Math.max(0, Math.min(this.#rows.length - 1, index))]?.row.focus();
    const { group, entity } = current ?? { group: null, entity: null };
    if (event.key === "ArrowDown") go(at + 1);
    else if (event.key === "ArrowUp") go(at - 1);
    else if (event.key === "ArrowRight" && group && !this.#open.has(group.key)) this.#toggle(group);
    else if (event.key === "ArrowLeft" && group && this.#open.has(group.key)) this.#toggle(group);
    else if (event.key === "ArrowLeft" && current) {
      go(this.#rows.slice(0, at).findLastIndex(({ level }) => level < current.level));
    } else if (event.key === "Enter" || event.key === " ") {
      if (group) this.#toggle(group);
      else if (entity) this.#app.select(entity.id);
    } else return;
    event.preventDefault();
    event.stopPropagation();
  }

  #setHidden(entities: Iterable<Entity>, hidden: boolean): void {
    for (const { id } of entities) this.#app.model?.flags.setHidden(id, hidden);
    this.#app.visibilityChanged.emit();
  }

  /** The focused group of the tree, else the selected object. */
  #findChosen(): Entity[] {
    const focused = this.#rows.find(({ row }) => row === this.#lastRow);
    if (focused?.group) return collectObjects(focused.group);
    const entity = this.#app.table.byId.get(this.#app.selection);
    return entity ? [entity] : [];
  }

  #isolate(): void {
    const chosen = new Set(this.#findChosen());
    if (chosen.size === 0) return this.#app.say("Select an object first.");
    for (const entity of this.#app.table.byId.values()) this.#app.model?.flags.setHidden(entity.id, !chosen.has(entity));
    this.#app.visibilityChanged.emit();
  }

  #hideSelected(): void {
    const chosen = this.#findChosen();
    if (chosen.length === 0) return this.#app.say("Select an object first.");
    this.#setHidden(chosen, true);
  }

  #showAll(): void {
    this.#setHidden(this.#app.table.byId.values(), false);
  }
}

function makeGroup(name: string, key: string): Group {
  return { name, key, groups: new Map(), objects: [] };
}

function collectObjects(group: Group): Entity[] {
  return [...group.objects, ...[...group.groups.values()].flatMap(collectObjects)];
}
