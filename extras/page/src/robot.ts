/** The geoms of the model as three.js meshes, in the poses of the last two steps. */

import * as THREE from "three";
import type { Env } from "mjenv";

/** MuJoCo's mjtGeom. */
const PLANE = 0;
const SPHERE = 2;
const CAPSULE = 3;
const ELLIPSOID = 4;
const CYLINDER = 5;
const BOX = 6;
const MESH = 7;

/** MuJoCo draws the groups 0 to 2, unless it is told otherwise. */
const GROUPS = 3;
/** Planes of half this size, m, or without a size, are floors; smaller ones are tables. */
const FLOOR = 5;
/** The colour that MuJoCo gives to geoms without one; their material's is drawn then. */
const NO_COLOUR = 0.5;

interface Part {
  mesh: THREE.Mesh;
  geom: number;
}

export class Robot {
  readonly group = new THREE.Group();
  /** The height of the model's floor, m, if it has one. */
  readonly floor: number | undefined;
  private readonly parts: Part[] = [];
  private readonly before: Poses;
  private readonly after: Poses;

  constructor(private readonly env: Env) {
    const model = new Model(env);
    const floors: number[] = [];
    this.before = new Poses(model.count);
    this.after = new Poses(model.count);
    this.after.read(env);
    for (let geom = 0; geom < model.count; geom++) {
      if (model.isFloor(geom)) floors.push(this.after.place(geom).z);
      const shape = model.shape(geom);
      if (!shape) continue;
      const mesh = new THREE.Mesh(shape, model.material(geom));
      mesh.castShadow = mesh.receiveShadow = true;
      mesh.userData = { geom, body: model.bodyOf(geom) };
      this.parts.push({ mesh, geom });
      this.group.add(mesh);
    }
    this.floor = floors.length ? Math.min(...floors) : undefined;
    this.jump();
  }

  /** After a step: the present poses become the ones before. */
  step(): void {
    this.before.copy(this.after);
    this.after.read(this.env);
  }

  /** After a reset or a restore: nothing lies between the poses before and now. */
  jump(): void {
    this.after.read(this.env);
    this.before.copy(this.after);
    this.show(1);
  }

  /** Shows the poses between the step before (0) and the last step (1). */
  show(between: number): void {
    for (const { mesh, geom } of this.parts) {
      mesh.position.lerpVectors(this.before.place(geom), this.after.place(geom), between);
      mesh.quaternion.slerpQuaternions(this.before.turn(geom), this.after.turn(geom), between);
    }
  }

  /** Where a point of a mesh is after the last step. The mesh itself may show an earlier pose. */
  now(mesh: THREE.Object3D, point: THREE.Vector3): THREE.Vector3 {
    const { geom } = mesh.userData as { geom: number };
    return point.clone().applyQuaternion(this.after.turn(geom)).add(this.after.place(geom));
  }

  /** The lowest point of the meshes, m. */
  lowest(): number {
    return new THREE.Box3().setFromObject(this.group).min.z;
  }

  free(): void {
    for (const { mesh } of this.parts) {
      mesh.geometry.dispose();
      (mesh.material as THREE.Material).dispose();
    }
    this.group.removeFromParent();
  }
}

/** Position and orientation of each geom. */
class Poses {
  private readonly places: THREE.Vector3[];
  private readonly turns: THREE.Quaternion[];
  private readonly matrix = new THREE.Matrix4();

  constructor(count: number) {
    this.places = Array.from({ length: count }, () => new THREE.Vector3());
    this.turns = Array.from({ length: count }, () => new THREE.Quaternion());
  }

  read(env: Env): void {
    const xpos = env.read("geom_xpos");
    const xmat = env.read("geom_xmat");
    this.places.forEach((place, geom) => place.fromArray(xpos, 3 * geom));
    this.turns.forEach((turn, geom) => {
      const [a, b, c, d, e, f, g, h, i] = xmat.subarray(9 * geom, 9 * geom + 9);
      turn.setFromRotationMatrix(this.matrix.set(a, b, c, 0, d, e, f, 0, g, h, i, 0, 0, 0, 0, 1));
    });
  }

