// A scene of Spark, three.js' renderer of Gaussians: 20,000 of them in a ball, and a cube in its middle.
import * as THREE from 'three';
import { SparkRenderer, SplatMesh } from '@sparkjsdev/spark';

export async function draw(canvas) {
    const renderer = new THREE.WebGLRenderer({ canvas, antialias: false, preserveDrawingBuffer: true });
    renderer.setSize(canvas.width, canvas.height, false);
    const scene = new THREE.Scene();
    scene.background = new THREE.Color(0x202830);
    const spark = new SparkRenderer({ renderer });
    scene.add(spark);
    let state = 1;
    const random = () => {
        state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
        return state / 2 ** 32;
    };
    const center = new THREE.Vector3();
    const scales = new THREE.Vector3();
    const turn = new THREE.Quaternion();
    const color = new THREE.Color();
    const splats = new SplatMesh({
        constructSplats(packed) {
            for (let i = 0; i < 20000; i += 1) {
                center.set(random() * 2 - 1, random() * 2 - 1, random() * 2 - 1);
                scales.set(0.01 + 0.03 * random(), 0.01 + 0.02 * random(), 0.01 + 0.01 * random());
                turn.set(random() - 0.5, random() - 0.5, random() - 0.5, random() - 0.5).normalize();
                color.setRGB(0.5 + center.x / 2, 0.5 + center.y / 2, 0.5 + center.z / 2);
                packed.pushSplat(center, scales, turn, 0.2 + 0.7 * random(), color);
            }
        },
    });
    await splats.initialized;
    scene.add(splats);
    scene.add(new THREE.Mesh(new THREE.BoxGeometry(0.8, 0.8, 0.8), new THREE.MeshNormalMaterial()));
    const camera = new THREE.PerspectiveCamera(50, canvas.width / canvas.height, 0.1, 50);
    camera.position.set(1.5, 1.2, 3);
    camera.lookAt(0, 0, 0);
    // Splats are sorted between frames.
    for (let frame = 0; frame < 30; frame += 1) {
        renderer.render(scene, camera);
        await new Promise((done) => setTimeout(done, 50));
    }
}
