// Runs WebGL conformance tests in Chromium: webgl.mjs MODULES EXPECTED [PATTERN...] [OPTIONS]; webgl.sh says what the options mean.
import { appendFile, readFile } from 'node:fs/promises';
import { createReadStream, existsSync, readFileSync, statSync } from 'node:fs';
import { createServer } from 'node:http';
import { createRequire } from 'node:module';
import path from 'node:path';
import { parseArgs } from 'node:util';

const root = process.env.GAURAST_WEBGL;
const [modules, expectedFile, ...rest] = process.argv.slice(2);
const { values: options, positionals: patterns } = parseArgs({
    args: rest,
    allowPositionals: true,
    options: {
        angle: { type: 'string', default: 'vulkan' },
        cases: { type: 'string' },
        seed: { type: 'string', default: '1' },
        jobs: { type: 'string', default: '1' },
        results: { type: 'string' },
        list: { type: 'boolean' },
    },
});
const { chromium } = createRequire(path.join(modules, 'index.js'))('playwright-core');

const VERSION = '2.0.1';
// A test that takes longer is stopped.
const LIMIT_MILLISECONDS = 300_000;
// Tests that a browser has run before a fresh one is started, so that memory of old pages is given back.
const TESTS_A_BROWSER = 100;

const number = (version) => version.split('.').reduce((sum, part) => sum * 1000 + Number(part), 0);

