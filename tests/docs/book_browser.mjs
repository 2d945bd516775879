// book_browser.mjs BOOK PLAYWRIGHT CHROMIUM: the book opened from the disk. Nothing is asked of any host, no script
// fails, formulas are drawn, the search finds, and no page is wider than a phone.
import { readdirSync } from 'node:fs';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';

const [book, playwright, executablePath] = process.argv.slice(2);
const { chromium } = await import(pathToFileURL(join(playwright, 'index.mjs')));
const pages = readdirSync(book, { recursive: true }).filter((name) => name.endsWith('.html'));
const problems = [];
const leastClasses = 300; // in the reference of the headers; some 400 are there
let classes = 0;
const browser = await chromium.launch({ executablePath, args: ['--no-sandbox'] });
const page = await browser.newPage({ viewport: { width: 390, height: 844 } });
let at = '';
page.on('request', (request) => {
  if (!/^(file|data|blob):/.test(request.url())) problems.push(`${at}: asks for ${request.url()}`);
});
page.on('requestfailed', (request) => problems.push(`${at}: ${request.url()} is not there`));
page.on('pageerror', (error) => problems.push(`${at}: ${error.message}`));
page.on('console', (message) => {
  if (message.type() === 'error') problems.push(`${at}: ${message.text()}`);
});
const open = async (name) => {
  at = name;
  await page.goto(`${pathToFileURL(book)}/${name}`);
};

for (const name of pages) {
  await open(name);
  const formulas = await page.evaluate(() => document.querySelectorAll('span.math, div.math').length);
  if (formulas > 0) {
    await page
      .waitForFunction((count) => document.querySelectorAll('.MathJax_SVG svg').length >= count, formulas, { timeout: 60000 })
      .catch(() => problems.push(`${name}: not all of ${formulas} formulas were drawn`));
  }
  const wrong = await page.evaluate(() => ({
    width: document.documentElement.scrollWidth,
    unread: document.querySelectorAll('.MathJax_Error, .noError, .MathJax_SVG [data-mjx-error], .merror').length,
  }));
  classes += await page.evaluate(
    () => [...document.querySelectorAll('dt.sig-object')].filter((entry) => /^\s*(template.*>\s*)?(struct|class)\s/.test(entry.innerText)).length,
  );
  if (wrong.width > 390) problems.push(`${name}: ${wrong.width} wide on a phone of 390`);
  if (wrong.unread > 0) problems.push(`${name}: ${wrong.unread} formulas that MathJax does not read`);
}

await open('index.html');
await page.setViewportSize({ width: 1280, height: 900 });
await page.locator('input.sidebar-search').fill('Kalman');
await page.locator('input.sidebar-search').press('Enter');
at = 'search';
await page
  .waitForFunction(() => document.querySelectorAll('#search-results li a').length >= 2, null, { timeout: 30000 })
  .catch(() => problems.push('the search for Kalman finds fewer than two pages'));
await browser.close();
if (classes < leastClasses) problems.push(`${classes} classes in the reference, must be ${leastClasses} at least`);
if (pages.length < 30) problems.push(`${pages.length} pages, must be 30 at least`);
console.log(problems.join('\n') || `${pages.length} pages, ${classes} classes`);
process.exit(problems.length > 0 ? 1 : 0);
