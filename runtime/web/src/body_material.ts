// What the body's surface looks like: plain and a little wet, or in colours that say numbers.
import { Color, DataTexture, DoubleSide, FrontSide, LinearFilter, NearestFilter, RGBAFormat, ShaderMaterial, SRGBColorSpace, Vector2, Vector4, type IUniform } from 'three';
import { map_texels, material_colours, tint, tissue, type MapName } from './colours';
import { light_glsl, seen_glsl, type Light } from './light';

const most_materials = 256;

function map_texture(name: MapName): DataTexture {
  const texture = new DataTexture(map_texels(name, 256), 256, 1, RGBAFormat);
  texture.colorSpace = SRGBColorSpace;
  texture.magFilter = texture.minFilter = LinearFilter;
  texture.needsUpdate = true;
  return texture;
}

function materials_texture(): DataTexture {
  const texels = new Uint8Array(4 * most_materials);
  for (let i = 0; i < most_materials; ++i) texels.set([...material_colours[i % material_colours.length]!, 255], 4 * i);
  const texture = new DataTexture(texels, most_materials, 1, RGBAFormat);
  texture.colorSpace = SRGBColorSpace;
  texture.magFilter = texture.minFilter = NearestFilter;
  texture.needsUpdate = true;
  return texture;
}

/** Light on the body: what it throws back of its own colour, and how it shines, glosses and glows; `open` is what its own shade leaves of sky and key lamp. */
const body_light = /* glsl */ `
${light_glsl}
void light_body(vec3 place, vec3 normal, vec3 eye, vec2 open, out vec3 diffuse, out vec3 gloss) {
  float near_tool = tool_open(place, normal);
  float sky = open.r * (0.2 + 0.8 * near_tool);
  float key = open.g * tool_shade(place, key_way) * mix(0.4, 1.0, open.r) * mix(0.45, 1.0, near_tool);
  Lit lit = light_at(place, normal, eye, sky, key);
  diffuse = lit.diffuse;
  gloss = vec3(lit.shine, lit.gloss, (1.0 - abs(dot(normal, key_way))) * key);
}
`;

/** Where a number lies on its bar; with `range` and `is_log`. */
export const share_glsl = /* glsl */ `
float share_of(float value) {
  if (is_log > 0.5) return value > 0.0 && range.y > 0.0 ? 1.0 + log(value / range.y) / log(1000.0) : 0.0;
  return (value - range.x) / max(range.y - range.x, 1e-30);
}
`;

/** What numbers are coloured by, as uniforms. */
export type Colours = Record<'colour_map' | 'range' | 'is_log' | 'tint', IUniform>;

const vertex = /* glsl */ `
attribute vec4 shown;
varying vec4 v_shown;
varying vec3 v_normal, v_place, v_world;
#ifdef ROUGH
varying vec3 v_diffuse, v_gloss;
${body_light}
#endif
void main() {
  vec4 place = modelViewMatrix * vec4(position, 1.0);
  v_shown = shown;
  v_world = position;
  v_place = place.xyz;
  v_normal = normalMatrix * normal;
  gl_Position = projectionMatrix * place;
#ifdef ROUGH
  vec3 eye = isOrthographic ? vec3(0.0, 0.0, 1.0) : normalize(-place.xyz);
  light_body(place.xyz, normalize(v_normal), eye, texture2D(open_map, 0.5 + 0.5 * gl_Position.xy / gl_Position.w).rg, v_diffuse, v_gloss);
#endif
}`;

