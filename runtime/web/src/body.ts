// The body as it is drawn: its surface, edges, held nodes and the overlay's outline.
import {
  BufferAttribute,
  BufferGeometry,
  DataTexture,
  DoubleSide,
  DynamicDrawUsage,
  FrontSide,
  Group,
  LinearFilter,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  MeshStandardMaterial,
  Points,
  PointsMaterial,
  RGBAFormat,
  SRGBColorSpace,
  Vector2,
} from 'three';
import { field_traits, map_texels, type Field, type MapName } from './colours';
import { displacements, fill_field, usual_largest } from './field';
import { boundary_edges, type Surface } from './pick';
import { make_topology, vertex_normals, type Topology } from './topology';
import type { Frame, Patch, Scene } from './wire';

function map_texture(name: MapName): DataTexture {
  const texture = new DataTexture(map_texels(name, 256), 256, 1, RGBAFormat);
  texture.colorSpace = SRGBColorSpace;
  texture.magFilter = texture.minFilter = LinearFilter;
  texture.needsUpdate = true;
  return texture;
}

interface BodyUniforms {
  colour_map: { value: DataTexture };
  range: { value: Vector2 };
  coloured: { value: number };
  hatch: { value: number };
  even: { value: number };
  shading: { value: number };
}

/** Looks up the colour by the vertex's number, and hatches where all corners are held. */
function coloured_material(uniforms: BodyUniforms): MeshStandardMaterial {
  const material = new MeshStandardMaterial({
    color: 0xc9b8a8,
    roughness: 0.62,
    metalness: 0,
    polygonOffset: true,
    polygonOffsetFactor: 2,
    polygonOffsetUnits: 4,
  });
  material.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, uniforms);
    shader.vertexShader = shader.vertexShader
      .replace('#include <common>', '#include <common>\nattribute vec3 shown;\nvarying vec3 v_shown;')
      .replace('#include <begin_vertex>', '#include <begin_vertex>\nv_shown = shown;');
    shader.fragmentShader = shader.fragmentShader
      .replace(
        '#include <common>',
        '#include <common>\nvarying vec3 v_shown;\nuniform sampler2D colour_map;\nuniform vec2 range;\nuniform float coloured, hatch, even, shading;',
      )
      .replace(
        '#include <color_fragment>',
        `#include <color_fragment>
        if (coloured > 0.5) {
          float share = clamp((v_shown.x - range.x) / max(range.y - range.x, 1e-30), 0.0, 1.0);
          vec3 looked_up = texture2D(colour_map, vec2(share * 255.0 / 256.0 + 0.5 / 256.0, 0.5)).rgb;
          diffuseColor.rgb = v_shown.y > 0.999 ? looked_up : vec3(0.18);
        }
        if (hatch > 0.5 && v_shown.z > 0.999) {
          float stripe = step(0.5, fract((gl_FragCoord.x + gl_FragCoord.y) / 9.0));
          diffuseColor.rgb *= 0.45 + 0.25 * stripe;
        }`,
      )
      // Colours that are to be read off a bar are those of the bar where the light falls, and a little darker on the far side: shape is seen.
      .replace(
        '#include <opaque_fragment>',
        `float away = 0.5 - 0.5 * dot(normalize(normal), normalize(vec3(-0.4, 0.5, 0.8)));
        float rim = shading * pow(1.0 - abs(normalize(normal).z), 6.0);
        if (even > 0.5) outgoingLight = diffuseColor.rgb * (1.0 - shading * away) + 0.12 * rim;
        #include <opaque_fragment>`,
      );
  };
  return material;
}

export class Body {
  readonly group = new Group();
  /** The largest absolute value of what is shown, and that of all but a few hot spots. */
  readonly shown = { largest: 0, usual: 0 };
  /** Seen is rest + scale * u. */
  scale = 1;
  field: Field = 'none';
  /** What is seen now, with all that a pointer may touch. */
  surface: Surface = { position: [], normal: [], triangle: [] };
  /** In the plane: the boundary, the body on its left, of the surface's vertices. */
  boundary: Uint32Array = new Uint32Array(0);

