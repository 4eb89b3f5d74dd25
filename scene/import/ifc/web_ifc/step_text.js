// Writes values of ifcXML as those of a STEP physical file (ISO 10303-21). Each function returns null
// for text that is no such value.

// Characters outside of the printable ASCII characters become \X2\ (16 bits) or \X4\ (32 bits).
function encodeOther(text) {
  return Array.from(text, (character) => {
    const code = character.codePointAt(0);
    const [form, digits] = code > 0xffff ? ['X4', 8] : ['X2', 4];
    return `\\${form}\\${code.toString(16).toUpperCase().padStart(digits, '0')}\\X0\\`;
  }).join('');
}

export function writeString(text) {
  const escaped = text.replaceAll('\\', '\\\\').replaceAll("'", "''");
  return `'${escaped.replace(/[^ -~]+/g, encodeOther)}'`;
}

function writeReal(text) {
  const [, mantissa, exponent] =
    /^([+-]?(?:\d+(?:\.\d*)?|\.\d+))(?:[eE]([+-]?\d+))?$/.exec(text) ?? [];
  if (mantissa === undefined) return null;
  const point = mantissa.includes('.') ? mantissa.replace(/^([+-]?)\./, '$10.') : `${mantissa}.`;
  return exponent === undefined ? point : `${point}E${exponent}`;
}

function writeBinary(text) {
  return /^([0-9a-fA-F]{2})*$/.test(text) ? `"0${text.toUpperCase()}"` : null;
}

const BOOLEANS = new Map([['true', '.T.'], ['1', '.T.'], ['false', '.F.'], ['0', '.F.']]);
const LOGICALS = new Map([...BOOLEANS, ['unknown', '.U.']]);

function writePrimitive(type, text) {
  switch (type.primitive) {
    case 'string':
      return writeString(text);
    case 'real':
      return writeReal(text);
    case 'integer':
      return /^[+-]?\d+$/.test(text) ? text : null;
    case 'boolean':
      return BOOLEANS.get(text) ?? null;
    case 'logical':
      return LOGICALS.get(text) ?? null;
    case 'binary':
      return writeBinary(text);
    default: {
      const word = text.toUpperCase();
      return type.words.has(word) ? `.${word}.` : null;
    }
  }
}

function writeWords(type, text) {
  const values = text.split(/[ \t\r\n]+/).filter((word) => word !== '');
  const written = values.map((word) => writePrimitive(type, word));
  return written.includes(null) ? null : written;
}

// A value of a simple type; `depth` 1: a list of them, separated by spaces; 2: a list of lists of
// `width` each.
export function writeSimple(type, depth, text, width) {
  if (depth + (type.list ? 1 : 0) === 0)
    return writePrimitive(type, type.primitive === 'string' ? text : text.trim());
  const values = writeWords(type, text);
  if (values === null || depth < 2) return values && `(${values})`;
  if (width === undefined || values.length % width !== 0) return null;
  const rows = [];
  for (let i = 0; i < values.length; i += width) rows.push(`(${values.slice(i, i + width)})`);
  return `(${rows})`;
}

// Splits at the commas outside of any bracket and string.
export function splitArguments(text) {
  const parts = [];
  let start = 0;
  let depth = 0;
  for (let i = 0; i < text.length; ++i) {
    const c = text[i];
    if (c === "'") {
      const end = text.indexOf("'", i + 1); // a doubled quote begins the next string
      i = end < 0 ? text.length : end;
    } else if (c === '(' || c === '[' || c === '{') ++depth;
    else if (c === ')' || c === ']' || c === '}') --depth;
    else if (c === ',' && depth === 0) {
      parts.push(text.slice(start, i));
      start = i + 1;
    }
  }
  parts.push(text.slice(start));
  return parts;
}

// Removes references for which `isMissing` holds: from lists, otherwise `$` takes their place.
export function removeReferences(text, isMissing) {
  if (text.startsWith('(')) {
    const items = splitArguments(text.slice(1, -1)).map((item) => removeReferences(item, isMissing));
    return `(${items.filter((item) => item !== '$')})`;
  }
  const reference = /^#(\d+)$/.exec(text);
  return reference && isMissing(Number(reference[1])) ? '$' : text;
}
