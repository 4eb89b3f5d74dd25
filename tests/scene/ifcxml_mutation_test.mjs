// Mutations of a small ifcXML document: each becomes STEP of known entities, or is refused in words
// and in bounded time. Seeded, so that each run makes the same documents.
//
//   node --test ifcxml_mutation_test.mjs        MUTATIONS=N in the environment: how many
import assert from 'node:assert/strict';
import { test } from 'node:test';

import { IfcSchema } from '../../scene/import/ifc/web_ifc/ifc_schema.js';
import { XmlError } from '../../scene/import/ifc/web_ifc/ifcxml_converter.js';
import { IfcXmlDocument } from '../../scene/import/ifc/web_ifc/ifcxml_document.js';
import { splitArguments } from '../../scene/import/ifc/web_ifc/step_text.js';

const MUTATIONS = Number(process.env.MUTATIONS ?? 2000);
const MAX_SECONDS = 5; // of processor time for one document; usual ones take milliseconds
const NAMESPACE = 'http://www.buildingsmart-tech.org/ifcXML/IFC4/Add2';

const HOUSE = `<ifcXML xmlns="${NAMESPACE}" xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance">
<header><name>not read</name></header>
<IfcProject id="p" GlobalId="0000000000000000000001" Name="It's a house, (ä)">
 <IsDecomposedBy><IfcRelAggregates GlobalId="0000000000000000000005"><RelatedObjects>
  <IfcSite id="site" GlobalId="0000000000000000000002" RefLatitude="24 28 0" RefElevation="10">
   <ObjectPlacement xsi:type="IfcLocalPlacement" xsi:nil="true" href="origin"/>
  </IfcSite>
 </RelatedObjects></IfcRelAggregates></IsDecomposedBy>
 <RepresentationContexts>
  <IfcGeometricRepresentationContext id="model" pos="0" CoordinateSpaceDimension="3" Precision="1E-05">
   <WorldCoordinateSystem><IfcAxis2Placement3D id="axes">
    <Location id="zero" Coordinates="0 0 0"/>
   </IfcAxis2Placement3D></WorldCoordinateSystem>
  </IfcGeometricRepresentationContext>
 </RepresentationContexts>
 <UnitsInContext><Units><IfcSIUnit UnitType="lengthunit" Name="metre"/></Units></UnitsInContext>
</IfcProject>
<IfcLocalPlacement id="origin"><RelativePlacement>
 <IfcAxis2Placement3D ref="axes" xsi:nil="true"/>
</RelativePlacement></IfcLocalPlacement>
<IfcWall id="wall" GlobalId="0000000000000000000008" Name="Wall" PredefinedType="standard">
 <ObjectPlacement ref="origin" xsi:nil="true"/>
 <Representation xsi:type="IfcProductDefinitionShape" id="box"><Representations>
  <IfcShapeRepresentation RepresentationIdentifier="Body" RepresentationType="Tessellation">
   <ContextOfItems xsi:nil="true" href="model"/>
   <Items><IfcTriangulatedFaceSet Closed="false" CoordIndex="1 2 3 1 3 4">
    <Coordinates CoordList="0 0 0 4 0 0 4 3 0 0 3 0"/>
   </IfcTriangulatedFaceSet></Items>
  </IfcShapeRepresentation>
 </Representations></Representation>
 <HasOpenings GlobalId="000000000000000000000A">
  <RelatedOpeningElement xsi:type="IfcOpeningElement" GlobalId="0000000000000000000009"/>
 </HasOpenings>
 <IsDefinedBy><IfcRelDefinesByProperties GlobalId="000000000000000000000H">
  <RelatingPropertyDefinition>
   <IfcPropertySet GlobalId="000000000000000000000I" Name="Pset_WallCommon"><HasProperties>
    <IfcPropertySingleValue Name="IsExternal">
     <NominalValue><IfcBoolean-wrapper>true</IfcBoolean-wrapper></NominalValue>
    </IfcPropertySingleValue>
   </HasProperties></IfcPropertySet>
  </RelatingPropertyDefinition>
 </IfcRelDefinesByProperties></IsDefinedBy>
</IfcWall>
<IfcBSplineSurface id="patch"><ControlPointsList>
 <Seq-IfcCartesianPoint-wrapper pos="0"><IfcCartesianPoint Coordinates="0 0 0"/></Seq-IfcCartesianPoint-wrapper>
 <IfcCartesianPoint pos="1 0" ref="zero" xsi:nil="true"/>
</ControlPointsList></IfcBSplineSurface>
<IfcRelContainedInSpatialStructure GlobalId="000000000000000000000E">
 <RelatedElements><IfcWall ref="wall" xsi:nil="true"/></RelatedElements>
 <RelatingStructure xsi:type="IfcSite" ref="site" xsi:nil="true"/>
</IfcRelContainedInSpatialStructure>
</ifcXML>
`;

