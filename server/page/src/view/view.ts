// The picture: renderer, camera, light, and edges drawn from the depth buffer, so that white rooms can be read.
// Renders on demand: invalidate() asks for a frame, and a frame whose updaters report motion asks for the next.
import {
  Color, DirectionalLight, Fog, FloatType, DepthTexture, GLSL3, HalfFloatType, HemisphereLight, Mesh, OrthographicCamera,
  PerspectiveCamera, PlaneGeometry, RawShaderMaterial, Scene, Vector2, WebGLRenderer, WebGLRenderTarget, type Box3,
} from "three";

const BACKGROUND = new Color(0xe9eef2);
const SLOW_FRAME = 0.05; // seconds; slower devices get the next cheaper quality
const SLOW_SECONDS = 1; // of slow frames in succession

interface Quality {
  samples: number; // of the multisampled picture
  shade: boolean; // in corners
  pixels: number; // fraction of the screen's resolution
}

// From the best to the cheapest.
const QUALITIES: Quality[] = [
  { samples: 4, shade: true, pixels: 1 },
  { samples: 0, shade: true, pixels: 1 },
  { samples: 0, shade: false, pixels: 0.8 },
  { samples: 0, shade: false, pixels: 0.5 },
];
const SOFTWARE_QUALITY = 2; // where a CPU draws
const SOFTWARE_IDLE = 1;
const IDLE_DELAY = 400; // milliseconds without motion until the picture is drawn once at its best quality

const COMPOSE_VERTEX = `
in vec3 position;
out vec2 at;
void main() { at = 0.5 * position.xy + 0.5; gl_Position = vec4(position.xy, 0.0, 1.0); }
`;

// On a plane, the inverse depth is an affine function of the pixel. Its second difference is therefore zero on every
// plane, and not at creases and silhouettes. Shade in corners: neighbours that lie in front of the plane occlude.
const COMPOSE_FRAGMENT = `
precision highp float;
uniform sampler2D colour;
uniform highp sampler2D depth;
uniform vec2 pixel;
uniform vec2 planes;
uniform float pixelAngle;
uniform bool shade;
in vec2 at;
out vec4 result;

float inverseDepth(vec2 p) {
  return mix(1.0 / planes.x, 1.0 / planes.y, texture(depth, p).r);
}

vec3 toScreen(vec3 linear) {
  vec3 high = 1.055 * pow(max(linear, vec3(0.0)), vec3(1.0 / 2.4)) - 0.055;
  return mix(high, 12.92 * linear, lessThanEqual(linear, vec3(0.0031308)));
}

void main() {
  float w = inverseDepth(at);
  float east = inverseDepth(at + vec2(pixel.x, 0.0)), west = inverseDepth(at - vec2(pixel.x, 0.0));
  float north = inverseDepth(at + vec2(0.0, pixel.y)), south = inverseDepth(at - vec2(0.0, pixel.y));
  vec3 seen = texture(colour, at).rgb;
  float bend = max(abs(east + west - 2.0 * w), abs(north + south - 2.0 * w)) / w;
  float distance = 1.0 / w;
  // A right angle bends the inverse depth by about the angle of a pixel.
  float edge = smoothstep(0.35, 1.1, bend / pixelAngle) * (1.0 - smoothstep(25.0, 90.0, distance));
  float occluded = 0.0;
  if (shade && distance < 60.0) {
    // The gentler slope of each axis belongs to this pixel's own plane.
    vec2 slope = vec2(abs(east - w) < abs(w - west) ? east - w : w - west,
                      abs(north - w) < abs(w - south) ? north - w : w - south) / pixel;
    float radius = clamp(0.45 * w / pixelAngle, 3.0, 90.0); // pixels
    for (int i = 0; i < 12; ++i) {
      float angle = 2.39996 * float(i);
      vec2 offset = sqrt((float(i) + 0.5) / 12.0) * radius * pixel * vec2(cos(angle), sin(angle));
      float there = inverseDepth(at + offset);
      float plane = w + dot(slope, offset);
      float rise = 1.0 / max(plane, 1e-4) - 1.0 / there; // metres in front of the plane
      occluded += smoothstep(0.015, 0.2, rise) * (1.0 - smoothstep(0.5, 1.4, rise));
    }
    occluded *= 0.34 / 12.0;
  }
  seen *= (1.0 - occluded) * (1.0 - 0.38 * edge);
  result = vec4(toScreen(seen), 1.0);
}
`;

