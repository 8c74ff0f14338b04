// The body as it is drawn: its surface, edges, held nodes and the overlay's outline.
import {
  Box3,
  BufferAttribute,
  BufferGeometry,
  DynamicDrawUsage,
  Group,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  type Plane,
  Points,
  PointsMaterial,
  type Vector4,
} from 'three';
import { BodyMaterial, type Colours } from './body_material';
import { field_traits, type Field, type SequentialMap } from './colours';
import { displacements, fill_dent, fill_field, mean_values, usual_largest } from './field';
import type { Light } from './light';
import { boundary_edges, type Hit, type Surface } from './pick';
import { Interior } from './interior';
import type { Region } from './section';
import { shape_layer } from './shade';
import { make_topology, vertex_normals, type Topology } from './topology';
import type { Frame, Patch, Scene } from './wire';
import type { Vec3 } from './words';

/** How numbers become colours. */
export interface Colouring {
  map: SequentialMap;
  is_log: boolean;
  isolines: number; // how many; 0: none
}

export class Body {
  readonly group = new Group();
  /** The largest absolute value of what is shown, and that of all but a few hot spots. */
  readonly shown = { largest: 0, usual: 0 };
  /** Seen is rest + scale * u. */
  scale = 1;
  field: Field = 'none';
  /** Of the tool [m]: a dent is told by it. */
  tool_size = 1;
  /** Around what is seen. */
  readonly box = new Box3();
  /** What is seen now, with all that a pointer may touch. */
  surface: Surface = { position: [], normal: [], triangle: [] };
  /** In the plane: the boundary, the body on its left, of the surface's vertices. */
  boundary: Uint32Array = new Uint32Array(0);

  /** Of the surface's vertices, of the body at rest. */
  rest_normal = new Float32Array(0);

  private scene_: Scene | null = null;
  private patch_: Patch | null = null;
  private frame_: Frame | null = null;
  private topology_: Topology | null = null;
  private u_ = new Float32Array(0);
  private untouched_ = new Float32Array(0); // u of the scene's nodes when the tool was last away
  private value_ = new Float32Array(0);
  private known_ = new Float32Array(0);
  private placed_: { topology: Topology | null; version: number; scale: number } = {
    topology: null,
    version: 0,
    scale: 1,
  };

  private readonly material_: BodyMaterial;
  private readonly mesh_: Mesh<BufferGeometry, BodyMaterial>;
  private readonly interior_: Interior;
  private readonly edges_ = new LineSegments(
    new BufferGeometry(),
    new LineBasicMaterial({ color: 0x0a0d12, transparent: true, opacity: 0.3 }),
  );
  private readonly outline_ = new LineSegments(new BufferGeometry(), new LineBasicMaterial({ color: 0xffb454 }));
  private readonly held_ = new Points(
    new BufferGeometry(),
    new PointsMaterial({ color: 0x8fa3bd, size: 3, sizeAttenuation: false }),
  );

  constructor(light: Light, cut: { value: Vector4 }, planes: Plane[]) {
    for (const part of [this.edges_, this.outline_, this.held_]) part.material.clippingPlanes = planes;
    this.material_ = new BodyMaterial(light, cut);
    this.mesh_ = new Mesh(new BufferGeometry(), this.material_);
    this.interior_ = new Interior(light, cut);
    this.mesh_.layers.enable(shape_layer);
    this.group.add(this.mesh_, this.edges_, this.outline_, this.held_, this.interior_.mesh);
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
    this.shows_held_ = on;
    this.material_.set({ shows_held: on ? 1 : 0 });
  }
  private shows_held_ = true;
  /** The surface as a veil, through which other materials are seen. */
  show_through(on: boolean): void {
    const flat = this.scene_?.dimension === 2;
    this.material_.set_see_through(on && !flat, flat || this.is_cut);
    this.interior_.mesh.visible = on && !flat;
    this.held_.visible = this.shows_held_ && !on;
    if (on) this.mesh_.layers.disable(shape_layer);
    else this.mesh_.layers.enable(shape_layer);
  }
  /** Whether a place is there to be touched. */
  shows: (place: Vec3) => boolean = () => true;
  /** A section shows the inside of what is left. */
  is_cut = false;

  /** Before a picture: pixels of the drawing for one of the page, what throws a shade, as Light has it, and whether light is that of the nodes. */
  prepare(pixel: number, tool: number, is_rough: boolean): void {
    this.material_.set({ pixel });
    this.material_.set_rough(is_rough && !this.is_cut && this.scene_?.dimension === 3 && !this.interior_.mesh.visible);
    for (const material of [this.material_, this.interior_.mesh.material]) {
      material.set_cut(this.is_cut);
      material.set_tool(tool);
    }
    this.held_.material.size = 3 * pixel;
  }

  /** Closed surfaces of each material. */
  regions(): Region[] {
    const topology = this.topology_;
    if (!topology || topology.triangle.length === 0) return [];
    return this.interior_.regions(topology, this.attribute('position'));
  }