const VALUES = [
  '', ' ', '0', '-1', '1e999', '-1e-999', '9'.repeat(400), '99999999999999999999', '0x10', 'NaN', '0,5',
  '1 2', '1 2 3 4 5 6 7', '#1', '$', '*', "'", "''", '(', '))', ",'", '\\X2\\00', '\\', ';', 'true',
  'constructor', '__proto__', 'toString', '.T.', 'wall', 'zero', 'p', 'IfcWall', 'IfcRoot',
  'IfcRelAggregates', '\u{10ffff}\u{1f600}', '&lt;&#x9;', 'x'.repeat(70000), '1 '.repeat(30001),
];
const NAMES = [
  'constructor', '__proto__', 'IfcRoot', 'IfcWall', 'IfcDoor', 'IfcRelVoidsElement', 'IfcPropertySingleValue',
  'IfcLabel-wrapper', 'IfcComplexNumber', 'IfcLogical-wrapper', 'Seq-IfcLengthMeasure-wrapper', 'Items',
  'HasOpenings', 'RelatedObjects', 'NominalValue', 'IfcBinary', 'IfcCompoundPlaneAngleMeasure', 'uos',
];
const ATTRIBUTES = ['id', 'ref', 'href', 'pos', 'path', 'xsi:type', 'xsi:nil', 'Name', 'GlobalId', 'hasOwnProperty'];

// ---- trees of XML -------------------------------------------------------------------------------

