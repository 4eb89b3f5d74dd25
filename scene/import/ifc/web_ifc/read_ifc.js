// Reads the meshes of IFC products with web-ifc. The importer starts this script as a process:
//
//   node read_ifc.js FIRST
//
// File descriptor 3 receives the messages, 4 is the IFC file, 5 the list of what to read: the
// number of ranges of the file (64 bits), the first byte and the size of each (64 bits). The
// express ids of the requested products (32 bits) follow. Both are complete when the pipe 6 is at
// its end. Products before index FIRST are done. The contents of the messages are documented in
// scene/import/ifc/ifc_meshes.hpp.
import { openModel, startEngine } from './engine.js';
import {
  IFC_FILE, WANTED, packDoubles, packWords, readAll, readInto, sendMessage, sendProgress,
  waitForInput,
} from './worker_io.js';

const FLOATS_A_VERTEX = 6; // position and normal, as web-ifc delivers them

// Words of 32 bits in the memory of web-ifc, as bytes, without the copy that GetVertexArray makes.
// Valid until web-ifc allocates.
function viewWords(engine, address, count) {
  return Buffer.from(engine.HEAPU8.buffer, address, 4 * count);
}

function readList() {
  const bytes = readAll(WANTED);
  if (bytes.length === 0) return { ranges: [], wanted: [] }; // other processes read all
  const count = Number(new BigUint64Array(bytes.buffer, 0, 1)[0]);
  const numbers = Array.from(new BigUint64Array(bytes.buffer, 8, 2 * count), Number);
  const ranges = [];
  let start = 0; // where the range begins in the text of all ranges
  for (let i = 0; i < count; ++i) {
    ranges.push({ start, first: numbers[2 * i], size: numbers[2 * i + 1] });
    start += numbers[2 * i + 1];
  }
  return { ranges, wanted: new Uint32Array(bytes.buffer.slice(8 + 16 * count)) };
}

// web-ifc knows IFC4.3 by the names of its releases; a technical corrigendum differs in no shape.
function nameKnownSchema(bytes) {
  const at = bytes.subarray(0, 65536).indexOf("'IFC4X3_TC1'");
  if (at >= 0) bytes.write("'IFC4X3'    ", at, 'latin1');
}

// Returns a function that fills a block with the ranges' text from `offset` on.
function makeReader(ranges) {
  return (block, offset) => {
    let done = 0;
    for (const { start, first, size: length } of ranges) {
      if (start + length <= offset + done) continue;
      const from = offset + done - start;
      const wanted = Math.min(block.length - done, length - from);
      readInto(IFC_FILE, block.subarray(done, done + wanted), first + from);
      done += wanted;
      if (done === block.length) break;
    }
    if (offset === 0) nameKnownSchema(Buffer.from(block.buffer, block.byteOffset, done));
    return done;
  };
}

// Sends each geometry once, before the first product that uses it.
function sendGeometry(engine, model, id, known) {
  if (known.has(id)) return;
  known.add(id);
  const geometry = engine.GetGeometry(model, id);
  const vertices = viewWords(engine, geometry.GetVertexData(), geometry.GetVertexDataSize());
  const indices = viewWords(engine, geometry.GetIndexData(), geometry.GetIndexDataSize());
  sendMessage('G', [packWords(id, vertices.length / 4 / FLOATS_A_VERTEX, indices.length / 4)],
            [vertices, indices]);
  geometry.delete();
}

function sendProduct(engine, model, mesh, known) {
  const parts = [];
  const count = mesh.geometries.size();
  for (let i = 0; i < count; ++i) {
    const placed = mesh.geometries.get(i);
    sendGeometry(engine, model, placed.geometryExpressID, known);
    const { x, y, z, w } = placed.color;
    parts.push(packWords(placed.geometryExpressID), packDoubles(x, y, z, w, ...placed.flatTransformation));
  }
  sendMessage('O', [packWords(mesh.expressID, count), ...parts]);
}

// Whether the heap of web-ifc may be corrupt: a WebAssembly trap corrupts it, web-ifc's own
// exceptions do not.
function isBroken(error) {
  return error instanceof WebAssembly.RuntimeError || error instanceof RangeError;
}

function describeError(error) {
  if (error instanceof WebAssembly.Exception) return 'web-ifc threw an exception';
  return String(error?.message ?? error);
}

async function main() {
  const first = Number(process.argv[2]);
  const started = await startEngine();
  const { engine } = started;
  waitForInput();
  const { ranges, wanted } = readList();
  if (wanted.length === 0) {
    sendProgress('shapes (web-ifc)', 1);
    sendMessage('D');
    return 0;
  }
  const model = openModel(started, makeReader(ranges));
  if (model < 0) {
    sendMessage('E', [Buffer.from('web-ifc does not know its schema')]);
    return 1;
  }
  const known = new Set();
  for (let i = first; i < wanted.length; ++i) {
    sendMessage('T', [packWords(i)]); // identifies the product if this process dies
    if (i % 64 === 0) sendProgress('shapes (web-ifc)', i / wanted.length);
    try {
      const send = (mesh) => sendProduct(engine, model, mesh, known);
      engine.StreamMeshes(model, [wanted[i]], send, true); // in metres
    } catch (error) {
      sendMessage('F', [packWords(wanted[i]), Buffer.from(describeError(error))]);
      if (isBroken(error)) return 1; // the importer starts another process for the rest
    }
  }
  sendMessage('D');
  return 0;
}

main().then(
  (code) => process.exit(code),
  (error) => {
    sendMessage('E', [Buffer.from(describeError(error))]);
    process.exit(1);
  },
);
