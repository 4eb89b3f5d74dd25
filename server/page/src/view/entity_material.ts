// Materials whose vertices know their entity: objects are hidden and marked by one texel each, whatever batch draws
// them. Thus hiding costs no draw call and no new geometry.
import {
  DataTexture, DoubleSide, MeshBasicMaterial, MeshLambertMaterial, NearestFilter, type Material, type MeshStandardMaterial,
} from "three";

const WIDTH = 1024; // texels in a row of the table

/** Of normalised device depth: an object of coplanar rank r is drawn r steps behind its plane. 4 units of 24 bits. */
const COPLANAR_STEP = 8 / 2 ** 24;

export class EntityFlags {
  readonly texture: DataTexture;
  readonly #data: Uint8Array;
  hiddenCount = 0;

  constructor(maxId: number) {
    const rows = Math.max(1, Math.ceil((maxId + 1) / WIDTH));
    this.#data = new Uint8Array(4 * WIDTH * rows);
    this.texture = new DataTexture(this.#data, WIDTH, rows);
    this.texture.minFilter = this.texture.magFilter = NearestFilter;
    this.texture.needsUpdate = true;
  }

  isHidden(id: number): boolean {
    return this.#data[4 * id] !== 0;
  }

  setHidden(id: number, hidden: boolean): void {
    if (4 * id >= this.#data.length || this.isHidden(id) === hidden) return;
    this.#data[4 * id] = hidden ? 255 : 0;
    this.hiddenCount += hidden ? 1 : -1;
    this.texture.needsUpdate = true;
  }

  setMarked(id: number, marked: boolean): void {
    if (4 * id + 1 >= this.#data.length) return;
    this.#data[4 * id + 1] = marked ? 255 : 0;
    this.texture.needsUpdate = true;
  }

  setCoplanarRank(id: number, rank: number): void {
    if (4 * id + 2 >= this.#data.length) return;
    this.#data[4 * id + 2] = rank;
    this.texture.needsUpdate = true;
  }

  dispose(): void {
    this.texture.dispose();
  }
}

/**
 * Parts of a vertex shader that hides and marks entities, and decides which of the surfaces in one plane is visible;
 * `VERTEX_BODY` follows gl_Position.
 */
export const VERTEX_HEAD = `
attribute float entityId;
uniform sampler2D entityFlags;
varying float entityMark;
`;

export const VERTEX_BODY = `
int entity = int(entityId + 0.5);
vec4 flags = texelFetch(entityFlags, ivec2(entity % ${WIDTH}, entity / ${WIDTH}), 0);
entityMark = flags.g;
gl_Position.z += ${COPLANAR_STEP.toExponential()} * floor(255.0 * flags.b + 0.5) * gl_Position.w;
// All corners of a hidden object fall on one point behind the far plane: the triangle has no pixels.
if (flags.r > 0.5) gl_Position = vec4(0.0, 0.0, 2.0, 1.0);
`;

/** Adds the entity table to a material's shaders. */
function addEntityFlags<M extends Material>(material: M, flags: EntityFlags): M {
  material.onBeforeCompile = (shader) => {
    shader.uniforms.entityFlags = { value: flags.texture };
    shader.vertexShader = VERTEX_HEAD + shader.vertexShader.replace(
      "#include <project_vertex>", `#include <project_vertex>${VERTEX_BODY}`,
    );
    shader.fragmentShader = `varying float entityMark;\n${shader.fragmentShader.replace(
      "#include <dithering_fragment>",
      `#include <dithering_fragment>
gl_FragColor.rgb = mix(gl_FragColor.rgb, vec3(0.05, 0.3, 0.75), 0.55 * entityMark);`,
    )}`;
  };
  material.customProgramCacheKey = () => "entity-flags";
  return material;
}

/** A material for one of the file. Lit ones become diffuse: rooms have no environment map that metal could mirror. */
export function makeMaterial(source: MeshStandardMaterial | MeshBasicMaterial, flags: EntityFlags, hasColors: boolean): Material {
  const isTransparent = source.transparent || source.opacity < 1;
  const common = {
    color: source.color,
    map: source.map,
    alphaTest: source.alphaTest,
    transparent: isTransparent,
    opacity: isTransparent ? Math.max(0.15, source.opacity) : 1,
    depthWrite: !isTransparent,
    side: DoubleSide,
    vertexColors: hasColors,
    name: source.name,
  };
  // Unlit files have their light in the textures.
  if (source instanceof MeshBasicMaterial) return addEntityFlags(new MeshBasicMaterial(common), flags);
  const { emissive, emissiveMap } = source;
  return addEntityFlags(new MeshLambertMaterial({ ...common, emissive, emissiveMap }), flags);
}
