// Converts ifcXML of IFC4 to a STEP physical file. The importer starts this script as a process:
//
//   node convert_ifcxml.js
//
// File descriptor 3 receives the messages, 4 is the document. The text of STEP is sent in blocks (kind
// X), each kind of problem as a message W: the number of its problems (32 bits), the kind, a line end
// and the first of them.
import fs from 'node:fs';
import { createRequire } from 'node:module';

import { IfcSchema } from './ifc_schema.js';
import { IfcXmlConverter, XmlError } from './ifcxml_converter.js';
import { IFC_FILE, packWords, readBlock, sendMessage, sendProgress } from './worker_io.js';

const { SaxesParser } = createRequire(import.meta.url)('saxes');

const BLOCK = 1 << 20; // bytes that are read, and characters that are sent, at once
const EXPORT_AGAIN = 'export it again, or as .ifc, the STEP form';

// The label of the encoding: of the mark at the start, otherwise as declared, otherwise UTF-8.
function detectEncoding(start) {
  if (start[0] === 0xff && start[1] === 0xfe) return 'utf-16le';
  if (start[0] === 0xfe && start[1] === 0xff) return 'utf-16be';
  const declaration = /^[^<]*<\?xml[^>]*?\bencoding\s*=\s*["']([^"']+)/.exec(start.toString('latin1'));
  return declaration?.[1] ?? 'utf-8';
}

function makeDecoder(start) {
  const encoding = detectEncoding(start);
  try {
    return new TextDecoder(encoding, { fatal: true });
  } catch {
    throw new XmlError(`its encoding '${encoding}' is not known`);
  }
}

// The release of IFC that the root element names.
function detectRelease(tag) {
  if (tag.local === 'iso_10303_28')
    throw new XmlError('ISO 10303-28, the ifcXML of IFC2x3, is not read');
  const location = Object.values(tag.attributes).find(({ local }) => local === 'schemaLocation');
  const namespace = tag.uri || (location?.value ?? '');
  if (tag.local !== 'ifcXML' || !/(buildingsmart|ifcXML)/i.test(namespace))
    throw new XmlError(`not an ifcXML file (its root is '${tag.name}' of namespace '${tag.uri}')`);
  const release = /IFC4(?:[._]?x?_?(\d))?(?![\d])/i.exec(namespace.replace(/ifcXML4?\//gi, ''));
  if (release === null || (release[1] ?? '3') !== '3')
    throw new XmlError(`ifcXML of '${namespace}' is not read, but that of IFC4 and IFC4.3`);
  return release[1] === undefined ? 'IFC4' : 'IFC4X3';
}

class ProblemList {
  constructor() {
    this.kinds = new Map();
  }

  add(kind, line, text) {
    const known = this.kinds.get(kind);
    if (known) ++known.count;
    else this.kinds.set(kind, { count: 1, example: `line ${line}: ${text}` });
  }

  send() {
    for (const [kind, { count, example }] of this.kinds)
      sendMessage('W', [packWords(count), Buffer.from(`${kind}\n${example}`)]);
  }
}

function makeParser(problems) {
  const parser = new SaxesParser({ xmlns: true });
  const state = { parser, release: undefined, converter: undefined };
  parser.on('error', (error) => {
    throw new XmlError(`the XML is damaged: ${error.message.replace(/^\d+:\d+: /, '')}`);
  });
  parser.on('doctype', () => {
    throw new XmlError('a document type (DTD) is not allowed');
  });
  parser.on('opentag', (tag) => {
    if (state.converter === undefined) {
      state.release = detectRelease(tag);
      const report = (...problem) => problems.add(...problem);
      state.converter = new IfcXmlConverter(new IfcSchema(state.release), report);
    }
    state.converter.open(tag, parser.line);
  });
  parser.on('closetag', () => state.converter.close(parser.line));
  parser.on('text', (text) => state.converter?.addText(text));
  parser.on('cdata', (text) => state.converter?.addText(text));
  return state;
}

function parse(state) {
  const { size } = fs.fstatSync(IFC_FILE);
  const decoder = makeDecoder(Buffer.from(readBlock(IFC_FILE, 0, Math.min(size, 200))));
  for (let at = 0; at < size; at += BLOCK) {
    sendProgress('convert XML', at / size);
    const bytes = readBlock(IFC_FILE, at, Math.min(BLOCK, size - at));
    let text;
    try {
      text = decoder.decode(bytes, { stream: at + BLOCK < size });
    } catch {
      throw new XmlError(`the XML is damaged: bytes that are not ${decoder.encoding}`);
    }
    state.parser.write(text);
  }
  state.parser.close();
}

function sendStep({ release, converter }) {
  let text = "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\n" +
    "FILE_NAME('','',(''),(''),'','','');\n" + `FILE_SCHEMA(('${release}'));\nENDSEC;\nDATA;\n`;
  for (const statement of converter.finish()) {
    text += statement;
    if (text.length < BLOCK) continue;
    sendMessage('X', [], [Buffer.from(text, 'latin1')]);
    text = '';
  }
  sendMessage('X', [], [Buffer.from(`${text}ENDSEC;\nEND-ISO-10303-21;\n`, 'latin1')]);
}

function main() {
  const problems = new ProblemList();
  const state = makeParser(problems);
  try {
    parse(state);
  } catch (error) {
    const place = error instanceof XmlError ? `${state.parser.line}: ` : ' ';
    sendMessage('E', [Buffer.from(`${place}${error.message}; ${EXPORT_AGAIN}`)]);
    return 1;
  }
  sendStep(state);
  problems.send();
  sendMessage('D');
  return 0;
}

process.exit(main());
