// Messages from these scripts to the importer, and the files that it passes to them. A message is a
// kind (one byte), a length (64 bits) and that many bytes, all little-endian.
import fs from 'node:fs';

const ANSWER = 3;
export const IFC_FILE = 4;
export const WANTED = 5;
const READY = 6;

// Sends small parts in one piece, and large blocks after them without copying them.
export function sendMessage(kind, parts = [], blocks = []) {
  const header = Buffer.alloc(9);
  const size = [...parts, ...blocks].reduce((sum, part) => sum + part.length, 0);
  header.write(kind, 0, 'latin1');
  header.writeBigUInt64LE(BigInt(size), 1);
  for (const block of [Buffer.concat([header, ...parts]), ...blocks]) {
    for (let sent = 0; sent < block.length; ) sent += fs.writeSync(ANSWER, block, sent);
  }
}

export function packDoubles(...values) {
  return Buffer.from(Float64Array.from(values).buffer);
}

export function packWords(...values) {
  return Buffer.from(Uint32Array.from(values).buffer);
}

export function sendProgress(stage, fraction) {
  sendMessage('P', [packDoubles(fraction), Buffer.from(stage)]);
}

// Fills `bytes` from `position` of the file on.
export function readInto(descriptor, bytes, position) {
  for (let done = 0; done < bytes.length; ) {
    const count = fs.readSync(descriptor, bytes, done, bytes.length - done, position + done);
    if (count === 0) throw new Error('the file became shorter while it was read');
    done += count;
  }
  return bytes;
}

export function readBlock(descriptor, position, size) {
  return readInto(descriptor, new Uint8Array(size), position);
}

export function readAll(descriptor) {
  return readBlock(descriptor, 0, fs.fstatSync(descriptor).size);
}

// Waits until the importer has written the files; nothing is ever written to this pipe.
export function waitForInput() {
  fs.readSync(READY, Buffer.alloc(1));
}