const fragment = /* glsl */ `
varying vec4 v_shown; // number (in the plain picture how deep, of the tool's size), 1 where it is known, 1 where it is held, material
varying vec3 v_normal, v_place, v_world;
uniform sampler2D colour_map, materials;
uniform vec2 range;
uniform vec4 cut;
uniform vec3 tissue, tint;
uniform float is_log, lines, shows_held, pixel;
${seen_glsl}
#ifdef ROUGH
varying vec3 v_diffuse, v_gloss;
#else
${body_light}
#endif
${share_glsl}
vec3 own_colour() {
#if COLOURING == 0
  return tissue * mix(vec3(0.02, 0.012, 0.01), vec3(1.0), exp(-15.0 * v_shown.x)); // darker where it is pressed in
#elif COLOURING == 2
  return texture2D(materials, vec2((floor(v_shown.w + 0.5) + 0.5) / 256.0, 0.5)).rgb;
#else
  if (v_shown.y < 0.999) return tint * 0.8;
  float share = clamp(share_of(v_shown.x), 0.0, 1.0);
  vec3 colour = texture2D(colour_map, vec2(share * 255.0 / 256.0 + 0.5 / 256.0, 0.5)).rgb;
#ifdef LINES
  {
    float place = share * lines;
    float width = fwidth(place);
    float apart = abs(fract(place - 0.5) - 0.5);
    if (width < 0.5) colour *= mix(0.42, 1.0, smoothstep(0.6 * width, 1.4 * width, place < 0.3 ? 1.0 : apart));
  }
#endif
  return colour;
#endif
}

void main() {
#ifdef CUT
  if (dot(cut.xyz, v_world) > cut.w) discard;
#endif
  vec3 colour = own_colour();
  float held = shows_held * step(0.999, v_shown.z);
  if (held > 0.5) {
    float stripe = smoothstep(0.35, 0.5, abs(fract((gl_FragCoord.x + gl_FragCoord.y) / (11.0 * pixel)) - 0.5) * 2.0);
    colour = mix(colour, mix(vec3(dot(colour, vec3(0.3, 0.6, 0.1))), vec3(0.02, 0.025, 0.03), 0.55), 0.35 + 0.5 * stripe);
  }
  float alpha = 1.0;
#ifndef FLAT
#ifdef ROUGH
  vec3 diffuse = v_diffuse, gloss = v_gloss;
#else
  vec3 eye = isOrthographic ? vec3(0.0, 0.0, 1.0) : normalize(-v_place);
  vec3 normal = normalize(v_normal);
  if (!gl_FrontFacing) normal = -normal;
  vec3 diffuse, gloss;
  light_body(v_place, normal, eye, texture2D(open_map, gl_FragCoord.xy / picture_size).rg, diffuse, gloss);
#endif
#if COLOURING == 0
  colour = colour * diffuse + vec3(0.10, 0.02, 0.012) * gloss.z + vec3(1.0, 0.97, 0.93) * (0.75 * gloss.x + 0.16 * gloss.y) * (1.0 - 0.8 * held);
#else
  float bright = dot(diffuse, vec3(0.2126, 0.7152, 0.0722));
  colour = colour * mix(0.35, 1.0, min(1.0, bright)) * mix(1.0, bright, 0.45) + vec3(0.10 * gloss.x + 0.05 * gloss.y);
#endif
  if (!gl_FrontFacing) colour *= 0.55;
#ifdef VEIL
  float away = 1.0 - abs(dot(normal, eye));
  alpha = mix(0.16, 0.85, away * away);
#endif
#endif
  gl_FragColor = vec4(as_seen(colour), alpha);
}`;

/** One for the body, one each for what lies in it; `set` changes what is shown. */
export class BodyMaterial extends ShaderMaterial {
  private static maps_: Record<MapName, DataTexture> | null = null;
  private static readonly materials_ = materials_texture();

  constructor(light: Light, cut: { value: Vector4 }) {
    super({
      vertexShader: vertex,
      fragmentShader: fragment,
      uniforms: {
        ...light.uniforms,
        cut,
        colour_map: { value: null },
        materials: { value: BodyMaterial.materials_ },
        range: { value: new Vector2(0, 1) },
        tissue: { value: new Color(tissue) },
        tint: { value: new Color(`rgb(${tint.join()})`) },
        is_log: { value: 0 },
        lines: { value: 0 },
        shows_held: { value: 1 },
        pixel: { value: 1 }, // pixels of the drawing for one of the page
      },
      defines: { TOOL: 0, COLOURING: 0 },
      polygonOffset: true,
      polygonOffsetFactor: 1,
      polygonOffsetUnits: 2,
    });
    this.set_map('viridis');
  }

  get colours(): Colours {
    const { colour_map, range, is_log, tint } = this.uniforms;
    return { colour_map: colour_map!, range: range!, is_log: is_log!, tint: tint! };
  }

  set(values: Partial<Record<'is_log' | 'shows_held' | 'pixel', number>>): void {
    for (const [name, value] of Object.entries(values)) this.uniforms[name]!.value = value;
  }

  /** 0: plain, 1: numbers, 2: materials; so many isolines, 0 for none. */
  set_colouring(colouring: 0 | 1 | 2, lines: number): void {
    this.uniforms.lines!.value = lines;
    this.define('COLOURING', colouring);
    this.define('LINES', lines > 0);
  }

  /** A body in the plane has no light and shade. */
  set_flat(on: boolean): void {
    this.define('FLAT', on);
  }

  /** Whether a section cuts it. */
  set_cut(on: boolean): void {
    this.define('CUT', on);
  }

  /** Whether light is that of the nodes, put between them: not where both sides are seen, or what lies behind. */
  set_rough(on: boolean): void {
    this.define('ROUGH', on);
  }

  /** Another code where another tool throws its shade. */
  set_tool(tool: number): void {
    this.define('TOOL', tool);
  }

  private define(name: string, value: number | boolean): void {
    const wanted = value === false ? undefined : value;
    if (this.defines[name] === wanted) return;
    if (wanted === undefined) delete this.defines[name];
    else this.defines[name] = wanted;
    this.needsUpdate = true;
  }

  set_range(low: number, high: number): void {
    (this.uniforms.range!.value as Vector2).set(low, high);
  }

  set_map(name: MapName): void {
    BodyMaterial.maps_ ??= {
      viridis: map_texture('viridis'),
      cividis: map_texture('cividis'),
      inferno: map_texture('inferno'),
      grey: map_texture('grey'),
      diverging: map_texture('diverging'),
    };
    this.uniforms.colour_map!.value = BodyMaterial.maps_[name];
  }

  /** Whether what lies behind is seen through it, and both of its sides are. */
  set_see_through(veil: boolean, both_sides: boolean): void {
    const side = both_sides ? DoubleSide : FrontSide;
    if (this.side !== side || this.transparent !== veil) this.needsUpdate = true;
    this.side = side;
    this.transparent = veil;
    this.depthWrite = !veil;
    this.define('VEIL', veil);
  }
}