function parseTree(text) {
  const root = { children: [] };
  const stack = [root];
  for (const [token, close, name, attributes, empty] of
    text.matchAll(/<(\/?)([\w:-]+)((?:\s+[\w:]+="[^"]*")*)\s*(\/?)>|[^<]+/g)) {
    if (name === undefined) {
      stack.at(-1).children.push(token);
    } else if (close) {
      stack.pop();
    } else {
      const list = Array.from(attributes.matchAll(/([\w:]+)="([^"]*)"/g), ([, key, value]) => [key, value]);
      const element = { name, attributes: list, children: [] };
      stack.at(-1).children.push(element);
      if (!empty) stack.push(element);
    }
  }
  return root.children.find((child) => child.name !== undefined);
}

function formatTree(node) {
  if (typeof node === 'string') return node;
  const attributes = node.attributes.map(([key, value]) => ` ${key}="${value}"`).join('');
  return `<${node.name}${attributes}>${node.children.map(formatTree).join('')}</${node.name}>`;
}

function clone(node) {
  if (typeof node === 'string') return node;
  const { name, attributes, children } = node;
  return { name, attributes: attributes.map((pair) => [...pair]), children: children.map(clone) };
}

function listElements(node, parent, found = []) {
  if (typeof node === 'string') return found;
  if (parent) found.push({ node, parent });
  for (const child of node.children) listElements(child, node, found);
  return found;
}

// ---- mutations ----------------------------------------------------------------------------------

// A generator of whole numbers below `n`: mulberry32.
function makeRandom(seed) {
  let state = seed;
  return (n) => {
    state = (state + 0x6d2b79f5) | 0;
    let t = Math.imul(state ^ (state >>> 15), 1 | state);
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
    return Math.floor((((t ^ (t >>> 14)) >>> 0) / 2 ** 32) * n);
  };
}

const CHANGES = [
  function drop({ node, parent }) { parent.children.splice(parent.children.indexOf(node), 1); },
  function duplicate({ node, parent }) { parent.children.push(clone(node)); },
  function unwrap({ node, parent }) {
    parent.children.splice(parent.children.indexOf(node), 1, ...node.children);
  },
  function moveTo({ node }, pick) { pick().node.children.push(clone(node)); },
  function rename({ node }, pick) { node.name = pick().node.name; },
  function renameOddly({ node }, pick, random) { node.name = NAMES[random(NAMES.length)]; },
  function swapAttributes({ node }, pick) {
    const other = pick().node;
    [node.attributes, other.attributes] = [other.attributes, node.attributes];
  },
  function setValue({ node }, pick, random) {
    const attribute = node.attributes[random(node.attributes.length)];
    if (attribute) attribute[1] = VALUES[random(VALUES.length)];
  },
  function addAttribute({ node }, pick, random) {
    const key = ATTRIBUTES[random(ATTRIBUTES.length)];
    node.attributes = node.attributes.filter(([name]) => name !== key);
    node.attributes.push([key, VALUES[random(VALUES.length)]]);
  },
  function dropAttribute({ node }, pick, random) { node.attributes.splice(random(8), 1); },
  function referTo({ node }, pick, random) {
    const ids = ['p', 'site', 'model', 'axes', 'zero', 'origin', 'wall', 'box', 'patch', 'none'];
    node.attributes = [['ref', ids[random(ids.length)]], ['xsi:nil', 'true']];
    node.children = [];
  },
  function addText({ node }, pick, random) { node.children.push(VALUES[random(VALUES.length)]); },
  function nest({ node, parent }, pick, random) {
    let inner = node;
    for (let depth = random(20) === 0 ? 1200 : random(40); depth > 0; --depth)
      inner = { name: node.name, attributes: [], children: [inner] };
    parent.children[parent.children.indexOf(node)] = inner;
  },
];

const TEXT_CHANGES = [
  function truncate(text, random) { return text.slice(0, random(text.length)); },
  function dropCharacter(text, random) {
    const at = random(text.length);
    return text.slice(0, at) + text.slice(at + 1);
  },
  function swapTags(text, random) {
    const tokens = text.match(/<[^>]*>|[^<]+/g);
    const [a, b] = [random(tokens.length), random(tokens.length)];
    [tokens[a], tokens[b]] = [tokens[b], tokens[a]];
    return tokens.join('');
  },
  function expandEntities(text, random) {
    const lines = ['<!ENTITY e0 "ha">'];
    for (let i = 1; i < 40; ++i) lines.push(`<!ENTITY e${i} "${`&e${i - 1};`.repeat(10)}">`);
    const used = text.replace(/Name="/, 'Name="&e39;');
    return random(2) ? `<!DOCTYPE ifcXML [${lines.join('')}]>${used}` : used;
  },
  function changeNamespace(text, random) {
    const others = ['IFC4x3', 'IFC4x1', 'IFC2x3', 'IFC4'.repeat(20000), ''];
    return text.replace(/IFC4(?=\/Add2)/g, others[random(others.length)]);
  },
];

function mutate(seed) {
  const random = makeRandom(seed);
  const tree = parseTree(HOUSE);
  for (let i = random(4); i >= 0; --i) {
    const pick = () => {
      const elements = listElements(tree);
      return elements.length > 0 ? elements[random(elements.length)] : { node: tree, parent: tree };
    };
    CHANGES[random(CHANGES.length)](pick(), pick, random);
  }
  const text = formatTree(tree);
  return random(6) === 0 ? TEXT_CHANGES[random(TEXT_CHANGES.length)](text, random) : text;
}

// ---- outcomes -----------------------------------------------------------------------------------

const schemas = new Map();
function getSchema(release) {
  if (!schemas.has(release)) schemas.set(release, new IfcSchema(release));
  return schemas.get(release);
}

// The STEP text, or null for a document that was refused in words.
function convert(text) {
  const bytes = Buffer.from(text);
  const document = new IfcXmlDocument(getSchema);
  try {
    document.read(bytes.length, (at, size) => bytes.subarray(at, at + size));
  } catch (error) {
    if (!(error instanceof XmlError)) throw error;
    assert.notEqual(error.message, '');
    return null;
  }
  for (const { count, example } of document.problems.values()) {
    assert.ok(count > 0 && /^line \d+: ./s.test(example), example);
    assert.ok(!example.includes('undefined'), example);
  }
  return Array.from(document.makeStep()).join('');
}

// Each statement is of a known entity, with its number of values, and refers to others.
function checkStep(step) {
  const schema = getSchema(/FILE_SCHEMA\(\('(\w+)'\)\)/.exec(step)[1]);
  const lines = step.slice(step.indexOf('DATA;\n') + 6, step.lastIndexOf('ENDSEC;')).split('\n');
  assert.equal(lines.pop(), '');
  const defined = new Set(lines.map((line) => line.slice(0, line.indexOf('='))));
  assert.equal(defined.size, lines.length, 'a number is defined twice');
  for (const line of lines) {
    const [, name, values] = /^#\d+=([A-Z0-9]+)\((.*)\);$/.exec(line) ?? assert.fail(line);
    assert.equal(splitArguments(values).length, Math.max(1, schema.findEntityByUpperCase(name).attributes.length), line);
    const rest = values.replace(/'(?:[^']|'')*'|"[0-9A-F]*"/g, 'S');
    const references = rest.match(/#\d+/g) ?? [];
    for (const reference of references) assert.ok(defined.has(reference), `${reference} in ${line}`);
    const value = /(?:#\d+|[+-]?\d+(?:\.\d*(?:E[+-]?\d+)?)?|\.\w+\.|S|\$|\*|[A-Z0-9]+(?=\()|[(),])/g;
    assert.equal(rest.replace(value, ''), '', line);
    const depth = [...rest].reduce((sum, c) => sum + (c === '(') - (c === ')'), 0);
    assert.equal(depth, 0, line);
  }
  return lines.length;
}

test('the document itself is converted without a problem', () => {
  const document = new IfcXmlDocument(getSchema);
  const bytes = Buffer.from(HOUSE);
  document.read(bytes.length, (at, size) => bytes.subarray(at, at + size));
  assert.deepEqual(document.problems, new Map());
  assert.equal(checkStep(Array.from(document.makeStep()).join('')), 22);
});

test('mutations become STEP of known entities, or are refused in words', () => {
  let converted = 0;
  for (let seed = 0; seed < MUTATIONS; ++seed) {
    const text = mutate(seed);
    const start = process.cpuUsage();
    try {
      const step = convert(text);
      if (step !== null) converted += checkStep(step) > 5;
    } catch (error) {
      error.message = `seed ${seed}: ${error.message}`;
      throw error;
    }
    const seconds = process.cpuUsage(start).user / 1e6;
    assert.ok(seconds < MAX_SECONDS, `seed ${seed} takes ${seconds} s`);
  }
  // Otherwise the mutations would test the refusals alone, or no refusal.
  assert.ok(converted > 0.5 * MUTATIONS && converted < 0.95 * MUTATIONS, `${converted} of ${MUTATIONS}`);
});
