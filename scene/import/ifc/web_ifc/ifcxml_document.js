// Reads an ifcXML document of IFC4 or IFC4.3 and writes it as a STEP physical file.
import { createRequire } from 'node:module';

import { IfcSchema } from './ifc_schema.js';
import { IfcXmlConverter, XmlError } from './ifcxml_converter.js';

const { SaxesParser } = createRequire(import.meta.url)('saxes');

const BLOCK = 1 << 20; // bytes that are read, and characters that are written, at once

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

export class IfcXmlDocument {
  constructor(makeSchema = (release) => new IfcSchema(release)) {
    this.makeSchema = makeSchema;
    this.problems = new Map(); // by kind: {count, example}
    this.parser = this.makeParser();
  }

  // Throws XmlError, at `line`. `readBlock(position, size)` returns bytes of the document.
  read(size, readBlock, progress = () => {}) {
    const decoder = makeDecoder(Buffer.from(readBlock(0, Math.min(size, 200))));
    for (let at = 0; at < size; at += BLOCK) {
      progress(at / size);
      const bytes = readBlock(at, Math.min(BLOCK, size - at));
      let text;
      try {
        text = decoder.decode(bytes, { stream: at + BLOCK < size });
      } catch {
        throw new XmlError(`the XML is damaged: bytes that are not ${decoder.encoding}`);
      }
      this.parser.write(text);
    }
    this.parser.close();
  }

  get line() {
    return this.parser.line;
  }

  // The blocks of the STEP file, after read().
  *makeStep() {
    let text = "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\n" +
      `FILE_NAME('','',(''),(''),'','','');\nFILE_SCHEMA(('${this.release}'));\nENDSEC;\nDATA;\n`;
    for (const statement of this.converter.finish()) {
      text += statement;
      if (text.length < BLOCK) continue;
      yield text;
      text = '';
    }
    yield `${text}ENDSEC;\nEND-ISO-10303-21;\n`;
  }

  report(kind, line, text) {
    const known = this.problems.get(kind);
    if (known) ++known.count;
    else this.problems.set(kind, { count: 1, example: `line ${line}: ${text}` });
  }

  makeParser() {
    const parser = new SaxesParser({ xmlns: true });
    parser.on('error', (error) => {
      throw new XmlError(`the XML is damaged: ${error.message.replace(/^\d+:\d+: /, '')}`);
    });
    parser.on('doctype', () => {
      throw new XmlError('a document type (DTD) is not allowed');
    });
    parser.on('opentag', (tag) => {
      if (this.converter === undefined) {
        this.release = detectRelease(tag);
        const report = (...problem) => this.report(...problem);
        this.converter = new IfcXmlConverter(this.makeSchema(this.release), report);
      }
      this.converter.open(tag, parser.line);
    });
    parser.on('closetag', () => this.converter.close(parser.line));
    parser.on('text', (text) => this.converter?.addText(text));
    parser.on('cdata', (text) => this.converter?.addText(text));
    return parser;
  }
}