  private scene_: Scene | null = null;
  private patch_: Patch | null = null;
  private frame_: Frame | null = null;
  private topology_: Topology | null = null;
  private u_ = new Float32Array(0);
  private value_ = new Float32Array(0);
  private known_ = new Float32Array(0);
  private placed_: { topology: Topology | null; frame_u: Int16Array | undefined; version: number; scale: number } = {
    topology: null,
    frame_u: undefined,
    version: 0,
    scale: 1,
  };

  private readonly maps_ = { sequential: map_texture('sequential'), diverging: map_texture('diverging') };
  private readonly uniforms_: BodyUniforms = {
    colour_map: { value: this.maps_.sequential },
    range: { value: new Vector2(0, 1) },
    coloured: { value: 0 },
    hatch: { value: 1 },
    even: { value: 0 },
    shading: { value: 0 },
  };
  private readonly material_ = coloured_material(this.uniforms_);
  private readonly mesh_ = new Mesh(new BufferGeometry(), this.material_);
  private readonly edges_ = new LineSegments(
    new BufferGeometry(),
    new LineBasicMaterial({ color: 0x0a0d12, transparent: true, opacity: 0.45 }),
  );
  private readonly outline_ = new LineSegments(new BufferGeometry(), new LineBasicMaterial({ color: 0xffb454 }));
  private readonly held_ = new Points(
    new BufferGeometry(),
    new PointsMaterial({ color: 0x7d8ba1, size: 4, sizeAttenuation: false }),
  );

  constructor() {
    this.group.add(this.mesh_, this.edges_, this.outline_, this.held_);
    for (const part of this.group.children) part.frustumCulled = false;
    this.edges_.visible = false;
  }

  get scene(): Scene | null {
    return this.scene_;
  }
  get frame(): Frame | null {
    return this.frame_;
  }

  show_edges(on: boolean): void {
    this.edges_.visible = on;
  }
  show_outline(on: boolean): void {
    this.outline_.visible = on;
  }
  show_held(on: boolean): void {
    this.held_.visible = on;
    this.uniforms_.hatch.value = on ? 1 : 0;
  }

  take_scene(scene: Scene): void {
    this.scene_ = scene;
    this.patch_ = null;
    this.frame_ = null;
    const flat = scene.dimension === 2;
    this.material_.side = flat ? DoubleSide : FrontSide;
    this.material_.needsUpdate = true;
    this.rebuild();
  }

  /** `patch` is the one that the frame refers to, if any. */
  take_frame(frame: Frame, patch: Patch | null): void {
    this.frame_ = frame;
    if (patch === this.patch_) {
      this.update();
    } else {
      this.patch_ = patch;
      this.rebuild();
    }
  }

  /** Positions, normals and values as frame, field and scale have them now. */
  update(): void {
    const topology = this.topology_;
    if (!topology || !this.scene_) return;
    if (this.frame_) {
      displacements(this.frame_, topology, this.u_);
      const largest = fill_field(this.field, this.frame_, topology, this.u_, this.value_, this.known_);
      this.shown.largest = largest;
      this.shown.usual = usual_largest(this.value_, this.known_, topology.area, largest, field_traits[this.field].cut);
    } else {
      this.u_.fill(0);
      this.known_.fill(this.field === 'none' ? 1 : 0);
      this.shown.largest = this.shown.usual = 0;
    }
    const values = this.attribute('shown');
    const shown = values.array as Float32Array;
    const { node } = topology;
    for (let v = 0; v < node.length; ++v) {
      const i = node[v]!;
      shown[3 * v] = this.value_[i]!;
      shown[3 * v + 1] = this.known_[i]!;
    }
    values.needsUpdate = true;
    this.place(topology);
  }

