// How light falls, as GLSL and uniforms that all surfaces share. All is in the camera's axes: the lamps go with who looks.
import { DataTexture, Vector2, Vector3, Vector4, type Texture } from 'three';

const open = new DataTexture(new Uint8Array([255, 255, 255, 255]), 1, 1);
open.needsUpdate = true;

/** Shared by reference: what is set here holds for all materials. */
export class Light {
  readonly uniforms = {
    /** Of the pixel: how open it is to the sky (r), how much of the key lamp comes (g). */
    open_map: { value: open as Texture },
    /** Of the body alone: normal x y (rg), depth (ba). */
    shape_map: { value: open as Texture },
    picture_size: { value: new Vector2(1, 1) },
    depth_range: { value: new Vector2(0, 1) },
    /** The tool: a segment with a radius; a disc where `tool_disc` has a radius (w) beside its axis. */
    tool_a: { value: new Vector3() },
    tool_b: { value: new Vector3() },
    tool_disc: { value: new Vector4(0, 0, 1, 0) },
    tool_radius: { value: 0 },
    is_light: { value: 0 },
  };

  /** What throws a shade, TOOL in the code below: a code for all cases would compute them all. */
  tool: 0 | 1 | 2 | 3 = 0; // none, ball, capsule, disc

  /** Where no shade of the body was drawn. */
  without_shade(): void {
    this.uniforms.open_map.value = open;
  }
}

/** What the screen is given. */
export const seen_glsl = /* glsl */ `
/** Linear light as the screen wants it, within half a grey level of sRGB's curve: roots cost far less than its power. */
vec3 as_seen(vec3 colour) {
  vec3 x = clamp(colour, 0.0, 1.0);
  vec3 root = sqrt(x), root4 = sqrt(root);
  return max(12.92 * min(x, 0.0031), 0.662002687 * root + 0.684122060 * root4 - 0.323583601 * sqrt(root4) - 0.022541147 * x);
}
`;

/** Where `TOOL` is defined. */
export const light_glsl = /* glsl */ `
uniform sampler2D open_map, shape_map;
uniform vec2 picture_size, depth_range;
uniform vec3 tool_a, tool_b;
uniform vec4 tool_disc;
uniform float tool_radius, is_light;

const vec3 key_way = vec3(-0.494, 0.664, 0.561);
const vec3 fill_way = vec3(0.802, -0.267, 0.535);

float disc_shade(vec3 place, vec3 way) {
  float along = dot(way, tool_disc.xyz);
  float t = dot(tool_a - place, tool_disc.xyz) / (abs(along) < 0.05 ? 0.05 * (along < 0.0 ? -1.0 : 1.0) : along);
  if (t <= 0.0) return 1.0;
  float soft = 0.05 * tool_disc.w + 0.3 * t;
  return smoothstep(-soft, soft, length(place + t * way - tool_a) - tool_disc.w);
}

/** What the tool leaves of the key lamp: soft, the softer the farther it is. */
float tool_shade(vec3 place, vec3 way) {
#if TOOL == 0
  return 1.0;
#elif TOOL == 3
  return disc_shade(place, way);
#else
  vec3 centre = tool_a;
#if TOOL == 2
  vec3 axis = tool_b - tool_a;
  vec3 from = place - tool_a;
  float across = dot(axis, axis) - dot(way, axis) * dot(way, axis);
  centre += (across > 1e-12 ? clamp((dot(from, axis) - dot(from, way) * dot(way, axis)) / across, 0.0, 1.0) : 0.0) * axis;
#endif
  float t = dot(centre - place, way);
  float soft = 0.04 * tool_radius + 0.4 * max(t, 0.0);
  float apart = length(centre - place - max(t, 0.0) * way) - tool_radius;
  return mix(1.0, smoothstep(-soft, soft, apart), smoothstep(-0.2, 0.3, t / tool_radius));
#endif
}

/** How much of the sky the tool leaves open. */
float tool_open(vec3 place, vec3 normal) {
#if TOOL == 0
  return 1.0;
#else
  vec3 nearest = tool_a;
  float size = tool_radius;
#if TOOL == 3
  vec3 from = place - tool_a;
  vec3 flat_way = from - dot(from, tool_disc.xyz) * tool_disc.xyz;
  nearest += flat_way * min(1.0, 0.55 * tool_disc.w / max(length(flat_way), 1e-9));
  size = max(tool_radius, 0.45 * tool_disc.w);
#elif TOOL == 2
  vec3 axis = tool_b - tool_a;
  nearest += axis * clamp(dot(place - tool_a, axis) / dot(axis, axis), 0.0, 1.0);
#endif
  vec3 way = nearest - place;
  float l = max(length(way), 1e-9);
  float h = max(l / size, 1.0);
  float facing = dot(normal, way) / l;
  float crease = 0.75 * exp(-max(0.0, l - tool_radius) / (0.42 * size)) * smoothstep(-0.9, -0.1, facing);
  return (1.0 - clamp(facing, 0.0, 1.0) / (h * h)) * (1.0 - crease);
#endif
}

struct Lit { vec3 diffuse; float shine; float gloss; float open; };

/** Light on a place of this normal; \`open_sky\` and \`key_share\` are what other parts leave of it. */
Lit light_at(vec3 place, vec3 normal, vec3 eye, float open_sky, float key_share) {
  float facing = dot(normal, key_way);
  float key = max(0.0, (facing + 0.12) / 1.12) * key_share;
  float fill = max(0.0, dot(normal, fill_way));
  vec3 sky = mix(vec3(0.15, 0.14, 0.15), vec3(0.40, 0.42, 0.46), 0.5 + 0.5 * normal.y);
  vec3 diffuse = vec3(1.16, 1.11, 1.04) * key + vec3(0.13, 0.15, 0.19) * fill * open_sky + sky * open_sky * mix(1.0, 1.25, is_light);
  vec3 half_way = normalize(key_way + eye);
  float near_half = max(0.0, dot(normal, half_way));
  vec3 seen = reflect(-eye, normal);
  float window = smoothstep(0.86, 0.985, dot(seen, normalize(vec3(-0.35, 0.8, 0.45))));
  float rim = 1.0 - max(0.0, dot(normal, eye));
  rim *= rim;
  rim *= rim;
  float near_half2 = near_half * near_half, near_half4 = near_half2 * near_half2, near_half8 = near_half4 * near_half4;
  float near_half16 = near_half8 * near_half8, near_half32 = near_half16 * near_half16;
  Lit lit;
  lit.diffuse = diffuse;
  lit.shine = near_half32 * near_half32 * near_half16 * near_half8 * near_half2 * key_share + 0.11 * window * open_sky * (0.4 + 0.6 * key_share);
  lit.gloss = 0.12 * near_half8 * near_half4 * key_share + rim * (0.25 + 0.75 * max(0.0, normal.y)) * open_sky;
  lit.open = open_sky;
  return lit;
}
`;
