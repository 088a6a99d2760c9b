// Runs pages in Chromium, whose ANGLE draws WebGL 2 by Vulkan: chromium.mjs MODULES OUT. Pictures are compared with those of the SwiftShader
// that Chromium brings, and a page whose layers are put together by Vulkan with one that the processor puts together.
import { createServer } from 'node:http';
import { readFile, writeFile } from 'node:fs/promises';
import { createRequire } from 'node:module';
import path from 'node:path';

const [modules, out] = process.argv.slice(2);
const here = path.dirname(new URL(import.meta.url).pathname);
const { chromium } = createRequire(path.join(modules, 'index.js'))('playwright-core');

const PAGE = `<!doctype html><canvas id="canvas" width="640" height="480"></canvas><script type="importmap">{"imports": {
    "three": "/modules/three/build/three.module.js",
    "three/addons/": "/modules/three/examples/jsm/",
    "@sparkjsdev/spark": "/modules/@sparkjsdev/spark/dist/spark.module.js"}}</script>`;

const server = createServer(async (request, response) => {
    const { pathname } = new URL(request.url, 'http://localhost');
    const file = pathname.startsWith('/modules/')
        ? path.join(modules, path.normalize(pathname.slice('/modules'.length)))
        : path.join(here, 'chromium', path.basename(pathname));
    // The browser asks for an icon, too, which there is not.
    const text = pathname === '/' ? PAGE : await readFile(file).catch(() => null);
    const type = pathname === '/' || file.endsWith('.html') ? 'text/html' : file.endsWith('.wasm') ? 'application/wasm' : 'text/javascript';
    response.writeHead(text === null ? 204 : 200, { 'Content-Type': type }).end(text ?? '');
});
await new Promise((listening) => server.listen(0, '127.0.0.1', listening));
const address = `http://127.0.0.1:${server.address().port}/`;

// Runs the checks and draws the pictures with one of ANGLE's devices. SwiftShader is found without the loader's variables alone.
async function run(angle) {
    const { VK_DRIVER_FILES, VK_ICD_FILENAMES, ...env } = process.env;
    const browser = await chromium.launch({
        env: angle === 'vulkan' ? process.env : env,
        executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
        args: ['--no-sandbox', '--use-gl=angle', `--use-angle=${angle}`, '--ignore-gpu-blocklist', '--enable-unsafe-swiftshader'],
    });
    const page = await browser.newPage();
    page.on('console', (message) => console.error(`${angle}: ${message.text()}`));
    page.on('pageerror', (error) => console.error(`${angle}: ${error}`));
    const fresh = async () => {
        await page.goto(address);
        page.setDefaultTimeout(120000);
    };
    await fresh();
    const device = await page.evaluate(() => {
        const gl = document.createElement('canvas').getContext('webgl2');
        return gl && gl.getParameter(gl.getExtension('WEBGL_debug_renderer_info').UNMASKED_RENDERER_WEBGL);
    });
    const failures = await page.evaluate(async () => {
        const { checks } = await import('/webgl.js');
        return Object.entries(checks).map(([name, check]) => [name, check()]).filter(([, found]) => found);
    });
    const pictures = {};
    for (const name of ['three', 'spark']) {
        await fresh();
        const picture = await page.evaluate(async (name) => {
            const canvas = document.getElementById('canvas');
            await (await import(`/${name}.js`)).draw(canvas);
            const copy = document.createElement('canvas');
            [copy.width, copy.height] = [canvas.width, canvas.height];
            const context = copy.getContext('2d', { willReadFrequently: true });
            context.drawImage(canvas, 0, 0);
            const { data } = context.getImageData(0, 0, copy.width, copy.height);
            return { png: copy.toDataURL(), pixels: Array.from(data) };
        }, name);
        await writeFile(path.join(out, `${name}-${angle}.png`), Buffer.from(picture.png.split(',')[1], 'base64'));
        pictures[name] = picture.pixels;
    }
    await browser.close();
    return { device, failures, pictures };
}

// A page as a browser shows it that composites with `args`, and what it says of its compositor.
async function composited(name, env, args) {
    const browser = await chromium.launch({
        env,
        executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
        args: ['--no-sandbox', ...args],
    });
    const page = await browser.newPage({ viewport: { width: 640, height: 480 } });
    await page.goto(`${address}page.html`);
    const file = await page.screenshot({ path: path.join(out, `page-${name}.png`) });
    const pixels = await page.evaluate(async (text) => {
        const picture = new Image();
        picture.src = `data:image/png;base64,${text}`;
        await picture.decode();
        const context = new OffscreenCanvas(640, 480).getContext('2d', { willReadFrequently: true });
        context.drawImage(picture, 0, 0);
        return Array.from(context.getImageData(0, 0, 640, 480).data);
    }, file.toString('base64'));
    await page.goto('chrome://gpu');
    const status = await page.evaluate(async () => {
        // The text is in shadow trees, and comes after a while.
        const texts = (node) => (node.nodeType === Node.TEXT_NODE
            ? [node.textContent.trim()]
            : [node.shadowRoot, ...node.childNodes].filter((child) => child).flatMap(texts));
        for (let wait = 0; wait < 100; wait += 1) {
            const text = texts(document.body).filter((line) => line).join('\n');
            if (text.includes('Compositing:')) return text;
            await new Promise((done) => setTimeout(done, 100));
        }
        return '';
    });
    await browser.close();
    return { pixels, status };
}

function fail(reason) {
    console.log(reason);
    process.exit(1);
}

const drawn = await run('vulkan');
if (!drawn.device) fail('there is no WebGL 2');
if (process.env.DEVICE && !drawn.device.includes(process.env.DEVICE)) fail(`WebGL is drawn by ${drawn.device}`);
if (drawn.failures.length) fail(drawn.failures.map(([name, found]) => `${name}: ${found}`).join('; '));
const reference = await run('swiftshader');
if (!reference.device.includes('SwiftShader')) fail(`the other pictures are by ${reference.device}`);
const byVulkan = ['--use-gl=angle', '--use-angle=vulkan', '--enable-features=Vulkan', '--ignore-gpu-blocklist'];
const shown = await composited('vulkan', process.env, byVulkan);
for (const found of ['Vulkan:\nEnabled', 'Compositing:\nHardware accelerated', 'Rasterization:\nHardware accelerated']) {
    if (!shown.status.includes(found)) fail(`the compositor does not say ${found.replace('\n', ' ')}`);
}
drawn.pictures.page = shown.pixels;
reference.pictures.page = (await composited('software', process.env, ['--disable-gpu'])).pixels;
const texts = [];
for (const [name, pixels] of Object.entries(drawn.pictures)) {
    const differences = pixels.map((value, i) => Math.abs(value - reference.pictures[name][i]));
    const mean = differences.reduce((sum, difference) => sum + difference, 0) / differences.length;
    const far = differences.filter((difference) => difference > 8).length / differences.length;
    const colors = new Set(pixels.filter((_, i) => i % 4 === 0)).size;
    texts.push(`${name} ${mean.toFixed(3)} of 255 on average, ${(100 * far).toFixed(2)} % above 8`);
    if (colors < 50 || mean > 1 || far > 0.01) fail(`${name} differs from SwiftShader's: ${texts.at(-1)}, ${colors} shades`);
}
server.close();
console.log(`five checks of WebGL 2 equal; pictures differ from SwiftShader's and the processor's by: ${texts.join('; ')}`);
