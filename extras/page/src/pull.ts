/** A body that the mouse or a finger pulls with a spring, as MuJoCo's viewer does. */

import * as THREE from "three";
import type { Env } from "mjenv";
import type { Robot } from "./robot.js";
import type { Stage } from "./stage.js";

/** 1/s²: the spring's stiffness for each kilogram that it moves, as the default vis.map.stiffness. */
const STIFFNESS = 100;
/** How many numbers a body has in xfrc_applied: force and torque. */
const WRENCH = 6;

export class Pull {
  private readonly ray = new THREE.Raycaster();
  private readonly plane = new THREE.Plane();
  private readonly aim = new THREE.Vector3();
  /** The pulled point, in the axes of its mesh. */
  private readonly grip = new THREE.Vector3();
  private readonly line: THREE.Line<THREE.BufferGeometry, THREE.LineBasicMaterial>;
  private readonly ball: THREE.Mesh;
  private mesh: THREE.Object3D | undefined;
  private pointer = -1;
  private last: THREE.Vector3 | undefined;
  private wasPulling = false;

  constructor(
    private readonly stage: Stage,
    private readonly robot: () => Robot | undefined,
  ) {
    const color = "#e0533d";
    this.line = new THREE.Line(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({ color, depthTest: false }));
    this.line.frustumCulled = false;
    this.ball = new THREE.Mesh(new THREE.SphereGeometry(1), new THREE.MeshBasicMaterial({ color, depthTest: false }));
    this.line.visible = this.ball.visible = false;
    this.line.renderOrder = this.ball.renderOrder = 1;
    stage.scene.add(this.line, this.ball);
    // Before OrbitControls hears of it: a pointer that holds a body does not turn the camera.
    stage.canvas.addEventListener("pointerdown", (event) => this.begin(event), { capture: true });
    stage.canvas.addEventListener("pointermove", (event) => this.move(event));
    for (const end of ["pointerup", "pointercancel"] as const)
      stage.canvas.addEventListener(end, (event) => event.pointerId === this.pointer && this.end());
  }

  get isActive(): boolean {
    return this.mesh !== undefined;
  }

  /** Writes the force of the spring for the next step. */
  apply(env: Env, robot: Robot): void {
    if (!this.mesh && !this.wasPulling) return;
    const forces = new Float64Array(env.read("xfrc_applied").length);
    if (this.mesh) this.force(env, robot.now(this.mesh, this.grip), forces);
    this.wasPulling = this.isActive;
    env.write("xfrc_applied", forces);
  }

  /** Draws the spring where the robot is now. */
  show(): void {
    this.line.visible = this.ball.visible = this.isActive;
    if (!this.mesh) return;
    this.line.geometry.setFromPoints([this.point(), this.aim]);
    this.ball.position.copy(this.aim);
    this.ball.scale.setScalar(0.008 * this.stage.camera.position.distanceTo(this.aim));
    this.stage.changed();
  }

  end(): void {
    this.mesh = this.last = undefined;
    this.pointer = -1;
    this.stage.controls.enabled = true;
    this.stage.changed();
  }

  private force(env: Env, point: THREE.Vector3, forces: Float64Array): void {
    const body: number = this.mesh!.userData.body;
    const velocity = this.last ? point.clone().sub(this.last).divideScalar(env.dt) : new THREE.Vector3();
    this.last = point.clone();
    const mass = 1 / Math.max(env.read("body_invweight0")[2 * body], 1e-6);
    // Critically damped.
    const force = this.aim.clone().sub(point).multiplyScalar(STIFFNESS);
    force.addScaledVector(velocity, -2 * Math.sqrt(STIFFNESS)).multiplyScalar(mass);
    const centre = new THREE.Vector3().fromArray(env.read("xipos"), 3 * body);
    const torque = point.sub(centre).cross(force);
    force.toArray(forces, WRENCH * body);
    torque.toArray(forces, WRENCH * body + 3);
  }

  /** The pulled point in the world. */
  private point(): THREE.Vector3 {
    this.mesh!.updateWorldMatrix(true, false);
    return this.mesh!.localToWorld(this.grip.clone());
  }

  private begin(event: PointerEvent): void {
    if (this.mesh || event.button !== 0) return;
    this.cast(event);
    const meshes = this.robot()?.group.children.filter((mesh) => mesh.userData.body > 0) ?? [];
    const [hit] = this.ray.intersectObjects(meshes, false);
    if (!hit) return;
    this.mesh = hit.object;
    this.pointer = event.pointerId;
    this.grip.copy(this.mesh.worldToLocal(hit.point.clone()));
    this.aim.copy(hit.point);
    this.stage.controls.enabled = false;
    this.stage.canvas.setPointerCapture(event.pointerId);
  }

  /** The pointer moves in the plane through the pulled point that faces the camera. */
  private move(event: PointerEvent): void {
    if (event.pointerId !== this.pointer || !this.mesh) return;
    this.cast(event);
    const facing = this.stage.camera.getWorldDirection(new THREE.Vector3());
    this.plane.setFromNormalAndCoplanarPoint(facing, this.point());
    this.ray.ray.intersectPlane(this.plane, this.aim);
    this.show();
  }

  private cast(event: PointerEvent): void {
    const { left, top, width, height } = this.stage.canvas.getBoundingClientRect();
    const x = (2 * (event.clientX - left)) / width - 1;
    const y = 1 - (2 * (event.clientY - top)) / height;
    this.ray.setFromCamera(new THREE.Vector2(x, y), this.stage.camera);
  }
}
