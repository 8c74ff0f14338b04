// Shade of the body on itself: from its depth in the picture, how open each pixel is to the sky and to the key lamp.
import {
  Camera,
  GLSL3,
  Mesh,
  NearestFilter,
  LinearFilter,
  OrthographicCamera,
  PlaneGeometry,
  RawShaderMaterial,
  Scene,
  ShaderMaterial,
  Vector2,
  Vector4,
  Matrix4,
  WebGLRenderTarget,
  type WebGLRenderer,
} from 'three';
import type { Light } from './light';

/** The layer of what casts shade on itself. */
export const shape_layer = 1;
const coarseness = 2; // pixels of the picture for each of the shade, along a side
const quick_coarseness = 4; // where time is short

/** Normal and depth of what is seen, in four bytes. `cut` is the section's plane. */
export function shape_material(cut: { value: Vector4 }, depth_range: { value: Vector2 }): ShaderMaterial {
  return new ShaderMaterial({
    uniforms: { cut, depth_range },
    vertexShader: /* glsl */ `
      varying vec3 v_normal, v_place, v_world;
      void main() {
        vec4 place = modelViewMatrix * vec4(position, 1.0);
        v_world = position;
        v_place = place.xyz;
        v_normal = normalMatrix * normal;
        gl_Position = projectionMatrix * place;
      }`,
    fragmentShader: /* glsl */ `
      varying vec3 v_normal, v_place, v_world;
      uniform vec4 cut;
      uniform vec2 depth_range;
      void main() {
        #ifdef CUT
          if (dot(cut.xyz, v_world) > cut.w) discard;
        #endif
        vec3 normal = normalize(v_normal) * (gl_FrontFacing ? 1.0 : -1.0);
        float depth = clamp((-v_place.z - depth_range.x) / depth_range.y, 0.0, 0.999);
        float coarse = floor(depth * 255.0);
        gl_FragColor = vec4(0.5 + 0.5 * normal.xy, coarse / 255.0, depth * 255.0 - coarse);
      }`,
  });
}

const whole_picture = /* glsl */ `
  in vec3 position;
  out vec2 at;
  void main() { at = 0.5 + 0.5 * position.xy; gl_Position = vec4(position.xy, 0.0, 1.0); }`;

const open_sky = /* glsl */ `
  precision highp float;
  in vec2 at;
  out vec4 colour;
  uniform sampler2D shape;
  uniform vec2 depth_range, texels, size;
  uniform mat4 projection;
  uniform float reach, height;
  const int samples = SAMPLES;
  const vec3 key_way = vec3(-0.494, 0.664, 0.561);

  vec3 place_at(vec2 where, vec4 read) {
    float z = -(depth_range.x + depth_range.y * (read.b + read.a / 255.0));
    vec2 seen = 2.0 * where - 1.0;
    bool deep = projection[2][3] < -0.5;
    vec2 xy = deep ? -z * (seen + vec2(projection[2][0], projection[2][1])) : seen - vec2(projection[3][0], projection[3][1]);
    return vec3(xy / vec2(projection[0][0], projection[1][1]), z);
  }
  vec4 read_at(vec2 where) { return texelFetch(shape, ivec2(where * size), 0); }
  float noise(vec2 pixel) { return fract(52.9829189 * fract(dot(mod(pixel, 4.0), vec2(0.06711056, 0.00583715)) * 17.0)); }

  float key_at(vec3 place, vec3 normal, float turn) {
    if (dot(normal, key_way) < 0.0) return 1.0;
    float shut = 0.0;
    for (int k = 0; k < 6; ++k) {
      vec3 way = place + normal * 0.02 * reach + key_way * reach * 1.3 * (float(k) + 0.35 + 0.65 * turn) / 6.0;
      vec4 clip = projection * vec4(way, 1.0);
      vec4 read = read_at(0.5 + 0.5 * clip.xy / clip.w);
      if (read.b > 0.997) continue;
      float behind = place_at(vec2(0.5), read).z - way.z;
      shut = max(shut, smoothstep(0.01, 0.06, behind / reach) * (1.0 - smoothstep(0.9, 1.4, behind / reach)) * (1.0 - float(k) / 9.0));
    }
    return 1.0 - shut;
  }

  void main() {
    vec4 here = texelFetch(shape, ivec2(gl_FragCoord.xy), 0);
    colour = vec4(1.0, 1.0, here.ba);
    if (here.b > 0.997) return;
    vec3 place = place_at(at, here);
    vec3 normal = vec3(2.0 * here.rg - 1.0, 0.0);
    normal.z = sqrt(max(0.0, 1.0 - dot(normal.xy, normal.xy)));
    bool deep = projection[2][3] < -0.5;
    float wide = min(0.35, 0.5 * projection[1][1] * reach / (deep ? -place.z : 1.0));
    float turn = noise(gl_FragCoord.xy);
    float shut = 0.0;
    for (int k = 0; k < samples; ++k) {
      float share = (float(k) + 0.5) / float(samples);
      float angle = 6.2831853 * (turn + float(k) * 0.38196601);
      vec2 where = at + vec2(cos(angle) * texels.x / texels.y, sin(angle)) * wide * share;
      vec4 read = read_at(where);
      if (read.b > 0.997) continue;
      vec3 way = place_at(where, read) - place;
      float l2 = dot(way, way);
      float rise = dot(normal, way) * inversesqrt(l2 + 1e-12);
      shut += max(0.0, rise - 0.06) * max(0.0, 1.0 - l2 / (reach * reach));
    }
    float sky = clamp(1.0 - 3.4 * shut / float(samples), 0.0, 1.0);
    colour = vec4(sky, key_at(place, normal, fract(turn * 7.13)), here.ba);
  }`;

