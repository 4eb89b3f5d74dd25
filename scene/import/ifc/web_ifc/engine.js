// Starts web-ifc's WebAssembly module. web-ifc's own entry point also builds tables of all IFC
// classes, which read_ifc.js does not need and which take longer than many a file; so the module's
// loader is cut out of the bundle.
import fs from 'node:fs';
import { createRequire } from 'node:module';
import path from 'node:path';
import vm from 'node:vm';

const LOG_LEVEL_OFF = 6; // web-ifc logs to stdout otherwise
const FILE_SCHEMA = 1109904537; // web-ifc's code of this line of the header

// As web-ifc's own, except TAPE_SIZE, the bytes of one block of text: its blocks of 64 MiB take
// more memory and are no faster.
const SETTINGS = {
  ALLOW_INCOMPATIBLE_SCHEMA_ALIASES: true,
  COORDINATE_TO_ORIGIN: false,
  CIRCLE_SEGMENTS: 12,
  TAPE_SIZE: 1 << 24,
  MEMORY_LIMIT: 2 ** 31,
  LINEWRITER_BUFFER: 10000,
  TOLERANCE_PLANE_INTERSECTION: 1e-4,
  TOLERANCE_PLANE_DEVIATION: 1e-4,
  TOLERANCE_BACK_DEVIATION_DISTANCE: 1e-4,
  TOLERANCE_INSIDE_OUTSIDE_PERIMETER: 1e-10,
  TOLERANCE_SCALAR_EQUALITY: 1e-4,
  PLANE_REFIT_ITERATIONS: 1,
  BOOLEAN_UNION_THRESHOLD: 150,
};

function cut(text, first, last) {
  const start = text.indexOf(first);
  const end = text.indexOf(last, start);
  if (start < 0 || end < 0) throw new Error('the bundle of web-ifc has another layout');
  return text.slice(start, end);
}

function readSchemaNames(bundle) {
  const names = new Set();
  for (let at = 0; (at = bundle.indexOf('\nSchemaNames[', at)) >= 0; ++at)
    for (const [, name] of cut(bundle.slice(at), '= [', ']').matchAll(/"(\w+)"/g)) names.add(name);
  return names;
}

// Returns the module and the names of the schemas that web-ifc knows.
export async function startEngine() {
  const require = createRequire(import.meta.url);
  const file = require.resolve('web-ifc');
  const bundle = fs.readFileSync(file, 'latin1'); // it is ASCII, and this decoding is the fastest
  const loader = cut(bundle, '"dist/web-ifc-node.js"(', '\n});\n');
  const makeLoader = vm.compileFunction(`return {${loader}};`, ['require', '__filename', '__dirname'],
                                        { filename: file });
  const found = { exports: {} };
  makeLoader(require, file, path.dirname(file))['dist/web-ifc-node.js'](found.exports, found);
  const engine = await found.exports({ noInitialRun: true });
  engine.SetLogLevel(LOG_LEVEL_OFF);
  return { engine, schemas: readSchemaNames(bundle) };
}

// Opens the file whose bytes `read(block, offset)` delivers: it fills a block of web-ifc's memory,
// as far as the file goes, and returns the number of bytes. Returns the model's number; -1: its
// schema is not known.
export function openModel({ engine, schemas }, read) {
  const model = engine.OpenModel(SETTINGS, (address, offset, size) =>
    read(engine.HEAPU8.subarray(address, address + size), offset));
  if (model < 0) return -1;
  const schema = engine.GetHeaderLine(model, FILE_SCHEMA)?.arguments?.[0]?.[0]?.value;
  return typeof schema === 'string' && schemas.has(schema.toUpperCase()) ? model : -1;
}
