// Converts ifcXML of IFC4 to a STEP physical file. The importer starts this script as a process:
//
//   node convert_ifcxml.js
//
// File descriptor 3 receives the messages, 4 is the document. The text of STEP is sent in blocks (kind
// X), each kind of problem as a message W: the number of its problems (32 bits), the kind, a line end
// and the first of them.
import fs from 'node:fs';

import { XmlError } from './ifcxml_converter.js';
import { IfcXmlDocument } from './ifcxml_document.js';
import { IFC_FILE, packWords, readBlock, sendMessage, sendProgress } from './worker_io.js';

const EXPORT_AGAIN = 'export it again, or as .ifc, the STEP form';

function main() {
  const { size } = fs.fstatSync(IFC_FILE);
  const document = new IfcXmlDocument();
  try {
    document.read(size, (...block) => readBlock(IFC_FILE, ...block),
      (fraction) => sendProgress('convert XML', fraction));
    for (const text of document.makeStep()) sendMessage('X', [], [Buffer.from(text, 'latin1')]);
  } catch (error) {
    const place = error instanceof XmlError ? `${document.line}: ` : ' ';
    sendMessage('E', [Buffer.from(`${place}${error.message}; ${EXPORT_AGAIN}`)]);
    return 1;
  }
  for (const [kind, { count, example }] of document.problems)
    sendMessage('W', [packWords(count), Buffer.from(`${kind}\n${example}`)]);
  sendMessage('D');
  return 0;
}

process.exit(main());
