// Dawn by npm's webgpu: a compute shader's numbers, and the pixels of a textured, instanced draw.
import { createRequire } from 'node:module';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';

const found = createRequire(join(process.argv[2], 'x')).resolve('webgpu');
const { create, globals } = await import(pathToFileURL(found));
Object.assign(globalThis, globals);
const gpu = create(['backend=vulkan']);
const adapter = await gpu.requestAdapter();
if (!adapter) throw new Error('no adapter');
const device = await adapter.requestDevice();
device.addEventListener('uncapturederror', (event) => fail(event.error.message));

function fail(message) {
    console.log(message);
    process.exit(1);
}

async function read(buffer, size) {
    const copy = device.createBuffer({ size, usage: GPUBufferUsage.MAP_READ | GPUBufferUsage.COPY_DST });
    const encoder = device.createCommandEncoder();
    encoder.copyBufferToBuffer(buffer, 0, copy, 0, size);
    device.queue.submit([encoder.finish()]);
    await copy.mapAsync(GPUMapMode.READ);
    return copy.getMappedRange().slice(0);
}

// Each workgroup sorts 256 numbers by a bitonic network in workgroup memory.
const COUNT = 256 * 40;
const numbers = Uint32Array.from({ length: COUNT }, (_, i) => Math.imul(i + 1, 2654435761) >>> 0);
const storage = GPUBufferUsage.STORAGE | GPUBufferUsage.COPY_SRC | GPUBufferUsage.COPY_DST;
const data = device.createBuffer({ size: 4 * COUNT, usage: storage });
device.queue.writeBuffer(data, 0, numbers);
const sort = device.createComputePipeline({
    layout: 'auto',
    compute: {
        module: device.createShaderModule({
            code: `
@group(0) @binding(0) var<storage, read_write> data: array<u32>;
var<workgroup> shared_data: array<u32, 256>;
@compute @workgroup_size(256)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) lane: u32) {
    shared_data[lane] = data[id.x];
    for (var size = 2u; size <= 256u; size *= 2u) {
        for (var step = size / 2u; step > 0u; step /= 2u) {
            workgroupBarrier();
            let other = lane ^ step;
            if other > lane {
                let a = shared_data[lane];
                let b = shared_data[other];
                if (a > b) == ((lane & size) == 0u) {
                    shared_data[lane] = b;
                    shared_data[other] = a;
                }
            }
        }
    }
    workgroupBarrier();
    data[id.x] = shared_data[lane];
}`,
        }),
    },
});
let encoder = device.createCommandEncoder();
const compute = encoder.beginComputePass();
compute.setPipeline(sort);
compute.setBindGroup(
    0,
    device.createBindGroup({ layout: sort.getBindGroupLayout(0), entries: [{ binding: 0, resource: { buffer: data } }] }),
);
compute.dispatchWorkgroups(COUNT / 256);
compute.end();
device.queue.submit([encoder.finish()]);
const sorted = new Uint32Array(await read(data, 4 * COUNT));
for (let group = 0; group < COUNT; group += 256) {
    const want = numbers.slice(group, group + 256).sort();
    if (want.some((value, i) => value !== sorted[group + i])) fail(`the numbers of workgroup ${group / 256} differ`);
}

// Sixteen instances of a square, each with a texel of its own.
const SIZE = 128;
const texels = Uint8Array.from({ length: 64 }, (_, i) => (i % 4 === 3 ? 255 : (i * 37 + 11) & 255));
const texture = device.createTexture({
    size: [4, 4],
    format: 'rgba8unorm',
    usage: GPUTextureUsage.TEXTURE_BINDING | GPUTextureUsage.COPY_DST,
});
device.queue.writeTexture({ texture }, texels, { bytesPerRow: 16 }, [4, 4]);
const target = device.createTexture({
    size: [SIZE, SIZE],
    format: 'rgba8unorm',
    usage: GPUTextureUsage.RENDER_ATTACHMENT | GPUTextureUsage.COPY_SRC,
});
const module = device.createShaderModule({
    code: `
struct Out { @builtin(position) position: vec4f, @location(0) at: vec2f }
@vertex fn vs(@builtin(vertex_index) v: u32, @builtin(instance_index) i: u32) -> Out {
    let corner = vec2f(f32(v & 1u), f32(v >> 1u));
    let cell = vec2f(f32(i % 4u), f32(i / 4u));
    let place = (cell + 0.25 + 0.5 * corner) / 2.0 - 1.0;
    return Out(vec4f(place.x, -place.y, 0.0, 1.0), (cell + 0.5) / 4.0);
}
@group(0) @binding(0) var colours: texture_2d<f32>;
@group(0) @binding(1) var nearest: sampler;
@fragment fn fs(in: Out) -> @location(0) vec4f { return textureSample(colours, nearest, in.at); }`,
});
const pipeline = device.createRenderPipeline({
    layout: 'auto',
    vertex: { module },
    primitive: { topology: 'triangle-strip' },
    fragment: { module, targets: [{ format: 'rgba8unorm' }] },
});
encoder = device.createCommandEncoder();
const pass = encoder.beginRenderPass({
    colorAttachments: [{ view: target.createView(), loadOp: 'clear', storeOp: 'store', clearValue: [0, 0, 0, 0] }],
});
pass.setPipeline(pipeline);
pass.setBindGroup(
    0,
    device.createBindGroup({
        layout: pipeline.getBindGroupLayout(0),
        entries: [
            { binding: 0, resource: texture.createView() },
            { binding: 1, resource: device.createSampler() },
        ],
    }),
);
pass.draw(4, 16);
pass.end();
const picture = device.createBuffer({ size: 4 * SIZE * SIZE, usage: storage });
encoder.copyTextureToBuffer({ texture: target }, { buffer: picture, bytesPerRow: 4 * SIZE }, [SIZE, SIZE]);
device.queue.submit([encoder.finish()]);
const pixels = new Uint8Array(await read(picture, 4 * SIZE * SIZE));
let wrong = 0;
for (let y = 0; y < SIZE; y++) {
    for (let x = 0; x < SIZE; x++) {
        const inside = x % 32 >= 8 && x % 32 < 24 && y % 32 >= 8 && y % 32 < 24;
        const texel = 4 * (4 * Math.floor(y / 32) + Math.floor(x / 32));
        for (let c = 0; c < 4; c++) {
            if (pixels[4 * (y * SIZE + x) + c] !== (inside ? texels[texel + c] : 0)) {
                wrong++;
                break;
            }
        }
    }
}
if (wrong) fail(`${wrong} pixels differ`);
console.log(`${adapter.info.description || adapter.info.device}: ${COUNT} numbers and ${SIZE * SIZE} pixels are equal`);
process.exit(0);
