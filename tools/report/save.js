import {html} from './panels.js';

/** Gives the reader a file that the page has made. */
export function save(text, name) {
  const link = html('a', {href: URL.createObjectURL(new Blob([text], {type: 'application/json'})), download: name});
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}
