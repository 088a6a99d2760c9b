// Runs three.js' WebGPURenderer without a browser, by Dawn: three_dawn.mjs MODULES. A sphere's diffuse shading is held against its
// formula, textured instances against their colours, and a compute shader of three.js' shading language against the processor.
import { createRequire } from 'node:module';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';

const found = createRequire(join(process.argv[2], 'x'));
const load = (name) => import(pathToFileURL(found.resolve(name)));
const { create, globals } = await load('webgpu');
Object.assign(globalThis, globals);
Object.defineProperty(globalThis, 'navigator', { value: { gpu: create(['backend=vulkan']), userAgent: 'node' }, configurable: true });
// What three.js asks of a browser; it draws to no canvas here.
const SIZE = 256;
const canvas = {
    width: SIZE, height: SIZE, style: {}, addEventListener() {}, removeEventListener() {},
    getContext: () => ({ configure() {}, unconfigure() {} }),
};
Object.assign(globalThis, {
    self: globalThis, window: globalThis, document: { createElementNS: () => canvas },
    requestAnimationFrame: (draw) => setTimeout(() => draw(performance.now()), 16), cancelAnimationFrame: clearTimeout,
});
const THREE = await load('three/webgpu');
const { Fn, instanceIndex, instancedArray, float, sin } = await load('three/tsl');

function check(holds, sentence) {
    if (holds) return;
    console.log(sentence);
    process.exit(1);
}

const renderer = new THREE.WebGPURenderer({ canvas });
await renderer.init();
const camera = new THREE.OrthographicCamera(-1, 1, 1, -1, 0.1, 10);
camera.position.z = 4;
async function pixels(scene) {
    const target = new THREE.RenderTarget(SIZE, SIZE);
    renderer.setRenderTarget(target);
    renderer.render(scene, camera);
    return renderer.readRenderTargetPixelsAsync(target, 0, 0, SIZE, SIZE);
}
// The centre of a pixel; rows go down.
const centre = (i) => [((i % SIZE) + 0.5) * 2 / SIZE - 1, 1 - (Math.floor(i / SIZE) + 0.5) * 2 / SIZE];

const sphere = new THREE.Scene();
const color = new THREE.Color(0.9, 0.5, 0.2);
sphere.add(new THREE.Mesh(new THREE.SphereGeometry(0.8, 256, 128), new THREE.MeshLambertMaterial({ color })));
const light = new THREE.DirectionalLight(0xffffff, 3);
light.position.set(2, 3, 6);
sphere.add(light);
const shaded = await pixels(sphere);
const toLight = light.position.clone().normalize();
let [apart, lit] = [0, 0];
for (let i = 0; i < SIZE * SIZE; i += 1) {
    const [x, y] = centre(i);
    // At the outline the sphere's triangles are seen from the side.
    if (x * x + y * y > 0.75 * 0.75) continue;
    const normal = new THREE.Vector3(x, y, Math.sqrt(0.64 - x * x - y * y)).divideScalar(0.8);
    const received = 3 * Math.max(normal.dot(toLight), 0) / Math.PI;
    [color.r, color.g, color.b].forEach((part, channel) => {
        apart = Math.max(apart, Math.abs(shaded[4 * i + channel] - 255 * Math.min(part * received, 1)));
    });
    lit += received > 0 ? 1 : 0;
}
check(lit > 10000 && apart < 1.5, `the sphere is ${apart} of 255 from its formula`);

// Tiles of 8x8 pixels, each of a colour of its own by a texture of 32x32 texels.
const texels = Uint8Array.from({ length: 4 * 1024 }, (_, i) => (i % 4 === 3 ? 255 : (37 * i) % 251));
const texture = new THREE.DataTexture(texels, 32, 32);
texture.needsUpdate = true;
const tiles = new THREE.Scene();
const instances = new THREE.InstancedMesh(new THREE.PlaneGeometry(1 / 4, 1 / 4), new THREE.MeshBasicMaterial({ map: texture }), 64);
const matrix = new THREE.Matrix4();
for (let i = 0; i < 64; i += 1) instances.setMatrixAt(i, matrix.makeTranslation((i % 8) / 4 - 7 / 8, 7 / 8 - Math.floor(i / 8) / 4, 0));
tiles.add(instances);
const tiled = await pixels(tiles);
let wrong = 0;
for (let i = 0; i < SIZE * SIZE; i += 1) {
    // The texture's first row is the lowest of a tile.
    const texel = 32 * (31 - (Math.floor(i / SIZE) % 32)) + (i % 32);
    wrong += [0, 1, 2].some((channel) => tiled[4 * i + channel] !== texels[4 * texel + channel]) ? 1 : 0;
}
check(wrong === 0, `${wrong} pixels of the tiles are wrong`);

const COUNT = 10000;
const waves = instancedArray(COUNT, 'float');
await renderer.computeAsync(Fn(() => {
    waves.element(instanceIndex).assign(sin(float(instanceIndex).mul(0.01)).add(float(instanceIndex)));
})().compute(COUNT));
const values = new Float32Array(await renderer.getArrayBufferAsync(waves.value));
const far = values.reduce((most, value, i) => Math.max(most, Math.abs(value - (Math.sin(i * 0.01) + i))), 0);
check(values.length === COUNT && far < 1e-3, `the compute shader is ${far} from the processor`);
console.log(`a sphere within ${apart.toFixed(2)} of 255, ${SIZE * SIZE} pixels of instances equal, ${COUNT} numbers within ${far.toExponential(1)}`);
process.exit(0);