  copy(other: Poses): void {
    this.places.forEach((place, geom) => place.copy(other.places[geom]));
    this.turns.forEach((turn, geom) => turn.copy(other.turns[geom]));
  }

  place(geom: number): THREE.Vector3 {
    return this.places[geom];
  }

  turn(geom: number): THREE.Quaternion {
    return this.turns[geom];
  }
}

/** What the mjModel says of its geoms. */
class Model {
  readonly count: number;
  private readonly type: Float64Array;
  private readonly size: Float64Array;
  private readonly rgba: Float64Array;
  private readonly group: Float64Array;
  private readonly body: Float64Array;
  private readonly materialOf: Float64Array;

  constructor(private readonly env: Env) {
    this.type = env.read("geom_type");
    this.size = env.read("geom_size");
    this.rgba = env.read("geom_rgba");
    this.group = env.read("geom_group");
    this.body = env.read("geom_bodyid");
    this.materialOf = env.read("geom_matid");
    this.count = this.type.length;
  }

  bodyOf(geom: number): number {
    return this.body[geom];
  }

  isFloor(geom: number): boolean {
    return this.type[geom] === PLANE && !(this.size[3 * geom] > 0 && this.size[3 * geom] < FLOOR);
  }

  /** The geometry, with MuJoCo's axes; undefined where nothing is drawn. */
  shape(geom: number): THREE.BufferGeometry | undefined {
    const [x, y, z] = this.size.subarray(3 * geom, 3 * geom + 3);
    if (this.group[geom] >= GROUPS || this.isFloor(geom)) return undefined;
    switch (this.type[geom]) {
      case PLANE:
        return new THREE.PlaneGeometry(2 * x, 2 * (y || x));
      case SPHERE:
        return new THREE.SphereGeometry(x, 32, 24);
      case CAPSULE:
        return new THREE.CapsuleGeometry(x, 2 * y, 12, 32).rotateX(Math.PI / 2);
      case ELLIPSOID:
        return new THREE.SphereGeometry(1, 32, 24).scale(x, y, z);
      case CYLINDER:
        return new THREE.CylinderGeometry(x, x, 2 * y, 40).rotateX(Math.PI / 2);
      case BOX:
        return new THREE.BoxGeometry(2 * x, 2 * y, 2 * z);
      case MESH:
        return this.mesh(this.env.read("geom_dataid")[geom]);
      default:
        return undefined;
    }
  }

  material(geom: number): THREE.Material {
    let [red, green, blue, alpha] = this.rgba.subarray(4 * geom, 4 * geom + 4);
    const id = this.materialOf[geom];
    if (id >= 0 && red === NO_COLOUR && green === NO_COLOUR && blue === NO_COLOUR && alpha === 1)
      [red, green, blue, alpha] = this.env.read("mat_rgba").subarray(4 * id, 4 * id + 4);
    const color = new THREE.Color().setRGB(red, green, blue, THREE.SRGBColorSpace);
    const shine = { specular: "#222222", shininess: 24 };
    return new THREE.MeshPhongMaterial({ color, ...shine, transparent: alpha < 1, opacity: alpha });
  }

  private mesh(id: number): THREE.BufferGeometry {
    const part = (name: string, of: string, width: number) => {
      const [start, count] = [this.env.read(`mesh_${of}adr`)[id], this.env.read(`mesh_${of}num`)[id]];
      return this.env.read(name).subarray(width * start, width * (start + count));
    };
    const shape = new THREE.BufferGeometry();
    shape.setAttribute("position", new THREE.BufferAttribute(Float32Array.from(part("mesh_vert", "vert", 3)), 3));
    shape.setIndex(Array.from(part("mesh_face", "face", 3)));
    shape.computeVertexNormals();
    return shape;
  }
}
