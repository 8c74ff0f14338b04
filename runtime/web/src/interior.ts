// Where materials meet within the body. Nothing is known of displacements there: they are what the surface nearby has.
import { BufferAttribute, BufferGeometry, DynamicDrawUsage, Mesh, type Vector4 } from 'three';
import { BodyMaterial } from './body_material';
import type { Light } from './light';
import type { Region } from './section';
import { vertex_normals, type Topology } from './topology';
import type { Scene } from './wire';

const neighbours = 8; // nodes of the surface that a place within follows

/** Of each place the nearest nodes of the surface, and their weights: the third power of what is near. */
export function weights_of(place: Float32Array, surface: Float32Array): { node: Uint32Array; weight: Float32Array } {
  const count = place.length / 3;
  const node = new Uint32Array(neighbours * count);
  const weight = new Float32Array(neighbours * count);
  const nodes = surface.length / 3;
  const near = new Float64Array(neighbours);
  for (let i = 0; i < count; ++i) {
    near.fill(Infinity);
    const first = neighbours * i;
    for (let k = 0; k < nodes; ++k) {
      const distance2 = (surface[3 * k]! - place[3 * i]!) ** 2 + (surface[3 * k + 1]! - place[3 * i + 1]!) ** 2 + (surface[3 * k + 2]! - place[3 * i + 2]!) ** 2;
      if (distance2 >= near[neighbours - 1]!) continue;
      let at = neighbours - 1;
      for (; at > 0 && near[at - 1]! > distance2; --at) {
        near[at] = near[at - 1]!;
        node[first + at] = node[first + at - 1]!;
      }
      near[at] = distance2;
      node[first + at] = k;
    }
    let sum = 0;
    for (let k = 0; k < neighbours; ++k) sum += weight[first + k] = Math.pow(near[k]! + 1e-30, -1.5);
    for (let k = 0; k < neighbours; ++k) weight[first + k]! /= sum;
  }
  return { node, weight };
}

export class Interior {
  readonly mesh: Mesh<BufferGeometry, BodyMaterial>;
  private scene_: Scene | null = null;
  private follows_: { node: Uint32Array; weight: Float32Array } = { node: new Uint32Array(0), weight: new Float32Array(0) };

  constructor(light: Light, cut: { value: Vector4 }) {
    this.mesh = new Mesh(new BufferGeometry(), new BodyMaterial(light, cut));
    this.mesh.material.set_colouring(2, 0);
    this.mesh.material.set_see_through(false, true);
    this.mesh.visible = false;
  }

  take(scene: Scene): void {
    this.scene_ = scene;
    const { position, triangle, inside } = scene.inner;
    this.follows_ = weights_of(position, scene.position);
    const dynamic = () => new BufferAttribute(new Float32Array(position.length), 3).setUsage(DynamicDrawUsage);
    const shown = new Float32Array((4 * position.length) / 3);
    triangle.forEach((node, at) => (shown[4 * node + 3] = inside[Math.floor(at / 3)]!));
    this.mesh.geometry.dispose();
    this.mesh.geometry = new BufferGeometry()
      .setAttribute('position', dynamic())
      .setAttribute('normal', dynamic())
      .setAttribute('shown', new BufferAttribute(shown, 4))
      .setIndex(new BufferAttribute(triangle, 1));
    this.place(new Float32Array(scene.position.length), 1);
  }

  /** Displacements of the surface's nodes, drawn `scale` times as large. */
  place(u: Float32Array, scale: number): void {
    const rest = this.scene_?.inner.position;
    if (!rest || rest.length === 0) return;
    const { node, weight } = this.follows_;
    const position = this.mesh.geometry.getAttribute('position') as BufferAttribute;
    const place = position.array as Float32Array;
    place.set(rest);
    for (let k = 0; k < node.length; ++k) {
      const i = 3 * Math.floor(k / neighbours);
      for (let axis = 0; axis < 3; ++axis) place[i + axis]! += scale * weight[k]! * u[3 * node[k]! + axis]!;
    }
    const normal = this.mesh.geometry.getAttribute('normal') as BufferAttribute;
    vertex_normals(place, this.scene_!.inner.triangle, normal.array as Float32Array);
    position.needsUpdate = normal.needsUpdate = true;
  }

  /** Of each material the closed surface: of the body's triangles, whose vertices are at `outer`, and of those within. */
  regions(topology: Topology, outer: BufferAttribute): Region[] {
    const { triangle, inside, outside } = this.scene_!.inner;
    const inner = this.mesh.geometry.getAttribute('position') as BufferAttribute;
    const materials = new Set<number>([...topology.material, ...inside, ...outside]);
    if (materials.size <= 1) return [{ material: 0, outer: { position: outer, triangle: topology.triangle }, inner: null }];
    return [...materials].sort((a, b) => a - b).map((material) => {
      const own: number[] = [];
      for (let t = 0; t < topology.triangle.length; t += 3) {
        if (topology.material[topology.triangle[t]!] === material) own.push(topology.triangle[t]!, topology.triangle[t + 1]!, topology.triangle[t + 2]!);
      }
      const within: number[] = [];
      for (let t = 0; t < inside.length; ++t) {
        const [a, b, c] = [triangle[3 * t]!, triangle[3 * t + 1]!, triangle[3 * t + 2]!];
        if (inside[t] === material) within.push(a, b, c);
        if (outside[t] === material) within.push(a, c, b);
      }
      return {
        material,
        outer: { position: outer, triangle: Uint32Array.from(own) },
        inner: within.length > 0 ? { position: inner, triangle: Uint32Array.from(within) } : null,
      };
    });
  }
}
