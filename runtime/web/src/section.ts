// A plane that cuts the body open: what is before it is not drawn, and the cut is filled by material.
import {
  AlwaysStencilFunc,
  BackSide,
  Box3,
  BufferAttribute,
  BufferGeometry,
  Color,
  DecrementWrapStencilOp,
  FrontSide,
  Group,
  IncrementWrapStencilOp,
  Mesh,
  NotEqualStencilFunc,
  Plane,
  PlaneGeometry,
  ShaderMaterial,
  Vector3,
  Vector4,
  ZeroStencilOp,
  type Side,
} from 'three';
import { share_glsl, type Colours } from './body_material';
import { material_colours } from './colours';
import type { Vec3 } from './words';

export const section_axes = ['off', 'x', 'y', 'z'] as const;
export type SectionAxis = (typeof section_axes)[number];

/** A part of the body of one material: a closed surface, of the body's vertices and of those within it. */
export interface Region {
  material: number;
  outer: { position: BufferAttribute; triangle: Uint32Array };
  inner: { position: BufferAttribute; triangle: Uint32Array } | null;
}

const sheet_cells = 96; // each way, of what fills the cut
const nowhere = new Vector4(0, 0, 0, 1);

function counting(side: Side, cut: { value: Vector4 }): ShaderMaterial {
  const op = side === BackSide ? IncrementWrapStencilOp : DecrementWrapStencilOp;
  return new ShaderMaterial({
    uniforms: { cut },
    vertexShader: 'varying vec3 v_world; void main() { v_world = position; gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }',
    fragmentShader: 'varying vec3 v_world; uniform vec4 cut; void main() { if (dot(cut.xyz, v_world) > cut.w) discard; gl_FragColor = vec4(0.0); }',
    side,
    colorWrite: false,
    depthWrite: false,
    depthTest: false,
    stencilWrite: true,
    stencilFunc: AlwaysStencilFunc,
    stencilFail: op,
    stencilZFail: op,
    stencilZPass: op,
  });
}

/** How a cut is filled: by material, by the number of the field there, or grey where it is not known within. */
export type Filling = 'material' | 'number' | 'unknown';

/** `colours`: uniforms of the body's own. */
function filling(own: Color, colours: Colours): ShaderMaterial {
  return new ShaderMaterial({
    uniforms: { ...colours, own: { value: own }, pixel: { value: 1 } },
    vertexShader: 'attribute float number; varying float v_number; void main() { v_number = number; gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }',
    fragmentShader: /* glsl */ `
      varying float v_number;
      uniform sampler2D colour_map;
      uniform vec2 range;
      uniform vec3 own, tint;
      uniform float pixel, is_log;
      ${share_glsl}
      vec3 fill() {
#if FILLING == 1
        return texture2D(colour_map, vec2(clamp(share_of(v_number), 0.0, 1.0) * 255.0 / 256.0 + 0.5 / 256.0, 0.5)).rgb;
#elif FILLING == 2
        return mix(tint * 0.55, own, 0.3); // parts can still be told apart
#else
        return own;
#endif
      }
      void main() {
        vec3 colour = fill();
        float line = smoothstep(0.35, 0.6, abs(fract((gl_FragCoord.x - gl_FragCoord.y) / (9.0 * pixel)) - 0.5) * 2.0);
        gl_FragColor = vec4(colour * mix(0.86, 1.0, line), 1.0);
        #include <colorspace_fragment>
      }`,
    defines: { FILLING: 0 },
    stencilWrite: true,
    stencilFunc: NotEqualStencilFunc,
    stencilRef: 0,
    stencilFail: ZeroStencilOp,
    stencilZFail: ZeroStencilOp,
    stencilZPass: ZeroStencilOp,
  });
}

export class Section {
  readonly group = new Group();
  /** Not drawn is what lies on the outer side of it: normal x y z, distance. */
  readonly cut = { value: nowhere.clone() };
  /** The same, for materials that are three.js's own: empty while nothing is cut. */
  readonly planes: Plane[] = [];
  private faces_ = 1; // along the axis: the side that who looks is on
  private axis_: SectionAxis = 'off';
  private share_ = 0.5;
  private is_flipped_ = false;
  private low_: Vec3 = [0, 0, 0];
  private high_: Vec3 = [1, 1, 1];
  private readonly sheet_ = new PlaneGeometry(1, 1, sheet_cells, sheet_cells).setAttribute('number', new BufferAttribute(new Float32Array((sheet_cells + 1) ** 2), 1));
  private readonly fills_: Mesh<PlaneGeometry, ShaderMaterial>[] = [];
  private readonly count_back_ = counting(BackSide, this.cut);
  private readonly count_front_ = counting(FrontSide, this.cut);

  constructor(private readonly colours_: () => Colours) {}

