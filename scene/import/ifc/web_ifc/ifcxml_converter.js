// Converts the elements of ifcXML (configuration ifcXML4 of buildingSMART) to statements of STEP.
//
// An entity is an element, or the element of the attribute that has it as its value. Attributes of
// simple types are attributes of XML. An inverse attribute contains the relationships that refer to the
// entity around it. Where an element could be a value or contain values, its XML attributes and its
// first child decide.
//
// The elements that are open are a stack of frames. A frame has some of: child(tag) for a child
// element, text for its own text, and close().
import { removeReferences, splitArguments, writeSimple } from './step_text.js';

const MAX_DEPTH = 1000; // of nested elements; models have some hundred
const XSI = 'http://www.w3.org/2001/XMLSchema-instance';

// Sizes of inner lists, which ifcXML writes one after another.
const INNER_SIZES = {
  CoordIndex: 3, ColourList: 3, Normals: 3, TexCoordIndex: 3, TexCoordsList: 2,
  'IfcCartesianPointList2D.CoordList': 2, 'IfcCartesianPointList3D.CoordList': 3,
};

// An error of the document: it cannot be converted.
export class XmlError extends Error {}

// {own: [[name, value]], id, ref, type, nil, position} of the XML attributes of a tag. Those of XML
// Schema and of ISO 10303-28 state no values of IFC.
function sortAttributes(tag) {
  const sorted = { own: [] };
  for (const { local, uri, prefix, value } of Object.values(tag.attributes)) {
    if (prefix === 'xmlns' || local === 'xmlns') continue;
    if (local === 'href' || (local === 'ref' && uri === '')) sorted.ref = value.replace(/^#/, '');
    else if (uri === XSI && local === 'type') sorted.type = value.replace(/^.*:/, '');
    else if (uri === XSI && local === 'nil') sorted.nil = value === 'true' || value === '1';
    else if (uri.startsWith('urn:') || uri.startsWith('http://www.w3.org/')) continue;
    else if (local === 'id') sorted.id = value;
    else if (local === 'pos') sorted.position = value.trim().split(/\s+/).map(Number);
    else if (local !== 'path') sorted.own.push([local, value]);
  }
  return sorted;
}

function namesEntity(attributes) {
  const { own, id, ref, type } = attributes;
  return own.length > 0 || [id, ref, type].some((value) => value !== undefined);
}

// In the order of `pos`, if all items have it.
function sortItems(items) {
  if (!items.every(({ position }) => position?.every(Number.isInteger))) return items;
  return [...items].sort((a, b) =>
    a.position[0] - b.position[0] || (a.position[1] ?? 0) - (b.position[1] ?? 0));
}

function joinItems(items, depth) {
  const sorted = sortItems(items);
  if (depth < 2 || sorted.some(({ position, isList }) => isList || position?.length !== 2))
    return `(${sorted.map(({ text }) => text)})`;
  const rows = new Map();
  for (const { text, position } of sorted) {
    if (!rows.has(position[0])) rows.set(position[0], []);
    rows.get(position[0]).push(text);
  }
  return `(${Array.from(rows.values(), (row) => `(${row})`)})`;
}

export class IfcXmlConverter {
  // `report(kind, line, text)`: of what is not read.
  constructor(schema, report) {
    this.schema = schema;
    this.report = report;
    this.frames = [];
    this.line = 0;
    this.numbers = new Map(); // by id of XML
    this.statements = ['']; // by number; undefined: not defined yet
    this.awaited = new Map(); // number -> {id, line} of the first reference
    this.inverses = new Map(); // number of a relationship -> Map of the attributes to complete
  }

  open(tag, line) {
    this.line = line;
    if (this.frames.length >= MAX_DEPTH)
      throw new XmlError(`its elements are nested more than ${MAX_DEPTH} deep`);
    if (this.frames.length === 0) this.frames.push({ child: (child) => this.openTopLevel(child) });
    else this.openChild(this.frames.at(-1), tag);
  }

  openChild(frame, tag) {
    const before = this.frames.length;
    if (frame.child === undefined) this.skip(tag);
    else frame.child(tag);
    if (this.frames.length !== before + 1) throw new Error(`no frame for ${tag.name}`);
  }

  addText(text) {
    const frame = this.frames.at(-1);
    if (frame === undefined) return;
    if (frame.text !== undefined) frame.text += text;
    else if (!frame.ignored && text.trim() !== '')
      this.report('xml_not_read', this.line, `text '${text.trim().slice(0, 40)}'`);
  }

  close(line) {
    this.line = line;
    this.frames.pop().close?.();
  }

  // The lines of the data section.
  *finish() {
    for (const [number, positions] of this.inverses)
      if (this.statements[number]) this.addInverses(number, positions);
    const missing = new Set();
    for (const [number, { id, line }] of this.awaited) {
      if (this.statements[number] !== undefined) continue;
      missing.add(number);
      this.report('xml_reference_missing', line, `id '${id}' is not in the file`);
    }
    for (const [number, statement] of this.statements.entries()) {
      if (!statement) continue;
      const [name, values] = this.splitStatement(statement);
      const kept = missing.size === 0 ? values
        : splitArguments(values).map((value) => removeReferences(value, (n) => missing.has(n))).join();
      yield `#${number}=${name}(${kept});\n`;
    }
  }

  // ---- elements -------------------------------------------------------------------------------

  skip(tag) {
    this.report('xml_not_read', this.line, `element '${tag.name}'`);
    this.ignore();
  }

  ignore() {
    this.frames.push({ ignored: true, child: () => this.ignore() });
  }

  openTopLevel(tag) {
    if (tag.local === 'header') this.ignore();
    else if (tag.local === 'uos') this.frames.push({ child: (child) => this.openTopLevel(child) });
    else if (this.schema.findEntity(tag.local)) this.openEntity(tag.local, tag, () => {});
    else this.skip(tag);
  }

  // `accept(text, position)` gets the reference to the entity. `inverse`: {relation, position, parent}
  // of the attribute that refers to the entity around it. References need no name.
  openEntity(name, tag, accept, inverse) {
    const attributes = sortAttributes(tag);
    if (attributes.ref !== undefined) {
      this.openReference(attributes, tag, accept, inverse);
      return;
    }
    const entity = this.schema.findEntity(attributes.type ?? name);
    if (entity === undefined) {
      const type = attributes.type === undefined ? '' : ` of type ${attributes.type}`;
      this.skip({ name: tag.name + type });
    } else if (attributes.nil && !namesEntity({ ...attributes, type: undefined })) {
      this.frames.push({});
    } else {
      this.openDefinition(entity, attributes, accept, inverse);
    }
  }

  openReference({ ref, own, position }, tag, accept, inverse) {
    const number = this.getNumber(ref);
    if (this.statements[number] === undefined && !this.awaited.has(number))
      this.awaited.set(number, { id: ref, line: this.line });
    accept(`#${number}`, position);
    if (inverse) this.awaitInverse(number, inverse);
    for (const [name] of own)
      this.report('xml_not_read', this.line, `attribute '${name}' of a reference, '${tag.name}'`);
    this.frames.push({});
  }

  openDefinition(entity, { id, own, position }, accept, inverse) {
    let number = id === undefined ? this.makeNumber() : this.getNumber(id);
    if (this.statements[number] !== undefined) {
      this.report('xml_not_read', this.line, `second element with id '${id}'`);
      number = this.makeNumber();
    }
    this.statements[number] = '';
    const values = entity.attributes.map((attribute) => (attribute === null ? '*' : '$'));
    for (const [name, text] of own) this.readAttribute(entity, name, text, values);
    accept(`#${number}`, position);
    this.frames.push({
      child: (tag) => this.openMember(entity, number, values, tag),
      close: () => {
        this.statements[number] = `${entity.name.toUpperCase()}(${values})`;
        if (inverse) this.awaitInverse(number, inverse);
      },
    });
  }

  readAttribute(entity, name, text, values) {
    const at = entity.positions.get(name);
    const simple = at === undefined ? undefined : entity.attributes[at].type.simple;
    if (simple === undefined) {
      this.report('xml_not_read', this.line, `attribute '${name}' of ${entity.name}`);
    } else {
      values[at] = this.readSimple(entity, entity.attributes[at], text);
    }
  }

  readSimple(entity, { name, type }, text) {
    const width = INNER_SIZES[`${entity.name}.${name}`] ?? INNER_SIZES[name];
    if (text.trim() === '' && (type.depth > 0 || type.simple.primitive !== 'string')) return '$';
    return writeSimple(type.simple, type.depth, text, width) ??
      this.rejectValue(`${name}="${text.slice(0, 40)}" of ${entity.name}`);
  }

  rejectValue(text) {
    this.report('xml_value_ignored', this.line, text);
    return '$';
  }

  // A child of an entity: an attribute or an inverse attribute.
  openMember(entity, number, values, tag) {
    const at = entity.positions.get(tag.local);
    const inverse = entity.inverses.get(tag.local);
    if (at !== undefined) this.openAttribute(entity, at, values, tag);
    else if (inverse !== undefined) this.openInverse(inverse, number, tag);
    else this.skip({ name: `${tag.name} of ${entity.name}` });
  }

  openInverse({ relation, position }, parent, tag) {
    const open = (child, name = child.local) =>
      this.openEntity(name, child, () => {}, { relation, position, parent });
    if (namesEntity(sortAttributes(tag))) open(tag, relation);
    else this.openContainer(relation, (child) => open(child), () => open(tag, relation));
  }

  openAttribute(entity, at, values, tag) {
    const { type, name } = entity.attributes[at];
    const accept = (text) => { values[at] = text; };
    const accepted = type.depth > 0 ? (text) => accept(`(${text})`) : accept;
    const own = sortAttributes(tag);
    if (type.simple !== undefined) {
      this.openSimple(entity, entity.attributes[at], accept);
    } else if (type.entity !== undefined ? namesEntity(own) : (own.type ?? own.ref) !== undefined) {
      this.openEntity(type.entity, tag, accepted);
    } else {
      for (const [unread] of own.own)
        this.report('xml_not_read', this.line, `attribute '${unread}' of ${entity.name}.${name}`);
      this.openValues(type, accept, tag);
    }
  }

  // An attribute whose element contains its value or values.
  openValues(type, accept, tag) {
    const items = [];
    const become = type.depth > 0 || type.entity === undefined
      ? undefined : () => this.openEntity(type.entity, tag, accept);
    this.openContainer(type.entity, (child) => this.openItem(type, child, items), become, () => {
      if (type.depth > 0) accept(joinItems(items, type.depth));
      else if (items.length > 0) accept(items[0].text);
      if (type.depth === 0 && items.length > 1)
        this.report('xml_not_read', this.line, `second value of '${tag.name}'`);
    });
  }

  // An element that contains entities or, if its first child is no entity, is one: then `become()`
  // opens that instead.
  openContainer(entity, openItem, become, close) {
    const frame = { close };
    frame.child = (child) => {
      const isMember = become !== undefined && !frame.used &&
        (this.schema.findEntity(entity).positions.has(child.local) ||
         this.schema.findEntity(entity).inverses.has(child.local));
      frame.used = true;
      if (!isMember) return openItem(child);
      this.frames.pop();
      become();
      this.frames.at(-1).child(child);
    };
    this.frames.push(frame);
  }

  openItem(type, tag, items) {
    const accept = (text, position) => items.push({ text, position });
    const list = /^Seq-.*-wrapper$/.test(tag.local);
    const name = tag.local.replace(/-wrapper$/, '');
    const simple = this.schema.findSimpleType(name);
    if (list && type.depth > 1) this.openRow(type, tag, items);
    else if (this.schema.findEntity(name)) this.openEntity(name, tag, accept);
    else if (simple) this.openWrapper(simple, tag, accept);
    else this.skip(tag);
  }

  openRow(type, tag, items) {
    const row = [];
    const { position } = sortAttributes(tag);
    this.frames.push({
      child: (child) => this.openItem({ ...type, depth: type.depth - 1 }, child, row),
      close: () => items.push({ text: joinItems(row, 1), position, isList: true }),
    });
  }

  // A value of a choice: its element names its type.
  openWrapper(simple, tag, accept) {
    const { position } = sortAttributes(tag);
    const frame = { text: '' };
    frame.close = () => {
      const value = writeSimple(simple, 0, frame.text);
      if (value === null) this.rejectValue(`${tag.name}: '${frame.text.trim().slice(0, 40)}'`);
      else accept(`${simple.name.toUpperCase()}(${value})`, position);
    };
    this.frames.push(frame);
  }

  // A simple attribute as an element: with text, or with an element for each value.
  openSimple(entity, attribute, accept) {
    const items = [];
    const { type, name } = attribute;
    const frame = { text: '' };
    frame.child = (tag) => {
      const { position } = sortAttributes(tag);
      const item = { text: '' };
      const depth = /^Seq-/.test(tag.local) ? type.depth - 1 : 0;
      item.close = () => {
        const value = writeSimple(type.simple, depth, item.text);
        if (value === null) this.rejectValue(`${name} of ${entity.name}: '${item.text.slice(0, 40)}'`);
        else items.push({ text: value, position, isList: depth > 0 });
      };
      if (/-wrapper$/.test(tag.local) || this.schema.findSimpleType(tag.local)) this.frames.push(item);
      else this.skip(tag);
    };
    frame.close = () => {
      if (items.length === 0) accept(this.readSimple(entity, attribute, frame.text));
      else if (type.depth > 0) accept(joinItems(items, type.depth));
      else accept(items[0].text);
    };
    this.frames.push(frame);
  }

  // ---- numbers and references -----------------------------------------------------------------

  makeNumber() {
    return this.statements.push(undefined) - 1;
  }

  getNumber(id) {
    if (!this.numbers.has(id)) this.numbers.set(id, this.makeNumber());
    return this.numbers.get(id);
  }

  awaitInverse(number, { relation, position, parent }) {
    if (!this.inverses.has(number)) this.inverses.set(number, new Map());
    const positions = this.inverses.get(number);
    const key = `${relation}.${position}`;
    if (!positions.has(key))
      positions.set(key, { relation, position, parents: new Set(), line: this.line });
    positions.get(key).parents.add(`#${parent}`);
  }

  splitStatement(statement) {
    const at = statement.indexOf('(');
    return [statement.slice(0, at), statement.slice(at + 1, -1)];
  }

  // Adds the entities that name a relationship to its attributes.
  addInverses(number, positions) {
    const [name, text] = this.splitStatement(this.statements[number]);
    const values = splitArguments(text);
    const entity = this.schema.findEntityByUpperCase(name);
    const { attributes } = entity;
    for (const { relation, position, parents, line } of positions.values()) {
      if (!this.schema.isKind(entity.name, relation)) {
        this.report('xml_not_read', line, `${entity.name} in place of ${relation}`);
        continue;
      }
      const isList = attributes[position].type.depth > 0;
      const stated = isList ? values[position].replace(/^\(|\)$/g, '').split(',') : [values[position]];
      const all = new Set([...stated.filter((value) => value.startsWith('#')), ...parents]);
      if (!isList && all.size > 1)
        this.report('xml_not_read', this.line, `${all.size} values of ${attributes[position].name}`);
      values[position] = isList ? `(${[...all]})` : [...all][0];
    }
    this.statements[number] = `${name}(${values})`;
  }
}
