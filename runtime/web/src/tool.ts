// The tool where it is, and as a rim where the hand wants it.
import { CapsuleGeometry, Color, Group, LatheGeometry, Mesh, ShaderMaterial, SphereGeometry, Vector2, Vector3, type Box3, type BufferGeometry, type Camera } from 'three';
import { tissue, tint } from './colours';
import { light_glsl, seen_glsl, type Light } from './light';
import { disc_profile, type ToolShape } from './pose';

const size_of_point = 0.008; // of the body's

const vertex = /* glsl */ `
varying vec3 v_normal, v_place;
void main() {
  vec4 place = modelViewMatrix * vec4(position, 1.0);
  v_place = place.xyz;
  v_normal = normalMatrix * normal;
  gl_Position = projectionMatrix * place;
}`;

const steel = /* glsl */ `
varying vec3 v_normal, v_place;
uniform float clear, size;
uniform vec3 body_colour;
${seen_glsl}
${light_glsl}
void main() {
  vec3 eye = isOrthographic ? vec3(0.0, 0.0, 1.0) : normalize(-v_place);
  vec3 normal = normalize(v_normal);
  vec4 shape = texture2D(shape_map, gl_FragCoord.xy / picture_size);
  float behind = depth_range.x + depth_range.y * (shape.b + shape.a / 255.0) + v_place.z;
  float near_body = shape.b > 0.997 ? 0.0 : 1.0 - smoothstep(0.0, 0.8 * size, behind);
  float deep = near_body * near_body;
  float sky = 1.0 - 0.8 * deep;
  Lit lit = light_at(v_place, normal, eye, sky, 1.0 - 0.7 * near_body);
  vec3 seen = reflect(-eye, normal);
  vec3 room = mix(vec3(0.16, 0.15, 0.16), vec3(0.85, 0.9, 0.98), smoothstep(-0.35, 0.75, seen.y + 0.25 * seen.x));
  float sees_body = shape.b > 0.997 ? 0.0 : smoothstep(0.25, -0.55, seen.z) * smoothstep(6.0, 0.0, behind / size);
  room = mix(room, body_colour * mix(0.75, 0.22, deep), 0.85 * sees_body);
  float edge = pow(1.0 - max(0.0, dot(normal, eye)), 3.0);
  vec3 colour = vec3(0.46, 0.50, 0.56) * lit.diffuse * 0.75 * (1.0 - 0.75 * sees_body) + room * mix(mix(0.22, 0.75, edge), 0.75, sees_body) * mix(1.0, 0.7, deep) + vec3(1.4 * lit.shine);
  float alpha = mix(1.0, mix(0.20, 0.92, edge) + 0.8 * lit.shine, clear);
  gl_FragColor = vec4(as_seen(colour), clamp(alpha, 0.0, 1.0));
}`;

const rim = /* glsl */ `
varying vec3 v_normal, v_place;
void main() {
  vec3 eye = isOrthographic ? vec3(0.0, 0.0, 1.0) : normalize(-v_place);
  float edge = 1.0 - abs(dot(normalize(v_normal), eye));
  gl_FragColor = vec4(vec3(0.25, 0.56, 0.95), 0.75 * smoothstep(0.72, 0.97, edge));
  #include <colorspace_fragment>
}`;

/** A disc normal to y, round at its edge. */
function disc_geometry(disc_radius: number, edge: number): BufferGeometry {
  return new LatheGeometry(disc_profile(disc_radius, edge, 12).map(([r, y]) => new Vector2(r, y)), 64);
}

export class ToolView {
  readonly group = new Group();
  /** Of what is seen of it [m]. */
  radius = 1;
  private shape_: ToolShape = { radius: 0, length: 0, disc_radius: 0 };
  private dimension_: 2 | 3 = 3;
  private readonly tool_: Mesh<BufferGeometry, ShaderMaterial>;
  private readonly ghost_: Mesh<BufferGeometry, ShaderMaterial>;

