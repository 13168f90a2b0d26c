// What the page is depends on what is in it: the report of a run, or the studio.

import {readBlocks} from './data.js';
import {mount} from './report.js';
import {mountStudio} from './studio.js';

const root = document.getElementById('page');
const begin = document.getElementById('rayrep-studio');
// For tests, and for those who look at it with a browser's tools.
window.rayrep = begin ? {studio: mountStudio(root, JSON.parse(begin.textContent))} : {page: report()};

function report() {
  const {data, meshes} = readBlocks(document);
  document.title = `${data.title}: rayrep`;
  return mount(root, data, meshes);
}