  take_scene(scene: Scene): void {
    this.scene_ = scene;
    this.patch_ = null;
    this.frame_ = null;
    this.interior_.take(scene);
    this.untouched_ = new Float32Array(scene.position.length);
    this.material_.set_flat(scene.dimension === 2);
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
      if (Math.hypot(...this.frame_.force) === 0) this.untouched_.set(this.u_.subarray(0, this.untouched_.length));
      else if (this.field === 'none' && this.scene_.dimension === 3) fill_dent(this.frame_, topology, this.u_, this.untouched_, this.tool_size, this.value_);
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
      shown[4 * v] = this.value_[i]!;
      shown[4 * v + 1] = this.known_[i]!;
    }
    values.needsUpdate = true;
    this.place(topology);
  }

  /** Positions and normals, which stay while no displacement changes. */
  private place(topology: Topology): void {
    const placed = this.placed_;
    const version = this.frame_?.version ?? 0;
    if (placed.topology === topology && placed.version === version && placed.scale === this.scale) return;
    this.placed_ = { topology, version, scale: this.scale };
    const position = this.attribute('position');
    const place = position.array as Float32Array;
    const { node, rest } = topology;
    const { scale, u_: u } = this;
    for (let v = 0; v < node.length; ++v) {
      const i = 3 * node[v]!;
      place[3 * v] = rest[i]! + scale * u[i]!;
      place[3 * v + 1] = rest[i + 1]! + scale * u[i + 1]!;
      place[3 * v + 2] = rest[i + 2]! + scale * u[i + 2]!;
    }
    this.box.setFromArray(place);
    const normal = this.attribute('normal');
    vertex_normals(place, topology.triangle, normal.array as Float32Array);
    position.needsUpdate = normal.needsUpdate = true;
    this.interior_.place(this.u_, this.scale);
  }

  /** Colours by the numbers from `low` to `high`. */
  show_range(low: number, high: number, colouring: Colouring): void {
    const traits = field_traits[this.field];
    this.material_.set_colouring(this.field === 'material' ? 2 : traits.has_range ? 1 : 0, colouring.isolines);
    this.material_.set({ is_log: colouring.is_log && !traits.is_signed ? 1 : 0 });
    this.colour_edges();
    this.material_.set_map(traits.is_signed ? 'diverging' : colouring.map);
    this.material_.set_range(high > 0 ? low : -Number(traits.is_signed), high > 0 ? high : 1); // where all is 0, 0 has its colour too
  }

  /** In the ink of the page where the inside is not known, so that they are all there is. */
  ink = 0xc9b8a8;
  private colour_edges(): void {
    const flat = this.scene_?.dimension === 2;
    const is_alone = flat && this.scene_?.triangle.length === 0;
    this.edges_.material.color.set(is_alone ? this.ink : 0x0a0d12);
    this.edges_.material.opacity = is_alone ? 1 : flat ? 0.6 : 0.38;
  }

  /** What numbers are coloured by. */
  get colours(): Colours {
    return this.material_.colours;
  }

  /** Numbers of places within the body [3 n], put between those of the surface: none is computed there. */
  numbers_within(places: Float32Array): Float32Array {
    const { node } = this.topology_!;
    return mean_values(places, this.surface, Float32Array.from(node, (one) => this.value_[one]!));
  }

  /** The number that colours a place of the surface. */
  value_at({ corner, weight }: Hit): { value: number; is_known: boolean; material: number } {
    if (!corner || !weight) return { value: NaN, is_known: false, material: 0 };
    const shown = this.attribute('shown').array;
    const value = corner.reduce((sum, vertex, k) => sum + weight[k]! * shown[4 * vertex]!, 0);
    return { value, is_known: corner.every((vertex) => shown[4 * vertex + 1]! > 0.999), material: shown[4 * corner[0] + 3]! };
  }

  /** The surface as it is now, for as long as a press lasts. */
  snapshot(): Surface {
    const { position, normal } = this.surface;
    return { ...this.surface, position: Float32Array.from(position), normal: Float32Array.from(normal) };
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
    const shown_of_vertex = new BufferAttribute(new Float32Array(4 * vertices), 4).setUsage(DynamicDrawUsage);
    const geometry = (index: Uint32Array) => new BufferGeometry().setAttribute('position', position).setIndex(new BufferAttribute(index, 1));
    const replace = (part: { geometry: BufferGeometry }, by: BufferGeometry) => {
      part.geometry.dispose();
      part.geometry = by;
    };
    replace(this.mesh_, geometry(topology.triangle).setAttribute('normal', dynamic()).setAttribute('shown', shown_of_vertex));
    const all_held = this.scene_.dimension === 2 ? 3 : 7;
    const held: number[] = [];
    this.scene_.held.forEach((axes, i) => axes !== 0 && held.push(i));
    const shown = this.attribute('shown').array as Float32Array;
    topology.node.forEach((i, v) => {
      shown[4 * v + 2] = ((this.scene_!.held[i] ?? 0) & all_held) === all_held ? 1 : 0;
      shown[4 * v + 3] = topology.material[v]!;
    });
    replace(this.edges_, geometry(topology.edge));
    replace(this.outline_, geometry(topology.outline));
    replace(this.held_, geometry(Uint32Array.from(held)));

    const normal = this.attribute('normal').array as Float32Array;
    this.surface = { position: position.array as Float32Array, normal, triangle: topology.triangle, shows: this.shows };
    this.rest_normal = new Float32Array(normal.length);
    const rest = Float32Array.from({ length: 3 * vertices }, (_, i) => topology.rest[3 * topology.node[Math.floor(i / 3)]! + (i % 3)]!);
    vertex_normals(rest, topology.triangle, this.rest_normal);
    this.boundary = new Uint32Array(0);
    if (this.scene_.dimension === 2) {
      this.boundary =
        topology.corner.length > 0 ? boundary_edges(topology.corner, topology.nodes) : Uint32Array.from(topology.edge);
    }
    this.update();
    this.rebuilt();
  }
  /** Triangles are others now. */
  rebuilt: () => void = () => undefined;
}