export class NoWebGl extends Error {}

export class View {
  readonly renderer: WebGLRenderer;
  readonly scene = new Scene();
  readonly camera = new PerspectiveCamera(60, 1, 0.05, 500);
  readonly canvas: HTMLCanvasElement;
  /** Called before each frame with the seconds since the last one; true: something moves, so continue. */
  readonly updaters: ((seconds: number) => boolean)[] = [];
  #target: WebGLRenderTarget;
  #composer = new Scene();
  #composerCamera = new OrthographicCamera(-1, 1, 1, -1, 0, 1);
  #compose: RawShaderMaterial;
  #sun = new DirectionalLight(0xfff6e6, 1.5);
  #isRequested = false;
  #last = 0;
  #level = 0; // of QUALITIES, while something moves
  #idleLevel = 0; // when nothing moves: one slow picture disturbs no one
  #isIdle = false;
  #idleTimer = 0;
  #slow = 0; // seconds of slow frames in succession
  /** Triangles and draw calls of the last picture of the scene. */
  drawn = { triangles: 0, calls: 0 };

  constructor() {
    this.canvas = document.createElement("canvas");
    const context = this.canvas.getContext("webgl2", { antialias: false, preserveDrawingBuffer: false, powerPreference: "high-performance" });
    if (!context) throw new NoWebGl("This browser has no WebGL 2.");
    this.renderer = new WebGLRenderer({ canvas: this.canvas, context });
    this.renderer.setClearColor(BACKGROUND);
    this.scene.background = BACKGROUND;
    this.scene.fog = new Fog(BACKGROUND, 60, 400);
    const sky = new HemisphereLight(0xf6f9ff, 0xd2cabd, 2.15);
    this.#sun.position.set(0.45, 1, 0.3);
    this.scene.add(sky, this.#sun, this.camera);
    if (isSoftware(context)) {
      this.#level = SOFTWARE_QUALITY;
      this.#idleLevel = SOFTWARE_IDLE;
    }
    this.#target = this.#makeTarget();
    this.#compose = new RawShaderMaterial({
      glslVersion: GLSL3, vertexShader: COMPOSE_VERTEX, fragmentShader: COMPOSE_FRAGMENT, depthTest: false,
      uniforms: {
        colour: { value: null }, depth: { value: null }, pixel: { value: new Vector2() },
        planes: { value: new Vector2() }, pixelAngle: { value: 0.001 }, shade: { value: true },
      },
    });
    const quad = new Mesh(new PlaneGeometry(2, 2), this.#compose);
    quad.frustumCulled = false;
    this.#composer.add(quad);
    this.canvas.addEventListener("webglcontextrestored", () => this.invalidate());
    new ResizeObserver(() => this.#resize()).observe(this.canvas);
  }

  get #quality(): Quality {
    return QUALITIES[this.#isIdle ? Math.min(this.#idleLevel, this.#level) : this.#level]!;
  }

  #makeTarget(): WebGLRenderTarget {
    const target = new WebGLRenderTarget(4, 4, { samples: this.#quality.samples, type: HalfFloatType });
    target.depthTexture = new DepthTexture(4, 4, FloatType);
    return target;
  }

  setBounds(bounds: Box3): void {
    const size = Math.max(50, bounds.min.distanceTo(bounds.max));
    this.camera.far = 2 * size;
    this.camera.updateProjectionMatrix();
    this.scene.fog = new Fog(BACKGROUND, 0.6 * size, 2 * size);
    this.invalidate();
  }

  #resize(): void {
    const { clientWidth, clientHeight } = this.canvas;
    if (clientWidth === 0 || clientHeight === 0) return;
    const ratio = Math.min(window.devicePixelRatio, 2) * this.#quality.pixels;
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.#target.setSize(Math.round(clientWidth * ratio), Math.round(clientHeight * ratio));
    this.camera.aspect = clientWidth / clientHeight;
    this.camera.updateProjectionMatrix();
    this.#draw(); // at once: a resized canvas is blank until it is drawn
  }

  /** Changes between the quality of motion and that of a still picture. */
  #setIdle(isIdle: boolean): void {
    if (this.#isIdle === isIdle) return;
    this.#isIdle = isIdle;
    if (this.#idleLevel < this.#level) this.#rebuild();
  }

  #rebuild(): void {
    this.#target.depthTexture?.dispose();
    this.#target.dispose();
    this.#target = this.#makeTarget();
    this.#resize();
  }

  invalidate(): void {
    if (this.#isRequested) return;
    this.#isRequested = true;
    requestAnimationFrame((now) => this.#frame(now / 1000));
  }

  #frame(now: number): void {
    this.#isRequested = false;
    const interval = now - this.#last;
    this.#last = now;
    let moves = false;
    // After a pause, motion begins with a short step.
    for (const update of this.updaters) moves = update(Math.min(0.1, interval)) || moves;
    clearTimeout(this.#idleTimer);
    if (moves) this.#setIdle(false);
    this.#draw();
    this.#judge(interval, moves);
    if (moves) this.invalidate();
    else this.#idleTimer = window.setTimeout(() => this.#setIdle(true), IDLE_DELAY);
  }

  #draw(): void {
    const { uniforms } = this.#compose;
    this.camera.updateMatrixWorld();
    this.renderer.setRenderTarget(this.#target);
    this.renderer.render(this.scene, this.camera);
    const { triangles, calls } = this.renderer.info.render;
    this.drawn = { triangles, calls };
    uniforms.colour!.value = this.#target.texture;
    uniforms.depth!.value = this.#target.depthTexture;
    uniforms.pixel!.value.set(1 / this.#target.width, 1 / this.#target.height);
    uniforms.planes!.value.set(this.camera.near, this.camera.far);
    uniforms.pixelAngle!.value = 2 * Math.tan((this.camera.fov * Math.PI) / 360) / this.#target.height;
    uniforms.shade!.value = this.#quality.shade;
    this.renderer.setRenderTarget(null);
    this.renderer.render(this.#composer, this.#composerCamera);
  }

  /** Lowers the quality while motion is slow. */
  #judge(interval: number, moves: boolean): void {
    const isSlow = moves && interval > SLOW_FRAME && interval < 2; // longer ones are pauses
    this.#slow = isSlow ? this.#slow + interval : 0;
    if (this.#slow < SLOW_SECONDS || this.#level === QUALITIES.length - 1) return;
    this.#slow = 0;
    this.#level += 1;
    this.#rebuild();
  }

  /** A PNG of the present picture. */
  async screenshot(): Promise<Blob> {
    this.#draw(); // the drawing buffer is only readable in the same task
    return await new Promise((resolve, reject) => this.canvas.toBlob(
      (blob) => (blob ? resolve(blob) : reject(new Error("the browser made no picture"))), "image/png",
    ));
  }
}

/** True if a CPU draws. Browsers may hide the name; then the time of frames decides. */
function isSoftware(context: WebGL2RenderingContext): boolean {
  const extension = context.getExtension("WEBGL_debug_renderer_info");
  const name = String(extension ? context.getParameter(extension.UNMASKED_RENDERER_WEBGL) : "");
  return /swiftshader|llvmpipe|software|basic render/i.test(name);
}