  /** Positions and normals, which stay while no displacement changes. */
  private place(topology: Topology): void {
    const placed = this.placed_;
    const version = this.frame_?.version ?? 0;
    if (placed.topology === topology && placed.frame_u === this.frame_?.u && placed.version === version && placed.scale === this.scale) return;
    this.placed_ = { topology, frame_u: this.frame_?.u, version, scale: this.scale };
    const position = this.attribute('position');
    const place = position.array as Float32Array;
    const { node, rest } = topology;
    for (let v = 0; v < node.length; ++v) {
      const i = node[v]!;
      for (let k = 0; k < 3; ++k) place[3 * v + k] = rest[3 * i + k]! + this.scale * this.u_[3 * i + k]!;
    }
    const normal = this.attribute('normal');
    vertex_normals(place, topology.triangle, normal.array as Float32Array);
    position.needsUpdate = normal.needsUpdate = true;
  }

  /** Colours by the numbers from `low` to `high`. */
  show_range(low: number, high: number): void {
    this.uniforms_.coloured.value = this.field === 'none' ? 0 : 1;
    this.colour_edges();
    this.uniforms_.colour_map.value = this.maps_[field_traits[this.field].map];
    this.uniforms_.range.value.set(high > 0 ? low : -Number(low < 0), high > 0 ? high : 1); // where all is 0, 0 has its colour too
    const flat = this.scene_?.dimension === 2;
    this.uniforms_.even.value = flat || this.field !== 'none' ? 1 : 0;
    this.uniforms_.shading.value = flat ? 0 : 0.6; // linear light: a fifth of what is seen
  }

  /** Light on dark colours and dark on light ones; alone where the inside is not known. */
  private colour_edges(): void {
    const flat = this.scene_?.dimension === 2;
    const is_alone = flat && this.scene_?.triangle.length === 0;
    const is_dark = this.field !== 'none' && field_traits[this.field].map === 'sequential';
    this.edges_.material.color.set(is_alone ? 0xc9b8a8 : is_dark ? 0xe6edf5 : 0x0a0d12);
    this.edges_.material.opacity = is_alone ? 1 : (flat ? 0.7 : 0.45) * (is_dark ? 0.6 : 1);
  }

  /** The surface as it is now, for as long as a press lasts. */
  snapshot(): Surface {
    const { position, normal, triangle } = this.surface;
    return { position: Float32Array.from(position), normal: Float32Array.from(normal), triangle };
  }

  private attribute(name: string): BufferAttribute {
    return this.mesh_.geometry.getAttribute(name) as BufferAttribute;
  }

  private rebuild(): void {
    if (!this.scene_) return;
    const topology = make_topology(this.scene_, this.patch_);
    this.topology_ = topology;
    this.u_ = new Float32Array(3 * topology.nodes);
    this.value_ = new Float32Array(topology.nodes);
    this.known_ = new Float32Array(topology.nodes);

    const vertices = topology.node.length;
    const dynamic = () => new BufferAttribute(new Float32Array(3 * vertices), 3).setUsage(DynamicDrawUsage);
    const position = dynamic();
    const geometry = (index: Uint32Array) => new BufferGeometry().setAttribute('position', position).setIndex(new BufferAttribute(index, 1));
    const replace = (part: { geometry: BufferGeometry }, by: BufferGeometry) => {
      part.geometry.dispose();
      part.geometry = by;
    };
    replace(this.mesh_, geometry(topology.triangle).setAttribute('normal', dynamic()).setAttribute('shown', dynamic()));
    const all_held = this.scene_.dimension === 2 ? 3 : 7;
    const held: number[] = [];
    this.scene_.held.forEach((axes, i) => axes !== 0 && held.push(i));
    const shown = this.attribute('shown').array as Float32Array;
    topology.node.forEach((i, v) => {
      shown[3 * v + 2] = ((this.scene_!.held[i] ?? 0) & all_held) === all_held ? 1 : 0;
    });
    replace(this.edges_, geometry(topology.edge));
    replace(this.outline_, geometry(topology.outline));
    replace(this.held_, geometry(Uint32Array.from(held)));

    const normal = this.attribute('normal').array as Float32Array;
    this.surface = { position: position.array as Float32Array, normal, triangle: topology.triangle };
    this.boundary = new Uint32Array(0);
    if (this.scene_.dimension === 2) {
      this.boundary =
        topology.corner.length > 0 ? boundary_edges(topology.corner, topology.nodes) : Uint32Array.from(topology.edge);
    }
    this.update();
  }
}
