// The entities and types of one release of IFC, from the tables and the declarations of web-ifc.
// web-ifc knows the order of attributes, but their types are only in its file of declarations.
import fs from 'node:fs';
import { createRequire } from 'node:module';

import { splitArguments } from './step_text.js';

const require = createRequire(import.meta.url);
// web-ifc's codes of primitive types
const STRING = 1;
const ENUMERATOR = 3;
const REAL = 4;
const INTEGER = 10;
const BINARY = 11;

// The text of one namespace of the declarations, by class, and its unions, by name.
function readDeclarations(release) {
  const text = fs.readFileSync(require.resolve('web-ifc').replace(/[^/]*$/, 'ifc-schema.d.ts'), 'utf8');
  const start = text.indexOf(`declare namespace ${release} {`);
  if (start < 0) throw new Error(`web-ifc does not declare ${release}`);
  const end = text.indexOf('\n}', start);
  const body = text.slice(start, end);
  const classes = new Map();
  for (const [, name, content] of body.matchAll(/^    class (\w+)[^{]*\{\n([^]*?)^    \}/gm))
    classes.set(name, content);
  const unions = new Map();
  for (const [, name, content] of body.matchAll(/^    type (\w+) = (.*);$/gm))
    unions.set(name, content);
  return { classes, unions };
}

function findPrimitive(code, name) {
  if (name === 'IfcBoolean') return 'boolean';
  if (name === 'IfcLogical') return 'logical';
  return { [STRING]: 'string', [REAL]: 'real', [INTEGER]: 'integer', [BINARY]: 'binary' }[code];
}

export class IfcSchema {
  // `release`: IFC4 or IFC4X3.
  constructor(release) {
    this.web = require('web-ifc');
    this.index = Object.keys(this.web.SchemaNames).find((i) =>
      this.web.SchemaNames[i].includes(release));
    this.types = this.web[release];
    this.declarations = readDeclarations(release);
    this.entities = new Map();
    this.simpleTypes = new Map();
  }

  // {name, attributes: [{name, type} or null where the value is derived], positions, inverses};
  // undefined: no entity has this name.
  findEntity(name) {
    if (!this.entities.has(name)) this.entities.set(name, this.makeEntity(name));
    return this.entities.get(name);
  }

  makeEntity(name) {
    const code = this.web[name.toUpperCase()];
    const order = this.web.ToRawLineData[this.index][code];
    if (!Object.hasOwn(this.types, name) || order === undefined) return undefined;
    const types = new Map();
    for (const [, key, text] of this.declarations.classes.get(name).matchAll(/^        (\w+): (.*);$/gm))
      types.set(key, text);
    const list = order.toString().replace(/^[^[]*\[|\][^\]]*$/g, '');
    const attributes = list.trim() === '' ? [] : splitArguments(list).map((text) => {
      const attribute = /\bi\.(\w+)/.exec(text)?.[1];
      if (attribute === undefined) return null;
      return { name: attribute, type: this.readAttributeType(types.get(attribute)) };
    });
    const positions = new Map(attributes.map((attribute, i) => [attribute?.name, i]));
    const inverses = new Map();
    for (const [inverse, relation, position] of this.web.InversePropertyDef[this.index][code] ?? [])
      inverses.set(inverse, { relation: this.findName(relation), position });
    return { name, attributes, positions, inverses };
  }

  findName(code) {
    this.names ??= new Map(Object.keys(this.types).map((name) => [this.web[name.toUpperCase()], name]));
    return this.names.get(code);
  }

  // Whether the entity is of the class, or of one that derives from it.
  isKind(name, base) {
    return name === base || this.types[name].prototype instanceof this.types[base];
  }

  // `name`: as STEP writes it.
  findEntityByUpperCase(name) {
    return this.findEntity(this.findName(this.web[name]));
  }

  // {depth: of nested lists, simple: of findSimpleType(), or entity: the only possible one, or neither:
  // a choice}
  readAttributeType(text) {
    let base = text.replace(/ \| null$/, '');
    let depth = 0;
    for (; base.endsWith('[]'); base = base.slice(0, -2)) ++depth;
    if (/^\(NumberHandle/.test(base)) return { depth, simple: { primitive: 'integer' } };
    if (/^\(Handle<logical>/.test(base)) return { depth, simple: { primitive: 'logical' } };
    const entity = /^\(Handle<(\w+)> \| \w+\)$/.exec(base)?.[1];
    if (entity !== undefined) return { depth, entity };
    return { depth, simple: this.findSimpleType(base) };
  }

  // {name, primitive, list: whether a value has several, words: of an enumeration}; undefined: no
  // simple type has this name.
  findSimpleType(name) {
    if (!this.simpleTypes.has(name)) this.simpleTypes.set(name, this.makeSimpleType(name));
    return this.simpleTypes.get(name);
  }

  makeSimpleType(name) {
    const type = Object.hasOwn(this.types, name) ? this.types[name] : undefined;
    if (typeof type !== 'function' || this.findEntity(name) !== undefined) return undefined;
    const words = Object.getOwnPropertyNames(type).filter((key) => type[key]?.type === ENUMERATOR);
    if (words.length > 0) return { name, primitive: 'enumeration', words: new Set(words) };
    const declared = this.declarations.classes.get(name) ?? '';
    const list = declared.includes('value: Array<');
    const items = /value: Array<(Ifc\w+)>/.exec(declared)?.[1];
    if (items !== undefined) {
      const primitive = this.findSimpleType(items)?.primitive;
      return primitive && { name, primitive, list };
    }
    const primitive = findPrimitive(new type('1').type, name);
    return primitive && { name, primitive, list };
  }
}