// The tests of a list and of the lists that it names, as the suite's own page reads them.
function listed(file, inherited) {
    return readFileSync(path.join(root, file), 'utf8').split('\n').flatMap((line) => {
        const words = line.trim().split(/\s+/);
        if (words[0] === '' || /^(#|;|\/\/)/.test(words[0])) return [];
        const found = { ...inherited };
        while (words[0].startsWith('--')) {
            const option = words.shift();
            if (option === '--min-version') found.min = words.shift();
            if (option === '--max-version') found.max = words.shift();
        }
        const name = path.join(path.dirname(file), words.join(' '));
        if (name.endsWith('.txt')) return listed(name, found);
        const old = found.min && number(found.min) > number(VERSION);
        return old || (found.max && number(found.max) < number(VERSION)) ? [] : [name];
    });
}

// Numbers below `bound` that a seed determines.
function random(seed) {
    let state = seed >>> 0;
    return (bound) => {
        state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
        return Math.floor((state / 2 ** 32) * bound);
    };
}

let tests = listed('00_test_list.txt', {}).filter((name) => !patterns.length || patterns.some((pattern) => name.includes(pattern)));
if (options.cases) {
    const below = random(Number(options.seed));
    for (let i = tests.length - 1; i > 0; i -= 1) {
        const other = below(i + 1);
        [tests[i], tests[other]] = [tests[other], tests[i]];
    }
    tests = tests.slice(0, Number(options.cases));
}
if (options.list) {
    // An end of the process would cut what a pipe has not taken yet.
    await new Promise((written) => process.stdout.write(`${tests.join('\n')}\n`, written));
    process.exit(0);
}

const TYPES = {
    html: 'text/html', js: 'text/javascript', css: 'text/css', png: 'image/png', jpg: 'image/jpeg', svg: 'image/svg+xml', mp4: 'video/mp4',
    webm: 'video/webm', json: 'application/json', wasm: 'application/wasm',
};

// A server of the suite's files; videos are asked for by ranges.
const server = createServer((request, response) => {
    const file = path.join(root, path.normalize(decodeURIComponent(new URL(request.url, 'http://localhost').pathname)));
    if (!existsSync(file) || !statSync(file).isFile()) {
        response.writeHead(404).end();
        return;
    }
    const { size } = statSync(file);
    const headers = { 'Content-Type': TYPES[path.extname(file).slice(1)] ?? 'text/plain', 'Accept-Ranges': 'bytes' };
    const range = /^bytes=(\d+)-(\d*)$/.exec(request.headers.range ?? '');
    if (!range) {
        response.writeHead(200, { ...headers, 'Content-Length': size });
        createReadStream(file).pipe(response);
        return;
    }
    const [start, end] = [Number(range[1]), Math.min(range[2] ? Number(range[2]) : size - 1, size - 1)];
    response.writeHead(206, { ...headers, 'Content-Length': end - start + 1, 'Content-Range': `bytes ${start}-${end}/${size}` });
    createReadStream(file, { start, end }).pipe(response);
});
await new Promise((listening) => server.listen(0, '127.0.0.1', listening));
const address = `http://127.0.0.1:${server.address().port}/`;

// What a page of the suite calls: it reports each check, and that it has ended.
function harness() {
    const state = { passed: 0, failed: 0, first: '', finished: false };
    window.webglTestHarness = {
        state,
        reportResults: (_url, success, message, skipped) => {
            if (success || skipped) {
                state.passed += success ? 1 : 0;
            } else {
                state.failed += 1;
                state.first ||= String(message);
            }
        },
        notifyFinished: () => {
            state.finished = true;
        },
    };
    window.addEventListener('error', (event) => {
        if (event.message) window.webglTestHarness.reportResults('', false, event.message);
    });
}

// SwiftShader is found without the loader's variables alone.
function environment() {
    const { VK_DRIVER_FILES, VK_ICD_FILENAMES, ...others } = process.env;
    return options.angle === 'vulkan' ? process.env : others;
}

function launch() {
    return chromium.launch({
        env: environment(),
        executablePath: process.env.CHROMIUM,
        args: [
            '--no-sandbox', '--use-gl=angle', `--use-angle=${options.angle}`, '--ignore-gpu-blocklist', '--enable-unsafe-swiftshader',
            '--autoplay-policy=no-user-gesture-required', '--disable-domain-blocking-for-3d-apis', '--disable-gpu-process-crash-limit',
            '--force-device-scale-factor=1', '--force-color-profile=srgb', '--js-flags=--expose-gc', '--test-type=gpu',
        ],
    });
}

async function open(browser) {
    const page = await browser.newPage({ viewport: { width: 1024, height: 768 } });
    await page.addInitScript(harness);
    return page;
}

// Runs one test in a page, which is of no more use if the test crashes or does not end.
async function run(page, name) {
    const start = Date.now();
    const result = { outcome: 'crash', passed: 0, failed: 0, first: '' };
    try {
        const query = name.startsWith('conformance/') ? '?webglVersion=2&quiet=0&quick=1' : '?quiet=0&quick=1';
        const ended = page.waitForFunction(() => window.webglTestHarness?.state.finished, null, { timeout: LIMIT_MILLISECONDS, polling: 50 });
        // Only one of the two is waited for.
        ended.catch(() => {});
        const crashed = new Promise((_, reject) => page.once('crash', () => reject(new Error('the page crashed'))));
        crashed.catch(() => {});
        await Promise.race([page.goto(address + name + query, { timeout: LIMIT_MILLISECONDS }).then(() => ended), crashed]);
        Object.assign(result, await page.evaluate(() => window.webglTestHarness.state));
        result.outcome = result.failed ? 'fail' : 'pass';
    } catch (error) {
        result.first ||= error.message;
        if (/Timeout/.test(error.message)) result.outcome = 'time-out';
    }
    return { name, seconds: (Date.now() - start) / 1000, ...result };
}

const lines = options.results && existsSync(options.results) ? (await readFile(options.results, 'utf8')).trim().split('\n') : [];
const results = new Map(lines.filter((line) => line).map((line) => {
    const [name, outcome, seconds, passed, failed, first] = line.split('\t');
    return [name, { name, outcome, seconds: Number(seconds), passed: Number(passed), failed: Number(failed), first }];
}));
const left = tests.filter((name) => !results.has(name));

async function work() {
    while (left.length) {
        const browser = await launch();
        const page = await open(browser);
        let sound = true;
        for (let i = 0; i < TESTS_A_BROWSER && left.length && sound; i += 1) {
            const result = await run(page, left.shift());
            sound = ['pass', 'fail'].includes(result.outcome) && browser.isConnected();
            const first = result.first.replace(/\s+/g, ' ').slice(0, 300);
            results.set(result.name, { ...result, first });
            if (options.results) {
                const { name, outcome, seconds, passed, failed } = result;
                await appendFile(options.results, `${[name, outcome, seconds.toFixed(1), passed, failed, first].join('\t')}\n`);
            }
        }
        await Promise.race([browser.close().catch(() => {}), new Promise((later) => setTimeout(later, 10_000))]);
    }
}
// Playwright closes the browsers when the process exits.
process.once('SIGTERM', () => process.exit(143));
await Promise.all(Array.from({ length: Number(options.jobs) }, work));
server.close();

const asked = tests.map((name) => results.get(name));
const counts = {};
for (const { outcome } of asked) counts[outcome] = (counts[outcome] ?? 0) + 1;
const seconds = asked.reduce((sum, result) => sum + result.seconds, 0);
console.log(`${asked.length} tests in ${seconds.toFixed(0)} s: ${Object.entries(counts).map(([outcome, count]) => `${count} ${outcome}`).join(', ')}`);
const expected = new Set(readFileSync(expectedFile, 'utf8').split('\n').map((line) => line.replace(/#.*/, '').trim()));
const wrong = asked.filter(({ outcome }) => outcome !== 'pass');
for (const { name, outcome, first } of wrong) console.log(`${outcome} ${name}: ${first}${expected.has(name) ? ' (expected)' : ''}`);
process.exitCode = wrong.some(({ name }) => !expected.has(name)) ? 1 : 0;
