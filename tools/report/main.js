// Of the page as a file: what it shows is in it.

import {readBlocks} from './data.js';
import {mount} from './report.js';

const {data, meshes} = readBlocks(document);
document.title = `${data.title}: rayrep`;
const page = mount(document.getElementById('page'), data, meshes);
// For tests, and for those who look at it with a browser's tools.
window.rayrep = {page};
