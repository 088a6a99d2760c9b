// A scene of three.js: physical materials in an environment, a light with a shadow, four samples.
import * as THREE from 'three';
import { RoomEnvironment } from 'three/addons/environments/RoomEnvironment.js';

export async function draw(canvas) {
    const renderer = new THREE.WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
    renderer.setSize(canvas.width, canvas.height, false);
    renderer.shadowMap.enabled = true;
    renderer.toneMapping = THREE.ACESFilmicToneMapping;
    const scene = new THREE.Scene();
    const blurred = new THREE.PMREMGenerator(renderer);
    scene.environment = blurred.fromScene(new RoomEnvironment(), 0.04).texture;
    scene.background = scene.environment;
    const light = new THREE.DirectionalLight(0xfff0d0, 3);
    light.position.set(3, 5, 2);
    light.castShadow = true;
    light.shadow.mapSize.set(512, 512);
    scene.add(light);
    const floor = new THREE.Mesh(new THREE.PlaneGeometry(10, 10), new THREE.MeshStandardMaterial({ color: 0x8090a0, roughness: 0.6 }));
    floor.rotation.x = -Math.PI / 2;
    floor.position.y = -1;
    floor.receiveShadow = true;
    scene.add(floor);
    for (let i = 0; i < 9; i += 1) {
        const material = new THREE.MeshPhysicalMaterial({
            color: new THREE.Color().setHSL(i / 9, 0.7, 0.5),
            metalness: (i % 3) / 2,
            roughness: Math.floor(i / 3) / 2,
            clearcoat: i === 4 ? 1 : 0,
            transmission: i === 0 ? 0.8 : 0,
        });
        const ball = new THREE.Mesh(i === 8 ? new THREE.TorusKnotGeometry(0.3, 0.12, 128, 32) : new THREE.SphereGeometry(0.5, 48, 32), material);
        ball.position.set((i % 3 - 1) * 1.3, Math.floor(i / 3) * 1.1 - 0.5, Math.floor(i / 3) * -0.6);
        ball.castShadow = true;
        ball.receiveShadow = true;
        scene.add(ball);
    }
    const camera = new THREE.PerspectiveCamera(45, canvas.width / canvas.height, 0.1, 50);
    camera.position.set(2, 1.8, 5);
    camera.lookAt(0, 0.4, 0);
    renderer.render(scene, camera);
}