/** Evens out the pattern of 4 × 4 pixels, not across edges: depth (ba) is beside what is open (rg). */
const even = /* glsl */ `
  precision highp float;
  out vec4 colour;
  uniform sampler2D open;
  uniform vec2 depth_range;
  uniform float reach;
  void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 here = texelFetch(open, pixel, 0);
    float depth = here.b + here.a / 255.0;
    float steep = 4.0 * depth_range.y / reach;
    vec3 sum = vec3(0.0);
    for (int i = -2; i < 2; ++i) {
      for (int k = -2; k < 2; ++k) {
        vec4 read = texelFetch(open, pixel + ivec2(i, k), 0);
        sum += vec3(read.rg, 1.0) * max(1e-4, 1.0 - steep * abs(read.b + read.a / 255.0 - depth));
      }
    }
    colour = vec4(sum.rg / sum.b, 0.0, 1.0);
  }`;

function pass(fragment: string, uniforms: Record<string, { value: unknown }>, samples = 8): RawShaderMaterial {
  return new RawShaderMaterial({
    glslVersion: GLSL3,
    vertexShader: whole_picture,
    fragmentShader: fragment,
    uniforms,
    defines: { SAMPLES: samples },
    depthTest: false,
    depthWrite: false,
  });
}

/** A part of the picture, in its widths and heights from the left and from below. */
export interface Around {
  left: number;
  below: number;
  width: number;
  height: number;
}

export class Shade {
  private readonly shape_ = new WebGLRenderTarget(1, 1, { minFilter: NearestFilter, magFilter: NearestFilter });
  private readonly rough_ = new WebGLRenderTarget(1, 1, { minFilter: NearestFilter, magFilter: NearestFilter, depthBuffer: false });
  private readonly open_ = new WebGLRenderTarget(1, 1, { minFilter: LinearFilter, magFilter: LinearFilter, depthBuffer: false });
  private readonly shared_;
  private readonly quick_: RawShaderMaterial;
  private readonly fine_: RawShaderMaterial;
  private readonly even_: RawShaderMaterial;
  private readonly sheet_ = new Mesh(new PlaneGeometry(2, 2));
  private readonly sheet_scene_ = new Scene();
  private readonly sheet_camera_ = new OrthographicCamera();
  readonly material: ShaderMaterial;

  constructor(
    private readonly light_: Light,
    cut: { value: Vector4 },
  ) {
    const { depth_range } = light_.uniforms;
    this.shared_ = {
      shape: { value: this.shape_.texture },
      open: { value: this.rough_.texture },
      projection: { value: new Matrix4() },
      texels: { value: new Vector2() },
      size: { value: new Vector2() },
      reach: { value: 1 },
      depth_range,
    };
    this.material = shape_material(cut, depth_range);
    this.quick_ = pass(open_sky, this.shared_, 8);
    this.fine_ = pass(open_sky, this.shared_, 20);
    this.even_ = pass(even, this.shared_);
    for (const target of [this.rough_, this.open_]) target.scissorTest = true;
    this.sheet_.frustumCulled = false;
    this.sheet_scene_.add(this.sheet_);
  }

  /** Of what is on the layer of shapes, for a picture of this size, all of which is within `around`; `reach` is how far shade goes [m]. Coarser if time is short (`is_thrifty`) and the picture is not to be fine. */
  draw(renderer: WebGLRenderer, scene: Scene, camera: Camera, [width, height]: [number, number], around: Around, reach: number, is_fine: boolean, is_thrifty: boolean): void {
    const coarse = is_thrifty && !is_fine ? quick_coarseness : coarseness;
    const [w, h] = [Math.max(1, Math.ceil(width / coarse)), Math.max(1, Math.ceil(height / coarse))];
    for (const target of [this.shape_, this.rough_, this.open_]) target.setSize(w, h);
    this.shared_.texels.value.set(1 / w, 1 / h);
    this.shared_.size.value.set(w, h);
    for (const target of [this.rough_, this.open_]) target.scissor.set(Math.floor(around.left * w) - 3, Math.floor(around.below * h) - 3, Math.ceil(around.width * w) + 6, Math.ceil(around.height * h) + 6);
    this.shared_.projection.value.copy(camera.projectionMatrix);
    this.shared_.reach.value = reach;
    const { mask } = camera.layers;
    camera.layers.set(shape_layer);
    scene.overrideMaterial = this.material;
    renderer.setRenderTarget(this.shape_);
    renderer.setClearColor(0x8080ff, 1);
    renderer.clear();
    renderer.render(scene, camera);
    scene.overrideMaterial = null;
    camera.layers.mask = mask;
    this.fill(renderer, is_fine ? this.fine_ : this.quick_, this.rough_);
    this.fill(renderer, this.even_, this.open_);
    renderer.setRenderTarget(null);
    renderer.setClearColor(0x000000, 0);
    this.light_.uniforms.open_map.value = this.open_.texture;
    this.light_.uniforms.shape_map.value = this.shape_.texture;
  }

  set_cut(on: boolean): void {
    if (('CUT' in this.material.defines) === on) return;
    if (on) this.material.defines.CUT = 1;
    else delete this.material.defines.CUT;
    this.material.needsUpdate = true;
  }

  private fill(renderer: WebGLRenderer, material: RawShaderMaterial, target: WebGLRenderTarget): void {
    this.sheet_.material = material;
    renderer.setRenderTarget(target);
    renderer.render(this.sheet_scene_, this.sheet_camera_);
  }
}
