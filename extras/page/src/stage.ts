/** What surrounds the robot: light, floor, and a camera that follows it. */

import * as THREE from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import type { View } from "./cameras.js";

interface Colours {
  sky: string;
  floor: [string, string];
  line: string;
  light: number;
}

const LIGHT: Colours = { sky: "#e9eef2", floor: ["#dfe6ea", "#d3dce2"], line: "#c2ced6", light: 1 };
const DARK: Colours = { sky: "#12181d", floor: ["#1d262d", "#212c34"], line: "#33424d", light: 0.8 };

/** m; the floor moves with the camera, so it has no end. */
const FLOOR_SIZE = 120;
const TILE = 256; // pixels
/** How much of the way to the robot the camera goes in a second: 1 - exp(-FOLLOW). */
const FOLLOW = 8;

export class Stage {
  readonly scene = new THREE.Scene();
  readonly camera = new THREE.PerspectiveCamera(40, 1, 0.02, 200);
  readonly controls: OrbitControls;
  private readonly renderer: THREE.WebGLRenderer;
  private readonly sun = new THREE.DirectionalLight();
  private readonly sky = new THREE.HemisphereLight();
  private readonly floor: THREE.Mesh<THREE.PlaneGeometry, THREE.MeshLambertMaterial>;
  private view: View | undefined;
  private tile = 1;
  private isDark = false;
  /** True until the next picture shows all changes. */
  private isStale = true;

  constructor(readonly canvas: HTMLCanvasElement) {
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, powerPreference: "high-performance" });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.shadowMap.enabled = true;
    this.renderer.toneMapping = THREE.NeutralToneMapping;
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.maxPolarAngle = 0.495 * Math.PI; // stays above the floor
    this.controls.addEventListener("change", () => this.changed());
    const texture = new THREE.CanvasTexture(document.createElement("canvas"));
    texture.wrapS = texture.wrapT = THREE.RepeatWrapping;
    texture.colorSpace = THREE.SRGBColorSpace;
    texture.anisotropy = this.renderer.capabilities.getMaxAnisotropy();
    const material = new THREE.MeshLambertMaterial({ map: texture });
    this.floor = new THREE.Mesh(new THREE.PlaneGeometry(FLOOR_SIZE, FLOOR_SIZE), material);
    this.floor.receiveShadow = true;
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.set(1024, 1024);
    this.sun.shadow.radius = 3;
    this.sun.shadow.bias = -0.0005;
    this.sun.shadow.normalBias = 0.01;
    this.scene.add(this.floor, this.sun, this.sun.target, this.sky);
    const dark = matchMedia("(prefers-color-scheme: dark)");
    dark.addEventListener("change", () => this.colour(dark.matches));
    this.colour(dark.matches);
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.resize();
  }

  /** Looks at another robot, from where its view says. */
  look(view: View, centre: THREE.Vector3, floor: number): void {
    this.view = view;
    this.floor.position.z = floor;
    const angle = THREE.MathUtils.degToRad(view.azimuth);
    const tilt = THREE.MathUtils.degToRad(view.elevation);
    const forward = new THREE.Vector3(
      Math.cos(tilt) * Math.cos(angle),
      Math.cos(tilt) * Math.sin(angle),
      Math.sin(tilt),
    );
    const narrow = Math.max(1, 1.15 / this.camera.aspect); // the whole robot on a phone, too
    this.controls.target.copy(this.aim(centre));
    this.camera.position.copy(this.controls.target).addScaledVector(forward, -view.distance * narrow);
    this.controls.minDistance = 0.2 * view.distance;
    this.controls.maxDistance = 6 * view.distance;
    this.scene.fog = new THREE.Fog(this.colours.sky, 4 * view.distance, 14 * view.distance);
    this.tile = view.distance > 1.5 ? 1 : 0.2;
    this.floor.material.map?.repeat.setScalar(FLOOR_SIZE / (2 * this.tile));
    const { camera } = this.sun.shadow;
    const reach = 0.9 * view.distance;
    camera.left = camera.bottom = -reach;
    camera.right = camera.top = reach;
    camera.near = 0.1;
    camera.far = 8 * view.distance;
    camera.updateProjectionMatrix();
    this.settle();
  }

  /** Moves with the robot, smoothly. */
  follow(centre: THREE.Vector3, seconds: number): void {
    if (!this.view?.follows) return;
    const way = this.aim(centre)
      .sub(this.controls.target)
      .multiplyScalar(1 - Math.exp(-FOLLOW * seconds));
    this.controls.target.add(way);
    this.camera.position.add(way);
    this.settle();
  }

  /** Goes to the robot at once, as after a reset. */
  jump(centre: THREE.Vector3): void {
    this.follow(centre, Infinity);
  }

  changed(): void {
    this.isStale = true;
  }

  /** Draws if something has changed; says whether it did. */
  draw(): boolean {
    if (!this.isStale) return false;
    this.isStale = false;
    this.renderer.render(this.scene, this.camera);
    return true;
  }

  private get colours(): Colours {
    return this.isDark ? DARK : LIGHT;
  }

  private aim(centre: THREE.Vector3): THREE.Vector3 {
    const [x, y, z] = this.view!.lookat;
    return this.view!.follows ? new THREE.Vector3(centre.x + x, centre.y + y, z) : new THREE.Vector3(x, y, z);
  }

  /** Light and floor go where the camera looks. The floor moves by whole tiles, which nobody sees. */
  private settle(): void {
    const { target } = this.controls;
    const step = 2 * this.tile;
    this.floor.position.x = step * Math.round(target.x / step);
    this.floor.position.y = step * Math.round(target.y / step);
    this.sun.target.position.copy(target);
    this.sun.position.copy(target).add(new THREE.Vector3(-0.35, -0.5, 1.1).multiplyScalar(3 * this.view!.distance));
    this.changed();
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !height) return;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.changed();
  }

  private colour(isDark: boolean): void {
    this.isDark = isDark;
    const { sky, light } = this.colours;
    this.scene.background = new THREE.Color(sky);
    this.scene.fog?.color.set(sky);
    this.sun.intensity = 2.2 * light;
    this.sky.intensity = 1.5 * light;
    this.sky.color.set("#ffffff");
    this.sky.groundColor.set(isDark ? "#3a444c" : "#c8cdd0");
    this.paint();
    this.changed();
  }

  /** Two by two tiles with thin lines between them. */
  private paint(): void {
    const texture = this.floor.material.map as THREE.CanvasTexture<HTMLCanvasElement>;
    const { image } = texture;
    image.width = image.height = 2 * TILE;
    const pen = image.getContext("2d")!;
    for (const x of [0, 1])
      for (const y of [0, 1]) {
        pen.fillStyle = this.colours.floor[(x + y) % 2];
        pen.fillRect(x * TILE, y * TILE, TILE, TILE);
        pen.strokeStyle = this.colours.line;
        pen.lineWidth = 3;
        pen.strokeRect(x * TILE, y * TILE, TILE, TILE);
      }
    texture.needsUpdate = true;
  }
}
