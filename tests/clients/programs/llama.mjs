// Runs a small language model with random weights by llama.cpp on Vulkan and on the processor: llama.mjs MODULES OUT.
// It compares the probabilities of the next token.
import { writeFile } from 'node:fs/promises';
import path from 'node:path';

const [modules, out] = process.argv.slice(2);
const { getLlama, LlamaLogLevel } = await import(path.join(modules, 'node-llama-cpp/dist/index.js'));

const TOKENS = 320;
const WIDTH = 256;
const HEADS = 4;
const INNER = 512;
const LAYERS = 3;

// Numbers of a normal distribution that are the same in every run.
let state = 1;
const uniform = () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return (state + 0.5) / 2 ** 32;
};
const normal = () => Math.sqrt(-2 * Math.log(uniform())) * Math.cos(2 * Math.PI * uniform());

// The types of values in a GGUF file.
const UINT32 = 4;
const INT32 = 5;
const FLOAT32 = 6;
const STRING = 8;
const ARRAY = 9;

// A model in the format GGUF, version 3: values by names, the shapes of tensors, and their 32-bit floats.
function model() {
    const parts = [];
    const number = (size, write) => (value) => {
        const buffer = Buffer.alloc(size);
        buffer[write](value);
        parts.push(buffer);
    };
    const [u32, i32, f32] = [number(4, 'writeUInt32LE'), number(4, 'writeInt32LE'), number(4, 'writeFloatLE')];
    const u64 = (value) => number(8, 'writeBigUInt64LE')(BigInt(value));
    const string = (text) => {
        u64(Buffer.byteLength(text));
        parts.push(Buffer.from(text));
    };
    const write = { [UINT32]: u32, [INT32]: i32, [FLOAT32]: f32, [STRING]: string };
    // The first three tokens have no text, the next 256 are bytes, and the others letters and pairs of them.
    const pairs = [...Array(TOKENS - 259).keys()].map((i) => String.fromCharCode(97 + (i % 26)) + (i < 26 ? '' : String.fromCharCode(97 + Math.floor(i / 26))));
    const bytes = [...Array(256).keys()].map((i) => `<0x${i.toString(16).toUpperCase().padStart(2, '0')}>`);
    const values = [
        ['general.architecture', STRING, 'llama'], ['llama.context_length', UINT32, 128], ['llama.embedding_length', UINT32, WIDTH],
        ['llama.block_count', UINT32, LAYERS], ['llama.feed_forward_length', UINT32, INNER],
        ['llama.attention.head_count', UINT32, HEADS], ['llama.attention.head_count_kv', UINT32, HEADS],
        ['llama.attention.layer_norm_rms_epsilon', FLOAT32, 1e-5], ['llama.rope.dimension_count', UINT32, WIDTH / HEADS],
        ['llama.vocab_size', UINT32, TOKENS], ['tokenizer.ggml.model', STRING, 'llama'],
        ['tokenizer.ggml.tokens', STRING, ['<unk>', '<s>', '</s>', ...bytes, ...pairs]],
        ['tokenizer.ggml.scores', FLOAT32, [...Array(TOKENS).keys()].map((i) => -i)],
        ['tokenizer.ggml.token_type', INT32, [2, 3, 3, ...Array(256).fill(6), ...Array(TOKENS - 259).fill(1)]],
        ['tokenizer.ggml.bos_token_id', UINT32, 1], ['tokenizer.ggml.eos_token_id', UINT32, 2],
    ];
    const layer = (i) => [
        [`blk.${i}.attn_norm.weight`, [WIDTH]], [`blk.${i}.ffn_norm.weight`, [WIDTH]],
        ...['q', 'k', 'v', 'output'].map((name) => [`blk.${i}.attn_${name}.weight`, [WIDTH, WIDTH]]),
        [`blk.${i}.ffn_gate.weight`, [WIDTH, INNER]], [`blk.${i}.ffn_up.weight`, [WIDTH, INNER]],
        [`blk.${i}.ffn_down.weight`, [INNER, WIDTH]],
    ];
    const tensors = [
        ['token_embd.weight', [WIDTH, TOKENS]], ['output_norm.weight', [WIDTH]], ['output.weight', [WIDTH, TOKENS]],
        ...[...Array(LAYERS).keys()].flatMap(layer),
    ];
    parts.push(Buffer.from('GGUF'));
    u32(3);
    u64(tensors.length);
    u64(values.length);
    for (const [name, type, value] of values) {
        string(name);
        if (Array.isArray(value)) {
            u32(ARRAY);
            u32(type);
            u64(value.length);
            value.forEach(write[type]);
        } else {
            u32(type);
            write[type](value);
        }
    }
    let offset = 0;
    const count = (shape) => shape.reduce((product, side) => product * side, 1);
    for (const [name, shape] of tensors) {
        string(name);
        u32(shape.length);
        shape.forEach(u64);
        u32(0);
        u64(offset);
        offset += 4 * count(shape);
    }
    const head = parts.reduce((sum, part) => sum + part.length, 0);
    parts.push(Buffer.alloc((32 - (head % 32)) % 32));
    for (const [, shape] of tensors) {
        const weights = Float32Array.from({ length: count(shape) }, () => (shape.length === 1 ? 1 + normal() / 10 : normal() / Math.sqrt(shape[0])));
        parts.push(Buffer.from(weights.buffer));
    }
    return Buffer.concat(parts);
}

// The probabilities of the token after each of a text's.
async function probabilities(gpu, file) {
    const llama = await getLlama({ gpu, build: 'never', logLevel: LlamaLogLevel.error, vramPadding: 0 });
    if ((llama.gpu || false) !== gpu) throw new Error(`llama.cpp runs on ${llama.gpu}`);
    const names = gpu ? await llama.getGpuDeviceNames() : [];
    const loaded = await llama.loadModel({ modelPath: file, gpuLayers: gpu ? LAYERS + 1 : 0 });
    const context = await loaded.createContext({ contextSize: 128 });
    const sequence = context.getSequence();
    const text = [1, ...[...Array(30).keys()].map((i) => 259 + ((7 * i) % (TOKENS - 259)))];
    const results = await sequence.controlledEvaluate(text.map((token) => [token, { generateNext: { probabilities: true } }]));
    const found = results.map(({ next }) => new Map(next.probabilities));
    await llama.dispose();
    return { names, found };
}

const file = path.join(out, 'random.gguf');
await writeFile(file, model());
const drawn = await probabilities('vulkan', file);
const expected = await probabilities(false, file);
let [apart, peak] = [0, 0];
expected.found.forEach((all, i) => all.forEach((probability, token) => {
    apart = Math.max(apart, Math.abs(probability - (drawn.found[i].get(token) ?? 0)));
    peak = Math.max(peak, probability);
}));
if (process.env.DEVICE && !drawn.names.some((name) => name.includes(process.env.DEVICE))) {
    console.log(`llama.cpp runs on ${drawn.names}`);
    process.exit(1);
}
console.log(`the probabilities of ${TOKENS} tokens after ${expected.found.length} within ${apart.toExponential(1)}, of up to ${peak.toFixed(2)}`);
process.exit(apart <= 1e-3 && peak > 0.02 ? 0 : 1);