  get axis(): SectionAxis {
    return this.axis_;
  }
  get is_on(): boolean {
    return this.axis_ !== 'off';
  }

  /** Whether a place is there to be seen and touched. */
  shows(place: Vec3): boolean {
    const { x, y, z, w } = this.cut.value;
    return x * place[0] + y * place[1] + z * place[2] <= w;
  }

  set(axis: SectionAxis, share: number, is_flipped: boolean): void {
    this.axis_ = axis;
    this.share_ = share;
    this.is_flipped_ = is_flipped;
    this.place();
  }

  /** The half towards the camera is what is cut off, as seen from `towards`. */
  face(towards: Vec3): void {
    const axis = 'xyz'.indexOf(this.axis_);
    this.faces_ = axis >= 0 && towards[axis]! < 0 ? -1 : 1;
    this.place();
  }

  set_box(low: Vec3, high: Vec3): void {
    this.low_ = low;
    this.high_ = high;
    this.place();
  }

  /** What the cut is filled with. */
  set_regions(regions: Region[]): void {
    for (const part of this.group.children) if (part instanceof Mesh && part.geometry !== this.sheet_) part.geometry.dispose();
    this.group.clear();
    this.fills_.length = 0;
    regions.forEach(({ material, outer, inner }, k) => {
      for (const { position, triangle } of [outer, ...(inner ? [inner] : [])]) {
        const geometry = new BufferGeometry().setAttribute('position', position).setIndex(new BufferAttribute(triangle, 1));
        for (const way of [this.count_back_, this.count_front_]) this.add(new Mesh(geometry, way), 10 * k - 1000);
      }
      const colour = regions.length === 1 ? new Color(0x8e4436) : new Color(`rgb(${material_colours[material % material_colours.length]!.join()})`);
      const fill = new Mesh(this.sheet_, filling(colour, this.colours_()));
      this.fills_.push(fill);
      this.add(fill, 10 * k - 999);
    });
    this.place();
  }

  /** Fills the cut so, with the numbers of places within the body. */
  fill(filling: Filling, numbers: (places: Float32Array) => Float32Array): void {
    const defined = { material: 0, number: 1, unknown: 2 }[filling];
    for (const { material } of this.fills_) {
      if (material.defines.FILLING !== defined) material.needsUpdate = true;
      material.defines.FILLING = defined;
    }
    const sheet = this.fills_[0];
    if (filling !== 'number' || !sheet) return;
    sheet.updateMatrixWorld();
    const [corner, number] = [this.sheet_.getAttribute('position'), this.sheet_.getAttribute('number')];
    const [low, high] = [new Vector3(...this.low_), new Vector3(...this.high_)];
    const around = new Box3(low, high).expandByScalar(0.2 * high.distanceTo(low));
    const place = new Vector3();
    const near: number[] = [];
    const places: number[] = [];
    for (let k = 0; k < number.count; ++k) {
      place.fromBufferAttribute(corner, k).applyMatrix4(sheet.matrixWorld);
      if (!around.containsPoint(place)) continue;
      near.push(k);
      places.push(place.x, place.y, place.z);
    }
    numbers(Float32Array.from(places)).forEach((value, k) => number.setX(near[k]!, value));
    number.needsUpdate = true;
  }

  /** Before a picture; `pixel` is how many of it are one of the page. */
  prepare(pixel: number): void {
    for (const fill of this.fills_) fill.material.uniforms.pixel!.value = pixel;
  }

  private add(mesh: Mesh, order: number): void {
    mesh.frustumCulled = false;
    mesh.renderOrder = order;
    this.group.add(mesh);
  }

  private place(): void {
    this.group.visible = this.is_on;
    if (!this.is_on) {
      this.cut.value.copy(nowhere);
      this.planes.length = 0;
      return;
    }
    const axis = 'xyz'.indexOf(this.axis_);
    const room = 0.002 * (this.high_[axis]! - this.low_[axis]!);
    const at = this.low_[axis]! - room + this.share_ * (this.high_[axis]! - this.low_[axis]! + 2 * room);
    const sign = this.is_flipped_ ? -this.faces_ : this.faces_;
    const normal = new Vector3().setComponent(axis, sign);
    this.cut.value.set(normal.x, normal.y, normal.z, sign * at);
    this.planes[0] = new Plane(normal.clone().negate(), sign * at);
    const centre = new Vector3(...this.low_).add(new Vector3(...this.high_)).multiplyScalar(0.5);
    centre.setComponent(axis, at);
    const size = 2 * new Vector3(...this.high_).distanceTo(new Vector3(...this.low_)) + 1e-9;
    for (const fill of this.fills_) {
      fill.position.copy(centre);
      fill.scale.set(size, size, 1);
      fill.quaternion.setFromUnitVectors(new Vector3(0, 0, 1), normal);
    }
  }
}
