/** Rows of separated text (RFC 4180), as `bakery/formats/rows.py` reads them. */

import { AvatarError } from './data.js';

const SEPARATORS = [',', ';', '\t'];
const quotes = (text) => text.split('"').length - 1;

/**
 * Number of the first line, from 1, and text of each record that is not blank.
 * @param {string} name how messages call the file
 * @param {string} text
 * @returns {[number, string][]}
 */
export function records(name, text) {
  const out = [];
  let held = [];
  let first = 0;
  let inside = false;
  text.split(/\r\n|\n|\r/).forEach((line, k) => {
    if (!held.length) {
      if (!line.trim()) return;
      first = k + 1;
    }
    held.push(line);
    if (quotes(line) % 2) inside = !inside;
    if (inside) return;
    out.push([first, held.join('\n')]);
    held = [];
  });
  if (held.length) throw new AvatarError(`${name}: row ${first}: a quote is not closed; mend or remove the row`);
  return out;
}

/** What stands between the fields of a header: the one that gives most of them. */
export function separatorOf(name, header) {
  const counts = SEPARATORS.map((one) => fieldsOf(header, one).length);
  const best = SEPARATORS[counts.indexOf(Math.max(...counts))];
  if (header.includes(best)) return best;
  const other = /timecode"?([^\w\s]|\s)/i.exec(header);
  const found = other ? `fields are separated by '${other[1]}'` : 'holds one field';
  throw new AvatarError(`${name}: row 1: ${found}; separate them by comma, semicolon or tab`);
}

/** The fields of a record, without quotes and the blanks around them. */
export function fieldsOf(record, separator) {
  const parts = record.split(separator);
  if (!record.includes('"')) return parts.map((part) => part.trim());
  const fields = [];
  let inside = false;
  for (const part of parts) {
    if (inside) fields[fields.length - 1] += separator + part;
    else fields.push(part);
    if (quotes(part) % 2) inside = !inside;
  }
  return fields.map((field) => unquoted(field.trim()));
}

const unquoted = (field) => (/^".*"$/s.test(field) && field.length > 1 ? field.slice(1, -1).replaceAll('""', '"').trim() : field);