  constructor(private readonly light_: Light) {
    const uniforms = { ...light_.uniforms, clear: { value: 0 }, size: { value: 1 }, body_colour: { value: new Color(tissue) } };
    const geometry = new SphereGeometry(1);
    this.tool_ = new Mesh(geometry, new ShaderMaterial({ vertexShader: vertex, fragmentShader: steel, uniforms, transparent: true, defines: { TOOL: 0 } }));
    this.ghost_ = new Mesh(geometry, new ShaderMaterial({ vertexShader: vertex, fragmentShader: rim, transparent: true, depthTest: false, depthWrite: false }));
    this.tool_.renderOrder = 2;
    this.ghost_.renderOrder = 3;
    this.group.add(this.tool_, this.ghost_);
    this.group.visible = false;
  }

  /** The shape, for a body of this size [m] and dimension. */
  take_shape(shape: ToolShape, body_size: number, dimension: 2 | 3): void {
    this.shape_ = shape;
    this.dimension_ = dimension;
    this.radius = shape.disc_radius || shape.radius || size_of_point * body_size;
    let geometry: BufferGeometry;
    if (shape.disc_radius > 0) {
      geometry = disc_geometry(shape.disc_radius, shape.radius);
      if (dimension === 3) geometry.rotateX(Math.PI / 2);
    } else if (shape.length > 0) {
      geometry = new CapsuleGeometry(shape.radius, shape.length, 12, 32).translate(0, shape.length / 2, 0);
      if (dimension === 3) geometry.rotateX(Math.PI / 2);
    } else {
      geometry = new SphereGeometry(this.radius, 36, 22);
    }
    this.tool_.material.uniforms.size!.value = this.radius;
    this.tool_.geometry.dispose();
    this.tool_.geometry = this.ghost_.geometry = geometry;
  }

  /** As glass, so that colours below it can be read. */
  set_clear(is_clear: boolean): void {
    (this.tool_.material.uniforms.body_colour!.value as Color).set(is_clear ? `rgb(${tint.join()})` : tissue);
    this.tool_.material.uniforms.clear!.value = is_clear ? 1 : 0;
    this.tool_.material.depthWrite = !is_clear;
  }

  /** Poses as a frame has them: position, quaternion x y z w. */
  show(tool: Float32Array, device: Float32Array): void {
    const place = (mesh: Mesh, pose: Float32Array) => {
      mesh.position.fromArray(pose);
      mesh.quaternion.fromArray(pose, 3).normalize();
    };
    place(this.tool_, tool);
    place(this.ghost_, device);
    this.ghost_.visible = this.tool_.position.distanceTo(this.ghost_.position) > 0.03 * this.radius;
  }

  /** Makes a box hold all that is drawn of it. */
  add_to(box: Box3): void {
    for (const mesh of [this.tool_, this.ghost_]) if (mesh.visible) box.expandByObject(mesh);
  }

  /** Its shade falls as this camera sees it; a tool that is not seen throws none. */
  cast(camera: Camera): void {
    const { tool_a, tool_b, tool_disc, tool_radius } = this.light_.uniforms;
    tool_radius.value = this.group.visible ? this.shape_.radius || this.radius : 0;
    this.light_.tool = !this.group.visible ? 0 : this.shape_.disc_radius > 0 ? 3 : this.shape_.length > 0 ? 2 : 1;
    const axis = (this.dimension_ === 3 ? new Vector3(0, 0, 1) : new Vector3(0, 1, 0)).applyQuaternion(this.tool_.quaternion);
    const to_eye = camera.matrixWorldInverse;
    tool_a.value.copy(this.tool_.position).applyMatrix4(to_eye);
    tool_b.value.copy(this.tool_.position).addScaledVector(axis, this.shape_.length).applyMatrix4(to_eye);
    axis.transformDirection(to_eye);
    tool_disc.value.set(axis.x, axis.y, axis.z, this.shape_.disc_radius);
  }
}
