// What the page is depends on what is in it: the report of a run, that of a scene, or the studio.

import {readBlocks} from './data.js';
import {mount} from './report.js';
import {ScenePage} from './scene.js';
import {mountScene} from './scene_edit.js';
import {mountStudio} from './studio.js';

const root = document.getElementById('page');
const begin = document.getElementById('rayrep-studio');
// For tests, and for those who look at it with a browser's tools.
window.rayrep = begin ? {studio: studio(JSON.parse(begin.textContent))} : {page: report()};

function studio(data) {
  return data.scene ? mountScene(root, data) : mountStudio(root, data);
}

function report() {
  const {data, meshes} = readBlocks(document);
  document.title = `${data.title}: rayrep`;
  return data.scene ? new ScenePage(root, data, meshes) : mount(root, data, meshes);
}
